"""Drawing a robot in the frames that it has now, and telling it goals in them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from webmap.core.frames import frames_of
from webmap.discovery import FoundRobot
from webmap.modules.robot.on_maps import OnMaps
from webmap.scope import no_scope
from webmap.tf import Buffer

if TYPE_CHECKING:
    from webmap import Bridge, Robot


def follow(
    robot: "Robot",
    bridge: "Bridge",
    found: FoundRobot,
    options: Mapping[str, Any] | None = None,
) -> str:
    """Let a robot that is shown be drawn in the frames that are known of it now.

    What else is set of it stays as it is: its goals and its place are told in the frame
    of its map as it is now, on the topics that are in use.

    Args:
        robot: The robot that is shown.
        bridge: The bridge that it is behind.
        found: The robot as it is found now.
        options: Those of ``Robot.set_tf``, if not those of a robot that is found.

    Returns:
        What is new, in a sentence for people; empty if all was so already.

    """
    options = found.tf_options if options is None else options
    news = []
    with no_scope():
        if found.tf_namespace is not None and _differ(robot, bridge, options):
            _place(robot, bridge, options)
            frames = robot.tf or options
            news.append(f"drawn where {frames['map_frame']} has {frames['base_frame']}")
        if _tell_in(robot, bridge, found.map_frame):
            news.append(f"told goals and its place in {found.map_frame}")
    return f"{robot.name} is {' and '.join(news)} from now on" if news else ""


def _differ(robot: "Robot", bridge: "Bridge", options: Mapping[str, Any]) -> bool:
    """Tell whether a robot is drawn in other frames than the options have."""
    now = robot.tf
    if now is None or now["bridge"] is not bridge:
        return True
    space = options["namespace"]
    base = options.get("base_frame", robot.base_link)
    wanted = (options.get("map_frame", "map"), base)
    named = tuple(Buffer().name(frame, space) for frame in wanted)
    return (now["map_frame"], now["base_frame"], now["namespace"]) != (*named, space)


def _place(robot: "Robot", bridge: "Bridge", options: Mapping[str, Any]) -> None:
    # What was heard of the frames is kept meanwhile.
    held = frames_of(bridge, options["namespace"]).join(lambda: None)
    try:
        robot.set_tf(bridge, **options)
    finally:
        held.remove()
    frames = robot.tf or {}
    # Its maps and markers were laid into the frame of before.
    laid = [module for module in robot.modules if isinstance(module, OnMaps)]
    made = [one for one in robot.module_arguments() if one[0] == OnMaps.__name__]
    for module, (name, args, said) in zip(laid, made, strict=True):
        if said.get("map_frame", frames["map_frame"]) != frames["map_frame"]:
            robot.remove_module(module)
            again = {**said, "map_frame": frames["map_frame"]}
            robot.add_module(name, *args, **again)


def _tell_in(robot: "Robot", bridge: "Bridge", frame: str) -> bool:
    """Tell goals and the initial pose in a frame; return whether that is news."""
    goals, place = robot.motion.move_topic, robot.motion.pose_topic
    new_goals = goals is not None and goals.bridge is bridge and goals.frame != frame
    new_place = place is not None and place.bridge is bridge and place.frame != frame
    if goals is not None and new_goals:
        robot.motion.set_move(replace(goals, frame=frame))
    if place is not None and new_place:
        robot.motion.set_pose(replace(place, frame=frame))
    return new_goals or new_place
