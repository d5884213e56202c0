"""Results of checks: what they are, and those about a rosbridge itself."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias
from urllib.parse import urlsplit

from webmap.ros.rosbridge.checks import LinkFacts, is_loopback

Level: TypeAlias = Literal["wrong", "warning", "note", "good"]
"""``wrong``: does not work, or not safely. ``note``: cannot be checked from here."""

LEVELS: tuple[Level, ...] = ("wrong", "warning", "note", "good")
"""All levels, the worst first."""

BRIDGE = "bridge"
"""``Finding.about`` of a finding that concerns the bridge, not one robot."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One result of a check."""

    level: Level
    about: str
    """A robot's name, or :data:`BRIDGE`."""

    text: str
    """The result, in a sentence."""

    advice: str = ""
    """What to do about it, in a sentence; empty if there is nothing to do."""


_UNREACHABLE = (
    (
        "name is not known",
        "Check how the host is spelled, or use its number, as in ws://192.168.1.20:9090.",
    ),
    (
        "nothing listens",
        "Start rosbridge_server on the robot, and check its address and port.",
    ),
    (
        "",
        "Start rosbridge_server on the robot, and check address and firewall.",
    ),
)
"""Advice by a part of the reason; the last entry fits any reason."""


def unreachable(trouble: str) -> Finding:
    """Return the finding that a rosbridge cannot be reached, with the reason."""
    return Finding(
        "wrong",
        BRIDGE,
        f"The rosbridge cannot be reached: {trouble}.",
        next(advice for reason, advice in _UNREACHABLE if reason in trouble),
    )


def topics_not_listed(trouble: str, otherwise: str) -> Finding:
    """Return the finding that the topics behind a rosbridge are not listed.

    Args:
        trouble: The error.
        otherwise: What else helps; empty if a list of topics was given.

    """
    return Finding(
        "warning" if otherwise else "note",
        BRIDGE,
        f"rosapi does not list the topics: {trouble}.",
        "Start the rosapi node beside rosbridge. Without it WebMap does not see "
        "which other programs publish velocity, and finds no robot that is added later."
        + (f" {otherwise}" if otherwise else ""),
    )


def openness(
    facts: LinkFacts, url: str, shown: Sequence[str], dialect: str | None
) -> Finding:
    """Return the finding about who can reach a rosbridge.

    Args:
        facts: The results of the checks of the bridge.
        url: Its address.
        shown: Topics that the bridge shows although no client needs them.
        dialect: ``ros1`` or ``ros2``; None if unknown.

    """
    hidden = f" No topic is hidden from its clients ({', '.join(shown)} is shown)."
    return openness_of(
        "rosbridge",
        facts,
        url,
        hidden if shown else "",
        listen_advice(dialect, "this machine alone (address: 127.0.0.1)"),
        f"{listen_advice(dialect, 'the robot alone or on a VPN (address)')} Hide "
        "topics and services that no client needs (topics_glob, services_glob), and "
        "use wss with a certificate.",
    )


def openness_of(
    kind: str, facts: LinkFacts, url: str, note: str, here_advice: str, advice: str
) -> Finding:
    """Return the finding about who can reach a bridge without sign-in.

    Args:
        kind: What people call the bridge.
        facts: The results of the checks of the bridge.
        url: Its address.
        note: What to add if the bridge is open to the network.
        here_advice: Advice for a bridge on this machine that others reach.
        advice: Advice for a bridge on another machine.

    """
    parts = urlsplit(url)
    here = is_loopback(facts.peer or parts.hostname or "")
    outward = [each for each in facts.listens if not is_loopback(each)]
    if here and outward:
        return Finding(
            "warning",
            BRIDGE,
            f"The {kind} is on this machine and listens at {', '.join(outward)}: it "
            "has no sign-in, so everybody who reaches this machine can drive.",
            here_advice,
        )
    if here and facts.listens:
        return Finding("good", BRIDGE, f"The {kind} listens on this machine alone.")
    if here:
        return Finding(
            "note",
            BRIDGE,
            f"The {kind} was reached at an address of this machine; WebMap "
            "cannot see whether other machines reach it too.",
        )
    encrypted = parts.scheme in ("wss", "foxgloves")
    secret = (
        "the connection is encrypted"
        if encrypted
        else "everybody on the network can read and change the messages"
    )
    return Finding(
        "note" if encrypted else "warning",
        BRIDGE,
        f"The {kind} is open to the network ({facts.peer or parts.hostname}): it "
        f"has no sign-in, so everybody who reaches it can drive; {secret}.{note}",
        advice,
    )


def listen_advice(dialect: str | None, where: str) -> str:
    """Return advice on how to close the port to other machines."""
    if dialect == "ros1":
        return (
            "Close its port for others in the firewall: rosbridge 0.11 for ROS 1 "
            "listens on all addresses, whatever its parameter address is."
        )
    return f"Configure it to listen on {where}, or close its port in the firewall."


def blocking(facts: LinkFacts, url: str, dialect: str | None) -> Finding:
    """Return the finding about whether a hanging service delays later operations.

    Args:
        facts: The results of the checks of the bridge.
        url: Its address.
        dialect: ``ros1`` or ``ros2``; None if unknown.

    """
    advice = (
        "Set call_services_in_new_thread: true on rosbridge_websocket. WebMap sends "
        "velocity and calls over different connections in any case."
    )
    how = " (tried)" if facts.tried else ", by its parameter"
    if facts.calls_in_threads is True:
        return Finding(
            "good", BRIDGE, f"A service that hangs blocks no other call{how}."
        )
    if facts.calls_in_threads is False:
        return Finding(
            "warning",
            BRIDGE,
            f"A service that hangs blocks its whole connection{how}.",
            advice,
        )
    if facts.no_result:
        return no_result(facts)
    if dialect is None:
        return Finding(
            "note",
            BRIDGE,
            "It is not known whether a service that hangs blocks its connection.",
        )
    if dialect == "ros2":
        return Finding(
            "note",
            BRIDGE,
            "A service that hangs may block its whole connection, as rosbridge for "
            "ROS 2 does by default before version 2.2; it was not tried.",
            f"Press Test for delays in the report on the page, or run webmap doctor "
            f"{url} --try-call. {advice}",
        )
    return Finding(
        "good",
        BRIDGE,
        "rosbridge for ROS 1 makes each call in a thread of its own, so a call that "
        "hangs blocks nothing.",
    )


def no_result(facts: LinkFacts, advice: str = "") -> Finding:
    """Return the finding that a slow service call was tried without a result."""
    text = f"The test of a slow service call gave no result: {facts.no_result}."
    return Finding("note", BRIDGE, text, advice)


def compression(facts: LinkFacts, packed: Sequence[str]) -> Finding:
    """Return the finding about the encoding of large messages.

    Args:
        facts: The results of the checks of the bridge.
        packed: The scans that came in a binary encoding.

    """
    text = (
        "The socket could be compressed"
        if facts.deflate
        else "No compression is offered"
    )
    if packed:
        text = f"Scans come packed as CBOR ({', '.join(packed)}). {text}"
    return Finding("good", BRIDGE, f"{text}; WebMap does not need it.")


def too_large(robot: str, topic: str, size: int) -> Finding:
    """Return the finding that messages of a topic are too large for the bridge's CBOR.

    Args:
        robot: The robot's name.
        topic: The topic.
        size: Bytes of a message in JSON.

    """
    return Finding(
        "warning",
        robot,
        f"{topic} comes in JSON only ({size} bytes, in parts): it is "
        f"larger than max_message_size of the bridge, above which it sends no "
        f"CBOR. JSON keeps the bridge busy for seconds.",
        f"Set the parameter max_message_size of rosbridge_websocket to {size} or more.",
    )


MAYBE_TOO_LARGE = (
    "If a message is larger than max_message_size of rosbridge_websocket (10 MB by "
    "default), increase that parameter."
)
"""Advice if a large message does not come."""


def type_not_certain(robot: str, topic: str, type: str) -> Finding:
    """Return the finding that the reported type may be that of another client.

    rosapi reports one type of a topic: of two types, the first in the alphabet.

    Args:
        robot: The name of the robot with this velocity topic.
        topic: The topic.
        type: The reported type, without its package.

    """
    return Finding(
        "note",
        robot,
        f"The bridge names the type {type} for {topic}, and a client of a bridge, "
        f"which may be WebMap itself, has announced that type, so WebMap cannot see "
        f"whether the base takes TwistStamped.",
        f"Look on the robot: ros2 topic info -v {topic}. A base that "
        f"takes another type would neither move nor stop.",
    )


def client_writes(robot: str, topic: str, nodes: Sequence[str]) -> Finding:
    """Return the finding that a client of a bridge publishes velocity.

    Args:
        robot: The name of the robot with this velocity topic.
        topic: The topic.
        nodes: The nodes that publish for their clients.

    """
    return Finding(
        "note",
        robot,
        f"A client of a bridge ({', '.join(nodes)}) writes to "
        f"{topic} now; it may be WebMap itself.",
    )
