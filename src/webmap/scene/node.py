"""The tree of the scene: nodes, and fragments that record the changes of nodes."""

import itertools
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Self

from webmap.base.errors import SceneError

_node_ids = itertools.count(1)
_fragment_ids = itertools.count(1)


class FrameRequest:
    """The request for frames, made by the first change after the last ones."""

    def __init__(self) -> None:
        self.is_made = True
        """Whether frames are requested; always, while nobody makes frames."""
        self.number = 0
        """The number of the next frames; :meth:`begin` counts."""
        self.changed: list[Fragment] = []
        """The fragments that had changed before the frames that are being made."""
        self._changing: list[Fragment] = []
        self._listener: Callable[[], object] | None = None

    def listen(self, listener: Callable[[], object] | None) -> None:
        """Call ``listener`` for each request, until there is another one or None."""
        self._listener = listener
        self.begin()

    def make(self) -> None:
        """Request frames, unless they are requested already."""
        if not self.is_made and self._listener is not None:
            self.is_made = True
            self._listener()

    def note(self, fragment: "Fragment") -> None:
        """Request frames with the changes of a fragment."""
        fragment.noted = self.number
        if self._listener is not None:
            self._changing.append(fragment)
            self.make()

    def begin(self) -> None:
        """Set that frames are made now: a change after them needs others."""
        self.is_made = self._listener is None
        self.number += 1
        self.changed, self._changing = self._changing, []


frame_request = FrameRequest()
"""The request for frames of this process."""


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
        self.id = next(_node_ids)
        self.parent: Parent | None = None
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

    def _touch(self, slot: str, *, waits: bool = False) -> None:
        if self.fragment is not None:
            self.fragment.touch(self, slot, waits=waits)


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
        """The text, which browsers show as it is."""
        return self._data

    @data.setter
    def data(self, data: str) -> None:
        data = str(data)
        if data != self._data:
            self._data = data
            self._touch("text")


Child = Node | str
"""A child of an element; a string becomes a text."""


class Parent(Node):
    """A node with children."""

    __slots__ = ("_children",)

    def __init__(self) -> None:
        super().__init__()
        self._children: list[Node] = []

    @property
    def children(self) -> tuple[Node, ...]:
        """The child elements and texts, in order."""
        return tuple(self._children)

    def walk(self) -> Iterator[Node]:
        """Yield this node and all its descendants, parents first."""
        yield self
        for child in self._children:
            yield from child.walk()

    @property
    def text(self) -> str:
        """All text in this node; setting it replaces the content."""
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
                appended, or contains this node.

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
        above: Parent | None = self
        while above is not None:
            if above is node:
                raise SceneError(f"{node!r} cannot be put into itself")
            above = above.parent
        return node

    def clear(self) -> Self:
        """Remove all children."""
        for child in reversed(self._children[:]):
            child.remove()
        return self

    def _take_out(self, node: Node) -> None:
        self._children.remove(node)
        if self.fragment is not None:
            self.fragment.take_out(node)
        node.parent = None

    def _release(self) -> None:
        for child in self._children:
            child._release()


class Removed(NamedTuple):
    """A node was removed, with its descendants."""

    node_id: int


class Added(NamedTuple):
    """A node was added, with its current descendants."""

    node: Node
    after: Node | None
    """The sibling before it, or None if it is the first."""


class Changed(NamedTuple):
    """A value of an existing node changed."""

    node: Node
    slot: str
    """The value: the name of an attribute or of another item that is sent."""


Change = Removed | Added | Changed


class Fragment:
    """A tree with a log of its changes.

    The log stores revisions: of each node when it was added, and of each value when it
    last changed. The changes since any revision are thus described by newest values.
    Only removals make the log longer; the oldest of them are discarded.
    """

    REMOVALS_KEPT = 2000

    def __init__(self, root: Parent) -> None:
        if root.parent is not None or root.fragment is not None:
            raise SceneError(f"{root!r} has a place already and cannot be a root")
        self.id = next(_fragment_ids)
        self.root = root
        self.revision = 0
        self.restructured = 0
        """The revision at which a node was last added or removed."""
        self.urgent = 0
        """The revision of the newest change that pages get at once; newer ones wait."""
        self.noted = -1
        """The number of the frames that a change was last noted for."""
        self.memo: Any = None
        """A cache of the encoder; no part of the scene."""
        self.dotted: dict[int, Node] = {}
        """The nodes that are drawn as dots, of which each page gets its own detail."""
        self.places: tuple[int, Any] | None = None
        """Where the dots are at a revision; a cache of the encoder."""
        self._nodes: dict[int, Node] = {}
        self._touched: dict[int, Node] = {}
        self._added: dict[int, Node] = {}
        self._removed: deque[tuple[int, int]] = deque()
        self._forgotten = 0
        self._sent = 0
        self._adopt(root)

    def __repr__(self) -> str:
        return f"<Fragment {self.id} of {self.root!r} at {self.revision}>"

    def __len__(self) -> int:
        return len(self._nodes)

    def find(self, node_id: int) -> Node | None:
        """Return the node with an id, or None if it is not in this fragment."""
        return self._nodes.get(node_id)

    # Changes of nodes -----------------------------------------------------------

    def touch(self, node: Node, slot: str, *, waits: bool = False) -> None:
        """Record that a value of ``node`` changed.

        Args:
            node: A node of this fragment.
            slot: The value.
            waits: Whether pages get it with the next change that does not wait, or with
                the next ages.

        """
        self.revision = revision = self.revision + 1
        if not waits:
            self.urgent = revision
            if self.noted != frame_request.number:
                frame_request.note(self)
        node._slots[slot] = node._changed = revision
        if slot == "dots":
            self.dotted[node.id] = node
        touched = self._touched
        touched.pop(node.id, None)
        touched[node.id] = node

    def put_in(self, node: Node) -> None:
        """Record that ``node`` was added to the tree."""
        self.revision = self.restructured = self.urgent = self.revision + 1
        frame_request.note(self)
        self._added[node.id] = node
        self._adopt(node)

    def take_out(self, node: Node) -> None:
        """Record that ``node`` is removed from the tree."""
        self.revision = self.restructured = self.urgent = self.revision + 1
        frame_request.note(self)
        # A node that was never sent needs no removal.
        if node._attached <= self._sent:
            self._removed.append((self.revision, node.id))
            if len(self._removed) > self.REMOVALS_KEPT:
                self._forgotten = self._removed.popleft()[0]
        for gone in node.walk():
            gone.fragment = None
            gone._slots.clear()
            del self._nodes[gone.id]
            self.dotted.pop(gone.id, None)
            self._touched.pop(gone.id, None)
            self._added.pop(gone.id, None)

    def _adopt(self, node: Node) -> None:
        for new in node.walk():
            new.fragment = self
            new._attached = self.revision
            self._nodes[new.id] = new
            if getattr(new, "_dots", None) is not None:
                self.dotted[new.id] = new

    # Requests of viewers --------------------------------------------------------

    def mark_sent(self) -> None:
        """Record that the current state was sent to a page."""
        self._sent = self.revision

    def changes_since(self, revision: int) -> list[Change] | None:
        """Return the changes from ``revision`` to the current state.

        Removals come first, then additions, in an order in which the preceding sibling
        always exists, then newest values.

        Args:
            revision: The revision that was last sent.

        Returns:
            The changes, or None if too much was removed since then, so that the whole
            tree must be sent.

        """
        if revision < self._forgotten:
            return None
        self.mark_sent()
        changes: list[Change] = []
        for when, node_id in reversed(self._removed):
            if when <= revision:
                break
            changes.append(Removed(node_id))
        changes.reverse()
        changes.extend(self._added_since(revision))
        changes.extend(
            Changed(node, slot)
            for node, slot in self.values_since(revision)
            if node._attached <= revision
        )
        return changes

    def values_since(self, revision: int) -> Iterator[tuple[Node, str]]:
        """Yield each node and the name of each of its values that changed since then.

        Args:
            revision: The revision that was last sent.

        """
        for node in reversed(self._touched.values()):
            if node._changed <= revision:
                break
            for slot, when in node._slots.items():
                if when > revision:
                    yield node, slot

    def _added_since(self, revision: int) -> list[Added]:
        new: dict[Parent, set[Node]] = {}
        for node in reversed(self._added.values()):
            if node._attached <= revision:
                break
            parent = node.parent
            # A new parent brings its children along.
            if parent is not None and parent._attached <= revision:
                new.setdefault(parent, set()).add(node)
        return [
            added for parent, nodes in new.items() for added in _in_order(parent, nodes)
        ]


def _in_order(parent: Parent, new: set[Node]) -> list[Added]:
    """Return the new children of ``parent`` from left to right."""
    found: list[Added] = []
    children = parent._children
    # From the end, because children are usually added there.
    for index in range(len(children) - 1, -1, -1):
        if len(found) == len(new):
            break
        if children[index] in new:
            found.append(Added(children[index], children[index - 1] if index else None))
    found.reverse()
    return found
