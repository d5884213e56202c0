"""Fragments: parts of the scene that are mounted whole and record their changes."""

import itertools
from collections import deque
from typing import Any, NamedTuple

from webmap.base.errors import SceneError
from webmap.scene.element import Element
from webmap.scene.node import Node

_ids = itertools.count(1)


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

    def __init__(self, root: Element) -> None:
        if root.parent is not None or root.fragment is not None:
            raise SceneError(f"{root!r} has a place already and cannot be a root")
        self.id = next(_ids)
        self.root = root
        self.revision = 0
        self.memo: Any = None
        """A cache of the encoder; no part of the scene."""
        self._nodes: dict[int, Node] = {}
        self._touched: dict[int, Node] = {}
        self._added: dict[int, Node] = {}
        self._removed: deque[tuple[int, int]] = deque()
        self._forgotten = 0
        self._told = 0
        self._adopt(root)

    def __repr__(self) -> str:
        return f"<Fragment {self.id} of {self.root!r} at {self.revision}>"

    def __len__(self) -> int:
        """Return the number of nodes in the fragment."""
        return len(self._nodes)

    def find(self, node_id: int) -> Node | None:
        """Return the node with an id, or None if it is not in this fragment."""
        return self._nodes.get(node_id)

    # Changes of nodes -----------------------------------------------------------

    def touch(self, node: Node, slot: str) -> None:
        """Record that a value of ``node`` changed."""
        self.revision = revision = self.revision + 1
        node._slots[slot] = node._changed = revision
        touched = self._touched
        touched.pop(node.id, None)
        touched[node.id] = node

    def put_in(self, node: Node) -> None:
        """Record that ``node`` was added to the tree."""
        self.revision += 1
        self._added[node.id] = node
        self._adopt(node)

    def take_out(self, node: Node) -> None:
        """Record that ``node`` is removed from the tree."""
        self.revision += 1
        # A node that was never sent needs no removal.
        if node._attached <= self._told:
            self._removed.append((self.revision, node.id))
            if len(self._removed) > self.REMOVALS_KEPT:
                self._forgotten = self._removed.popleft()[0]
        for gone in node.walk():
            gone.fragment = None
            gone._slots.clear()
            del self._nodes[gone.id]
            self._touched.pop(gone.id, None)
            self._added.pop(gone.id, None)

    def _adopt(self, node: Node) -> None:
        for new in node.walk():
            new.fragment = self
            new._attached = self.revision
            self._nodes[new.id] = new

    # Requests of viewers --------------------------------------------------------

    def mark_told(self) -> None:
        """Record that the current state was sent to a page."""
        self._told = self.revision

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
        self.mark_told()
        changes: list[Change] = []
        for when, node_id in reversed(self._removed):
            if when <= revision:
                break
            changes.append(Removed(node_id))
        changes.reverse()
        changes.extend(self._added_since(revision))
        for node in reversed(self._touched.values()):
            if node._changed <= revision:
                break
            if node._attached <= revision:
                for slot, when in node._slots.items():
                    if when > revision:
                        changes.append(Changed(node, slot))
        return changes

    def _added_since(self, revision: int) -> list[Added]:
        new: dict[Element, set[Node]] = {}
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


def _in_order(parent: Element, new: set[Node]) -> list[Added]:
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
