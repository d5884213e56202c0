"""A page, a running gate and a robot that records the messages that it receives."""

import json
import random
import time

import pytest
from gate_page import Page

from equipment.declarations import changed
from equipment.waiting import wait_for
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
    """Declare the witness with some settings; return a page that may drive it."""
    pages = []

    def declare(kind=Recorder, **changes):
        client.declare(
            changed(
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
    """A page that keeps every command that it sent."""

    def __init__(self, client):
        self.sent = []
        super().__init__(client)

    def send(self, **command):
        self.sent.append(command)
        super().send(**command)


def moving(witness, since=0.0):
    return [
        received
        for received in witness.log.twists
        if received.at >= since and not received.is_zero
    ]


def press(page, reached, what):
    """Press until ``reached`` returns true; a busy computer may require a release."""

    def under_way():
        page.x = 1.0 if page.robot()["armed"] else 0.0
        return reached()

    wait_for(under_way, what, 30)


@pytest.mark.parametrize("forged", [(), ("epoch", "seq")])
def test_replayed_commands_of_an_old_session_do_not_move_the_robot(
    client, driven, witness, forged
):
    page = driven()
    page.take()
    press(page, lambda: len(moving(witness)) > 10, "a drive")
    page.end()
    recorded = [command for command in page.sent if command["op"] == "drive"]
    assert any(command["x"] for command in recorded)
    other = Recorder(client)
    other.take()
    before = time.monotonic()
    for number, command in enumerate(recorded, 1):
        now = {"epoch": other.robot()["epoch"], "seq": number}
        other.connection.receive(
            json.dumps(command | {name: now[name] for name in forged})
        )
        witness_has_time = time.monotonic() + 0.05
        wait_for(lambda until=witness_has_time: time.monotonic() > until, "50 ms")
    assert not moving(witness, before)
    other.x = 0.0
    wait_for(lambda: other.robot()["armed"], "released inputs")
    other.x = 1.0
    wait_for(lambda: moving(witness, before), "motion by its own commands")
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
        wait_for(lambda: witness.log.twists[-1].is_zero, "a zero at once")
        slack = 0.1 + sentinel.worst(0.0)
    wrong = check_invariants(
        witness.log.twists, Bounds(V_MAX, 1.5, a_max=0.4, slack=slack)
    )
    assert not wrong
    speeds = [received.speed for received in witness.log.twists]
    assert any(0.0 < speed < 0.2 for speed in speeds), "the speed rose gradually"


class LatePage(Recorder):
    """Receives each tick late, after a varying delay, as over a link with jitter."""

    def __init__(self, client, latency, jitter):
        self._lateness = random.Random(1)
        self._latency, self._jitter = latency, jitter
        self._ticks = []
        super().__init__(client)

    def _receive(self, text):
        super()._receive(text)
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
    # A quarter of a metre during the age of the loop, the dead-man timeout and the
    # 250 ms of the robot. The first velocities were sent before the age was known.
    fastest = max(received.speed for received in moving(witness)[30:])
    assert fastest <= 0.25 / (DEADMAN + 0.25 + 0.15)


def test_a_page_connection_slower_than_300_ms_does_not_move_the_robot(driven, witness):
    page = driven(kind=lambda client: LatePage(client, 0.32, 0.2))
    page.take()
    for x in (0.0, 1.0):
        page.x = x
        count = len(page.sent)
        wait_for(lambda until=count + 40: len(page.sent) > until, "two seconds", 30)
    assert any(command.get("x") for command in page.sent)
    assert not moving(witness)
