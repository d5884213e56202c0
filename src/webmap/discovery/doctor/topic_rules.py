"""Findings of the diagnosis about topics: rate and age, and what else is shown."""

from collections.abc import Iterator
from dataclasses import replace

from webmap.base.text import counted
from webmap.discovery.doctor.facts import BridgeFacts, Measurement
from webmap.discovery.findings import FoundRobot, Guess, TopicRole
from webmap.ros.rosbridge import advice
from webmap.ros.rosbridge.advice import Finding, Level

OLD = 1.0
"""Seconds after which a pose is too old for driving."""

SLOW = 5.0
"""Messages a second below which a pose or a scan moves in visible jumps."""

AGED = 0.5

RARE = 60.0
"""Seconds after which a slow topic, such as a battery's charge, is stale."""

AHEAD = 0.1


def rate_finding(
    name: str, guess: Guess, seen: BridgeFacts, *, needed: bool
) -> Finding:
    """Return the rate and the age of a pose or a scan as a finding.

    Args:
        name: The robot's name.
        guess: The topic.
        seen: All observations.
        needed: Whether a robot cannot be driven without the topic.

    """
    measured = seen.measured[guess.topic]
    bad: Level = "wrong" if needed else "warning"
    if not measured.count:
        blind = ", and a robot without a pose is not driven" if needed else ""
        return silence(name, guess.topic, seen, bad, blind)
    if measured.trouble:
        return Finding(
            bad,
            name,
            f"{guess.topic} cannot be read: {measured.trouble}.",
            "Check that its type is the type that the bridge lists.",
        )
    text = f"{guess.topic}: {measured.rate:.1f} messages a second"
    if measured.frame:
        text += f" in the frame {measured.frame}"
    age = age_of(measured, seen)
    if needed and measured.longest_gap > OLD:
        return Finding(
            "wrong",
            name,
            f"{text}, but none for {measured.longest_gap:.1f} s: driving stops when a "
            f"pose is older than {OLD:g} s.",
            "Publish it at 10 Hz or more.",
        )
    if age is not None and age > AGED:
        return Finding(
            "warning",
            name,
            f"{text}, {age:.1f} s old when they arrive.",
            "Look for a slow connection, a queue, or a stamp that is not updated.",
        )
    if age is not None and age < -AHEAD:
        return Finding(
            "warning",
            name,
            f"{text}, stamped {-age:.1f} s ahead of the robot's own clock.",
            "Synchronise the clocks of all the robot's computers with one server.",
        )
    if measured.rate < SLOW:
        return Finding(
            "warning",
            name,
            f"{text}: too few for smooth motion on the map.",
            "Publish it at 10 Hz or more.",
        )
    old = "" if age is None else f", {max(age, 0.0) * 1000:.0f} ms old"
    return Finding("good", name, f"{text}{old}.")


def rare_finding(name: str, guess: Guess, seen: BridgeFacts) -> Finding:
    """Return a finding about a topic that may be slow, such as a battery's."""
    measured = seen.measured[guess.topic]
    if not measured.count:
        return Finding(
            "note",
            name,
            f"No message was received on {guess.topic} in {measured.seconds:.0f} s; "
            "the topic may be slow.",
        )
    if measured.trouble:
        return Finding(
            "warning",
            name,
            f"{guess.topic} cannot be read: {measured.trouble}.",
            "Check that its type is the type that the bridge lists.",
        )
    age = age_of(measured, seen)
    old = "" if age is None else f", {max(age, 0.0):.1f} s old"
    text = f"{guess.topic}: {measured.rate:.1f} messages a second{old}"
    if age is not None and age > RARE:
        return Finding(
            "warning",
            name,
            f"{text}: the shown value may be out of date.",
            "Look for a queue, or a stamp that is not updated.",
        )
    return Finding("good", name, f"{text}.")


def silence(
    name: str, topic: str, seen: BridgeFacts, bad: Level, blind: str
) -> Finding:
    """Return a finding about a topic without messages, with its publishers.

    Args:
        name: The robot's name.
        topic: The topic.
        seen: All observations.
        bad: Level of the finding.
        blind: The consequence, as the end of a sentence.

    """
    text = f"No message was received on {topic} in {seen.measured[topic].seconds:.0f} s"
    writers = seen.publishers.get(topic)
    if writers:
        return Finding(
            bad,
            name,
            f"{text}, although {', '.join(writers)} can publish it{blind}.",
            "Check whether that node waits for something"
            + (
                ", and whether its quality of service is compatible with that of the "
                f"bridge (ros2 topic info -v {topic})."
                if seen.findings.dialect != "ros1"
                else f" (rostopic echo {topic})."
            ),
        )
    if writers == ():
        return Finding(
            bad,
            name,
            f"{text}: no node publishes it{blind}.",
            "Start the node that publishes it; the topic exists only because a node "
            "subscribes to it.",
        )
    return Finding(
        bad,
        name,
        f"{text}{blind}.",
        "Start the node that publishes it; the topic may exist only because a node "
        "subscribes to it.",
    )


def age_of(measured: Measurement, seen: BridgeFacts) -> float | None:
    """Return the age of the newest message when it arrived, in seconds.

    None if it has no stamp, or the robot's clock is unknown.
    """
    if measured.stamp is None or seen.clock is None:
        return None
    return measured.arrived + seen.clock.ahead - measured.stamp


PICTURE_AGE = 1.0
"""Seconds after which a picture is too old for driving."""

CLOUD_AGE = 1.0

MOST: dict[TopicRole, int] = {
    "camera": 4,
    "cloud": 2,
    "costmap": 3,
    "map": 1,
    "plan": 2,
}
"""Most topics of each kind that are measured, which is what is shown of a robot."""


def shown_topics(robot: FoundRobot) -> Iterator[tuple[str, str, str]]:
    """Yield the other shown topics of a robot: role, topic and type."""
    for role, most in MOST.items():
        for guess in robot.guesses.get(role, ())[:most]:
            yield role, guess.topic, guess.type
    if robot.action is not None:
        name, type = robot.action
        nav2 = type.startswith("nav2_msgs/")
        package = "action_msgs/msg" if nav2 else "actionlib_msgs"
        tail = "_action/status" if nav2 else "status"
        yield "status", f"{name}/{tail}", f"{package}/GoalStatusArray"


def shown_findings(robot: FoundRobot, seen: BridgeFacts) -> Iterator[Finding]:
    """Yield the rate and the age of each of these topics."""
    for kind, topic, _ in shown_topics(robot):
        measured = seen.measured.get(topic)
        if measured is None:
            continue
        if not measured.count:
            yield from _silent(kind, robot.name, topic, seen)
        elif topic in seen.link.too_large:
            size = seen.link.too_large[topic]
            yield advice.too_large(robot.name, topic, size)
        elif measured.trouble:
            yield Finding(
                "warning",
                robot.name,
                f"{topic} cannot be read: {measured.trouble}.",
                "Check that its type is the type that the bridge lists.",
            )
        else:
            yield _came(kind, robot.name, topic, measured, age_of(measured, seen))


def _came(
    kind: str, name: str, topic: str, measured: Measurement, age: float | None
) -> Finding:
    text = f"{topic}: {counted(measured.count, 'message')}"
    if measured.every:
        text = f"{topic}: {1 / measured.every:.1f} messages a second"
    if age is not None:
        text += f", {_duration_text(max(age, 0.0))} old"
    if kind == "camera" and (measured.every or measured.longest_gap) > PICTURE_AGE:
        return Finding(
            "warning",
            name,
            f"{text}: driving with this camera stops whenever its picture is older "
            f"than {PICTURE_AGE:g} s.",
            "Publish 5 pictures a second or more, or choose smaller or compressed "
            "pictures.",
        )
    if kind == "camera" and age is not None and age > PICTURE_AGE:
        return Finding(
            "warning",
            name,
            f"{text}: its pictures arrive too late for driving.",
            "Look for a slow connection or a queue, or choose smaller or compressed "
            "pictures.",
        )
    if kind == "cloud" and age is not None and age > CLOUD_AGE:
        return Finding(
            "warning",
            name,
            f"{text}, so its points are drawn at an earlier pose of the robot.",
            "Look for a slow connection, or let the driver send fewer points.",
        )
    return Finding("good", name, f"{text}.")


def _silent(kind: str, name: str, topic: str, seen: BridgeFacts) -> Iterator[Finding]:
    if kind == "map" and seen.publishers.get(topic) == ():
        return  # reported already: the topic has no publisher
    if kind in ("plan", "status"):
        seconds = seen.measured[topic].seconds
        text = (
            f"No message was received on {topic} in {seconds:.0f} s; messages may "
            f"begin with a goal."
        )
        yield Finding("note", name, text)
        return
    why = {
        "camera": ", so driving with this camera stops",
        "costmap": ", so no costs are drawn",
        "map": ", so no map is drawn under the robot",
        "cloud": ", so no points are drawn",
    }
    level: Level = "warning"
    found = silence(name, topic, seen, level, why[kind])
    writers = seen.publishers.get(topic)
    if kind == "map" and writers:
        found = replace(found, advice=_map_advice(writers[0], topic, seen))
    if kind in ("map", "costmap", "cloud") and writers:
        text = f"{found.advice} {advice.MAYBE_TOO_LARGE}"
        found = replace(found, advice=text)
    yield found


def _map_advice(node: str, topic: str, seen: BridgeFacts) -> str:
    """Return the usual reasons why a map with a publisher does not come."""
    if seen.findings.dialect == "ros1":
        return (
            f"Maps are sent once: check whether {node} has loaded its map, and whether "
            f"it is latched, so that later subscribers receive it (rostopic echo "
            f"{topic})."
        )
    return (
        f"Maps are sent once: check whether {node} is active (ros2 lifecycle get "
        f"{node}) and has loaded its map, and whether its durability is "
        "transient_local, so that later subscribers receive it (ros2 topic info -v "
        f"{topic})."
    )


def _duration_text(seconds: float) -> str:
    if seconds < 1.0:
        return f"{seconds * 1000:.0f} ms"
    if seconds < 120.0:
        return f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.0f} h"
