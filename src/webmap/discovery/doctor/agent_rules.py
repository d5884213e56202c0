"""Findings of the diagnosis about a rosbridge that is reached through an agent."""

from collections.abc import Iterator
from urllib.parse import urlsplit

from webmap.discovery.doctor.observed import Observed
from webmap.ros.names import agent_named
from webmap.ros.rosbridge.advice import BRIDGE, Finding, listen_advice
from webmap.ros.rosbridge.checks import is_loopback

ON_THE_ROBOT = (
    "On the robot, run webmap doctor with the address of the rosbridge itself."
)


def unreachable(seen: Observed) -> Finding:
    """Return the finding that an agent or its rosbridge cannot be reached."""
    agent = agent_named(seen.url)
    if "the router at" in seen.trouble:
        advice = "Check the router's address, and that it runs: webmap router."
    elif "its rosbridge" in seen.trouble:
        advice = "Start rosbridge on the robot. " + ON_THE_ROBOT
    else:
        advice = f"Start webmap agent on the robot, with --name {agent or 'NAME'}."
    return Finding(
        "wrong", BRIDGE, f"The agent cannot be reached: {seen.trouble}.", advice
    )


def agent_findings(seen: Observed) -> Iterator[Finding]:
    """Yield the findings about who else reaches the robot or reads its data."""
    if seen.open_at is None:
        yield Finding(
            "note",
            BRIDGE,
            "The agent does not know whether other computers reach its rosbridge.",
            ON_THE_ROBOT,
        )
    elif seen.open_at:
        yield Finding(
            "warning",
            BRIDGE,
            f"Other computers may reach the agent's rosbridge at "
            f"{', '.join(seen.open_at)}: it has no sign-in, so they can drive the "
            "robot without the agent.",
            listen_advice(
                seen.findings.dialect,
                "the robot's computer alone (address: 127.0.0.1), where the agent runs",
            ),
        )
    else:
        yield Finding(
            "good", BRIDGE, "The agent's rosbridge listens on its own computer alone."
        )
    parts = urlsplit(seen.url)
    if parts.scheme == "zenoh" and not is_loopback(parts.hostname or ""):
        yield Finding(
            "warning",
            BRIDGE,
            "The connection to the router is not encrypted: everybody on the network "
            "can read the messages.",
            "Start the router with TLS and users, and use zenohs:// in the address.",
        )
    if seen.link.no_result:
        yield Finding(
            "note",
            BRIDGE,
            f"The test of a slow service call gave no result: {seen.link.no_result}.",
            ON_THE_ROBOT,
        )
