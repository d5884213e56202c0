"""A hand, a running gate and a robot that notes what it is told."""

import json
import random
import time

import msgspec
import pytest
from gate_page import Page
from gate_robot import eventually

from webmap.gate.display.client import GateClient
from webmap.gate.rules.motion import DEADMAN
from webmap.testing import (
    Bounds,
    Sentinel,
    WitnessRobot,
    check_invariants,
)

pytestmark = pytest.mark.serial

V_MAX = 1.0


@pytest.fixture
def witness():
    with WitnessRobot(timeout=0.25) as robot:
        yield robot


@pytest.fixture
def driven(client: GateClient, robot_spec, witness):
    """Declare the witness with some settings; returns a page that may drive it."""
    pages = []

    def declare(kind=Recorder, **changes):
        client.declare(
            msgspec.structs.replace(
                robot_spec,
                bridge_url=witness.url,
                v_max=V_MAX,
                goal_topic=None,
                cancel_topic=None,
                **changes,
            )
        )
        pages.append(kind(client))
        return pages[-1]

    yield declare
    for page in pages:
        page.end()


class Recorder(Page):
    """Keeps every word that it said."""

    def __init__(self, client):
        self.said = []
        super().__init__(client)

    def say(self, **command):
        self.said.append(command)
        super().say(**command)


def moving(witness, since=0.0):
    return [
        received
        for received in witness.log.twists
        if received.at >= since and not received.is_zero
    ]


def press(page, reached, what):
    """Press until it is so; a busy machine may ask for a release in between."""

    def under_way():
        page.x = 1.0 if page.robot()["armed"] else 0.0
        return reached()

    eventually(under_way, what, 30)


@pytest.mark.parametrize("forged", [(), ("epoch", "seq")])
def test_replayed_commands_of_an_old_session_do_not_move_the_robot(
    client, driven, witness, forged
):
    page = driven()
    page.take()
    press(page, lambda: len(moving(witness)) > 10, "a drive")
    page.end()
    recorded = [word for word in page.said if word["op"] == "drive"]
    assert any(word["x"] for word in recorded)
    other = Recorder(client)
    other.take()
    before = time.monotonic()
    for number, word in enumerate(recorded, 1):
        now = {"epoch": other.robot()["epoch"], "seq": number}
        other.connection.receive(
            json.dumps(word | {name: now[name] for name in forged})
        )
        witness_has_time = time.monotonic() + 0.05
        eventually(lambda until=witness_has_time: time.monotonic() > until, "50 ms")
    assert not moving(witness, before)
    other.x = 0.0
    eventually(lambda: other.robot()["armed"], "a hand at rest")
    other.x = 1.0
    eventually(lambda: moving(witness, before), "its own words to move it")
    other.end()


def test_a_robot_does_not_accelerate_faster_than_its_limit(driven, witness):
    with Sentinel() as sentinel:
        page = driven(a_max=0.4)
        page.take()
        press(
            page,
            lambda: any(received.speed > 0.25 for received in moving(witness)),
            "speed",
        )
        page.x = 0.0
        eventually(lambda: witness.log.twists[-1].is_zero, "a zero at once")
        slack = 0.1 + sentinel.worst(0.0)
    wrong = check_invariants(
        witness.log.twists, Bounds(V_MAX, 1.5, a_max=0.4, slack=slack)
    )
    assert not wrong
    speeds = [received.speed for received in witness.log.twists]
    assert any(0.0 < speed < 0.2 for speed in speeds), "it was sped up by and by"


class LatePage(Recorder):
    """Hears each tick late, by fits and starts, as over a link with jitter."""

    def __init__(self, client, latency, jitter):
        self._lateness = random.Random(1)
        self._latency, self._jitter = latency, jitter
        self._ticks = []
        super().__init__(client)

    def _hear(self, text):
        super()._hear(text)
        message = json.loads(text)
        if message["op"] == "tick":
            self._ticks.append((time.monotonic(), message["tick"]))

    def drive(self, x, robot="r1"):
        until = (
            time.monotonic() - self._latency - self._lateness.uniform(0, self._jitter)
        )
        seen = [tick for at, tick in self._ticks if at <= until]
        if seen:
            self.tick = seen[-1]
            super().drive(x, robot)


def test_a_slow_page_connection_with_jitter_reduces_the_speed(driven, witness):
    page = driven(kind=lambda client: LatePage(client, 0.12, 0.03))
    page.take()
    press(page, lambda: len(moving(witness)) > 60, "a drive")
    # A quarter of a metre until anything takes effect: the loop, the dead-man timeout
    # and 250 ms of the robot's own. The first words are from before it is known.
    fastest = max(received.speed for received in moving(witness)[30:])
    assert fastest <= 0.25 / (DEADMAN + 0.25 + 0.15)


def test_a_page_connection_slower_than_300_ms_does_not_move_the_robot(driven, witness):
    page = driven(kind=lambda client: LatePage(client, 0.32, 0.2))
    page.take()
    for x in (0.0, 1.0):
        page.x = x
        said = len(page.said)
        eventually(lambda until=said + 40: len(page.said) > until, "two seconds", 30)
    assert any(word.get("x") for word in page.said)
    assert not moving(witness)
