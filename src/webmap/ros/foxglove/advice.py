"""The part of ``webmap doctor`` that holds for a Foxglove bridge alone."""

from collections.abc import Iterator

from webmap.ros.rosbridge.advice import (
    BRIDGE,
    Finding,
    listen_advice,
    no_result,
    openness_of,
)
from webmap.ros.rosbridge.checks import LinkFacts


def unreachable(trouble: str) -> Finding:
    """Return the finding that a Foxglove bridge cannot be reached, with the reason."""
    advice = "Start foxglove_bridge on the robot, and check address, port and firewall."
    if "accepts none of" in trouble:
        advice = "Use the address of the robot's foxglove_bridge, or ws:// in this one."
    return Finding(
        "wrong", BRIDGE, f"The Foxglove bridge cannot be reached: {trouble}.", advice
    )


def no_actions() -> Finding:
    """Return the finding that a bridge of ROS 2 offers no action."""
    return Finding(
        "note",
        BRIDGE,
        "The Foxglove bridge offers no action: goals can be sent to a topic only, "
        "without progress and result.",
        "To send goals to Nav2's NavigateToPose and to cancel them, start "
        "foxglove_bridge with include_hidden:=true.",
    )


def findings(facts: LinkFacts, url: str) -> Iterator[Finding]:
    """Yield the findings about a bridge itself.

    Args:
        facts: The results of the checks of the bridge.
        url: Its address.

    """
    yield openness_of(
        "Foxglove bridge",
        facts,
        url,
        "",
        listen_advice("ros2", "this machine alone (address)"),
        f"{listen_advice('ros2', 'the robot alone or on a VPN (address)')} Offer only "
        "the topics that clients need (topic_whitelist, client_topic_whitelist), and "
        "use TLS.",
    )
    if facts.no_result:
        yield no_result(facts)
    yield Finding(
        "note",
        BRIDGE,
        "A service that hangs may delay everything for all clients of the bridge, the "
        "velocity too.",
        "Offer only the services that people need (service_whitelist).",
    )
