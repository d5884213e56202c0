"""The part of ``webmap doctor`` that holds for a Foxglove bridge alone."""

from collections.abc import Iterator
from urllib.parse import urlsplit

from webmap.ros.rosbridge.advice import BRIDGE, Finding
from webmap.ros.rosbridge.checks import LinkFacts, is_loopback

_LISTEN = "Configure it to listen on {} (address), or close its port in the firewall."


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
    yield _openness(facts, url)
    if facts.no_result:
        yield Finding(
            "note",
            BRIDGE,
            f"The test of a slow service call gave no result: {facts.no_result}.",
        )
    yield Finding(
        "note",
        BRIDGE,
        "A service that hangs may delay everything for all clients of the bridge, the "
        "velocity too.",
        "Offer only the services that people need (service_whitelist).",
    )


def _openness(facts: LinkFacts, url: str) -> Finding:
    parts = urlsplit(url)
    here = is_loopback(facts.peer or parts.hostname or "")
    outward = [each for each in facts.listens if not is_loopback(each)]
    if here and facts.listens and not outward:
        text = "The Foxglove bridge listens on this machine alone."
        return Finding("good", BRIDGE, text)
    if here and outward:
        return Finding(
            "warning",
            BRIDGE,
            f"The Foxglove bridge is on this machine and listens at "
            f"{', '.join(outward)}: it has no sign-in, so everybody who reaches this "
            "machine can drive.",
            _LISTEN.format("this machine alone"),
        )
    if here:
        return Finding(
            "note",
            BRIDGE,
            "The Foxglove bridge was reached at an address of this machine; WebMap "
            "cannot see whether other machines reach it too.",
        )
    encrypted = parts.scheme == "foxgloves"
    secret = (
        "the connection is encrypted"
        if encrypted
        else "everybody on the network can read and change the messages"
    )
    return Finding(
        "note" if encrypted else "warning",
        BRIDGE,
        f"The Foxglove bridge is open to the network ({facts.peer or parts.hostname}): "
        f"it has no sign-in, so everybody who reaches it can drive; {secret}.",
        f"{_LISTEN.format('the robot alone or on a VPN')} Offer only the topics that "
        "clients need (topic_whitelist, client_topic_whitelist), and use TLS.",
    )
