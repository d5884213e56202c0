"""One look at one bridge at a time, for everybody who wants to know."""

import asyncio
import logging
import time
import weakref
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from typing import TYPE_CHECKING

from webmap.discovery.doctor import Finding, MeantRobot, Observed, judge
from webmap.discovery.doctor.measure import TRYING, observe, tried
from webmap.discovery.doctor.verdict import report

if TYPE_CHECKING:
    from webmap import Bridge

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
        observe: Looks at a bridge.
        tried: Takes what was seen, tries a call that hangs, and adds what that tells.

    """

    def __init__(
        self, url: str, observe: Observe = observe, tried: Observe = tried
    ) -> None:
        self.url = url
        self.version = 0
        """A number that grows whenever there is something new to show."""
        self.doing = ""
        """What is being done, in a sentence; empty if nothing is."""
        self.findings: Sequence[Finding] = ()
        """What was found last: the bridge first, then each robot, worst first."""
        self.ended: float | None = None
        """When topics were listened to last, on the monotonic clock; None if never."""
        self._observe = observe
        self._tried = tried
        self._seen: Observed | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def is_running(self) -> bool:
        """Whether somebody's check is under way."""
        return self._task is not None and not self._task.done()

    @property
    def can_try(self) -> bool:
        """Whether a call that hangs can be tried: the bridge was there at the check."""
        seen = self._seen
        return seen is not None and not seen.trouble and not self.is_running

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

    def start(self, robots: Sequence[MeantRobot] = ()) -> None:
        """Look at the bridge, unless somebody has that done already.

        Args:
            robots: The robots that the page has of it, with the topics in use; those
                that are found are looked at if there are none.

        """
        if not self.is_running:
            self._begin(self._look(robots))

    def try_call(self) -> None:
        """Try what a call that hangs holds up; the rest of the report stays.

        Nothing is tried while something is done, or if the bridge was away.
        """
        if self._seen is not None and self.can_try:
            self._begin(self._try(self._seen))

    def _begin(self, work: Coroutine[None, None, Observed]) -> None:
        self._say("Beginning.")
        self._task = asyncio.get_running_loop().create_task(self._run(work))

    async def _look(self, robots: Sequence[MeantRobot]) -> Observed:
        try:
            return await self._observe(
                self.url, seconds=SECONDS, meant=lambda _: robots, progress=self._say
            )
        finally:
            self.ended = time.monotonic()

    async def _try(self, seen: Observed) -> Observed:
        self._say(TRYING)
        return await self._tried(seen)

    async def _run(self, work: Coroutine[None, None, Observed]) -> None:
        try:
            self._seen = await work
            self.findings = judge(self._seen)
        except Exception as error:
            log.exception("the readiness check of %s failed", self.url)
            words = f"The check itself failed: {error!r}."
            advice = f"Run webmap doctor {self.url} in a terminal, and look at the log."
            self._seen = None
            self.findings = [Finding("wrong", "bridge", words, advice)]
        self._say("")

    def _say(self, doing: str) -> None:
        self.doing = doing
        self.version += 1


_checkups: "weakref.WeakKeyDictionary[Bridge, Checkup]" = weakref.WeakKeyDictionary()


def checkup_of(bridge: "Bridge") -> Checkup:
    """Return the check of a bridge, which all viewers share."""
    found = _checkups.get(bridge)
    if found is None:
        found = _checkups[bridge] = Checkup(bridge.url)
    return found
