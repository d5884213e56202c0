"""Scopes: what is made on behalf of somebody ends with them.

A page, a map and a robot each own a :class:`Scope`. Whatever is made while a scope
is current (a subscription, a listener, an element's handler) joins it and is removed
when the scope closes, in reverse order, also when one removal raises.
"""

import asyncio
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Protocol, TypeVar

log = logging.getLogger("webmap")

T = TypeVar("T", bound="Removable")

_current: ContextVar["Scope | None"] = ContextVar("webmap_scope", default=None)


class Removable(Protocol):
    """Anything that was added and can be removed again, any number of times."""

    def remove(self) -> None:
        """Undo what was added; the second call does nothing."""


class Removal:
    """One thing that was added, and how to undo it once."""

    __slots__ = ("__weakref__", "_undo")

    def __init__(self, undo: Callable[[], object]) -> None:
        self._undo: Callable[[], object] | None = undo

    def remove(self) -> None:
        """Undo what was added; the second call does nothing."""
        undo, self._undo = self._undo, None
        if undo is not None:
            undo()


class Scope:
    """The things that one owner made, in the order in which they were made.

    Args:
        name: The owner's name, for the log.
        report: Shows people that something made here failed: a sentence, and what
            that is about if it goes on failing, else None.
        mended: Is told what goes on failing no more: what it was about.

    """

    def __init__(
        self,
        name: str = "",
        report: Callable[[str, object], object] | None = None,
        mended: Callable[[object], object] | None = None,
    ) -> None:
        self.name = name
        self.report = report
        self.mended = mended
        self._things: dict[int, Removable] = {}
        self.closed = False

    def __len__(self) -> int:
        return len(self._things)

    def add(self, thing: Removable) -> None:
        """Let ``thing`` end with this scope; at once if the scope is closed."""
        if self.closed:
            thing.remove()
        else:
            self._things[id(thing)] = thing

    def discard(self, thing: Removable) -> None:
        """Forget ``thing``, because it was removed by other means."""
        self._things.pop(id(thing), None)

    @contextmanager
    def active(self) -> Iterator["Scope"]:
        """Make this the scope that new things join, within a ``with`` block."""
        token = _current.set(self)
        try:
            yield self
        finally:
            _current.reset(token)

    def close(self) -> None:
        """Remove everything, newest first, also when one removal raises."""
        self.closed = True
        while self._things:
            _, thing = self._things.popitem()
            try:
                thing.remove()
            except Exception:
                log.exception("scope %r: a removal failed", self.name)


def current_scope() -> Scope | None:
    """Return the scope that new things join now, if there is one."""
    return _current.get()


@contextmanager
def no_scope() -> Iterator[None]:
    """Make things in this ``with`` block that belong to no scope."""
    token = _current.set(None)
    try:
        yield
    finally:
        _current.reset(token)


def keep(thing: T) -> T:
    """Put ``thing`` into the current scope, if there is one, and return it."""
    scope = _current.get()
    if scope is not None:
        scope.add(thing)
    return thing


def break_off(task: "asyncio.Future[Any]") -> None:
    """Cancel what goes on beside the caller for somebody who has ended.

    The task that ends somebody itself, as a handler does that takes itself away, is
    left alone: it has the rest of its own work to do.
    """
    try:
        current = asyncio.current_task()
    except RuntimeError:  # no event loop runs in this thread
        current = None
    if task is not current:
        task.cancel()
