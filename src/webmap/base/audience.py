"""Whether somebody looks at the pages of this process.

While nobody does, what is only shown is received less often: see ``unwatched`` of
:meth:`webmap.Bridge.subscribe`.
"""

import asyncio
import logging
import weakref
from typing import Any, Protocol

from webmap.base.scope import Removal

log = logging.getLogger("webmap")

GRACE = 10.0
"""Seconds without an open page after which nobody looks: a page that is loaded again,
or loses its connection, changes nothing."""

RARELY = 5000
"""The usual ``unwatched`` of what is only shown, in milliseconds."""


class Follower(Protocol):
    """An object that receives less while nobody looks."""

    def audience_changed(self) -> None:
        """Adapt to :attr:`Audience.present`."""


class Audience:
    """Counts the open pages; used in the model's thread.

    A process without pages, such as a program that only drives, always counts as one at
    which somebody looks.
    """

    def __init__(self) -> None:
        self.present = True
        """Whether a page is open, was open in the last moments, or none is served."""
        self._pages = 0
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._followers: weakref.WeakSet[Any] = weakref.WeakSet()

    def expect_pages(self, loop: asyncio.AbstractEventLoop) -> None:
        """Count from now on: pages are served."""
        self._loop = loop
        if not self._pages:
            self._wait()

    def page_opened(self) -> Removal:
        """Count a page until the removal."""
        self._pages += 1
        self._forget_timer()
        self._set(True)
        return Removal(self._page_closed)

    def follow(self, follower: Follower) -> None:
        """Call ``follower`` whenever :attr:`present` changes, while it exists."""
        self._followers.add(follower)

    def forget(self, follower: Follower) -> None:
        """Call ``follower`` no more."""
        self._followers.discard(follower)

    def end(self) -> None:
        """Count no more: the process serves no pages now."""
        self._forget_timer()
        self._loop = None
        self._set(True)

    def _page_closed(self) -> None:
        self._pages -= 1
        if not self._pages:
            self._wait()

    def _wait(self) -> None:
        self._forget_timer()
        if self._loop is not None:
            self._timer = self._loop.call_later(GRACE, self._set, False)

    def _set(self, somebody: bool) -> None:
        if somebody == self.present:
            return
        self.present = somebody
        for follower in list(self._followers):
            try:
                follower.audience_changed()
            except Exception:
                log.exception("%r did not adapt to who looks", follower)

    def _forget_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


audience = Audience()
"""The pages of this process."""
