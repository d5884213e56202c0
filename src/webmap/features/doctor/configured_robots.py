"""The topics of a bridge that a page's robots use, for the check of that bridge."""

import inspect
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

from webmap import Bridge, Robot
from webmap.discovery.doctor import ConfiguredRobot
from webmap.discovery.findings import ACTIONS, TopicRole

ROLES: Mapping[str, TopicRole] = {
    "Battery": "battery",
    "Camera": "camera",
    "LaserScanner": "scan",
    "Path": "plan",
    "PointCloud": "cloud",
}
"""The role of a topic for a robot, by the module that reads it."""

GRIDS: tuple[TopicRole, ...] = ("map", "costmap")

ModuleArguments: TypeAlias = tuple[str, tuple[Any, ...], dict[str, Any]]
"""The name and the arguments of a module, as ``module_arguments()`` returns them."""

Topics: TypeAlias = dict[TopicRole, tuple[tuple[str, str], ...]]


def configured_robots(
    robots: Iterable[Robot], bridge: Bridge, maps: Iterable[ModuleArguments] = ()
) -> list[ConfiguredRobot]:
    """Return the robots that use a bridge, with the topics that they use on it.

    Args:
        robots: The robots that are shown.
        bridge: The bridge.
        maps: The modules of the map that shows the robots.
    """
    grids = list(maps)
    found = (_configured_robot(robot, bridge, grids) for robot in robots)
    return [each for each in found if each is not None]


def _configured_robot(
    robot: Robot, bridge: Bridge, maps: Iterable[ModuleArguments]
) -> ConfiguredRobot | None:
    feed, motion = robot.feed, robot.motion
    twist, goals = motion.config.twist, motion.config.move
    frames = robot.tf
    topics: Topics = {"odometry": (), "pose": (), "velocity": (), "action": ()}
    elsewhere: set[TopicRole] = set()
    if feed is not None and feed.bridge is bridge:
        topics["odometry"] = ((feed.topic, feed.type or ""),)
    elif feed is not None:
        elsewhere.add("odometry")
    if twist is not None and motion.bridge("twist") is bridge:
        topics["velocity"] = ((twist.topic, twist.type or ""),)
    elif twist is not None:
        elsewhere.add("velocity")
    if goals is not None and motion.bridge("move") is bridge and goals.action:
        kind = goals.action_type.rpartition("/")[2]
        tails = [tail for tail, type in ACTIONS.items() if type.endswith(f"/{kind}")]
        topics["action"] = tuple((goals.action + tail, "") for tail in tails)
    base = start = ""
    if frames is not None and frames["bridge"] is bridge:
        topics["tf"] = ((f"{frames['namespace']}/tf", ""),)
        base, start = frames["base_frame"], frames["map_frame"]
    elif feed is None:
        # The robot is not drawn by frames, whichever frames the bridge has.
        topics["tf"] = ()
        if frames is not None:
            elsewhere.add("odometry")
    topics |= _drawn_topics(robot, bridge, maps)
    if not any(topics[role] for role in topics if role not in GRIDS):
        return None  # the robot has at most a shared map there
    return ConfiguredRobot(robot.name, topics, base, start, frozenset(elsewhere))


def _drawn_topics(
    robot: Robot, bridge: Bridge, maps: Iterable[ModuleArguments]
) -> Topics:
    """Return the topics drawn for a robot, including the maps that show it."""
    roles: tuple[TopicRole, ...] = (*ROLES.values(), *GRIDS)
    topics: Topics = dict.fromkeys(roles, ())
    grids = list(maps)
    for name, args, options in robot.module_arguments():
        if name in ROLES:
            bound = inspect.signature(robot.namespace[name]).bind(
                robot, *args, **options
            )
            bound.apply_defaults()
            if bound.arguments.get("bridge") is bridge:
                topic, type = (bound.arguments.get(key) for key in ("topic", "type"))
                found = (str(topic), str(type or ""))
                topics[ROLES[name]] = (*topics[ROLES[name]], found)
        elif name == "OnMaps" and args:
            grids.append((args[0], args[1:], {"robot": robot, **options}))
    for name, args, options in grids:
        role, grid = _grid(robot, bridge, name, args, options)
        if grid and (grid, "") not in topics[role]:
            topics[role] = (*topics[role], (grid, ""))
    return topics


def _grid(
    robot: Robot,
    bridge: Bridge,
    name: str,
    args: tuple[Any, ...],
    options: dict[str, Any],
) -> tuple[TopicRole, str]:
    """Return a grid's role and topic; no topic if the robot is not on the grid."""
    arguments = {**dict(zip(("bridge", "topic"), args, strict=False)), **options}
    role: TopicRole = "costmap" if arguments.get("palette") == "costmap" else "map"
    mine = arguments.get("bridge") is bridge and arguments.get("robot") in (None, robot)
    if name != "OccupancyGrid" or not mine:
        return role, ""
    return role, str(arguments.get("topic", "/map"))
