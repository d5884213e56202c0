"""A robot's side, and a running gate in front of it."""

import pytest
from decisions import Decisions
from gate_page import Page
from gate_robot import FakeRobot

from webmap.gate.display.client import GateClient
from webmap.gate.protocol import RobotSpec
from webmap.gate.rules.machines import Machines


@pytest.fixture(autouse=True)
def state_folder(tmp_path, monkeypatch):
    """Keep locks of tests out of everybody's way."""
    folder = tmp_path / "state"
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(folder))
    return folder


@pytest.fixture(autouse=True)
def decisions(request, monkeypatch):
    """Compare what the gate decides with what it decided when that was recorded."""
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
    """Start gates as they are: what one has run that may be killed tells nothing."""
    monkeypatch.delenv("COVERAGE_PROCESS_CONFIG", raising=False)


@pytest.fixture
def fake():
    with FakeRobot() as robot:
        yield robot


@pytest.fixture
def robot_spec(fake):
    return RobotSpec(
        id="r1",
        name="Bob",
        bridge_url=fake.url,
        twist_topic="/cmd_vel",
        stops_within=0.25,
        v_max=0.25,  # low enough for a slow loop to take nothing off it
        w_max=1.5,
        odometry_topic="/odom",
        odometry_type="nav_msgs/Odometry",
        goal_topic="/goal",
        cancel_topic="/cancel",
    )


@pytest.fixture
def client():
    """A gate that runs."""
    gate = GateClient()
    gate.start()
    yield gate
    gate.stop()


@pytest.fixture
def page(client, robot_spec):
    """A page at a gate that knows the robot."""
    client.declare(robot_spec)
    made = Page(client)
    yield made
    made.end()
