"""The start: the error of one robot is reported, and the others start."""

import asyncio
import threading

import pytest

import webmap
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


@pytest.fixture
def model(gate):
    model = Runtime()
    model.start()
    yield model
    model.stop()


def test_call_returns_the_result_of_a_coroutine_function_in_the_models_thread(model):
    async def thread_after_a_pause(name):
        await asyncio.sleep(0.01)
        return name, threading.current_thread()

    assert model.run(thread_after_a_pause, "Bob") == ("Bob", model._thread)
    assert model.run(threading.current_thread) is model._thread


def test_call_raises_the_error_of_the_function(model):
    async def fail():
        raise ConfigError("no such robot")

    with pytest.raises(ConfigError, match="no such robot"):
        model.run(fail)


def test_call_in_the_models_thread_is_refused(model):
    with pytest.raises(RuntimeError, match="await it"):
        model.run(lambda: model.run(print))


def test_call_before_the_start_is_refused():
    with pytest.raises(RuntimeError, match=r"call webmap\.start"):
        webmap.call(print)
