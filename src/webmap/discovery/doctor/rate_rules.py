"""Findings of the diagnosis about the rate and the age of messages on a topic."""

from webmap.discovery.doctor.observed import Measurement, Observed
from webmap.discovery.found import Guess
from webmap.ros.rosbridge.advice import Finding, Level

OLD = 1.0
"""Seconds after which a pose is too old for driving."""

SLOW = 5.0
"""Messages a second below which a pose or a scan moves in visible jumps."""

AGED = 0.5

RARE = 60.0
"""Seconds after which a slow topic, such as a battery's charge, is stale."""

AHEAD = 0.1


def rate_finding(name: str, guess: Guess, seen: Observed, *, needed: bool) -> Finding:
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


def rare_finding(name: str, guess: Guess, seen: Observed) -> Finding:
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


def silence(name: str, topic: str, seen: Observed, bad: Level, blind: str) -> Finding:
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


def age_of(measured: Measurement, seen: Observed) -> float | None:
    """Return the age of the newest message when it arrived, in seconds.

    None if it has no stamp, or the robot's clock is unknown.
    """
    if measured.stamp is None or seen.clock is None:
        return None
    return measured.arrived + seen.clock.ahead - measured.stamp
