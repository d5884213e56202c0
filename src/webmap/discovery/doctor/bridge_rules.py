"""What the readiness check says of a bridge."""

from collections.abc import Iterator
from urllib.parse import urlsplit

from webmap.discovery.doctor.observed import (
    MOST_ROBOTS,
    Clock,
    Finding,
    Observed,
)
from webmap.discovery.doctor.ports import is_loopback

ABOUT = "bridge"

SLOW_LOOP = 0.15
"""Seconds of a round trip from which driving is slowed down."""

NO_LOOP = 0.3
"""Seconds from which there is none: no command is that fresh."""

CLOCK_OFF = 0.5
"""Seconds from which stamps of both machines do not fit together."""

SIMULATED = 365 * 24 * 3600.0
"""Seconds of difference from which the robot's clock is a simulator's."""


TELL = (
    "Give a list of the topics (webmap doctor URL --topics FILE), or name each robot "
    "to webmap view with --robot NAME:ODOM:CMD_VEL:SCAN."
)

_AWAY = (
    (
        "name is not known",
        "Look how the host is spelled, or give its number, as in ws://192.168.1.20:9090.",
    ),
    (
        "nothing listens",
        "Start rosbridge_server on the robot, and look at its address and port.",
    ),
    (
        "",
        "Start rosbridge_server on the robot, and look at address and firewall.",
    ),
)
"""What to do, by what is in the reason; the last holds for any."""


def bridge_findings(seen: Observed) -> Iterator[Finding]:
    """Say what holds for the link and for everything behind it."""
    if seen.trouble:
        yield Finding(
            "wrong",
            ABOUT,
            f"The rosbridge cannot be reached: {seen.trouble}.",
            next(said for words, said in _AWAY if words in seen.trouble),
        )
        return
    yield _openness(seen)
    yield from _rosapi(seen)
    if seen.clock is not None:
        yield from _clock(seen.clock)
    elif not seen.rosapi:
        yield Finding(
            "note", ABOUT, "rosapi does not tell the time, so clocks are not compared."
        )
    yield _blocking(seen)
    yield _compression(seen)


def _openness(seen: Observed) -> Finding:
    parts = urlsplit(seen.url)
    hidden = (
        f" Nothing is hidden from anybody either ({', '.join(seen.shown)} is shown)."
        if seen.shown
        else ""
    )
    here = is_loopback(seen.peer or parts.hostname or "")
    outward = [each for each in seen.listens if not is_loopback(each)]
    if here and seen.listens and not outward:
        return Finding("good", ABOUT, "The rosbridge listens on this machine alone.")
    if here and outward:
        return Finding(
            "warning",
            ABOUT,
            f"The rosbridge is on this machine and listens at {', '.join(outward)}: it "
            f"asks nobody who they are, so whoever reaches this machine can drive.",
            _listen_advice(seen, "this machine alone (address: 127.0.0.1)"),
        )
    if here:
        return Finding(
            "note",
            ABOUT,
            "The rosbridge was reached at an address of this machine; whether others "
            "reach it too cannot be seen.",
        )
    secret = (
        "the way there is encrypted"
        if parts.scheme == "wss"
        else "everybody on the way can read and change what is sent"
    )
    return Finding(
        "note" if parts.scheme == "wss" else "warning",
        ABOUT,
        f"The rosbridge is open to the network ({seen.peer or parts.hostname}): it "
        f"asks nobody who they are, so whoever reaches it can drive; {secret}.{hidden}",
        f"{_listen_advice(seen, 'the robot alone or on a VPN (address)')} Hide what "
        f"nobody needs (topics_glob, services_glob), and use wss with a certificate.",
    )


def _listen_advice(seen: Observed, where: str) -> str:
    """Return how to keep others from the port."""
    if seen.findings.dialect == "ros1":
        return (
            "Close its port for others in the firewall: rosbridge 0.11 for ROS 1 "
            "listens on all addresses, whatever its parameter address is."
        )
    return f"Let it listen on {where}, or close its port in the firewall."


def _rosapi(seen: Observed) -> Iterator[Finding]:
    robots = seen.findings.robots
    if seen.rosapi:
        yield Finding(
            "note" if seen.told else "warning",
            ABOUT,
            f"rosapi does not say which topics there are: {seen.rosapi}.",
            "Start the rosapi node beside rosbridge. Without it nobody tells who else "
            "writes velocity, and robots that come later are not found."
            + ("" if seen.told else f" {TELL}"),
        )
        if not seen.told:
            return
    source = "rosapi answers"
    if seen.told:
        source = "The topics are those that were given"
    which = "robots looked at" if seen.meant else "robots found"
    if not robots:
        said = " ".join(seen.findings.notes)
        yield Finding("wrong", ABOUT, f"No robot was found. {said}", TELL)
        return
    names = ", ".join(robot.name for robot in robots)
    yield Finding("good", ABOUT, f"{source}; {which}: {names}.")
    if seen.others:
        yield Finding(
            "note",
            ABOUT,
            f"Robots that nobody named here were found too, and not looked at: "
            f"{', '.join(seen.others)}.",
        )
    if len(robots) > MOST_ROBOTS:
        yield Finding(
            "note",
            ABOUT,
            f"{len(robots)} robots are many: only the first {MOST_ROBOTS} of them were "
            f"listened to.",
        )


def _clock(clock: Clock) -> Iterator[Finding]:
    trip = f"A call takes {clock.round_trip * 1000:.0f} ms there and back"
    near = "Bring both ends nearer, by cable or by a better radio link."
    if clock.round_trip > NO_LOOP:
        yield Finding("wrong", ABOUT, f"{trip}: too long to drive.", near)
    elif clock.round_trip > SLOW_LOOP:
        yield Finding("warning", ABOUT, f"{trip}: driving is slow to answer.", near)
    else:
        yield Finding("good", ABOUT, f"{trip}.")
    off = abs(clock.ahead)
    side = "ahead of" if clock.ahead > 0 else "behind"
    if off > SIMULATED:
        yield Finding(
            "note", ABOUT, "The robot's clock is not this world's: a simulator's."
        )
    elif off - clock.round_trip / 2 > CLOCK_OFF:
        yield Finding(
            "warning",
            ABOUT,
            f"The robot's clock is {off:.1f} s {side} this machine's.",
            "Let both take the time from one server (chrony, systemd-timesyncd). "
            "WebMap decides nothing by them, but stamps of both do not fit together.",
        )
    else:
        yield Finding("good", ABOUT, "Both clocks agree.")


def _blocking(seen: Observed) -> Finding:
    advice = (
        "Set call_services_in_new_thread: true on rosbridge_websocket. WebMap sends "
        "velocity and calls over different sockets in any case."
    )
    how = " (tried)" if seen.tried else ", as the bridge says"
    if seen.calls_in_threads is True:
        return Finding("good", ABOUT, f"A service that hangs blocks no socket{how}.")
    if seen.calls_in_threads is False:
        return Finding(
            "warning",
            ABOUT,
            f"A service that hangs blocks its whole socket{how}.",
            advice,
        )
    if seen.untold:
        return Finding(
            "note",
            ABOUT,
            f"Whether a service that hangs blocks its socket was tried, and is not "
            f"known: {seen.untold}.",
        )
    if seen.findings.dialect is None:
        return Finding(
            "note",
            ABOUT,
            "Whether a service that hangs blocks its socket is not known.",
        )
    if seen.findings.dialect == "ros2":
        return Finding(
            "note",
            ABOUT,
            "A service that hangs may block its whole socket, as rosbridge for ROS 2 "
            "does unless told otherwise; it was not tried.",
            f"The button Try a call of the console's report finds out, or webmap "
            f"doctor {seen.url} --try-call. {advice}",
        )
    return Finding(
        "good",
        ABOUT,
        "rosbridge for ROS 1 makes each call in a thread of its own, so one that hangs "
        "blocks nothing.",
    )


def _compression(seen: Observed) -> Finding:
    robots = seen.findings.robots
    scans = {scan.topic for one in robots for scan in one.guesses.get("scan", ())}
    binary = [topic for topic, heard in seen.heard.items() if heard.binary]
    packed = [topic for topic in binary if topic in scans]
    words = (
        "The socket could be compressed"
        if seen.deflate
        else "No compression is offered"
    )
    if packed:
        words = f"Scans come packed as CBOR ({', '.join(packed)}). {words}"
    return Finding("good", ABOUT, f"{words}; WebMap does without.")
