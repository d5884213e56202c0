"""The start: the error of one robot is reported, and the others start."""

import pytest

from webmap import Bridge, Robot
from webmap.base.errors import ConfigError
from webmap.base.lifecycle import Lifecycle
from webmap.core import runtime as runtime_module
from webmap.core.runtime import Runtime


class Gate:
    """Records the declared robots; refuses one of them."""

    def __init__(self):
        self.declared = []

    def declare(self, spec):
        if spec.name == "Eve":
            raise ConfigError("robot 'Eve': no such thing")
        self.declared.append(spec.name)

    def forget(self, robot_id):
        pass

    def on_report(self, fn):
        pass

    def start(self):
        pass

    def stop(self):
        pass


@pytest.fixture
def gate(monkeypatch):
    """A fake gate, which does not receive robots of other tests."""
    gate = Gate()
    monkeypatch.setattr(runtime_module, "_all_gates", lambda: gate)
    monkeypatch.setattr(runtime_module, "lifecycle", Lifecycle())
    monkeypatch.setattr(runtime_module, "robot_motions", set())
    return gate


def test_a_robot_refused_by_the_gate_does_not_prevent_the_start_of_the_others(
    gate, monkeypatch, caplog
):
    bridge = Bridge("ws://robot:9090")
    robots = [Robot(name) for name in ("Ann", "Eve", "Bob")]
    for robot in robots:
        robot.set_twist_topic(bridge, "/cmd_vel")
        runtime_module.robot_motions.add(robot.motion)
    runtime = Runtime()
    runtime.start()
    runtime.stop()
    assert sorted(gate.declared) == ["Ann", "Bob"]
    assert "Eve: it cannot be moved: robot 'Eve': no such thing" in caplog.text
    for robot in robots:
        robot.destroy()
