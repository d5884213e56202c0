"""Which namespaces are robots.

A robot is a namespace with a topic for the pose or for the velocity. A namespace with
only one of the two inside another robot's namespace is a part of that robot: a camera
with its own odometry, or an input of a velocity mux.
"""

from collections import Counter
from collections.abc import Container, Iterable

from webmap.discovery.rules import Match

MOVING = ("odometry", "pose", "velocity")
"""Roles that make a namespace a robot."""


def robot_namespaces(matches: Iterable[Match]) -> tuple[str, ...]:
    """Return the namespaces that are robots, sorted; one may be empty."""
    halves: dict[str, set[str]] = {}
    for each in matches:
        if each.role in MOVING:
            half = "velocity" if each.role == "velocity" else "place"
            halves.setdefault(each.namespace, set()).add(half)
    outer = {space: nearest(space, halves) for space in halves}
    # Counts the namespaces in the same robot with exactly the same half.
    alike = Counter((outer[space], *sorted(has)) for space, has in halves.items())
    kept = set(halves)
    for space in sorted(halves, key=_depth, reverse=True):
        around, has = outer[space], halves[space]
        if around is None or len(has) == 2:
            continue
        alone = alike[(around, *sorted(has))] == 1
        # Several that only take velocity are inputs; several with poses may be a fleet.
        if alone or (len(halves[around]) == 2 and has == {"velocity"}):
            kept.discard(space)
            halves[around] |= has
    return tuple(sorted(kept))


def nearest(name: str, namespaces: Container[str]) -> str | None:
    """Return the innermost of the namespaces that contain a name, None if none.

    All names are in the empty namespace, except the empty one itself.
    """
    while name:
        name = name.rpartition("/")[0]
        if name in namespaces:
            return name
    return None


def inside(name: str, namespace: str) -> bool:
    """Return whether a name is in a namespace; all names are in the empty one."""
    return name.startswith(namespace + "/")


def _depth(namespace: str) -> int:
    return namespace.count("/")
