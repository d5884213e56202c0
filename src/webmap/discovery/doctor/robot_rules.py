"""What the readiness check says of a robot."""

from collections.abc import Iterator

from webmap.discovery.doctor.observed import Finding, Heard, Observed
from webmap.discovery.found import FoundRobot, Guess
from webmap.ros.names import is_type

OLD = 1.0
"""Seconds after which a pose is too old to drive by."""

SLOW = 5.0
"""Messages a second below which a pose or a scan jumps."""

AGED = 0.5
AHEAD = 0.1
MOST_ODDITIES = 3
BRIDGES = ("rosbridge", "webmap")
"""What is in the names of nodes that publish for their clients, ourselves too."""


def robot_findings(robot: FoundRobot, seen: Observed) -> Iterator[Finding]:
    """Say what holds for one robot."""
    yield from _velocity(robot, seen)
    where = robot.first("odometry") or robot.first("pose")
    if where is None:
        yield Finding(
            "wrong",
            robot.name,
            "Nothing says where it is.",
            "Start its odometry, or name the topic with --robot.",
        )
    elif where.topic in seen.heard:
        yield _heard(robot.name, where, seen, needed=True)
    scan = robot.first("scan")
    if scan is not None and scan.topic in seen.heard:
        yield _heard(robot.name, scan, seen, needed=False)
    yield from _frames(robot, seen)
    if robot.first("velocity") is not None:
        yield Finding(
            "note",
            robot.name,
            "Whether the base stops by itself when commands cease cannot be seen from "
            "here.",
            "Set its timeout, try it with raised wheels, and state it as stops_within.",
        )


def _frames(robot: FoundRobot, seen: Observed) -> Iterator[Finding]:
    way = seen.ways.get(robot.name)
    if way is None:
        return
    if way.missing:
        yield Finding(
            "note",
            robot.name,
            f"It is drawn in the frame {way.frame}, where odometry has it: "
            f"{way.missing}.",
            "To see it on the map, start what tells of the frame map: amcl, "
            "slam_toolbox, or a static transform.",
        )
    else:
        yield Finding("good", robot.name, f"Frames lead from map to {way.frame}.")
    for oddity in way.oddities[:MOST_ODDITIES]:
        yield Finding(
            "warning",
            robot.name,
            f"A frame is odd: {oddity}.",
            "Look which node tells of it, and whether two do.",
        )


def _velocity(robot: FoundRobot, seen: Observed) -> Iterator[Finding]:
    velocity = robot.first("velocity")
    if velocity is None:
        yield Finding(
            "warning",
            robot.name,
            "No topic is surely its velocity, so it can be seen and not driven.",
            "Name it: --robot NAME:ODOM:CMD_VEL:SCAN.",
        )
        return
    short = velocity.type.rpartition("/")[2]
    stamped = is_type(velocity.type, "geometry_msgs/TwistStamped")
    yield Finding(
        "good",
        robot.name,
        f"{velocity.topic} takes {short}, and WebMap sends that"
        f"{', with a stamp of zero' if stamped else ''}.",
    )
    yield from _writers(robot, velocity, seen)
    listeners = seen.subscribers.get(velocity.topic)
    if listeners == ():
        yield Finding(
            "wrong",
            robot.name,
            f"Nobody listens to {velocity.topic}: the robot would not move, nor stop.",
            "Start the base's driver, or name the topic that it listens to.",
        )


def _writers(robot: FoundRobot, velocity: Guess, seen: Observed) -> Iterator[Finding]:
    writers = seen.publishers.get(velocity.topic)
    if writers is None:
        yield Finding(
            "note",
            robot.name,
            f"Who else writes to {velocity.topic} cannot be told: rosapi did not say.",
        )
        return
    others = [name for name in writers if not any(word in name for word in BRIDGES)]
    bridges = [name for name in writers if name not in others]
    if others:
        yield Finding(
            "warning",
            robot.name,
            f"{velocity.topic} has other writers too: {', '.join(others)}. The base "
            f"takes whatever comes last.",
            "Put a mux before the base (twist_mux) with a topic of WebMap's own, "
            "webmap/cmd_vel, below the hand-held's priority.",
        )
    elif bridges:
        yield Finding(
            "note",
            robot.name,
            f"A client of a rosbridge ({', '.join(bridges)}) writes to "
            f"{velocity.topic} now; it may be WebMap itself.",
        )
    else:
        yield Finding("good", robot.name, f"Nobody else writes to {velocity.topic}.")


def _heard(name: str, guess: Guess, seen: Observed, *, needed: bool) -> Finding:
    heard = seen.heard[guess.topic]
    bad = "wrong" if needed else "warning"
    if not heard.count:
        return Finding(
            bad,  # type: ignore[arg-type]
            name,
            f"Nothing came on {guess.topic} in {heard.seconds:.0f} s"
            + (", and without a pose a robot is not driven." if needed else "."),
            "Start what publishes it; the topic may be there only because somebody "
            "listens to it.",
        )
    if heard.trouble:
        return Finding(
            bad,  # type: ignore[arg-type]
            name,
            f"{guess.topic} cannot be read: {heard.trouble}.",
            "Look whether its type is the one that rosapi says.",
        )
    said = f"{guess.topic}: {heard.rate:.1f} messages a second"
    if heard.frame:
        said += f" in the frame {heard.frame}"
    age = age_of(heard, seen)
    if needed and heard.longest_gap > OLD:
        return Finding(
            "wrong",
            name,
            f"{said}, and none for {heard.longest_gap:.1f} s: driving stops when a "
            f"pose is older than {OLD:g} s.",
            "Let it be published at 10 Hz or more.",
        )
    if age is not None and age > AGED:
        return Finding(
            "warning",
            name,
            f"{said}, {age:.1f} s old when they come.",
            "Look for a slow link, a queue, or a stamp that is not set anew.",
        )
    if age is not None and age < -AHEAD:
        return Finding(
            "warning",
            name,
            f"{said}, stamped {-age:.1f} s ahead of the robot's own clock.",
            "Let all of the robot's computers take the time from one server.",
        )
    if heard.rate < SLOW:
        return Finding(
            "warning",
            name,
            f"{said}: few, so what is shown jumps.",
            "Let it be published at 10 Hz or more.",
        )
    old = "" if age is None else f", {max(age, 0.0) * 1000:.0f} ms old"
    return Finding("good", name, f"{said}{old}.")


def age_of(heard: Heard, seen: Observed) -> float | None:
    """Return how old the newest message was when it came, in seconds.

    None if it has no stamp, or nobody told the robot's time.
    """
    if heard.stamp is None or seen.clock is None:
        return None
    return heard.arrived + seen.clock.ahead - heard.stamp
