"""Log lines for when poses stop over an open connection, and when they resume."""

import asyncio
import logging
import math
import time
from collections.abc import Callable

from webmap.ros.bridge import Bridge

log = logging.getLogger("webmap.robot")

LIMIT = 3.0
"""Seconds without a pose after which the log gets a line."""

PERIODS = 2.5
"""The same limit in multiples of the least time between two poses; the longer one is
used."""

LATE = 0.5
"""Delay of a timer in seconds beyond which it is set again for as long: then this
process was stopped, and not the robot."""

AGAIN = 60.0
"""The least time between two such lines about one robot, in seconds."""


class Silence:
    """Decides when a robot has sent no pose for so long that the log gets a line.

    All times are in seconds of one monotonic clock.
    """

    def __init__(self) -> None:
        self.limit = LIMIT
        """Seconds without a pose after which the log gets a line."""
        self._last_pose_at = 0.0
        self._counted_from = 0.0
        self._logged_at = -math.inf
        self._is_logged = False

    @property
    def due(self) -> float:
        """When the line is due if no pose arrives until then."""
        return max(self._counted_from + self.limit, self._logged_at + AGAIN)

    def record(self, now: float, period: float = 0.0) -> float | None:
        """Record a pose; return the time without poses, if it was logged.

        Args:
            now: The time.
            period: The least time until the next pose.

        """
        self.expect(period)
        took = now - self._last_pose_at if self._is_logged else None
        self._last_pose_at = self._counted_from = now
        self._is_logged = False
        return took

    def expect(self, period: float) -> None:
        """Set the least time between two poses from now on."""
        self.limit = max(LIMIT, PERIODS * period)

    def look(self, now: float, *, linked: bool) -> float | None:
        """Return the time without poses, if the line is due now.

        Args:
            now: The time.
            linked: Whether the connection has been open since the last check. If not,
                the log has a line about the connection.

        """
        if not linked:
            self._counted_from = now
        if now < self.due:
            return None
        self._logged_at, self._is_logged = now, True
        return now - self._last_pose_at

    def forget(self) -> None:
        """Forget the silence: the next poses come from another source."""
        self._is_logged = False


class SilenceWatch:
    """Logs when a robot's poses stop, and when they resume.

    It has one timer, from the first pose on. Without an event loop it logs nothing.

    Args:
        name: Returns the name of the robot for a line of the log.

    """

    def __init__(self, name: Callable[[], str]) -> None:
        self._name = name
        self._silence = Silence()
        self._bridge: Bridge | None = None
        self._topic = ""
        self._links: int | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._due_at = 0.0

    def restart(self, bridge: Bridge | None, topic: str) -> None:
        """Watch another source, from its first pose on.

        Args:
            bridge: The bridge of the poses; None if there is no source.
            topic: The topic.

        """
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._links = None
        self._bridge, self._topic = bridge, topic
        self._silence.forget()

    def record(self, now: float, period: float) -> None:
        """Record a pose of a topic that also sends while the robot is at rest.

        Args:
            now: The time, in seconds of :func:`time.monotonic`.
            period: The least time until the next pose, in seconds.

        """
        took = self._silence.record(now, period)
        if took is not None:
            log.info("%s: poses again, after %.0f s", self._name(), took)
        # To ask for the running loop takes longer than all else here.
        known = self._loop
        if self._timer is not None and known is not None and not known.is_closed():
            return
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            return
        self._loop = loop
        self._look_at(loop, now + self._silence.limit)

    def expect(self, period: float) -> None:
        """Set the least time between two poses from now on, in seconds."""
        self._silence.expect(period)

    def _look_at(self, loop: asyncio.AbstractEventLoop, when: float) -> None:
        self._due_at = when
        self._timer = loop.call_later(when - time.monotonic(), self._look, loop)

    def _look(self, loop: asyncio.AbstractEventLoop) -> None:
        self._timer, bridge = None, self._bridge
        if bridge is None:
            return
        now = time.monotonic()
        if now - self._due_at > LATE:  # received poses may not be processed yet
            self._look_at(loop, now + LATE)
            return
        before, self._links = self._links, bridge.stats.links
        linked = bridge.state == "open" and before in (None, self._links)
        silent = self._silence.look(now, linked=linked)
        if silent is None:
            # A loop's clock may be slightly ahead of the clock used here.
            self._look_at(loop, max(now + 0.01, self._silence.due))
            return
        log.warning(
            "%s: no pose for %.0f s from %s on %s, although the connection is open",
            self._name(),
            silent,
            self._topic,
            bridge.name,
        )
