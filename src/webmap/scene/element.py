"""The elements of the scene, SVG and HTML, and the events of a page."""

import inspect
import math
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from webmap.base.errors import NotAllowed, SceneError
from webmap.base.roles import Role, covers, who_may
from webmap.base.scope import Removal, Scope, Within, current_scope, keep
from webmap.scene.allowed import (
    attribute_name,
    check_event,
    check_property,
    check_tag,
    check_value,
    format_value,
)
from webmap.scene.live import Line, Live, MapPlace
from webmap.scene.node import Child

Handler = Callable[["Event"], Any]
"""Called with an event; may be a coroutine function."""

Report = Callable[[Exception], object]
"""Called with an exception that a handler raised."""

Spawn = Callable[[Awaitable[Any]], object]
"""Runs the coroutine that a handler returned, in the context of the call."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """One event on the page of one viewer, at one element."""

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

    page: Any = None
    """The page of the event."""

    map: Any = None
    """The map of the event, or None."""


class Listener:
    """One handler of one kind of event, and the scope in which it was added."""

    __slots__ = ("handler", "prevent", "removal", "role", "scope", "stop")

    def __init__(
        self,
        handler: Handler,
        scope: Scope | None,
        role: Role,
        *,
        prevent: bool,
        stop: bool,
    ) -> None:
        self.handler = handler
        self.role = role
        self.scope = scope
        self.prevent = prevent
        self.stop = stop
        self.removal: Removal | None = None

    def call(self, event: Event, report: Report, spawn: Spawn | None) -> None:
        """Call the handler in its scope; an exception is reported, not raised."""
        if event.viewer is not None and not covers(event.viewer.role, self.role):
            report(NotAllowed(who_may(self.role)))
            return
        with Within(self.scope):
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


class Classes:
    """The classes that Python gave to an element, in the order of addition.

    Classes that a page adds by itself (``selected`` on one viewer's map, ``stale``) are
    not included.
    """

    __slots__ = ("_element",)

    def __init__(self, element: "Element") -> None:
        self._element = element

    def __contains__(self, name: object) -> bool:
        return name in self._element._classes

    def __iter__(self) -> Iterator[str]:
        return iter(self._element._classes)

    def __len__(self) -> int:
        return len(self._element._classes)

    def __str__(self) -> str:
        return " ".join(self._element._classes)

    def add(self, *names: str) -> None:
        """Add classes that the element does not have yet."""
        self._replace({**self._element._classes, **split_classes(*names)})

    def remove(self, *names: str) -> None:
        """Remove classes that the element has."""
        gone = split_classes(*names)
        self._replace({n: None for n in self._element._classes if n not in gone})

    def toggle(self, name: str, on: bool | None = None) -> bool:
        """Set a class by ``on``, or toggle it without ``on``.

        Returns:
            Whether the element has the class now.

        """
        wanted = name not in self if on is None else on
        (self.add if wanted else self.remove)(name)
        return wanted

    def _replace(self, classes: dict[str, None]) -> None:
        element = self._element
        if classes.keys() != element._classes.keys():
            element._classes = classes
            element._touch("class")


def split_classes(*names: str) -> dict[str, None]:
    """Return the single classes in ``names``, without duplicates, in order.

    Raises:
        SceneError: If a name is empty or not text.

    """
    classes: dict[str, None] = {}
    for name in names:
        if not isinstance(name, str) or not name.strip():
            raise SceneError(f"a class must be a word, got {name!r}")
        classes.update(dict.fromkeys(name.split()))
    return classes


# A viewer may have changed these on a page since, so they are always sent.
_CHANGED_BY_VIEWERS = frozenset({"value", "checked", "open", "selected"})


class Element(Live):
    """One element; every change is sent to the pages that show it.

    Keywords are attributes: ``class_`` is ``class`` and ``stroke_width`` is
    ``stroke-width``. Tags and attributes outside the allow-list raise.
    """

    __slots__ = (
        "_attributes",
        "_classes",
        "_listeners",
        "_styles",
        "namespace",
        "tag",
    )

    parent: "Element | None"

    def __init__(
        self,
        tag: str,
        /,
        *children: Child,
        text: str | None = None,
        namespace: str = "svg",
        **attributes: Any,
    ) -> None:
        super().__init__()
        check_tag(namespace, tag)
        self._prepare(tag, namespace)
        self.set(**attributes)
        if text is not None:
            self.append(text)
        self.append(*children)

    def _prepare(self, tag: str, namespace: str) -> None:
        self.tag = tag
        self.namespace = namespace
        self._attributes: dict[str, str | Line] = {}
        self._classes: dict[str, None] = {}
        self._listeners: dict[str, list[Listener]] = {}
        self._styles: dict[str, str] = {}

    def __repr__(self) -> str:
        name = f" class={str(self.classes)!r}" if self._classes else ""
        return f"<{self.tag} {self.id}{name}>"

    # Attributes ---------------------------------------------------------------

    @property
    def attributes(self) -> dict[str, str]:
        """The texts of all set attributes, as a copy."""
        names = ("class", "transform", *self._attributes)
        return {name: text for name in names if (text := self.get(name)) is not None}

    def get(self, name: str) -> str | None:
        """Return the text of an attribute, or None if it is not set."""
        name = attribute_name(self.namespace, name)
        if name == "class":
            return str(self.classes) or None
        if name == "transform":
            return self._transform if isinstance(self._transform, str) else None
        value = self._attributes.get(name)
        return value if value is None else str(value)

    def set(
        self, name: str | None = None, value: Any = None, /, **attributes: Any
    ) -> Self:
        """Set attributes, by keyword or one by name; None and False unset them.

        Raises:
            SceneError: If an attribute or its value is not allowed.

        """
        if name is not None:
            self._set(attribute_name(self.namespace, name), value)
        for key, item in attributes.items():
            self._set(attribute_name(self.namespace, key), item)
        return self

    def unset(self, *names: str) -> Self:
        """Unset attributes; does nothing for those that are not set."""
        for name in names:
            self._set(attribute_name(self.namespace, name), None)
        return self

    def _set(self, name: str, value: Any) -> None:
        text = format_value(name, value)
        if text is not None:
            check_value(self.tag, name, text)
        if name == "class":
            self.classes._replace(split_classes(text) if text else {})
        elif name == "transform":
            self._transform = text
            self._touch("transform")
        elif text != self._attributes.get(name) or name in _CHANGED_BY_VIEWERS:
            self._store(self._attributes, name, text)

    def set_style(self, name: str, value: str | float | None) -> Self:
        """Set a custom style property such as ``"--dot-size"``; None unsets it.

        Raises:
            SceneError: If ``name`` is not a custom property, or the value refers to
                something outside the document.

        """
        check_property(name)
        text = format_value(name, value)
        if text is not None:
            check_value(self.tag, name, text)
        if text != self._styles.get(name):
            self._store(self._styles, name, text)
        return self

    def _store(self, place: dict[str, Any], name: str, text: str | None) -> None:
        if text is None:
            place.pop(name, None)
        else:
            place[name] = text
        self._touch(name)

    def set_map(self, world: "Element", width: float = 0, height: float = 0) -> Self:
        """Make the element, an ``<svg>``, a map whose view each page moves by itself.

        Args:
            world: The group in it whose matrix is the view; do not set its matrix
                otherwise.
            width: Pixels, or 0 for the width of its container.
            height: Pixels, or 0 for the height of its container.

        Raises:
            SceneError: If this is no ``<svg>``, ``world`` is not in it, or a size is
                not a finite number of at least 0.

        """
        if self.tag != "svg" or world not in self.walk():
            raise SceneError(f"a map is an svg with its world in it, not {self!r}")
        if not (0 <= width < math.inf and 0 <= height < math.inf):
            raise SceneError(f"a map has a size in pixels, got {width} x {height}")
        self._map = MapPlace(world.id, width, height)
        self._touch("map")
        return self

    @property
    def classes(self) -> Classes:
        """The classes that Python gave to the element."""
        return Classes(self)

    # Events ---------------------------------------------------------------

    def on(
        self,
        event: str,
        handler: Handler,
        *,
        role: Role = "operator",
        prevent: bool = False,
        stop: bool = False,
    ) -> Removal:
        """Call ``handler`` for every event of this kind, of every viewer who may.

        The handler joins the current scope and is called within it; it also ends with
        the element. A running coroutine of the handler is cancelled when that scope
        closes.

        Args:
            event: The browser's name of the event, such as ``"click"``.
            handler: A function, or a coroutine function, that takes an :class:`Event`.
            role: The least role of a viewer whose events the handler gets; a page shows
                others who may do this.
            prevent: Whether the browser's default action is prevented.
            stop: Whether the event does not propagate to outer elements.

        Returns:
            The removal of the handler.

        Raises:
            SceneError: If the event is not allowed in a scene.

        """
        check_event(event)
        listener = Listener(handler, current_scope(), role, prevent=prevent, stop=stop)
        self._listeners.setdefault(event, []).append(listener)
        self._touch("events")
        listener.removal = Removal(lambda: self._off(event, listener))
        return keep(listener.removal)

    def _release(self) -> None:
        for listeners in self._listeners.values():
            for listener in listeners:
                listener.forget()
        self._listeners = {}
        super()._release()

    def _off(self, event: str, listener: Listener) -> None:
        listener.forget()
        listeners = self._listeners.get(event, [])
        if listener in listeners:
            listeners.remove(listener)
            if not listeners:
                del self._listeners[event]
            self._touch("events")

    def handlers(self, event: str) -> tuple[Handler, ...]:
        """Return the handlers of an event, in the order in which they were added."""
        return tuple(item.handler for item in self._listeners.get(event, ()))

    def dispatch(
        self, event: Event, report: Report, spawn: Spawn | None = None
    ) -> None:
        """Call every handler of ``event.kind``, each in the scope of its addition.

        Args:
            event: The event.
            report: Called with each exception that a handler raises; the other handlers
                are still called.
            spawn: Called with the coroutine that a handler returned, in the context in
                which it is to run.

        """
        for listener in tuple(self._listeners.get(event.kind, ())):
            listener.call(event, report, spawn)

    @property
    def listening(self) -> dict[str, tuple[bool, bool]]:
        """The events with listeners: whether prevented, whether stopped."""
        return {
            kind: (any(i.prevent for i in items), any(i.stop for i in items))
            for kind, items in self._listeners.items()
        }


class TagMaker:
    """Makes elements with one tag of a namespace."""

    namespace: ClassVar[str]
    """``"svg"`` or ``"html"``."""

    def __init__(self, tag: str) -> None:
        self.tag = tag

    def __call__(
        self, *children: Child, text: str | None = None, **attributes: Any
    ) -> Element:
        """Return a new element.

        Raises:
            SceneError: If an attribute is not allowed.

        """
        return Element(
            self.tag, *children, text=text, namespace=self.namespace, **attributes
        )

    def __repr__(self) -> str:
        return f"<maker of {self.namespace.upper()} {self.tag}>"
