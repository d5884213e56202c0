"""The list of alerts: what needs a person. No I/O and no clock."""

import itertools
import secrets
from collections.abc import Collection
from dataclasses import dataclass

from webmap.core.problems import cut, without_numbers

KINDS = {
    "disobeys": "not obeying",
    "unconfirmed": "STOP not confirmed",
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

    by: str | None = None
    """The name of the viewer who acknowledged it; None until then."""

    acknowledged: float | None = None
    """When it was acknowledged; None until then."""

    version: int = 0
    """Increases with every change of any alert."""


class Alerts:
    """The alerts of all robots.

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

    def acknowledge(self, id: int, by: str, now: float) -> bool:
        """Acknowledge an alert; the first viewer who does so stays recorded.

        Args:
            id: The id of the alert.
            by: The name of the viewer.
            now: Unix seconds.

        Returns:
            Whether the list has the alert.
        """
        alert = self.listed.get(id)
        if alert is not None and alert.by is None:
            alert.by, alert.acknowledged = by, now
            self._changed(alert)
        return alert is not None

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
