"""A gate reads the files that an earlier version stored, for every robot.

The names of the files are derived from the bridge's address and the velocity topic: if
a name changed, a STOP would be forgotten.
"""

import asyncio
import contextlib
import shutil

import pytest
from gate_page import Page
from stored_robots import FOLDER, IDENTITIES, PORT, ROBOTS, STOPPED, TESTED

from equipment.declarations import changed
from equipment.waiting import wait_for
from webmap.gate import actions, events, process
from webmap.gate.disk import UNKNOWN, Disk, Records
from webmap.gate.display.client import GateClient
from webmap.gate.events import Key
from webmap.gate.locks import Locks
from webmap.gate.rules.motion import ZERO

pytestmark = pytest.mark.slow


@pytest.fixture
def stored(state_folder):
    """The folder of a new gate, with the files of an earlier gate."""
    shutil.copytree(FOLDER, state_folder)
    return state_folder


@contextlib.contextmanager
def new_gate():
    """Start a gate with the folder; yield a page with a report of each robot."""
    client = GateClient()
    client.start()
    for spec in ROBOTS:
        client.declare(spec)
    page = Page(client)
    wait_for(lambda: len(page.robots) == len(ROBOTS), "a report of each robot")
    yield page
    page.end()
    client.stop()


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    """The report of a new gate about each robot, by the robot's name."""
    folder = tmp_path_factory.mktemp("stored") / "state"
    shutil.copytree(FOLDER, folder)
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("WEBMAP_STATE_DIR", str(folder))
        with new_gate() as page:
            return {report["name"]: report for report in page.robots.values()}


def test_stored_stops_are_still_active_and_name_the_same_operators(reports):
    stopped = [report for report in reports.values() if report["latched"]]
    found = {report["name"]: report["stop"]["by"] for report in stopped}
    assert found == {**STOPPED, "Unreadable": UNKNOWN}
    assert {report["state"] for report in stopped} == {"stopped"}
    assert not any(report["armable"] for report in stopped)


def test_every_stored_stop_keeps_its_identity(reports):
    found = {name: reports[name]["stop"]["id"] for name in IDENTITIES}
    assert found == IDENTITIES


def test_stored_stop_test_results_are_reported_with_their_dates(reports):
    found = {
        name: (report["stop_time"], report["stop_date"])
        for name, report in reports.items()
        if report["stop_source"] == "tested"
    }
    assert found == TESTED


def test_a_reset_deletes_a_stored_stop_file_and_a_new_stop_gets_the_same_file_name(
    stored,
):
    def stops():
        return {path.name for path in stored.glob("*.stop*")}

    before = {name.removesuffix(".lifted") for name in stops()}
    with new_gate() as page:
        for name in STOPPED:
            page.send(op="reset", robot=name.lower())
        wait_for(lambda: not stops(), "a folder without STOPs")
        for name in STOPPED:
            page.send(op="stop", robot=name.lower())
        wait_for(lambda: stops() == before, "a file for each STOP")


class Links:
    """Records the velocities to robots; every link is up."""

    def __init__(self, report):
        self.written = []

    def perform(self, action):
        assert not isinstance(action, actions.WriteTwist), "nothing but zeros"

    def write_zeros(self, zeros):
        self.written += [(zero.key, zero.twist) for zero in zeros]
        return [
            events.TwistWritten(zero.key, zero.twist, zero.epoch, zero.by, True)
            for zero in zeros
        ]


class Outbox:
    def put(self, message):
        pass


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "[::1]"])
def test_a_machine_marked_as_driven_gets_a_zero_for_every_name_of_localhost(
    stored, monkeypatch, host
):
    monkeypatch.setattr(process, "Links", Links)
    url, other = f"ws://{host}:{PORT}", "ws://robot-nine.example:9090"
    specs = {spec.name: spec for spec in ROBOTS}

    async def scenario():
        gate = process.Shell(Outbox(), Locks(stored), Disk(Records(stored)))
        gate.deliver(changed(specs["Driven"], bridge_url=url))
        gate.deliver(specs["Untouched"])
        for there in (url, other):
            gate.deliver(events.LinkUp(there, "control"))
        return gate._links.written

    assert asyncio.run(scenario()) == [(Key(url, "/driven/cmd_vel"), ZERO)]


def test_tidy_keeps_only_lock_files_of_machines_marked_as_driven(stored):
    """A gate that starts removes the lock files of all other machines."""
    Locks(stored).tidy()
    left = [path.read_text().split()[:3] for path in stored.glob("*.lock")]
    assert {driven for driven, *_ in left} == {"1"}
    assert ["1", f"ws://127.0.0.1:{PORT}", "/driven/cmd_vel"] in left
