"""Scopes: objects that a page, map or robot creates end together with their owner.

A page, a map and a robot each own a :class:`Scope`. An object that is created while a
scope is current (a subscription, a listener, an element's handler) joins it and is
removed when the scope closes, in reverse order, also when one removal raises.
"""

import asyncio
import logging
from collections.abc import Callable
from contextvars import ContextVar
from typing import Any, Protocol, TypeVar

log = logging.getLogger("webmap")

T = TypeVar("T", bound="Removable")

_current: ContextVar["Scope | None"] = ContextVar("webmap_scope", default=None)


enter_scope, leave_scope = _current.set, _current.reset
"""Set the scope that new objects join, and return to the one before; as :class:`Within`
does, at a quarter of its cost."""


class Removable(Protocol):
    """An object that was added and can be removed, any number of times."""

    def remove(self) -> None:
        """Undo the addition; the second call has no effect."""


class Removal:
    """One added object, with a function that removes it once."""

    __slots__ = ("__weakref__", "_undo")

    def __init__(self, undo: Callable[[], object]) -> None:
        self._undo: Callable[[], object] | None = undo

    def remove(self) -> None:
        """Undo the addition; the second call has no effect."""
        undo, self._undo = self._undo, None
        if undo is not None:
            undo()


class Scope:
    """The objects of one owner, in the order in which they were created.

    Args:
        name: The owner's name, for the log.
        report: Shows a failure to people: called with a sentence, and with the failing
            object if the failure lasts, else None.
        mended: Called with the object when its failure has ended.

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
        """Remove ``thing`` when this scope closes; at once if it is closed."""
        if self.closed:
            thing.remove()
        else:
            self._things[id(thing)] = thing

    def discard(self, thing: Removable) -> None:
        """Forget ``thing``, which was removed by other means."""
        self._things.pop(id(thing), None)

    def active(self) -> "Within":
        """Make this the scope that new objects join, within a ``with`` block."""
        return Within(self)

    def close(self) -> None:
        """Remove all objects, newest first, also when one removal raises."""
        self.closed = True
        while self._things:
            _, thing = self._things.popitem()
            try:
                thing.remove()
            except Exception:
                log.exception("scope %r: a removal failed", self.name)


def current_scope() -> Scope | None:
    """Return the scope that new objects join now, if there is one."""
    return _current.get()


class Within:
    """A ``with`` block in which new objects join a given scope; used once.

    Args:
        scope: The scope; ``None`` for no scope.

    """

    __slots__ = ("_scope", "_token")

    def __init__(self, scope: Scope | None) -> None:
        self._scope = scope

    def __enter__(self) -> Scope | None:
        self._token = _current.set(self._scope)
        return self._scope

    def __exit__(self, *error: object) -> None:
        _current.reset(self._token)


def no_scope() -> Within:
    """Let new objects join no scope, within a ``with`` block."""
    return Within(None)


def keep(thing: T) -> T:
    """Put ``thing`` into the current scope, if there is one, and return it."""
    scope = _current.get()
    if scope is not None:
        scope.add(thing)
    return thing


def break_off(task: "asyncio.Future[Any]") -> None:
    """Cancel a task whose owner has ended.

    The current task is not cancelled: a handler that removes itself still finishes its
    work.
    """
    try:
        current = asyncio.current_task()
    except RuntimeError:  # no event loop runs in this thread
        current = None
    if task is not current:
        task.cancel()
