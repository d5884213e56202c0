"""``webmap doctor URL --stop-test ROBOT``: does the base stop by itself?

The command is one more client of the gate: it holds the robot's lease and answers 20
times a second that every input is neutral. The gate's own stop test moves the robot,
measures it and stores the result, as with the button on a robot's card.
"""

import asyncio
import json
import queue
import time
from collections.abc import Sequence
from datetime import datetime
from typing import Any, Literal, TypeAlias

import click

from webmap.base.echo import echo
from webmap.base.errors import BridgeError, ConfigError
from webmap.base.text import escaped
from webmap.config.motion import TwistConfig
from webmap.discovery import FoundRobot, discover
from webmap.discovery.robots import host_name
from webmap.gate.display.client import GateClient
from webmap.gate.protocol import RobotSpec
from webmap.gate.rules.stop_test import MOVES_ON
from webmap.ros.names import normalise_url
from webmap.ros.temporary_bridge import ask_topics

PERIOD = 0.05
"""Seconds between two answers to the gate."""

AGAIN = 1.0
"""Seconds after which a request is repeated."""

PATIENCE = 10.0
"""Seconds to wait for the gate, the robot and its odometry at each stage."""

ROBOT = "r1"
STOPS, GOES_ON, UNKNOWN = 0, 1, 2

GateMessage: TypeAlias = dict[str, Any]


class StopTestClient:
    """The client of the gate and its output for the person, stage by stage. No I/O.

    Args:
        now: The time in seconds.

    """

    def __init__(self, now: float) -> None:
        self.stage: Literal["coming", "ready", "taking", "testing", "over"] = "coming"
        self.code = UNKNOWN
        """The exit status, at the end."""
        self.news: list[str] = []
        """Sentences for the person, the newest last."""
        self._why = "the gate has not answered"
        self._since = now
        self._asked_at = float("-inf")
        self._report: GateMessage | None = None
        self._tick: int | None = None
        self._seq = 0

    def receive(self, message: GateMessage, now: float) -> None:
        """Process a message that the gate sends to pages."""
        match message["op"]:
            case "tick":
                self._tick = message["tick"]
            case "hello" if self._report is not None:
                self._end("the gate restarted in the meantime")
            case "refused" if message["what"] == "lease" and self.stage != "coming":
                self._end(message["why"])
            case "refused":
                self._why = message["why"]
            case "robot":
                self._receive_robot(message, now)

    def begin(self, now: float) -> None:
        """Start the test, after the person has agreed."""
        if self.stage == "ready":
            self._go_on("taking", now)

    def step(self, now: float) -> list[GateMessage]:
        """Return what to send to the gate; called 20 times a second."""
        if now - self._since > PATIENCE and self.stage not in ("ready", "over"):
            self._end(self._why)
        report = self._report
        if self.stage not in ("taking", "testing") or report is None:
            return []
        if not report["mine"]:
            return [{"op": "take", "robot": ROBOT}] if self._may_ask(now) else []
        messages: list[GateMessage] = []
        if self._tick is not None:
            messages.append(self._released(report["epoch"], self._tick))
        if self.stage == "taking" and report["armed"] and self._may_ask(now):
            messages.append({"op": "stop-test", "robot": ROBOT})
        return messages

    def _released(self, epoch: int, tick: int) -> GateMessage:
        self._seq += 1
        axes = {"x": 0.0, "y": 0.0, "turn": 0.0}
        state = {"epoch": epoch, "seq": self._seq, "tick": tick, **axes}
        return {"op": "drive", "robot": ROBOT, **state}

    def _receive_robot(self, report: GateMessage, now: float) -> None:
        before, self._report = self._report, report
        if self.stage == "coming" and report["armable"]:
            self._go_on("ready", now)
        elif report["latched"] and self.stage != "over":
            self._end(report["reason"] or "STOP is active")
        elif self.stage in ("coming", "taking") and not report["mine"]:
            self._why = report["reason"] or self._why
        test = report["test"]
        if test is None or self.stage not in ("taking", "testing"):
            return
        if self.stage == "taking":
            self._go_on("testing", now)
            self._why = "the gate did not store the result"
        if before is None or test != before["test"]:
            self.news.append(test["text"])
        concluded = test["state"] == "done" or test["text"] == MOVES_ON
        if test["state"] == "failed" and not concluded:
            self._end(test["text"])
        elif concluded and _is_result(report, test["text"]):
            self._conclude(report)

    def _conclude(self, report: GateMessage) -> None:
        seconds, day = report["stop_time"], report["stop_date"]
        self.stage = "over"
        if seconds is None:
            self.code = GOES_ON
            self.news.append(
                f"Result of {day}: the base does NOT stop by itself, so WebMap drives "
                "it at 0.3 m/s at most. Set a command timeout in the robot's base."
            )
        else:
            self.code = STOPS
            self.news.append(
                f"Result of {day}: the base stops by itself in {seconds:.2f} s."
            )

    def _may_ask(self, now: float) -> bool:
        if now < self._asked_at + AGAIN:
            return False
        self._asked_at = now
        return True

    def _go_on(self, stage: Literal["ready", "taking", "testing"], now: float) -> None:
        self.stage, self._since, self._asked_at = stage, now, float("-inf")

    def _end(self, why: str) -> None:
        if self.stage != "over":
            self.stage = "over"
            self.news.append(f"The stop test gave no result: {why}.")


def _is_result(report: GateMessage, text: str) -> bool:
    """Return whether a report belongs to this test and not to an earlier one."""
    today = datetime.now().astimezone().date().isoformat()
    if report["stop_source"] != "tested" or report["stop_date"] != today:
        return False
    seconds = report["stop_time"]
    return (text == MOVES_ON) if seconds is None else f"after {seconds:.2f} s" in text


def find_out(urls: Sequence[str], name: str, *, wait: float, yes: bool) -> int:
    """Test whether a robot stops by itself, and return the exit status.

    Args:
        urls: The address of the robot's rosbridge, and no other.
        name: The robot's name in ``webmap discover``.
        wait: How long to wait for an unreachable rosbridge, in seconds.
        yes: Whether to start without asking the person.

    Returns:
        0 if it stops by itself, 1 if it does not, 2 if the result is unknown.

    Raises:
        click.UsageError: If there is more than one address.

    """
    if len(urls) > 1:
        raise click.UsageError(f"--stop-test takes one URL, got {len(urls)}")
    try:
        url = normalise_url(urls[0])
        found = discover(asyncio.run(_topics(url, wait)), host_name(url))
        spec = _spec(url, name, found.robots)
    except (BridgeError, ConfigError) as error:
        echo(f"The stop test gave no result: {error}", err=True)
        return UNKNOWN
    except KeyboardInterrupt:
        echo("Interrupted before the stop test had a result; nothing was moved.")
        return UNKNOWN
    client = GateClient()
    client.declare(spec)
    try:
        client.start()
        return _run(client, spec, yes)
    except (KeyboardInterrupt, click.Abort):
        echo("Interrupted before the stop test had a result; the robot is stopped.")
        return UNKNOWN
    finally:
        client.stop()


async def _topics(url: str, wait: float) -> dict[str, str]:
    def waiting(why: str) -> None:
        echo(f"Waiting for the bridge at {url}: {why}", err=True)

    return await ask_topics(url, wait=wait, waiting=waiting)


def _spec(url: str, name: str, robots: tuple[FoundRobot, ...]) -> RobotSpec:
    """Return the robot's specification for the gate, without a command timeout."""
    robot = next((one for one in robots if one.name == name), None)
    if robot is None:
        there = ", ".join(one.name for one in robots) or "none"
        raise ConfigError(f"no robot {name!r} behind {url}; the robots are: {there}")
    velocity, odometry = robot.first("velocity"), robot.first("odometry")
    if velocity is None or odometry is None:
        missing = "velocity topic" if velocity is None else "odometry"
        raise ConfigError(f"robot {name!r} has no {missing}, so it cannot be tested")
    return RobotSpec(
        id=ROBOT,
        name=name,
        twist=TwistConfig(topic=velocity.topic, type=velocity.type, bridge=url),
        odometry_topic=odometry.topic,
        odometry_type=odometry.type,
    )


def _run(client: GateClient, spec: RobotSpec, yes: bool) -> int:
    """Run the client from stage to stage, at 20 Hz."""
    test = StopTestClient(time.monotonic())
    received: queue.SimpleQueue[str] = queue.SimpleQueue()
    connection = client.connect("webmap doctor", "operator", received.put, echo)
    while test.stage != "over":
        time.sleep(PERIOD)
        while not received.empty():
            test.receive(json.loads(received.get()), time.monotonic())
        if test.stage == "ready":
            if not yes and not _agrees(spec):
                echo("Nothing was moved.")
                return UNKNOWN
            test.begin(time.monotonic())
        for message in test.step(time.monotonic()):
            connection.receive(json.dumps(message))
        for text in test.news:
            echo(f"{spec.name}: {text}")
        test.news.clear()
    return test.code


def _agrees(spec: RobotSpec) -> bool:
    return click.confirm(
        f"{escaped(spec.name)} ({escaped(spec.base.topic)}) will creep forward "
        "at 0.1 m/s for up to 5 s. Is half a metre free in front of it?",
        default=False,
    )
