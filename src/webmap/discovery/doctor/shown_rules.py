"""Findings of the diagnosis about shown topics other than pose and scan."""

from collections.abc import Iterator
from dataclasses import replace

from webmap.base.counted import counted
from webmap.discovery.doctor.observed import Measurement, Observed
from webmap.discovery.doctor.rate_rules import age_of, silence
from webmap.discovery.found import FoundRobot, Role
from webmap.ros.rosbridge import advice
from webmap.ros.rosbridge.advice import Finding, Level

PICTURE_AGE = 1.0
"""Seconds after which a picture is too old for driving."""

CLOUD_AGE = 1.0

MOST: dict[Role, int] = {"camera": 4, "cloud": 2, "costmap": 3, "map": 1, "plan": 2}
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


def shown_findings(robot: FoundRobot, seen: Observed) -> Iterator[Finding]:
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


def _silent(kind: str, name: str, topic: str, seen: Observed) -> Iterator[Finding]:
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


def _map_advice(node: str, topic: str, seen: Observed) -> str:
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
