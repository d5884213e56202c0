"""One look at one bridge at a time, for everybody who wants to know."""

import asyncio
import logging
import time
import weakref
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from webmap.discovery.doctor import Finding, Observed, judge
from webmap.discovery.doctor.measure import observe
from webmap.discovery.doctor.verdict import report

if TYPE_CHECKING:
    from webmap import Bridge
    from webmap.console.fleet import RobotDescription

log = logging.getLogger("webmap.console")

SECONDS = 3.0
"""How long topics are listened to."""

PLURAL = {"wrong": "wrong", "warning": "warnings", "note": "notes", "good": "good"}

Observe = Callable[..., Awaitable[Observed]]


class Checkup:
    """The readiness check of one bridge, and what it found last.

    However many viewers ask, there is one at a time, with one socket for listening;
    the bridge's own links are not touched.

    Args:
        url: The bridge's address.
        known: Types by topic, for a bridge that does not say which there are.
        observe: Looks at a bridge.

    """

    def __init__(
        self,
        url: str,
        known: Mapping[str, str] | None = None,
        observe: Observe = observe,
    ) -> None:
        self.url = url
        self._known = {} if known is None else known
        self.version = 0
        """A number that grows whenever there is something new to show."""
        self.doing = ""
        """What is being done, in a sentence; empty if nothing is."""
        self.findings: Sequence[Finding] = ()
        """What was found last: the bridge first, then each robot, worst first."""
        self.ended: float | None = None
        """When that was, on the monotonic clock; None if it never was."""
        self._observe = observe
        self._task: asyncio.Task[None] | None = None

    @property
    def is_running(self) -> bool:
        """Whether somebody's check is under way."""
        return self._task is not None and not self._task.done()

    @property
    def summary(self) -> str:
        """How many findings of each level there are, in words."""
        numbers = {level: 0 for level in PLURAL}
        for finding in self.findings:
            numbers[finding.level] += 1
        said = [
            f"{number} {level if number == 1 else PLURAL[level]}"
            for level, number in numbers.items()
            if number
        ]
        free = not numbers["wrong"] and not numbers["warning"]
        return ("Nothing is in the way: " if free else "") + ", ".join(said)

    @property
    def text(self) -> str:
        """All findings as plain text."""
        return report(self.url, self.findings)

    def start(self) -> None:
        """Look at the bridge, unless somebody has that done already."""
        if self.is_running:
            return
        self._say("Beginning.")
        self._task = asyncio.get_running_loop().create_task(self._run())

    async def _run(self) -> None:
        try:
            seen = await self._observe(
                self.url, seconds=SECONDS, known=self._known, progress=self._say
            )
            self.findings = judge(seen)
        except Exception as error:
            log.exception("the readiness check of %s failed", self.url)
            words = f"The check itself failed: {error!r}."
            advice = f"Run webmap doctor {self.url} in a terminal, and look at the log."
            self.findings = [Finding("wrong", "bridge", words, advice)]
        self.ended = time.monotonic()
        self._say("")

    def _say(self, doing: str) -> None:
        self.doing = doing
        self.version += 1


_TYPES = {
    "odometry": "nav_msgs/Odometry",
    "twist": "geometry_msgs/Twist",
    "scan": "sensor_msgs/LaserScan",
    "battery": "sensor_msgs/BatteryState",
}
"""What a robot that was told by hand is taken to have on its topics."""

_known: "weakref.WeakKeyDictionary[Bridge, dict[str, str]]"
_known = weakref.WeakKeyDictionary()


def remember(robots: "Iterable[RobotDescription]") -> None:
    """Keep the topics of robots for the checks of their bridges."""
    for robot in robots:
        topics = _known.setdefault(robot.bridge, {})
        for role, type in _TYPES.items():
            topic = getattr(robot, role)
            if topic:
                topics[topic] = type


_checkups: "weakref.WeakKeyDictionary[Bridge, Checkup]" = weakref.WeakKeyDictionary()


def checkup_of(bridge: "Bridge") -> Checkup:
    """Return the check of a bridge, which all viewers share."""
    found = _checkups.get(bridge)
    if found is None:
        found = _checkups[bridge] = Checkup(bridge.url, _known.setdefault(bridge, {}))
    return found
