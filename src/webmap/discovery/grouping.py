"""Which namespaces are robots.

A robot is a namespace in which something says where it is or takes velocity. A
namespace with only one of the two inside another robot's is a part of that one: a
camera with odometry of its own, or an input of a velocity mux.
"""

from collections.abc import Iterable

from webmap.discovery.rules import Match

MOVING = ("odometry", "pose", "velocity")
"""Roles of which one makes a namespace a robot's."""


def robot_namespaces(matches: Iterable[Match]) -> tuple[str, ...]:
    """Return the namespaces that are robots, sorted; one may be empty."""
    halves: dict[str, set[str]] = {}
    for each in matches:
        if each.role in MOVING:
            half = "velocity" if each.role == "velocity" else "place"
            halves.setdefault(each.namespace, set()).add(half)
    kept = set(halves)
    for space in sorted(halves, key=_depth, reverse=True):
        outer = nearest(space, kept - {space})
        if outer is not None and _belongs_to(space, outer, halves):
            kept.discard(space)
            halves[outer] |= halves[space]
    return tuple(sorted(kept))


def _belongs_to(space: str, outer: str, halves: dict[str, set[str]]) -> bool:
    """Tell whether an inner namespace is a part of the robot around it."""
    if len(halves[space]) == 2:
        return False
    alike = [
        other
        for other, has in halves.items()
        if has == halves[space] and other != outer and inside(other, outer)
    ]
    if len(alike) == 1:
        return True
    # Several that only take velocity are inputs; several places may be a fleet.
    return len(halves[outer]) == 2 and halves[space] == {"velocity"}


def nearest(topic: str, namespaces: Iterable[str]) -> str | None:
    """Return the innermost of the namespaces that a name is in, None if none."""
    around = [space for space in namespaces if inside(topic, space)]
    return max(around, key=_depth, default=None)


def inside(name: str, namespace: str) -> bool:
    """Tell whether a name lies in a namespace; all of them lie in the empty one."""
    return name.startswith(namespace + "/")


def _depth(namespace: str) -> int:
    return namespace.count("/")
