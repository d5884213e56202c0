"""Names of robots that have an agent."""

import pytest

from webmap import Bridge, Robot
from webmap.core.motion import RobotMotion, shown_name


@pytest.mark.parametrize(
    ("name", "agent", "shown"),
    [
        ("Bob", "", "Bob"),
        ("Bob", "bay3", "Bob (bay3)"),
        ("Bay3", "bay3", "Bay3"),
    ],
)
def test_the_name_contains_that_of_the_agent(name, agent, shown):
    assert shown_name(name, agent) == shown


def test_the_gate_of_an_agent_reports_the_name_that_displays_show(monkeypatch):
    monkeypatch.setattr(RobotMotion, "agent", "bay3")
    robot = Robot("Bob")
    robot.set_twist_topic(Bridge("ws://127.0.0.1:9"), "/cmd_vel")
    assert robot.motion.spec().name == "Bob (bay3)"
    robot.destroy()
