"""The robots of an agent: found behind its rosbridge, or of a fleet file."""

import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import webmap
from webmap import Bridge
from webmap.config.checks import Mistakes
from webmap.config.fleet import read_fleet
from webmap.config.motion import MotionConfig
from webmap.config.robot import RobotConfig
from webmap.config.toml_text import read_text, readable_secret
from webmap.console import Console, make_robot
from webmap.fleet.fleet_file import make_bridges
from webmap.fleet.overrides import Overrides
from webmap.fleet.robot_files import check_agent_fleet, load_pictures
from webmap.fleet.robot_options import parse_robots
from webmap.fleet.search import find_fleet
from webmap.ros.names import web_socket_url
from webmap.ros.rosbridge.checks import is_loopback, listening_addresses
from webmap.ros.tf import Buffer

log = logging.getLogger("webmap.agent")


class AgentRobot(NamedTuple):
    """A robot of an agent, with the id that its gate uses."""

    id: str
    config: RobotConfig


class AgentRobots(NamedTuple):
    """The robots of an agent and the maps under them, behind one rosbridge."""

    bridge: Bridge
    robots: Callable[[], list[AgentRobot]]
    """Returns the robots that are known now."""
    grids: Callable[[], Mapping[str, dict[str, Any]]]
    """Returns the options of the maps under the robots, by topic."""
    pictures: Mapping[str, bytes] = {}
    """The pictures of the robots, by the names in their configurations."""


def robots_behind(
    url: str, robots: Sequence[str], overrides: Overrides, wait: float
) -> AgentRobots:
    """Return the robots behind a rosbridge, found by their topics or given.

    Args:
        url: The address of the rosbridge.
        robots: The values of ``--robot``.
        overrides: Settings that replace guesses.
        wait: How long to wait for an unreachable rosbridge, in seconds.

    Raises:
        ConfigError: If an argument is invalid.

    """
    bridge, console = webmap.Bridge(url), Console()
    given = parse_robots(robots, [bridge])
    fleet = find_fleet([bridge], given, wait=wait, overrides=overrides)
    shown = fleet.make_robots(console, moving_parts)
    return AgentRobots(
        bridge,
        lambda: [AgentRobot(each.robot.motion.id, each.config) for each in shown.shown],
        lambda: {topic: options for (_, topic), options in console.grids.items()},
    )


def robots_in_file(file: Path) -> AgentRobots:
    """Return the robots of a fleet file with one bridge.

    Raises:
        ConfigError: If the file has mistakes, or several bridges.
        OSError: If it cannot be read.

    """
    text, mistakes = read_text(file), Mistakes()
    fleet = read_fleet(text.data, mistakes)
    if not mistakes.found and len(fleet.bridges) != 1:
        mistakes.add(("bridges",), "an agent is beside the robots of one bridge")
    check_agent_fleet(fleet, mistakes)
    configs, pictures = load_pictures(fleet.robots, file.parent, mistakes)
    text.refuse(mistakes)
    warning = readable_secret(file, text.data)
    if warning is not None:
        log.warning("%s", warning)
    bridges = make_bridges(fleet)
    (bridge,) = bridges.values()
    made = [make_robot(moving_parts(config), bridges) for config in configs]
    _robots.extend(made)
    robots = [
        AgentRobot(robot.motion.id, config)
        for robot, config in zip(made, configs, strict=True)
    ]
    grids = {grid.topic: grid.options for grid in fleet.map}
    return AgentRobots(bridge, lambda: robots, lambda: grids, pictures)


_robots: list[object] = []
"""Robots that live as long as the process."""


def moving_parts(config: RobotConfig) -> RobotConfig:
    """Return what an agent itself needs of a robot: that which moves it.

    The robot needs no frames, only the name of its own, which a TwistStamped has.
    """
    base, tf = config.base_link, config.tf
    if tf is not None:
        base = Buffer().name(tf.base_frame or base, tf.namespace)
    kept = ("name", "bridge", "odometry", "alignment", *MotionConfig.__struct_fields__)
    return RobotConfig(base_link=base, **{key: getattr(config, key) for key in kept})


def open_addresses(url: str) -> list[str] | None:
    """Return where other computers may reach a rosbridge; None if it is unknown.

    Args:
        url: The address of the rosbridge, which runs.

    """
    parts = urlsplit(url)
    if not is_loopback(parts.hostname or ""):
        return [parts.hostname or ""]
    port = urlsplit(web_socket_url(url)).port or 80
    listens = listening_addresses(port)
    if not listens:
        return None
    return [each for each in listens if not is_loopback(each)]


def warn_of_open_bridge(url: str, places: Sequence[str]) -> None:
    """Log a warning that other computers may reach the rosbridge at these places."""
    log.warning(
        "other computers may reach the rosbridge %s at %s, and drive the robot without "
        "the agent: let rosbridge listen on 127.0.0.1 and run the agent beside it, or "
        "close its port in the firewall",
        url,
        ", ".join(places),
    )
