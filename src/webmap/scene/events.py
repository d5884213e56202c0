"""Events of a page, and their listeners."""

import inspect
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from webmap.base.scope import Removal, Scope, no_scope

if TYPE_CHECKING:
    from webmap.scene.element import Element

Handler = Callable[["Event"], Any]
"""Called with an event; may be a coroutine function."""

Report = Callable[[Exception], object]
"""Called with an exception that a handler raised."""

Spawn = Callable[[Awaitable[Any]], object]
"""Runs the coroutine that a handler returned, in the context of the call."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """One event of one viewer, at one element."""

    kind: str
    """The browser's name of the event: ``"click"``, ``"keydown"``, ..."""

    element: "Element | None" = None
    """The element with the listener, which may differ from the one under the
    pointer."""

    x: float = 0.0
    """Pixels from the left of the map, or of the window if not on a map."""

    y: float = 0.0
    """Pixels from the top of the map, or of the window if not on a map."""

    world_x: float | None = None
    """Metres in the world of the map, or None if not on a map."""

    world_y: float | None = None
    """Metres in the world of the map, or None if not on a map."""

    key: str = ""
    """The browser's name of the key of a key event: ``"a"``, ``"ArrowUp"``."""

    button: int = 0
    """The button of a pointer event: 0 is the main one."""

    delta: float = 0.0
    """How far a wheel turned, in pixels; away from the viewer is negative."""

    shift: bool = False
    ctrl: bool = False
    alt: bool = False
    meta: bool = False

    value: str | None = None
    """The value of an input after the event."""

    checked: bool | None = None
    """Whether a checkbox is checked after the event."""

    viewer: Any = None
    """The viewer of the page."""

    map: Any = None
    """The map of the event, or None."""


class Listener:
    """One handler of one kind of event, and the scope in which it was added."""

    __slots__ = ("handler", "prevent", "removal", "scope", "stop")

    def __init__(
        self, handler: Handler, scope: Scope | None, *, prevent: bool, stop: bool
    ) -> None:
        self.handler = handler
        self.scope = scope
        self.prevent = prevent
        self.stop = stop
        self.removal: Removal | None = None

    def call(self, event: Event, report: Report, spawn: Spawn | None) -> None:
        """Call the handler in its scope; an exception is reported, not raised."""
        with self.scope.active() if self.scope is not None else no_scope():
            try:
                result = self.handler(event)
                if spawn is not None and inspect.isawaitable(result):
                    spawn(result)
            except Exception as error:
                report(error)

    def forget(self) -> None:
        """Remove this listener from its scope, so that the scope does not grow."""
        if self.scope is not None and self.removal is not None:
            self.scope.discard(self.removal)
