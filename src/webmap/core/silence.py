"""Poses that cease while the link is up: the log says so, and when they come again."""

import asyncio
import logging
import math
import time
from typing import Protocol

from webmap.ros.bridge import Bridge

log = logging.getLogger("webmap.robot")

LIMIT = 3.0
"""Seconds without a pose after which that is said."""

PERIODS = 2.5
"""As many times the least time between two poses, where that is longer."""

LATE = 0.5
"""A look that is later than this by so many seconds is done again after as many: this
process stood still, and not the robot."""

AGAIN = 60.0
"""Least seconds between two times that it is said of one robot."""


class Silence:
    """Decides when a robot has said nothing for so long that it is worth a line.

    All times are in seconds of one clock that only goes forward.
    """

    def __init__(self) -> None:
        self.limit = LIMIT
        """Seconds without a pose after which that is said."""
        self._heard = 0.0
        self._counted_from = 0.0
        self._said_at = -math.inf
        self._is_said = False

    @property
    def due(self) -> float:
        """When it is to be said, if no pose comes until then."""
        return max(self._counted_from + self.limit, self._said_at + AGAIN)

    def hear(self, now: float) -> float | None:
        """Note a pose; return for how long there was none, if that had been said."""
        took = now - self._heard if self._is_said else None
        self._heard = self._counted_from = now
        self._is_said = False
        return took

    def look(self, now: float, *, linked: bool) -> float | None:
        """Return for how long there was no pose, if that is to be said now.

        Args:
            now: The time.
            linked: Whether the link was open since the last look. Where it was not,
                that is what was wrong, and is said of the link.

        """
        if not linked:
            self._counted_from = now
        if now < self.due:
            return None
        self._said_at, self._is_said = now, True
        return now - self._heard

    def forget(self) -> None:
        """Take it that there was no pose: those to come are from somewhere else."""
        self._is_said = False


class Named(Protocol):
    """Whose poses they are: a robot."""

    name: str


class SilenceWatch:
    """Sees to it that the log says when a robot falls silent, and speaks again.

    It costs no more than a timer for each robot that said where it is. Outside of an
    event loop nothing is said.

    Args:
        owner: The robot.

    """

    def __init__(self, owner: Named) -> None:
        self._owner = owner
        self._silence = Silence()
        self._bridge: Bridge | None = None
        self._topic = ""
        self._links: int | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._due_at = 0.0

    def hear(self, bridge: Bridge, topic: str, period: float = 0.0) -> None:
        """Take it that a pose came now.

        Args:
            bridge: The link that it came over.
            topic: The topic, which goes on also while the robot stands.
            period: The least time between two of its messages, in seconds.

        """
        took = self._silence.hear(time.monotonic())
        if took is not None:
            log.info("%s: poses again, after %.0f s", self._owner.name, took)
        self._silence.limit = max(LIMIT, PERIODS * period)
        self._bridge, self._topic = bridge, topic
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            return
        if self._timer is None or self._loop is not loop:
            self._loop = loop
            self._look_at(time.monotonic() + self._silence.limit)

    def forget(self) -> None:
        """Expect no more poses, until there is one."""
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._bridge = self._links = None
        self._silence.forget()

    def _look_at(self, when: float) -> None:
        assert self._loop is not None  # who calls this has one
        self._due_at = when
        self._timer = self._loop.call_later(when - time.monotonic(), self._look)

    def _look(self) -> None:
        self._timer = None
        loop, bridge = self._loop, self._bridge
        if loop is None or bridge is None:
            return
        now = time.monotonic()
        if now - self._due_at > LATE:  # what came meanwhile may not be taken in yet
            self._look_at(now + LATE)
            return
        before, self._links = self._links, bridge.stats.links
        linked = bridge.state == "open" and before in (None, self._links)
        silent = self._silence.look(now, linked=linked)
        if silent is None:
            # A loop's clock may be a moment ahead of the one that is counted by.
            self._look_at(max(now + 0.01, self._silence.due))
            return
        log.warning(
            "%s: no pose for %.0f s; they come from %s on %s, and that link is open",
            self._owner.name,
            silent,
            self._topic,
            bridge.name,
        )
