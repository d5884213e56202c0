"""Derives robots from topics with types."""

import ipaddress
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal
from urllib.parse import urlsplit

from webmap.discovery.findings import Findings, FoundRobot, Guess, TopicRole
from webmap.discovery.layers import drawn_otherwise, find_layers
from webmap.discovery.rules import (
    FUSED,
    INNER_VELOCITY,
    VELOCITY,
    Match,
    inside,
    match,
    nearest,
    robot_by_frames,
    robot_namespaces,
)
from webmap.discovery.tf_robots import Base, Trees, owners
from webmap.ros.names import agent_named, is_topic, is_type

SHARED: tuple[TopicRole, ...] = ("map", "tf")
"""Roles that a topic without a namespace fills for every robot."""

DRAWN_ONLY: tuple[TopicRole, ...] = ("scan", "plan", "map", "costmap", "cloud")
"""Roles of topics that are only drawn, so that a layer may take them."""

DIRECTION = (
    "A list of topics does not show which nodes publish and which subscribe: a topic "
    "may exist only because another program subscribes to it, and carry no messages."
)


def discover(
    topics: Mapping[str, str], host: str = "robot", trees: Trees | None = None
) -> Findings:
    """Return the robots that these topics and frames belong to.

    Args:
        topics: Types by topic, in either dialect, as ``Bridge.topics()`` gives them.
            Invalid topic names are ignored.
        host: Name of a robot without a namespace.
        trees: The frames that were received, if any.

    """
    topics = {name: type.strip() for name, type in topics.items() if is_topic(name)}
    found = (match(name, type) for name, type in sorted(topics.items()))
    others = drawn_otherwise(topics)
    matches = _packed(
        [
            each
            for each in found
            if each is not None
            and not (each.role in DRAWN_ONLY and each.topic in others)
        ]
    )
    trees = trees or Trees()
    homes = robot_by_frames(matches, trees)
    spaces = robot_namespaces(matches, homes)
    bases, alone = owners(trees.bases(), spaces)
    for base in alone:
        bases.setdefault(homes.get(base.space, base.space), base)
    spaces = tuple(sorted({*spaces, *bases, *_with_frames(matches, spaces)}))
    homes = {part: home for part, home in homes.items() if home in spaces}
    homes |= {space: space for space in spaces}
    mine, twists = _owned(homes, matches), _twists(spaces, topics)
    robots = tuple(
        _robot(name, space, mine[space], twists[space], bases.get(space))
        for name, space in zip(_names(spaces, bases, host), spaces, strict=True)
    )
    return Findings(
        robots,
        _dialect(topics.values()),
        _notes(topics, robots),
        find_layers(topics, homes),
    )


def host_name(url: str) -> str:
    """Return the name of a robot without a namespace behind a bridge.

    It is the name of the agent, or the first part of the host's name, or "robot" if the
    host is an IP address.
    """
    if agent := agent_named(url):
        return agent
    host = urlsplit(url).hostname or "robot"
    try:
        ipaddress.ip_address(host)
    except ValueError:
        first = host.partition(".")[0]
        return "robot" if first in ("", "localhost") else first
    return "robot"


def _packed(matches: Sequence[Match]) -> list[Match]:
    """Return the topics without raw pictures that also come compressed."""
    there = {each.topic for each in matches if each.role == "camera"}
    return [
        each
        for each in matches
        if each.role != "camera" or f"{each.topic}/compressed" not in there
    ]


def _with_frames(matches: Iterable[Match], robots: Sequence[str]) -> set[str]:
    """Return the namespaces that have their own frames and belong to no robot."""
    known = {space for space in robots if space}
    return {
        each.namespace
        for each in matches
        if each.role == "tf"
        and each.namespace
        and each.namespace not in known
        and nearest(each.namespace, known) is None
    }


def _owned(
    homes: Mapping[str, str], matches: Iterable[Match]
) -> dict[str, list[Match]]:
    """Return the topics of each robot, the best first."""
    mine: dict[str, list[Match]] = {space: [] for space in homes.values()}
    shared = []
    for each in matches:
        owner = nearest(each.topic, homes)
        if each.role in SHARED and each.namespace == "":
            shared.append(each)
        elif owner is not None:
            mine[homes[owner]].append(each)
        elif len(mine) == 1:
            mine[next(iter(mine))].append(each)
    return {
        space: sorted([*own, *shared], key=lambda each: _rank(each, space))
        for space, own in mine.items()
    }


def _rank(each: Match, space: str) -> tuple[int, int, int, str]:
    place, parts, name = each.rank
    # The robot's own topics come before those of its parts and shared ones, but the
    # estimate of a filter comes before the odometry that it is computed from.
    own = each.namespace == space or each.reason == FUSED
    strange = 0 if own else 1 if inside(each.topic, space) else 2
    return (strange, place, parts, name)


def _twists(spaces: Sequence[str], topics: Mapping[str, str]) -> dict[str, list[str]]:
    """Return topics of each robot that may be inner steps of its velocity."""
    found: dict[str, list[str]] = {space: [] for space in spaces}
    for name, type in sorted(topics.items()):
        if is_type(type, *VELOCITY) and INNER_VELOCITY.search(name):
            owner = nearest(name, found)
            if owner is not None:
                found[owner].append(name)
    return found


def _robot(
    name: str,
    space: str,
    matches: Sequence[Match],
    twists: Sequence[str],
    base: Base | None,
) -> FoundRobot:
    guesses: dict[TopicRole, tuple[Guess, ...]] = {}
    for each in matches:
        guess = Guess(each.topic, each.type, _reason(each, space))
        guesses[each.role] = (*guesses.get(each.role, ()), guess)
    robot = FoundRobot(name, space, guesses)
    if base is not None:
        robot = replace(
            robot, base_frame=base.frame, root_frame=base.root, above=base.above
        )
    return replace(robot, notes=_robot_notes(robot, twists))


def _reason(each: Match, space: str) -> str:
    if each.namespace == space:
        return each.reason
    where = "in a part of the robot" if inside(each.topic, space) else "shared by all"
    if each.role == "odometry" and not inside(each.topic, space):
        where = "in a part of the robot: its child_frame_id is a frame of this robot"
    elif each.role in ("odometry", "pose"):
        where += f": no topic in {each.namespace or 'its namespace'} takes a velocity"
    return f"{each.reason}, {where}"


def _robot_notes(robot: FoundRobot, twists: Sequence[str]) -> tuple[str, ...]:
    notes = []
    odometry, pose = robot.first("odometry"), robot.first("pose")
    if odometry and pose:
        where = (
            f"with the frames from {robot.root_frame} to {robot.base_frame}"
            if robot.base_frame
            else "in its own frame"
        )
        notes.append(
            f"{pose.topic} has the pose on the map, but usually only while the robot "
            f"moves; {odometry.topic} is used, {where}."
        )
    elif pose:
        notes.append(f"There is no odometry; {pose.topic} is used in its place.")
    elif not odometry and robot.base_frame:
        notes.append(
            f"There is no odometry; its pose comes from its frames, "
            f"{robot.base_frame} in {robot.root_frame}."
        )
    elif robot.tf_alone and robot.tf_namespace:
        notes.append(
            f"There is no odometry; its pose comes from the frames on "
            f"{robot.topic('tf')}."
        )
    elif not odometry:
        notes.append("No topic gives its pose, so it cannot be drawn or driven.")
    for guess in robot.guesses.get("odometry", ())[1:]:
        notes.append(f"{guess.topic} is odometry too ({guess.rule}).")
    chosen = robot.first("velocity")
    others = [name for name in twists if name != robot.topic("velocity")]
    if chosen is None and others:
        notes.append(
            f"Its velocity topic is unknown; "
            f"{'a topic' if len(others) == 1 else 'topics'} with velocities: "
            f"{', '.join(others)}."
        )
    elif chosen is None:
        notes.append("No topic takes its velocity, so it can be seen but not driven.")
    elif others:
        notes.append(f"Not used for driving, but of that type: {', '.join(others)}.")
    return tuple(notes)


def _names(spaces: Sequence[str], bases: Mapping[str, Base], host: str) -> list[str]:
    """Return a name for each namespace: its last part, if that is unique.

    Without a namespace, the name is the prefix of its base frame.
    """
    framed = bases[""].prefix.rpartition("/")[2] if "" in bases else ""
    last = [space.rpartition("/")[2] or framed or host for space in spaces]
    often = Counter(name.casefold() for name in last)
    return [
        name if often[name.casefold()] == 1 else space.strip("/") or f"{host} (no name)"
        for name, space in zip(last, spaces, strict=True)
    ]


def _dialect(types: Iterable[str]) -> Literal["ros1", "ros2"] | None:
    for type in types:
        if "/msg/" in type:
            return "ros2"
    return "ros1" if any("/" in type for type in types) else None


def _notes(topics: Mapping[str, str], robots: Sequence[FoundRobot]) -> tuple[str, ...]:
    if robots:
        return (DIRECTION,)
    if not topics:
        return ("There are no topics.",)
    return (
        f"There are {len(topics)} topics, but none gives the pose of a robot "
        f"(nav_msgs/Odometry, a pose named amcl_pose, or frames from map or odom to "
        f"base_link) or takes its velocity "
        f"(a Twist or TwistStamped named cmd_vel).",
    )
