"""What makes an alert, and the watch over all robots."""

import asyncio
import logging
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from webmap.base.audience import RARELY, audience
from webmap.base.lifecycle import lifecycle
from webmap.features.alerts.alerts import KINDS, Alerts
from webmap.gate.protocol import MAY_MOVE
from webmap.poses.silence import PERIODS

if TYPE_CHECKING:
    from webmap.core.robot import Robot

log = logging.getLogger("webmap.modules.alerts")

PERIOD = 0.5
"""Seconds between two looks at all robots while a page is open."""

LOST = 3.0
"""Seconds without a pose or a connection after which a robot is lost."""


def conditions(robot: "Robot") -> dict[str, str]:
    """Return what is wrong with a robot now: a text for each kind of alert.

    Nothing is wrong with a robot of a recording.
    """
    bridge = robot.pose_source.bridge
    if bridge is not None and bridge.replays:
        return {}
    found = _reported(robot)
    if bridge is not None and bridge.lost:
        found["lost"] = "No connection to the bridge"
    elif bridge is None or bridge.state == "open":
        silent, period = robot.silent_for, robot.pose_source.period
        if silent is not None and silent > max(LOST, PERIODS * period):
            found["lost"] = "No pose received"
    charge = robot.charge
    if charge is not None and charge < robot.battery_low:
        found["battery"] = f"Battery at {round(100 * charge)} %"
    for module in robot.modules:
        if hasattr(module, "parts") and hasattr(module, "hold"):
            bad = [part for part in module.parts if part.level == "error"]
            if bad:
                more = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
                found["health"] = f"{bad[0].name}: {bad[0].message}{more}"
    return found


def _reported(robot: "Robot") -> dict[str, str]:
    """Return the conditions that the gate reports."""
    report = robot.report
    if report is None:
        return {}
    found = {}
    if report.alarm is not None:
        others = [report.other_writer] if report.other_writer else []
        title = "No connection" if report.alarm == MAY_MOVE else "Not obeying"
        found["disobeys"] = f"{title}: {'; '.join([report.alarm, *others])}"
    if report.doing == "unconfirmed":
        why = report.stop.why if report.stop is not None else ""
        found["unconfirmed"] = f"STOP not confirmed: {why}".removesuffix(": ")
    if report.link == "down":
        found["commands"] = "No connection for commands"
    if report.doing == "blocked":
        found["blocked"] = "Driven, but not moving"
    if report.goal is not None and report.goal.state == "failed":
        found["goal"] = f"Goal failed: {report.goal.why}".removesuffix(": ")
    return found


class AlertWatch:
    """Looks at all robots twice a second, and every five seconds without a page.

    Args:
        alerts: The list to fill.
        robots: Returns the robots that are shown now.
    """

    def __init__(
        self,
        alerts: Alerts,
        robots: "Callable[[], Iterable[Robot]]",
    ) -> None:
        self.alerts = alerts
        self._robots = robots
        self._unlinked: dict[str, float] = {}
        """When the gate lost each robot without a connection, by id."""
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """Watch while the process runs."""
        lifecycle.add(self)

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin the periodic looks; called in the loop's thread."""
        self._task = loop.create_task(self._look_on())

    async def stop(self) -> None:
        """End the periodic looks."""
        if self._task is not None:
            self._task.cancel()
            self._task = None

    def look(self, now: float) -> None:
        """Report the conditions of all robots, at ``now`` in Unix seconds."""
        found = set()
        for robot in list(self._robots()):
            texts = conditions(robot)
            if not self._is_unlinked(robot.id, "commands" in texts, now):
                texts.pop("commands", None)
            for kind in KINDS if texts else ():  # the most urgent first
                if kind in texts:
                    found.add((robot.id, kind))
                    self.alerts.report(robot.id, robot.name, kind, texts[kind], now)
        self.alerts.end_others(found, now)

    def _is_unlinked(self, robot: str, down: bool, now: float) -> bool:
        """Return whether the gate has had no connection to a robot for a while.

        Every connection is down at first.
        """
        if not down:
            self._unlinked.pop(robot, None)
            return False
        return now - self._unlinked.setdefault(robot, now) >= LOST

    async def _look_on(self) -> None:
        while True:
            try:
                self.look(time.time())
            except Exception:
                log.exception("the alerts were not updated")
            await asyncio.sleep(PERIOD if audience.present else RARELY / 1000)
