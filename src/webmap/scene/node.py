"""Base class of elements and texts: an identity and a place in a tree."""

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from webmap.scene.element import Element
    from webmap.scene.fragment import Fragment

_ids = itertools.count(1)


class Node:
    """A node of the tree, with an id that is unique in this process."""

    __slots__ = (
        "__weakref__",
        "_attached",
        "_changed",
        "_slots",
        "fragment",
        "id",
        "parent",
    )

    tag = ""

    def __init__(self) -> None:
        self.id = next(_ids)
        self.parent: Element | None = None
        self.fragment: Fragment | None = None
        # Used by the fragment: the revisions at which this node was added, last
        # changed, and at which each of its values changed.
        self._attached = 0
        self._changed = 0
        self._slots: dict[str, int] = {}

    def walk(self) -> Iterator["Node"]:
        """Yield this node and all its descendants, parents first."""
        yield self

    def remove(self) -> None:
        """Remove this node from its tree and release its listeners."""
        if self.parent is not None:
            self.parent._take_out(self)
        self._release()

    def _release(self) -> None:
        """Release references that would keep other objects alive."""

    def _touch(self, slot: str) -> None:
        if self.fragment is not None:
            self.fragment.touch(self, slot)


class Text(Node):
    """A piece of text; its content is never parsed as markup."""

    __slots__ = ("_data",)

    tag = "#text"

    def __init__(self, data: str) -> None:
        super().__init__()
        self._data = str(data)

    def __repr__(self) -> str:
        return f"<#text {self.id} {self._data!r}>"

    @property
    def data(self) -> str:
        """The text."""
        return self._data

    @data.setter
    def data(self, data: str) -> None:
        data = str(data)
        if data != self._data:
            self._data = data
            self._touch("text")
