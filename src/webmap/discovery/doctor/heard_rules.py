"""Findings of the diagnosis about messages that came, or did not come, on a topic."""

from webmap.discovery.doctor.observed import Heard, Observed
from webmap.discovery.found import Guess
from webmap.ros.finding import Finding, Level

OLD = 1.0
"""Seconds after which a pose is too old for driving."""

SLOW = 5.0
"""Messages a second below which a pose or a scan moves in visible jumps."""

AGED = 0.5

RARE = 60.0
"""Seconds after which a slow topic, such as a battery's charge, is stale."""

AHEAD = 0.1


def heard_finding(name: str, guess: Guess, seen: Observed, *, needed: bool) -> Finding:
    """Return the rate and the age of a pose or a scan as a finding.

    Args:
        name: The robot's name.
        guess: The topic.
        seen: All observations.
        needed: Whether a robot cannot be driven without the topic.

    """
    heard = seen.heard[guess.topic]
    bad: Level = "wrong" if needed else "warning"
    if not heard.count:
        blind = ", and without a pose a robot is not driven" if needed else ""
        return silence(name, guess.topic, seen, bad, blind)
    if heard.trouble:
        return Finding(
            bad,
            name,
            f"{guess.topic} cannot be read: {heard.trouble}.",
            "Look whether its type is the one that the bridge says.",
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


def rare_finding(name: str, guess: Guess, seen: Observed) -> Finding:
    """Return a finding about a topic that may be slow, such as a battery's."""
    heard = seen.heard[guess.topic]
    if not heard.count:
        return Finding(
            "note",
            name,
            f"Nothing came on {guess.topic} in {heard.seconds:.0f} s; it may be slow.",
        )
    if heard.trouble:
        return Finding(
            "warning",
            name,
            f"{guess.topic} cannot be read: {heard.trouble}.",
            "Look whether its type is the one that the bridge says.",
        )
    age = age_of(heard, seen)
    old = "" if age is None else f", {max(age, 0.0):.1f} s old"
    said = f"{guess.topic}: {heard.rate:.1f} messages a second{old}"
    if age is not None and age > RARE:
        return Finding(
            "warning",
            name,
            f"{said}: what is shown is no more so.",
            "Look for a queue, or a stamp that is not set anew.",
        )
    return Finding("good", name, f"{said}.")


def silence(name: str, topic: str, seen: Observed, bad: Level, blind: str) -> Finding:
    """Return a finding that nothing came on a topic, with its possible publishers.

    Args:
        name: The robot's name.
        topic: The topic.
        seen: All observations.
        bad: Level of the finding.
        blind: The consequence, as the end of a sentence.

    """
    said = f"Nothing came on {topic} in {seen.heard[topic].seconds:.0f} s"
    writers = seen.publishers.get(topic)
    if writers:
        return Finding(
            bad,
            name,
            f"{said}, though {', '.join(writers)} could publish it{blind}.",
            "Look whether that node is waiting for something"
            + (
                ", and whether its quality of service is one that the bridge takes "
                f"(ros2 topic info -v {topic})."
                if seen.findings.dialect != "ros1"
                else f" (rostopic echo {topic})."
            ),
        )
    if writers == ():
        return Finding(
            bad,
            name,
            f"{said}: nobody publishes it{blind}.",
            "Start what publishes it; the topic is there only because somebody listens "
            "to it.",
        )
    return Finding(
        bad,
        name,
        f"{said}{blind}.",
        "Start what publishes it; the topic may be there only because somebody listens "
        "to it.",
    )


def age_of(heard: Heard, seen: Observed) -> float | None:
    """Return the age of the newest message when it came, in seconds.

    None if it has no stamp, or the robot's clock is unknown.
    """
    if heard.stamp is None or seen.clock is None:
        return None
    return heard.arrived + seen.clock.ahead - heard.stamp
