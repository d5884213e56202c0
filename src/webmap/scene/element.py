"""The elements of the scene: SVG and HTML, in Python."""

import math
from collections.abc import Iterator
from typing import Any, ClassVar, Self

from webmap.base.errors import SceneError
from webmap.base.scope import Removal, current_scope, keep
from webmap.scene.allowed import (
    attribute_name,
    check_event,
    check_property,
    check_tag,
    check_value,
    format_value,
)
from webmap.scene.events import Event, Handler, Listener, Report, Spawn
from webmap.scene.live import Live, MapPlace
from webmap.scene.node import Node, Text


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


Child = Node | str
"""A child of an element; a string becomes a text."""

# A person may have changed these on a page since, so they are always sent.
_CHANGED_BY_HANDS = frozenset({"value", "checked", "open", "selected"})


class Element(Live):
    """One element; every change is sent to the pages that show it.

    Keywords are attributes: ``class_`` is ``class`` and ``stroke_width`` is
    ``stroke-width``. Tags and attributes outside the allow-list raise.
    """

    __slots__ = (
        "_attributes",
        "_children",
        "_classes",
        "_listeners",
        "_styles",
        "namespace",
        "tag",
    )

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
        self._attributes: dict[str, str] = {}
        self._children: list[Node] = []
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
        return self._attributes.get(name)

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
        elif text != self._attributes.get(name) or name in _CHANGED_BY_HANDS:
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

    def _store(self, place: dict[str, str], name: str, text: str | None) -> None:
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

    # Tree ---------------------------------------------------------------------

    @property
    def children(self) -> tuple[Node, ...]:
        """The child elements and texts, in order."""
        return tuple(self._children)

    def walk(self) -> Iterator[Node]:
        """Yield this element and all its descendants, parents first."""
        yield self
        for child in self._children:
            yield from child.walk()

    @property
    def text(self) -> str:
        """All text in the element; setting it replaces the content."""
        return "".join(node.data for node in self.walk() if isinstance(node, Text))

    @text.setter
    def text(self, text: str) -> None:
        children = self._children
        if len(children) == 1 and isinstance(children[0], Text):
            children[0].data = text
        else:
            self.clear()
            self.append(text)

    def append(self, *children: Child) -> Self:
        """Append children; a child of another parent is moved.

        Raises:
            SceneError: If a child is not allowed here.

        """
        for child in children:
            self.insert(len(self._children), child)
        return self

    def prepend(self, *children: Child) -> Self:
        """Insert children at the beginning, in their order."""
        for index, child in enumerate(children):
            self.insert(index, child)
        return self

    def insert(self, index: int, child: Child) -> Self:
        """Insert ``child`` before the child that is at ``index`` now.

        Raises:
            SceneError: If ``child`` is the root of a fragment, which is mounted and not
                appended, or contains this element.

        """
        node = self._check_child(child)
        if node.parent is not None:
            if node.parent is self and self._children.index(node) < index:
                index -= 1
            node.parent._take_out(node)
        self._children.insert(index, node)
        node.parent = self
        if self.fragment is not None:
            self.fragment.put_in(node)
        return self

    def _check_child(self, child: Child) -> Node:
        node = Text(child) if isinstance(child, str) else child
        if not isinstance(node, Node):
            raise SceneError(f"a child must be an element or text, got {child!r}")
        if node.parent is None and node.fragment is not None:
            raise SceneError(
                f"{node!r} is the root of a fragment: mount the fragment instead"
            )
        above: Element | None = self
        while above is not None:
            if above is node:
                raise SceneError(f"{node!r} cannot be put into itself")
            above = above.parent
        return node

    def clear(self) -> Self:
        """Remove everything in the element."""
        for child in reversed(self._children[:]):
            child.remove()
        return self

    def _take_out(self, node: Node) -> None:
        self._children.remove(node)
        if self.fragment is not None:
            self.fragment.take_out(node)
        node.parent = None

    def _release(self) -> None:
        for listeners in self._listeners.values():
            for listener in listeners:
                listener.forget()
        self._listeners = {}
        for child in self._children:
            child._release()

    # Events -------------------------------------------------------------------

    def on(
        self,
        event: str,
        handler: Handler,
        *,
        prevent: bool = False,
        stop: bool = False,
    ) -> Removal:
        """Call ``handler`` for every event of this kind, of every viewer.

        The handler joins the current scope and is called within it; it also ends with
        the element. A running coroutine of the handler is cancelled when that scope
        closes.

        Args:
            event: The browser's name of the event, such as ``"click"``.
            handler: A function, or a coroutine function, that takes an :class:`Event`.
            prevent: Whether the browser's default action is prevented.
            stop: Whether the event does not propagate to outer elements.

        Returns:
            The removal of the handler.

        Raises:
            SceneError: If the event is not allowed in a scene.

        """
        check_event(event)
        listener = Listener(handler, current_scope(), prevent=prevent, stop=stop)
        self._listeners.setdefault(event, []).append(listener)
        self._touch("events")
        listener.removal = Removal(lambda: self._off(event, listener))
        return keep(listener.removal)

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
