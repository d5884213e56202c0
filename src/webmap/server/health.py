"""What ``/healthz`` and ``/metrics`` show: whether WebMap works, and its figures."""

import asyncio
import shutil
import time
from concurrent.futures import Future
from datetime import UTC, datetime
from typing import NamedTuple

from webmap.base.lifecycle import lifecycle
from webmap.base.tls import Renewal
from webmap.core.refusals import refusals
from webmap.core.runtime import runtime
from webmap.core.visible_robot import robots
from webmap.gate.locks import state_folder
from webmap.ros.bridge import Bridge

ANSWERS_WITHIN_S = 1.0
"""How long the model's thread has to answer, and the gate between two ticks."""

LEAST_FREE = 16 << 20
"""Bytes that the disk of the state folder should have, because a STOP is kept there."""

EXPIRES_SOON_S = 7 * 86_400.0


class RobotFigures(NamedTuple):
    """The figures of one robot."""

    name: str
    """Its name, with its identifier if another robot has the name too."""
    state: str
    conditions: tuple[str, ...]
    pose_age: float | None
    stopped: bool


class BridgeFigures(NamedTuple):
    """The figures of one bridge."""

    name: str
    """Its name, with its address if another bridge has the name too."""
    is_open: bool
    lag: float


class Figures(NamedTuple):
    """The figures of the model's thread and the gate."""

    robots: list[RobotFigures]
    bridges: list[BridgeFigures]
    refused: int
    gate_pid: int | None
    tick_age: float | None
    """Seconds since the gate's newest tick; None if there was none."""
    tick_gap: float
    """The longest time between two ticks lately, in seconds."""


class Findings(NamedTuple):
    """What is wrong, in sentences, and the figures."""

    problems: list[str]
    """Because of these people cannot work, or a STOP may be forgotten."""
    notes: list[str]
    figures: Figures | None
    """None if the model's thread does not answer."""


class Health:
    """Finds what is wrong in this process."""

    def __init__(self) -> None:
        self.certificate: Renewal | None = None
        """The server's certificate, if it has one."""

    async def look(self) -> Findings:
        """Return what is wrong; called in the event loop of a server."""
        figures = await _ask()
        problems = [] if figures else ["WebMap's program does not answer: it is busy."]
        notes = []
        if figures is not None:
            problems += _of_gate(figures)
            is_open = sum(bridge.is_open for bridge in figures.bridges)
            if is_open < len(figures.bridges):
                notes.append(f"{is_open} of {len(figures.bridges)} bridges are open.")
        problems += await asyncio.to_thread(_of_disk)
        ends = await asyncio.to_thread(self.certificate.ends) if self.certificate else 0
        if ends and ends - time.time() < EXPIRES_SOON_S:
            day = datetime.fromtimestamp(ends, UTC)
            notes.append(f"The certificate expires on {day:%Y-%m-%d}.")
        return Findings(problems, notes, figures)


async def _ask() -> Figures | None:
    answer: Future[Figures] = Future()
    try:
        runtime.call(lambda: answer.set_result(_figures()))
        async with asyncio.timeout(ANSWERS_WITHIN_S):
            return await asyncio.wrap_future(answer)
    except (RuntimeError, TimeoutError):  # not started, or busy
        return None


def _figures() -> Figures:
    """Return the figures; called in the model's thread."""
    gate, now = runtime.gate, time.monotonic()
    ticks = gate.ticks if gate else None
    shown = sorted(robots.values(), key=lambda robot: (robot.name, robot.id))
    named = _unique([(robot.name, robot.id) for robot in shown])
    links = [each for each in lifecycle.services if isinstance(each, Bridge)]
    links.sort(key=lambda bridge: (bridge.name, bridge.url))
    places = _unique([(bridge.name, bridge.url) for bridge in links])
    return Figures(
        [
            RobotFigures(
                name,
                robot.state.activity,
                robot.state.conditions,
                robot.pose_age,
                robot.report is not None and robot.report.latched,
            )
            for name, robot in zip(named, shown, strict=True)
        ],
        [
            BridgeFigures(name, bridge.state == "open", bridge.lag)
            for name, bridge in zip(places, links, strict=True)
        ],
        refusals.total,
        gate.pid if gate else None,
        ticks.age(now) if ticks else None,
        ticks.gap(now) if ticks else 0.0,
    )


def _unique(named: list[tuple[str, str]]) -> list[str]:
    names = [name for name, _ in named]
    return [
        name if names.count(name) == 1 else f"{name} ({other})" for name, other in named
    ]


def _of_gate(figures: Figures) -> list[str]:
    age = figures.tick_age
    if figures.gate_pid is None or age is None:
        return ["The gate does not run: robots cannot be driven."]
    if age > ANSWERS_WITHIN_S:
        return [f"The gate has not answered for {age:.1f} s: robots cannot be driven."]
    return []


def _of_disk() -> list[str]:
    folder = state_folder()
    try:
        free = shutil.disk_usage(folder if folder.exists() else folder.parent).free
    except OSError as error:
        return [f"The folder for state cannot be used: {error.strerror}."]
    if free >= LEAST_FREE:
        return []
    return [
        f"The disk of the folder for state is full ({free >> 20} MiB are free): a "
        "restart may forget a STOP."
    ]
