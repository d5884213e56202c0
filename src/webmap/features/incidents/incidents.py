"""Keeps the last minutes of all robots as recordings, and the button on the page."""

import asyncio
import logging
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from webmap.base.lifecycle import lifecycle
from webmap.core.map import Map
from webmap.core.robot import Robot
from webmap.core.shift_log import shift_log
from webmap.features.incidents.observer import RobotObserver
from webmap.features.incidents.writer import IncidentWriter, Kept
from webmap.scene import html
from webmap.scene.element import Element

log = logging.getLogger("webmap.incidents")

PERIOD = 0.1
"""Seconds between two looks at all robots."""

MANY = 100
"""Robots from which on there are fewer looks, so that they cost no more."""

HAND_OVER = 1.0
"""Seconds of records that are handed to the writer at once."""

AFTER = 10.0
"""Seconds after a STOP or an alarm that the recording still has."""

APART = 60.0
"""Least seconds between two recordings that nobody has asked for."""


@dataclass(slots=True)
class Keeping:
    """When the next recording is kept, and why; asks no clock."""

    reasons: list[str] = field(default_factory=list)
    """What happened, without repetitions; empty if nothing is to be kept."""
    asked: bool = False
    """Whether a person asked for it."""
    due: float = 0.0
    last: float = float("-inf")
    """When the last one was kept."""

    def trigger(self, reason: str, now: float, *, asked: bool = False) -> None:
        """Keep a recording soon; what happens until then belongs to the same one."""
        soon = now + AFTER
        if not self.reasons:
            self.due = soon if asked else max(soon, self.last + APART)
        elif asked and not self.asked:
            self.due = min(self.due, soon)
        self.asked |= asked
        if reason not in self.reasons:
            self.reasons.append(reason)

    def take(self, now: float) -> None:
        """Begin anew, after a recording was kept."""
        self.reasons, self.asked, self.last = [], False, now


class Incidents:
    """Records all robots, and keeps a recording when something has happened.

    Args:
        robots: Returns the robots to record.
        alerts: The list of alerts, whose new ones are events.

    """

    def __init__(
        self, robots: Callable[[], Iterable[Robot]], alerts: Any = None
    ) -> None:
        self.keeping = Keeping()
        self._robots = robots
        self._alerts = alerts
        self._alert_version = 0
        self._observers: dict[str, RobotObserver] = {}
        self._writer: IncidentWriter | None = None
        self._task: asyncio.Task[None] | None = None
        self._handed_at = 0.0

    @property
    def trouble(self) -> str:
        """Why nothing is recorded or kept, as a sentence; empty if all is well."""
        return "" if self._writer is None else self._writer.trouble

    @property
    def kept(self) -> Kept | None:
        """The newest recording of this run."""
        return None if self._writer is None else self._writer.kept

    @property
    def is_busy(self) -> bool:
        """Whether a recording is made now."""
        return self._writer is not None and self._writer.is_busy

    def begin(self) -> None:
        """Record while the process runs."""
        lifecycle.add(self)

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to record; called in the loop's thread."""
        self._writer = IncidentWriter()
        self._writer.start()
        self._task = loop.create_task(self._look_on())

    async def stop(self) -> None:
        """Hand over all records, and keep a recording that is due."""
        if self._task is None or self._writer is None:
            return
        self._task.cancel()
        self._task = None
        self._hand_over(time.monotonic())
        if self.keeping.reasons:
            self._keep(time.monotonic())
        await asyncio.to_thread(self._writer.finish)

    def keep(self, robot: Robot, by: str) -> None:
        """Keep the last minutes, because a person asked for it.

        Args:
            robot: The robot that it is about.
            by: The person.

        """
        self.note(robot, "alarm", f"The last minutes were kept by {by}")
        reason = f"asked for by {by}"
        self.keeping.trigger(reason, time.monotonic(), asked=True)

    def note(self, robot: Robot, kind: Any, text: str) -> None:
        """Add an event of a robot to the recording."""
        self._observer_of(robot).note(time.time_ns(), kind, text)

    def look(self, now: float) -> None:
        """Record what is new of all robots, at ``now`` of ``time.monotonic()``."""
        stamp = time.time_ns()
        present = set()
        for robot in self._robots():
            present.add(robot.id)
            for why in self._observer_of(robot).look(now, stamp):
                self.keeping.trigger(f"{why} of {robot.name}", now)
        self._note_alerts(stamp)
        if now - self._handed_at >= HAND_OVER:
            self._hand_over(now)
            for gone in self._observers.keys() - present:
                del self._observers[gone]
        if self.keeping.reasons and now >= self.keeping.due:
            self._hand_over(now)
            self._keep(now)

    def _observer_of(self, robot: Robot) -> RobotObserver:
        found = self._observers.get(robot.id)
        if found is None or found.robot is not robot:
            found = self._observers[robot.id] = RobotObserver(robot)
        return found

    def _note_alerts(self, stamp: int) -> None:
        """Record alerts that began; the reports have the most urgent ones already."""
        if self._alerts is None or self._alerts.version == self._alert_version:
            return
        for alert in self._alerts.since(self._alert_version):
            observer = self._observers.get(alert.robot)
            urgent = alert.kind in ("disobeys", "unconfirmed")
            if observer is not None and alert.ended is None and not urgent:
                observer.note(stamp, "alarm", alert.text)
        self._alert_version = self._alerts.version

    def _hand_over(self, now: float) -> None:
        self._handed_at = now
        frames = [each.take() for each in self._observers.values() if each.records]
        if frames and self._writer is not None:
            self._writer.put(frames)

    def _keep(self, now: float) -> None:
        keeping = self.keeping
        reasons, asked = tuple(keeping.reasons), keeping.asked
        keeping.take(now)
        if self._writer is not None:
            self._writer.keep(asked)
        why = ", ".join(reasons[:MOST_REASONS])
        log.info("the last minutes are kept: %s", why)
        shift_log.note("recording", f"The last minutes are kept: {why}")

    async def _look_on(self) -> None:
        while True:
            try:
                self.look(time.monotonic())
            except Exception:
                log.exception("the robots were not recorded")
            await asyncio.sleep(PERIOD * max(1.0, len(self._observers) / MANY))


MOST_REASONS = 10
"""The greatest number of reasons that the log names."""


class IncidentButton:
    """Keeps the last minutes when it is pressed; a module of maps.

    Args:
        map: The map.
        element: The page's element to append to.
        incidents: The recorder.

    """

    def __init__(self, map: Map, element: Element, incidents: Incidents) -> None:
        self.map = map
        self._incidents = incidents
        self._may = map.page.viewer.role != "viewer"
        self._button = html.button(
            "Keep the last minutes",
            type="button",
            class_="button",
            data_act="keep-minutes",
            title="Keeps a recording of all robots: the last ten minutes and the next "
            "ten seconds. Open it with webmap play.",
        )
        self._button.on("click", lambda event: self._keep())
        self._text = html.p(class_="webmap-muted minor", role="status")
        buttons = html.div(self._button, class_="webmap-row wraps")
        self.element = html.section(buttons, self._text, aria_label="Recording")
        element.append(self.element)
        self.poll()

    def destroy(self) -> None:
        """Remove the button."""
        self.element.remove()

    def poll(self) -> None:
        """Show what is kept now, and the newest recording."""
        incidents = self._incidents
        waits = bool(incidents.keeping.reasons) or incidents.is_busy
        self._button.set(disabled=not self._may or (waits and incidents.keeping.asked))
        text = incidents.trouble
        if not text and waits:
            text = "The last minutes will be kept in a moment."
        elif not text and incidents.kept is not None:
            text = incidents.kept.text
        self._text.text = text

    def _keep(self) -> None:
        robot = self.map.selected
        if robot is not None and self._may:
            self._incidents.keep(robot, self.map.page.viewer.operator.logged)
            self.poll()
