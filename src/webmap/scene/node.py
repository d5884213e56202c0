"""What elements and texts have in common: an identity and a place in a tree."""

import itertools
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from webmap.scene.element import Element
    from webmap.scene.fragment import Fragment

_ids = itertools.count(1)


class Node:
    """One thing in the tree, with an id that is unique in this process."""

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
        # Kept for the fragment: when this node came into it, when it last changed,
        # and when each of its values did.
        self._attached = 0
        self._changed = 0
        self._slots: dict[str, int] = {}

    def walk(self) -> Iterator["Node"]:
        """Yield this node and everything in it, parents first."""
        yield self

    def remove(self) -> None:
        """Take this node out of its tree, for good: its listeners are released."""
        if self.parent is not None:
            self.parent._take_out(self)
        self._release()

    def _release(self) -> None:
        """Let go of what would keep others alive."""

    def _touch(self, slot: str) -> None:
        if self.fragment is not None:
            self.fragment.touch(self, slot)


class Text(Node):
    """A piece of text; only ever text, whatever is in it."""

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
