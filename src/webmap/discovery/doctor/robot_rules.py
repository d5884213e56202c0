"""Findings of the diagnosis about a robot."""

from collections.abc import Iterator

from webmap.discovery.doctor.facts import BridgeFacts, ConfiguredRobot, FramePath
from webmap.discovery.doctor.topic_rules import (
    rare_finding,
    rate_finding,
    shown_findings,
)
from webmap.discovery.findings import FoundRobot, Guess
from webmap.ros.names import has_gate, is_agent_url, is_type, same_type
from webmap.ros.rosbridge import advice
from webmap.ros.rosbridge.advice import Finding
from webmap.ros.rosbridge.graph import is_client_node

MOST_ODDITIES = 3


def robot_findings(robot: FoundRobot, seen: BridgeFacts) -> Iterator[Finding]:
    """Yield the findings about one robot."""
    one = seen.configured.get(robot.name, ConfiguredRobot(robot.name))
    if has_gate(seen.url) and "velocity" not in one.elsewhere:
        yield from _velocity(robot, seen)
    if "odometry" not in one.elsewhere:
        yield from _place(robot, seen)
    battery = robot.first("battery")
    for scan in robot.guesses.get("scan", ()):
        if scan.topic in seen.measured:
            yield rate_finding(robot.name, scan, seen, needed=False)
    if battery is not None and battery.topic in seen.measured:
        yield rare_finding(robot.name, battery, seen)
    yield from _map(robot, seen)
    yield from shown_findings(robot, seen)
    yield from _frames(robot, seen)
    if has_gate(seen.url) and robot.first("velocity") is not None:
        # The stop test identifies robots by the names that discovery finds.
        name = one.found_as if robot.name in seen.configured else robot.name
        command = f"webmap doctor {seen.url} --stop-test {name}, or " if name else ""
        if is_agent_url(seen.url):  # its gate alone moves its robots
            command = ""
        yield Finding(
            "note",
            robot.name,
            "This check does not find out whether the base stops by itself when "
            "commands end.",
            "Set its command timeout, then run the stop test (up to 5 s) with half a "
            f"metre free in front of the robot: {command}the button on its card.",
        )


def _place(robot: FoundRobot, seen: BridgeFacts) -> Iterator[Finding]:
    """Yield the findings about the topic with a robot's pose."""
    where = robot.first("odometry") or robot.first("pose")
    if robot.tf_alone:
        yield from _drawn_by_frames(robot, seen)
    elif where is None:
        yield Finding(
            "wrong",
            robot.name,
            "No topic gives its pose.",
            "Start its odometry, or name the topic with --robot.",
        )
    elif where.topic in seen.measured:
        yield rate_finding(robot.name, where, seen, needed=True)


def _map(robot: FoundRobot, seen: BridgeFacts) -> Iterator[Finding]:
    grid = robot.first("map")
    if grid is not None and seen.publishers.get(grid.topic) == ():
        yield Finding(
            "warning",
            robot.name,
            f"No node publishes {grid.topic}, so no map is drawn under the robot.",
            "Start map_server or slam_toolbox, or give a floor plan with --floor.",
        )


def _drawn_by_frames(robot: FoundRobot, seen: BridgeFacts) -> Iterator[Finding]:
    """Yield whether frames locate a robot that has no other source of its pose."""
    topic, path = robot.topic("tf"), seen.frame_paths.get(robot.name)
    if path is not None and not path.missing:
        yield Finding(
            "good",
            robot.name,
            f"Its pose comes from its frames, {path.frame} in {path.start}"
            f"{_often(topic, seen)}; there is no odometry.",
        )
    elif path is not None or (topic in seen.measured and not robot.base_frame):
        why = f"{topic} has no transform from map or odom to base_link"
        if path is not None:
            why = path.missing
        yield Finding(
            "wrong",
            robot.name,
            f"Its pose is unknown: {why}.",
            f"Start the node that publishes its frames on {topic}, or its odometry.",
        )


def _often(topic: str, seen: BridgeFacts) -> str:
    rate = seen.measured[topic].rate if topic in seen.measured else 0.0
    return f" ({topic}: {rate:.1f} messages a second)" if rate else ""


def _frames(robot: FoundRobot, seen: BridgeFacts) -> Iterator[Finding]:
    path = seen.frame_paths.get(robot.name)
    if path is None:
        return
    if robot.tf_alone:
        pass  # reported already: the robot has no other source of its pose
    elif path.missing:
        yield Finding(
            "note",
            robot.name,
            f"It is drawn in the frame {path.frame}, at the pose from odometry: "
            f"{path.missing}.",
            "To see it on the map, start the node that publishes the frame "
            f"{path.start}: amcl, slam_toolbox, or a static transform.",
        )
    else:
        often = _often(f"{robot.tf_namespace}/tf", seen)
        yield Finding(
            "good", robot.name, f"Frames lead from {path.start} to {path.frame}{often}."
        )
    yield from _inner_frames(robot.name, path)
    for oddity in path.oddities[:MOST_ODDITIES]:
        yield Finding(
            "warning",
            robot.name,
            f"Error in the frames: {oddity}.",
            "Check which node publishes it, and whether two nodes do.",
        )


def _inner_frames(name: str, path: FramePath) -> Iterator[Finding]:
    if path.base_missing:
        yield Finding(
            "note",
            name,
            f"There is no transform from {path.frame} to {path.base}, although "
            f"odometry names both: {path.base_missing}.",
            "Let one node publish that transform too: the base's driver, or the filter "
            "that publishes the odometry (publish_tf).",
        )
    if path.scan_missing:
        yield Finding(
            "warning",
            name,
            f"The pose of the scanner on the robot is unknown: {path.scan_missing}. "
            "Its points are drawn as if it were in the robot's middle, facing ahead.",
            "Start robot_state_publisher with the robot's URDF, or a "
            f"static_transform_publisher from {path.base} to {path.scan}.",
        )
    elif path.scan and path.base and not path.base_missing:
        base = f"{path.base} and to " if path.base != path.frame else ""
        yield Finding(
            "good", name, f"Frames lead further from {path.frame} to {base}{path.scan}."
        )


def _velocity(robot: FoundRobot, seen: BridgeFacts) -> Iterator[Finding]:
    velocity = robot.first("velocity")
    configured = seen.configured.get(robot.name)
    if velocity is None and configured is not None and "velocity" in configured.topics:
        yield Finding(
            "note",
            robot.name,
            "It is configured without a velocity topic: it can be seen but not driven.",
        )
        return
    if velocity is None:
        yield Finding(
            "warning",
            robot.name,
            "Its velocity topic is unknown, so it can be seen but not driven.",
            "Name it: --robot NAME:ODOM:CMD_VEL:SCAN.",
        )
        return
    yield _type(robot, velocity, seen)
    yield from _writers(robot, velocity, seen)
    listeners = seen.subscribers.get(velocity.topic)
    if listeners == ():
        yield Finding(
            "wrong",
            robot.name,
            f"No node subscribes to {velocity.topic}: the robot would neither move "
            f"nor stop.",
            "Start the base's driver, or name the topic that it subscribes to.",
        )


def _type(robot: FoundRobot, velocity: Guess, seen: BridgeFacts) -> Finding:
    """Return whether the topic has the type that WebMap sends."""
    short = velocity.type.rpartition("/")[2]
    takes = seen.types.get(velocity.topic, "").strip()
    stated = seen.topics_given or (robot.name in seen.configured and not takes)
    has = "has the stated type" if stated else "has the type"
    if takes and not same_type(takes, velocity.type):
        return Finding(
            "wrong",
            robot.name,
            f"{velocity.topic} {has} {takes.rpartition('/')[2]}, but WebMap is "
            f"configured to send {short}: the robot would neither move nor stop.",
            "Correct the type where the robot is configured (twist.type of a fleet "
            "file, velocity_type of --set), or leave it out: then WebMap queries it.",
        )
    stamped = is_type(velocity.type, "geometry_msgs/TwistStamped")
    if not stamped and seen.findings.dialect == "ros2" and _has_client(velocity, seen):
        return advice.type_not_certain(robot.name, velocity.topic, short)
    return Finding(
        "note" if stated else "good",
        robot.name,
        f"{velocity.topic} {has} {short}, and "
        f"WebMap sends this type{', with a zero stamp' if stamped else ''}.",
    )


def _has_client(velocity: Guess, seen: BridgeFacts) -> bool:
    """Return whether a client of a rosbridge publishes or subscribes to a topic."""
    nodes = [
        *(seen.publishers.get(velocity.topic) or ()),
        *(seen.subscribers.get(velocity.topic) or ()),
    ]
    return any(map(is_client_node, nodes))


def _writers(
    robot: FoundRobot, velocity: Guess, seen: BridgeFacts
) -> Iterator[Finding]:
    writers = seen.publishers.get(velocity.topic)
    if writers is None:
        yield Finding(
            "note",
            robot.name,
            f"The bridge does not list the publishers of {velocity.topic}, so other "
            f"programs that drive the robot are not detected.",
        )
        return
    others = [name for name in writers if not is_client_node(name)]
    bridges = [name for name in writers if name not in others]
    if others:
        yield Finding(
            "warning",
            robot.name,
            f"Other nodes publish to {velocity.topic} too: {', '.join(others)}. The "
            f"base obeys the newest message of any node.",
            "Put a mux (twist_mux) before the base, with an input for WebMap, "
            "webmap/cmd_vel, of lower priority than that of a handheld controller.",
        )
    elif bridges:
        yield advice.client_writes(robot.name, velocity.topic, bridges)
    else:
        yield Finding(
            "good", robot.name, f"No other node publishes to {velocity.topic}."
        )
