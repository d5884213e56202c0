"""Which namespaces are robots.

A robot is a namespace with a topic for the pose or for the velocity. A namespace with
only one of the two inside another robot's namespace is a part of that robot: a camera
with its own odometry, or an input of a velocity mux. So is a namespace anywhere that
has odometry with a ``child_frame_id`` of that robot and no topic for the velocity.
"""

from collections import Counter
from collections.abc import Container, Iterable, Mapping, Sequence
from posixpath import commonpath

from webmap.discovery.rules import Match
from webmap.discovery.tf_robots import BASE, Base, Trees

MOVING = ("odometry", "pose", "velocity")
"""Roles that make a namespace a robot."""


def robot_by_frames(matches: Sequence[Match], trees: Trees) -> dict[str, str]:
    """Return the robot's namespace of each namespace with odometry of a known base."""
    roles: dict[str, set[str]] = {}
    for each in matches:
        roles.setdefault(each.role, set()).add(each.namespace)
    driven = roles.get("velocity", set())
    groups: dict[Base, set[str]] = {}
    for each in matches:
        child = trees.odometry.get(each.topic)
        if child:
            frames = nearest(each.topic, roles.get("tf", ())) or ""
            base = trees.base_of(child, frames)
            group = groups.setdefault(base, set())
            group.add(each.namespace)
            if BASE.match(base.frame) and (base.space or "" in driven):
                group.add(base.space)
    robots: dict[str, str] = {}
    for base, group in groups.items():
        # Frames without a prefix may belong to several robots that are driven.
        found = group & driven or group & {base.space}
        if len(found) == 1 or (not found and len(group) > 1):
            outer = commonpath([f"{space}/" for space in group]).rstrip("/")
            robots |= dict.fromkeys(group, min(found, default=outer))
    return robots | {robot: robot for robot in robots.values()}


def robot_namespaces(
    matches: Iterable[Match], by_frames: Mapping[str, str]
) -> tuple[str, ...]:
    """Return the namespaces that are robots, sorted; one may be empty.

    Args:
        matches: The topics that fit a role.
        by_frames: The robots that are known by their frames.

    """
    halves: dict[str, set[str]] = {}
    for each in matches:
        if each.role in MOVING:
            half = "velocity" if each.role == "velocity" else "place"
            space = by_frames.get(each.namespace, each.namespace)
            halves.setdefault(space, set()).add(half)
    outer = {space: nearest(space, halves) for space in halves}
    # Counts the namespaces in the same robot with exactly the same half.
    alike = Counter((outer[space], *sorted(has)) for space, has in halves.items())
    kept = set(halves)
    # The inputs of a robot are first: it is whole with them, whatever their names are.
    order = sorted(halves, key=lambda space: ("place" in halves[space], -_depth(space)))
    for space in order:
        around, has = outer[space], halves[space]
        if around is None or len(has) == 2 or space in by_frames:
            continue
        alone = alike[(around, *sorted(has))] == 1
        # Several in a whole robot are inputs or sensors; several others may be a fleet.
        if alone or len(halves[around]) == 2:
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
