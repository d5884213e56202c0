"""Whose the parts are of which a topic of diagnostics speaks, for several robots.

Nothing in a ``diagnostic_msgs/DiagnosticArray`` says which robot it is about but the
names of the parts. Updaters put the name of their node in front: in ROS 1 with its
namespace and without the slash that it begins with (``robot_0/base: Motors``), in ROS 2
without the namespace (``base: Motors``) unless they are told otherwise
(``/robot_0/base: Motors``). Aggregators name groups: ``/Power/base: Battery``.
"""

import weakref
from collections import Counter
from typing import Literal, TypeAlias

from webmap.ros.bridge import Bridge
from webmap.scope import Removal, keep

Whose: TypeAlias = Literal["own", "another", "nobody"]
"""Of a robot, a part is its own, another robot's, or by its name of nobody."""


class PartOwners:
    """The robots that follow one topic, by their namespaces."""

    def __init__(self) -> None:
        self._followers: Counter[str] = Counter()

    def join(self, namespace: str) -> Removal:
        """Count a robot in until the current scope ends, or this is removed.

        Args:
            namespace: The robot's, as :func:`bare` has it; empty if it has none.

        """
        self._followers[namespace] += 1
        return keep(Removal(lambda: self._leave(namespace)))

    def whose(self, name: str, namespace: str) -> Whose:
        """Return whose a part is.

        All parts are those of the only robot. With several, a part is that of the
        innermost namespace that its name begins with.

        Args:
            name: The part's name.
            namespace: The namespace of the robot that asks, as :func:`bare` has it.

        """
        if len(self._followers) < 2:
            return "own"
        # What stands behind the colon is a task, which may have slashes too.
        inside = bare(name).partition(":")[0]
        while inside and inside not in self._followers:
            inside = inside.rpartition("/")[0]
        if not inside:
            return "nobody"
        return "own" if inside == namespace else "another"

    def _leave(self, namespace: str) -> None:
        self._followers[namespace] -= 1
        if not self._followers[namespace]:
            del self._followers[namespace]


def bare(name: str) -> str:
    """Return a name of a part, or a namespace, without slashes in front and behind."""
    return name.strip("/")


def part_owners(bridge: Bridge, topic: str) -> PartOwners:
    """Return the robots that follow a topic behind a bridge."""
    return _owners.setdefault(bridge, {}).setdefault(topic, PartOwners())


_owners: weakref.WeakKeyDictionary[Bridge, dict[str, PartOwners]] = (
    weakref.WeakKeyDictionary()
)
