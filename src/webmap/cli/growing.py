"""Giving a robot that is shown already what it has more than before."""

import logging
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from webmap.cli.described import MOST_CAMERAS
from webmap.cli.draw_layer import shows
from webmap.console.fleet import set_goals
from webmap.discovery import FoundRobot
from webmap.discovery.found import Role
from webmap.scope import no_scope

if TYPE_CHECKING:
    from webmap import Bridge, Robot

log = logging.getLogger("webmap.cli")


def grow(
    robot: "Robot",
    bridge: "Bridge",
    found: FoundRobot,
    roles: Iterable[Role],
    *,
    stops_within: float | None = None,
) -> list[str]:
    """Let a robot use topics that came later.

    Args:
        robot: The robot that is shown.
        bridge: The bridge that it is behind.
        found: The robot as it is found now.
        roles: What is new of it.
        stops_within: Seconds within which the base stops by itself, if known.

    Returns:
        What it uses now, such as ``velocity /cmd_vel``.

    """

    def use_pose() -> bool:
        topic = found.topic("pose")
        # A pose may be silent while the robot stands; what else tells its place is not.
        placed = robot.feed is not None or (robot.tf is not None and found.base_frame)
        if placed or not topic:
            return False
        robot.set_odometry_topic(bridge, topic)
        return True

    def use_scan() -> None:
        if shows(robot, bridge, found.topic("scan")):  # as one of several
            return
        scanner = robot.add_module(
            "LaserScanner", bridge, found.topic("scan"), max_dots=None, throttle=100
        )
        robot.svg.insert(1, scanner.svg)  # after the title, under the body

    def use_goals() -> None:
        set_goals(
            robot,
            bridge,
            found.topic("goal"),
            found.topic("cancel"),
            found.action,
            frame=found.map_frame,
        )

    def use_plan() -> None:
        if not shows(robot, bridge, found.topic("plan")):
            robot.add_module("Path", bridge, found.topic("plan"))

    def use_cameras() -> list[str]:
        there = [module for module in robot.modules if hasattr(module, "watch")]
        known = {getattr(camera, "topic", None) for camera in there}
        new = [c.topic for c in found.guesses["camera"] if c.topic not in known]
        new = new[: max(0, MOST_CAMERAS - len(there))]
        for number, topic in enumerate(new, len(there) + 1):
            name = "Camera" if number == 1 else f"Camera {number}"
            robot.add_module("Camera", bridge, topic, name)
        return new

    uses: dict[Role, Callable[[], object]] = {
        "odometry": lambda: robot.set_odometry_topic(bridge, found.topic("odometry")),
        "pose": use_pose,
        "velocity": lambda: robot.set_twist_topic(
            bridge,
            found.topic("velocity"),
            type=found.type_of("velocity") or None,
            stops_within=stops_within,
        ),
        "goal": use_goals,
        "action": use_goals,
        "initialpose": lambda: robot.set_initial_pose_topic(
            bridge, found.topic("initialpose"), frame=found.map_frame
        ),
        "scan": use_scan,
        "battery": lambda: robot.add_module("Battery", bridge, found.topic("battery")),
        "plan": use_plan,
        "tf": lambda: robot.set_tf(bridge, **found.tf_options),
    }
    used = []
    with no_scope():
        for role in roles:
            try:
                if role == "camera":
                    used += [f"camera {topic}" for topic in use_cameras()]
                elif role in uses and uses[role]() is not False:
                    used.append(f"{role} {found.topic(role)}")
            except Exception:  # the others are news now and never again
                log.exception("%s: its %s is not used", robot.name, role)
    return used
