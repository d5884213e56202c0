"""A gate that ends at every start: the reports, and STOPs in the meantime."""

import sys
import time

import pytest
from gate_page import Page

from equipment.waiting import wait_for
from webmap.base.errors import NoLease
from webmap.core.runtime import Runtime
from webmap.gate import protocol
from webmap.gate.display.client import GateClient

pytestmark = pytest.mark.slow


@pytest.fixture
def broken(tmp_path, monkeypatch):
    """Let every gate end at once until ``mend`` is called; ``starts`` is the count."""
    starts = tmp_path / "starts"
    script = tmp_path / "python"
    script.write_text(
        f"#!/bin/sh\necho x >> {starts}\n"
        "echo 'Traceback (most recent call last):' >&2\n"
        "echo \"ModuleNotFoundError: No module named 'webmap'\" >&2\necho >&2\nexit 1\n"
    )
    script.chmod(0o755)
    starts.touch()

    class Broken:
        @property
        def starts(self):
            return len(starts.read_text().split())

        def mend(self):
            monkeypatch.undo()

    monkeypatch.setattr(sys, "executable", str(script))
    return Broken()


@pytest.fixture
def reports():
    return []


@pytest.fixture
def failing(broken, reports, robot_spec, state_folder, monkeypatch):
    """A client whose gate has ended several times."""
    client = GateClient()
    client.on_report(reports.append)
    client.declare(robot_spec)
    client.start()
    wait_for(lambda: downs(reports) and downs(reports)[-1].failing, "trouble")
    yield client
    client.stop()


def downs(reports):
    return [report for report in reports if isinstance(report, protocol.GateDown)]


def mend(broken, monkeypatch, state_folder):
    broken.mend()
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(state_folder))


def test_a_failing_gate_is_restarted_at_growing_intervals(failing, broken):
    begun = time.monotonic()
    before = broken.starts
    wait_for(lambda: broken.starts >= before + 3, "three more starts")
    # The waits after the second start: 0.25, 0.5, 1 and 2 s; one may have passed.
    assert time.monotonic() - begun > 1.2


def test_the_reason_of_a_failing_gate_is_reported(failing, reports):
    assert [down.failing for down in downs(reports)[:2]] == [False, True]
    why = downs(reports)[-1].why
    assert why.startswith(
        "The gate does not start: ModuleNotFoundError: No module named 'webmap'. "
    )
    with pytest.raises(NoLease, match="does not start: ModuleNotFoundError"):
        failing.take("r1").result(5)


@pytest.mark.parametrize("robot", ["r1", "*"])
@pytest.mark.parametrize("by", ["a page", "a page that is gone", "a program"])
def test_a_stop_pressed_without_a_gate_is_active_when_a_gate_runs(
    failing, broken, monkeypatch, state_folder, by, robot
):
    page = Page(failing)
    if by == "a program":
        failing.stop_robot(None if robot == "*" else robot)
    else:
        page.send(op="stop", robot=robot)
    if by == "a page that is gone":
        page.end()
        page = Page(failing)
    before = broken.starts
    wait_for(lambda: broken.starts > before, "another gate that ends")
    mend(broken, monkeypatch, state_folder)
    stop = wait_for(lambda: page.robot().get("stop"), "an active STOP")
    assert stop["by"] == ("Ann" if by == "a page" else "program")
    page.end()


def test_a_repaired_gate_is_reported_as_running_and_drives(
    failing, broken, reports, monkeypatch, state_folder, fake
):
    mend(broken, monkeypatch, state_folder)
    wait_for(lambda: isinstance(reports[-1], protocol.RobotReport), "a gate")
    assert any(isinstance(report, protocol.GateUp) for report in reports)
    page = Page(failing)
    page.drive_off(fake)
    page.end()


def test_a_gate_program_that_cannot_be_started_is_reported(
    monkeypatch, reports, tmp_path
):
    monkeypatch.setattr(sys, "executable", str(tmp_path / "nothing"))
    client = GateClient()
    client.on_report(reports.append)
    client.start()
    wait_for(lambda: downs(reports) and downs(reports)[-1].failing, "trouble")
    assert "No such file" in downs(reports)[-1].why
    client.stop()


def test_a_viewer_receives_the_reason_why_the_gate_does_not_start(broken):
    class Viewer:
        notices: list[str] = []

        def tick(self, now):
            pass

        def notice(self, text):
            self.notices.append(text)

    runtime = Runtime()
    runtime.start()
    try:
        runtime.call(runtime.watch, Viewer())
        received = wait_for(lambda: Viewer.notices, "a notice")
    finally:
        runtime.stop()
    assert received[0].startswith("The gate does not start: ModuleNotFoundError: ")
    assert "WebMap cannot drive robots" in received[0]
