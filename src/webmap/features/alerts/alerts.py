"""Alerts: what needs a person, in one list of all robots."""

import asyncio
import itertools
import logging
import secrets
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

from webmap.base.audience import RARELY, audience
from webmap.base.lifecycle import lifecycle
from webmap.base.roles import Role
from webmap.core.map import Map
from webmap.core.operators import Operator
from webmap.core.problems import cut, without_numbers
from webmap.core.robot import Robot
from webmap.gate.protocol import MAY_MOVE
from webmap.poses.silence import PERIODS

log = logging.getLogger("webmap.modules.alerts")

KINDS = {
    "disobeys": "not obeying",
    "unconfirmed": "STOP not confirmed",
    "bridge": "no connection to a bridge",
    "lost": "lost",
    "commands": "no connection for commands",
    "blocked": "blocked",
    "goal": "goal failed",
    "battery": "battery low",
    "health": "diagnostics error",
}
"""The kinds of alerts with their texts, the most urgent first."""

MOST = 200
"""The greatest number of alerts in the list."""

AGAIN = 10.0
"""Seconds after its end within which an acknowledged condition that returns is the same
alert, so that nobody has to acknowledge it again."""


@dataclass(slots=True)
class Alert:
    """A condition of a robot that needs a person. All times are in Unix seconds."""

    id: int
    """Increases with every alert."""

    robot: str
    """The id of the robot."""

    name: str
    """The name of the robot."""

    kind: str
    """A key of ``KINDS``."""

    text: str
    began: float
    """When it began first."""

    ended: float | None = None
    """When it ended; None while it is active."""

    count: int = 1
    """The number of times it began."""

    by: Operator | None = None
    """The viewer who acknowledged it, under the name of then; None until then."""

    acknowledged: float | None = None
    """When it was acknowledged; None until then."""

    version: int = 0
    """Increases with every change of any alert."""


class Alerts:
    """The alerts of all robots; no I/O and no clock.

    There is one alert for each robot and kind: a condition that ends and returns is the
    same alert with a greater count, until somebody has acknowledged it.
    """

    def __init__(self) -> None:
        self.listed: dict[int, Alert] = {}
        """The alerts of the list by id, the newest last, at most ``MOST``."""
        self.dropped = 0
        """The number of alerts that left the list before they were acknowledged."""
        self.version = 0
        self._newest: dict[tuple[str, str], Alert] = {}
        """The newest alert of each robot and kind, while it is listed or active."""
        # A page opened before a restart of WebMap has other ids.
        self._ids = itertools.count(secrets.randbits(31))

    def report(self, robot: str, name: str, kind: str, text: str, now: float) -> None:
        """Begin or update the alert of a condition that is true now.

        Args:
            robot: The id of the robot.
            name: The name of the robot.
            kind: A key of ``KINDS``.
            text: The condition as text. A text that differs only in its numbers is no
                change.
            now: Unix seconds.
        """
        alert = self._newest.get((robot, kind))
        text = cut(text)
        if alert is None or _is_past(alert, now):
            self._begin(robot, name, kind, text, now)
        elif alert.ended is not None:
            alert.text, alert.ended = text, None
            alert.count += 1
            self._changed(alert)
        elif without_numbers(alert.text) != without_numbers(text):
            alert.text = text
            self._changed(alert)

    def end_others(self, found: Collection[tuple[str, str]], now: float) -> None:
        """End all alerts except those of conditions that are true now.

        Args:
            found: The conditions, each by the id of its robot and its kind.
            now: Unix seconds.
        """
        for condition, alert in list(self._newest.items()):
            if alert.ended is None and condition not in found:
                self._end(alert, now)

    def acknowledge(self, id: int, by: Operator, now: float) -> bool:
        """Acknowledge an alert; the first viewer who does so stays recorded.

        Args:
            id: The id of the alert.
            by: The viewer.
            now: Unix seconds.

        Returns:
            Whether the list has the alert.
        """
        alert = self.listed.get(id)
        if alert is not None and alert.by is None:
            alert.by, alert.acknowledged = by, now
            self._changed(alert)
        return alert is not None

    def restore(self, earlier: Iterable[Alert]) -> None:
        """Add the alerts of an earlier process, with ids of this one."""
        for alert in list(earlier)[-MOST:]:
            alert.id = next(self._ids)
            self._newest[alert.robot, alert.kind] = self.listed[alert.id] = alert
            self._changed(alert)

    def since(self, version: int) -> list[Alert]:
        """Return the alerts that changed after a version, the newest last."""
        return [each for each in self.listed.values() if each.version > version]

    def _begin(self, robot: str, name: str, kind: str, text: str, now: float) -> None:
        alert = Alert(next(self._ids), robot, name, kind, text, now)
        self._newest[robot, kind] = self.listed[alert.id] = alert
        self._changed(alert)
        if len(self.listed) > MOST:
            self._drop(min(self.listed.values(), key=_worth))

    def _end(self, alert: Alert, now: float) -> None:
        alert.ended = now
        self._changed(alert)
        self._forget(alert)

    def _drop(self, alert: Alert) -> None:
        del self.listed[alert.id]
        self.dropped += alert.by is None
        self._forget(alert)

    def _forget(self, alert: Alert) -> None:
        """Forget an alert that is neither listed nor active."""
        key = (alert.robot, alert.kind)
        known = alert.id in self.listed or alert.ended is None
        if not known and self._newest.get(key) is alert:
            del self._newest[key]

    def _changed(self, alert: Alert) -> None:
        self.version += 1
        alert.version = self.version


def _is_past(alert: Alert, now: float) -> bool:
    """Return whether the same condition would be a new alert."""
    if alert.ended is None or alert.by is None:
        return False
    return now - alert.ended >= AGAIN


def _worth(alert: Alert) -> tuple[bool, bool, int]:
    """Return the order in which alerts leave a full list."""
    return alert.by is None, alert.ended is None, alert.id


PERIOD = 0.5
"""Seconds between two looks at all robots while a page is open."""

LOST = 3.0
"""Seconds without a pose or a connection after which a robot is lost."""


def conditions(robot: Robot) -> dict[str, str]:
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


def _reported(robot: Robot) -> dict[str, str]:
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


def without_bridge(robots: Iterable[Robot]) -> list[list[Robot]]:
    """Return the robots of each lost bridge that has several.

    The fault is one of the bridge: it is one alert and not one for each robot.
    """
    lost: dict[int, list[Robot]] = {}
    for robot in robots:
        bridge = robot.pose_source.bridge
        if bridge is not None and bridge.lost and not bridge.replays:
            lost.setdefault(id(bridge), []).append(robot)
    return [each for each in lost.values() if len(each) > 1]


class AlertWatch:
    """Looks at all robots twice a second, and every five seconds without a page.

    Args:
        alerts: The list to fill.
        robots: Returns the robots that are shown now.
    """

    def __init__(
        self,
        alerts: Alerts,
        robots: Callable[[], Iterable[Robot]],
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
        robots = list(self._robots())
        covered = set()
        for several in without_bridge(robots):
            first, bridge = several[0], several[0].pose_source.bridge
            assert bridge is not None
            found.add((first.id, "bridge"))
            text = f"No connection: {len(several)} robots"
            name = bridge.name or bridge.url
            self.alerts.report(first.id, name, "bridge", text, now)
            covered |= {robot.id for robot in several}
        for robot in robots:
            texts = conditions(robot)
            if robot.id in covered:
                texts.pop("lost", None)
                texts.pop("commands", None)
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


class AlertPanel:
    """A button with the number of new alerts, and their list; a module of maps.

    Args:
        map: The map.
        alerts: The list that all pages share.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {
        "acknowledge": "operator",
        "select": "viewer",
    }

    def __init__(self, map: Map, alerts: Alerts) -> None:
        self.map = map
        self._alerts = alerts
        self._sent = -1
        self._may = map.page.viewer.role != "viewer"
        self.browser_part = map.add_browser_part(
            self,
            "features/alerts/alert_panel.js",
            {"kinds": KINDS, "may": self._may},
            "features/alerts/alert_panel.css",
        )

    def on_ready(self) -> None:
        """Send everything: a page that was loaded again knows no alert."""
        self._sent = -1
        self.poll()

    def poll(self) -> None:
        """Send the page the alerts that changed."""
        if self._sent == self._alerts.version:
            return
        changed = self._alerts.since(self._sent)
        self._sent = self._alerts.version
        self.browser_part.send(
            {
                "alerts": [self._shown(alert) for alert in changed],
                "ids": list(self._alerts.listed),
                "dropped": self._alerts.dropped,
            }
        )

    def _shown(self, alert: Alert) -> dict[str, Any]:
        by = alert.by and self.map.page.viewer.calls(alert.by)
        return asdict(replace(alert, by=None)) | {"by": by}

    def on_message(self, message: dict[str, Any]) -> None:
        """Acknowledge alerts, or select the robot of an alert."""
        if "acknowledge" in message:
            self._answer(self._acknowledge(message["acknowledge"]))
        elif "select" in message:
            self._answer(self._select(message["select"]))
        else:
            log.warning("%r: an unknown message of the page was ignored", self.map)

    def _answer(self, problem: str) -> None:
        self.browser_part.send({"problem": problem})

    def _acknowledge(self, ids: object) -> str:
        """Acknowledge alerts; return what was wrong, or an empty text."""
        if not self._may:
            return "Viewers cannot acknowledge alerts: sign in as an operator."
        if not isinstance(ids, list) or len(ids) > MOST or not all(map(_is_id, ids)):
            return (
                f"Not acknowledged: a list of at most {MOST} numbers of alerts was "
                f"expected, got {str(ids)[:80]}. Reload the page."
            )
        now, by = time.time(), self.map.page.viewer.operator
        missing = [id for id in ids if not self._alerts.acknowledge(id, by, now)]
        self.poll()
        if not missing:
            return ""
        return f"No longer in the list: {len(missing)} of the acknowledged alerts."

    def _select(self, id: object) -> str:
        """Select a robot and show it; return what was wrong, or an empty text."""
        robot = self.map.find_robot(id)
        if robot is None:
            return "This robot is no longer on the page."
        self.map.set_selected(robot)
        if robot.valid:
            self.map.bring_into_sight(robot)
        return ""


def _is_id(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)
