"""Fragments: pieces of the scene that are mounted whole and know what changed."""

import itertools
from collections import deque
from typing import Any, NamedTuple

from webmap.base.errors import SceneError
from webmap.scene.element import Element
from webmap.scene.node import Node

_ids = itertools.count(1)


class Removed(NamedTuple):
    """A node went, with everything in it."""

    node_id: int


class Added(NamedTuple):
    """A node came, with everything that is in it now."""

    node: Node
    after: Node | None
    """The sibling before it, or None if it is the first."""


class Changed(NamedTuple):
    """A value of a node that was there already is another now."""

    node: Node
    slot: str
    """Which value: the name of an attribute or of something else that is sent."""


Change = Removed | Added | Changed


class Fragment:
    """A tree with a log of its changes.

    The log is kept as revisions: of each node when it came, and of each value when
    it changed last. So what changed since any revision is told by newest values,
    and only removals make it longer; it forgets the oldest of them.
    """

    REMOVALS_KEPT = 2000

    def __init__(self, root: Element) -> None:
        if root.parent is not None or root.fragment is not None:
            raise SceneError(f"{root!r} has a place already and cannot be a root")
        self.id = next(_ids)
        self.root = root
        self.revision = 0
        self.memo: Any = None
        """Whatever the encoder wants to find again; no part of the scene."""
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
        """How many nodes the fragment holds."""
        return len(self._nodes)

    def find(self, node_id: int) -> Node | None:
        """Return the node of that id, or None if it is not in this fragment."""
        return self._nodes.get(node_id)

    # What nodes tell ------------------------------------------------------------

    def touch(self, node: Node, slot: str) -> None:
        """Note that a value of ``node`` changed."""
        self.revision = revision = self.revision + 1
        node._slots[slot] = node._changed = revision
        touched = self._touched
        touched.pop(node.id, None)
        touched[node.id] = node

    def put_in(self, node: Node) -> None:
        """Note that ``node`` came into the tree."""
        self.revision += 1
        self._added[node.id] = node
        self._adopt(node)

    def take_out(self, node: Node) -> None:
        """Note that ``node`` goes out of the tree."""
        self.revision += 1
        # What nobody was told of needs no removal.
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

    # What viewers ask -----------------------------------------------------------

    def mark_told(self) -> None:
        """Note that somebody was given the state as it is now."""
        self._told = self.revision

    def changes_since(self, revision: int) -> list[Change] | None:
        """Return what to do to come from ``revision`` to the state as it is now.

        Removals come first, then what was added, in an order in which the sibling
        before each is there already, then newest values.

        Args:
            revision: The revision that was seen last.

        Returns:
            The changes, or None if too much was removed since then, so that only
            the whole tree will do.

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
            # A parent that is new itself brings its children along.
            if parent is not None and parent._attached <= revision:
                new.setdefault(parent, set()).add(node)
        return [
            added for parent, nodes in new.items() for added in _in_order(parent, nodes)
        ]


def _in_order(parent: Element, new: set[Node]) -> list[Added]:
    """Return the new children of ``parent`` from left to right."""
    found: list[Added] = []
    children = parent._children
    # From the end, because that is where children come as a rule.
    for index in range(len(children) - 1, -1, -1):
        if len(found) == len(new):
            break
        if children[index] in new:
            found.append(Added(children[index], children[index - 1] if index else None))
    found.reverse()
    return found
