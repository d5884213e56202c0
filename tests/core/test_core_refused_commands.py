"""A program gets the refusals of its commands from the process of the gate."""

import json
from types import SimpleNamespace

import pytest

import webmap
from equipment.waiting import wait_for
from webmap.base.errors import MotionError
from webmap.core import runtime as runtime_module
from webmap.core.runtime import Runtime
from webmap.gate.display.client import GateClient
from webmap.testing.witness import WitnessRobot

PLACE, TURN = webmap.geometry.Vector3(1.0, 2.0), webmap.geometry.Quaternion()


@pytest.fixture
def program(tmp_path, monkeypatch):
    """A started program with one robot, and the refusals that it gets."""
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))
    monkeypatch.setattr(runtime_module, "robot_motions", set())
    refused = []
    module = SimpleNamespace(on_refused=lambda *refusal: refused.append(refusal))
    runtime = Runtime()
    runtime.make_gate = GateClient
    with WitnessRobot() as there:
        bob = webmap.Robot("Bob")
        bob.set_move_topic(webmap.Bridge(there.url), "/goal")
        bob.add_module(lambda robot: module)
        runtime_module.robot_motions.add(bob.motion)
        runtime.start()
        yield SimpleNamespace(runtime=runtime, bob=bob, refused=refused)
        runtime.run(bob.destroy)
        runtime.stop()


def test_a_program_gets_the_refusal_of_its_goal_for_a_viewer(program):
    bob, texts = program.bob, []
    viewer = program.runtime.gate.connect("Ann", "viewer", texts.append, texts.append)

    def moved():
        try:
            program.runtime.run(lambda: bob.move(PLACE, TURN, by=viewer))
        except MotionError:  # the gate has just begun
            return False
        return True

    wait_for(moved, "the gate")
    wait_for(lambda: program.refused, "a refusal")
    why = "viewers can only look and press STOP; driving needs an operator"
    assert program.refused == [("move", why)]
    assert any(why in text for text in texts)
    # What the viewer sends is not of the program.
    viewer.receive(json.dumps({"op": "take", "robot": bob.id}))
    wait_for(lambda: any('"what":"take"' in text for text in texts), "a refusal")
    assert len(program.refused) == 1


def test_a_program_gets_the_refusal_of_its_own_command(program):
    program.runtime.run(lambda: program.bob.acquire_lease(timeout=20.0))
    program.runtime.run(program.bob.locate, PLACE, TURN)
    what, why = wait_for(lambda: program.refused, "a refusal")[0]
    assert what == "locate"
    assert "initial pose" in why
