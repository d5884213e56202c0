"""A robot's side of a rosbridge, and a running gate that connects to it."""

import pytest
from decisions import Decisions
from gate_page import Page
from gate_robot import FakeRobot

from equipment.declarations import declared
from webmap.gate.display.client import GateClient
from webmap.gate.rules.machines import Machines


@pytest.fixture(autouse=True)
def state_folder(tmp_path, monkeypatch):
    """Keep the locks of each test in a folder of its own."""
    folder = tmp_path / "state"
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(folder))
    return folder


@pytest.fixture(autouse=True)
def decisions(request, monkeypatch):
    """Compare the decisions of the gate with the recorded decisions."""
    found = Decisions(request.node.nodeid.removeprefix("tests/gate/"))
    found.listen(monkeypatch)
    yield found
    found.end()


@pytest.fixture(autouse=True)
def awake(monkeypatch):
    """Check after each event and step that exactly the active machines are awake.

    Returns:
        The method without this check.

    """
    report = Machines.report

    def checked(machines, now):
        report(machines, now)
        active = {m for m in machines._by_key.values() if m.active}
        assert machines._awake == active

    monkeypatch.setattr(Machines, "report", checked)
    return report


@pytest.fixture(autouse=True)
def not_measured(monkeypatch):
    """Do not measure coverage in gates: a killed gate does not write its data."""
    monkeypatch.delenv("COVERAGE_PROCESS_CONFIG", raising=False)


@pytest.fixture
def fake():
    with FakeRobot() as robot:
        yield robot


@pytest.fixture
def robot_spec(fake):
    return declared(
        id="r1",
        name="Bob",
        bridge_url=fake.url,
        twist_topic="/cmd_vel",
        stops_within=0.25,
        v_max=0.25,  # so low that a slow loop does not reduce it
        w_max=1.5,
        odometry_topic="/odom",
        odometry_type="nav_msgs/Odometry",
        goal_topic="/goal",
        cancel_topic="/cancel",
    )


@pytest.fixture
def client():
    """The client of a running gate."""
    gate = GateClient()
    gate.start()
    yield gate
    gate.stop()


@pytest.fixture
def page(client, robot_spec):
    """A page of a gate to which the robot is declared."""
    client.declare(robot_spec)
    made = Page(client)
    yield made
    made.end()
