"""The findings of the diagnosis about a bridge, and all findings in order."""

from collections import Counter
from collections.abc import Iterator, Sequence
from urllib.parse import urlsplit

from webmap.base.text import one_line
from webmap.discovery.doctor.facts import MOST_ROBOTS, BridgeFacts, Clock
from webmap.discovery.doctor.robot_rules import robot_findings
from webmap.ros.foxglove import advice as foxglove_advice
from webmap.ros.names import (
    agent_named,
    has_gate,
    is_agent_url,
    is_foxglove_url,
    is_rosbridge_url,
)
from webmap.ros.rosbridge import advice
from webmap.ros.rosbridge.advice import BRIDGE, LEVELS, Finding, Level, listen_advice
from webmap.ros.rosbridge.checks import is_loopback

MARKS = {"wrong": "WRONG", "warning": "warning", "note": "note", "good": "good"}


def judge(seen: BridgeFacts) -> list[Finding]:
    """Return all findings: the bridge first, then each robot, worst first."""
    groups = [list(_bridge(seen))]
    groups += [list(robot_findings(one, seen)) for one in seen.findings.robots]
    return [
        finding
        for group in groups
        for finding in sorted(group, key=lambda each: LEVELS.index(each.level))
    ]


def is_ready(findings: Sequence[Finding]) -> bool:
    """Return whether nothing is wrong."""
    return not any(finding.level == "wrong" for finding in findings)


def report(url: str, findings: Sequence[Finding]) -> str:
    """Return the findings for a terminal, with a heading for each robot."""
    lines = [one_line(url)]
    about = ""
    for finding in findings:
        if finding.about != about:
            about = finding.about
            lines += ["", one_line(about)]
        lines.append(f"  {MARKS[finding.level]:<8} {one_line(finding.text)}")
        if finding.advice:
            lines.append(f"           -> {one_line(finding.advice)}")
    counts = Counter(finding.level for finding in findings)
    texts = [_counted(counts[level], level) for level in LEVELS]
    return "\n".join([*lines, "", ", ".join(texts)])


def _counted(count: int, level: Level) -> str:
    """Return the number of findings of a level as text, such as "4 notes"."""
    is_noun = level in ("warning", "note")
    return f"{count} {level}{'s' if is_noun and count != 1 else ''}"


SLOW_LOOP = 0.15
"""Seconds of a round trip from which WebMap limits the speed."""

NO_LOOP = 0.3
"""Seconds of a round trip from which every command is too old."""

CLOCK_OFF = 0.5
"""Seconds from which the stamps of the two machines do not match."""

SIMULATED = 365 * 24 * 3600.0
"""Seconds of difference from which the robot's clock is a simulator's."""


GIVE_TOPICS = (
    "Give a list of the topics (webmap doctor URL --topics FILE), or pass each robot "
    "to webmap view with --robot NAME:ODOM:CMD_VEL:SCAN."
)


WATCHED = "The robots behind this kind of bridge can be watched and not driven."
DRIVEN = "Drive them through a rosbridge, a Foxglove bridge or an agent."


def _bridge(seen: BridgeFacts) -> Iterator[Finding]:
    """Yield the findings about the connection and everything behind it."""
    by_agent = is_agent_url(seen.url)
    by_foxglove = is_foxglove_url(seen.url)
    by_rosbridge = is_rosbridge_url(seen.url)
    if seen.trouble:
        yield _unreachable(seen)
        return
    dialect = seen.findings.dialect
    if by_agent:
        yield from _agent(seen)
    elif by_foxglove:
        yield from foxglove_advice.findings(seen.link, seen.url)
        listed = not seen.unlisted and not seen.topics_given
        has_actions = any("/_action/" in topic for topic in seen.types)
        if listed and dialect == "ros2" and not has_actions:
            yield foxglove_advice.no_actions()
    elif by_rosbridge:
        yield advice.openness(seen.link, seen.url, seen.shown, dialect)
    if not has_gate(seen.url):
        yield Finding("wrong", BRIDGE, WATCHED, DRIVEN)
    if seen.unlisted:
        yield advice.topics_not_listed(
            seen.unlisted, "" if seen.topics_given else GIVE_TOPICS
        )
    if seen.topics_given or not seen.unlisted:
        yield from _robots(seen)
    if seen.clock is not None:
        if has_gate(seen.url):
            yield _reaction(seen.clock, "A ping" if by_foxglove else "A service call")
        yield _clock(seen.clock)
    elif not seen.unlisted:
        text = "The bridge does not report its time, so clocks are not compared."
        yield Finding("note", BRIDGE, text)
    if by_rosbridge:
        yield advice.blocking(seen.link, seen.url, dialect)
        yield advice.compression(seen.link, _packed_scans(seen))


def _unreachable(seen: BridgeFacts) -> Finding:
    if is_agent_url(seen.url):
        return _unreachable_agent(seen)
    if is_foxglove_url(seen.url):
        return foxglove_advice.unreachable(seen.trouble)
    if is_rosbridge_url(seen.url):
        return advice.unreachable(seen.trouble)
    text = f"The bridge cannot be reached: {seen.trouble}."
    return Finding("wrong", BRIDGE, text, "Start it, and check address and firewall.")


def _packed_scans(seen: BridgeFacts) -> list[str]:
    robots = seen.findings.robots
    scans = {scan.topic for one in robots for scan in one.guesses.get("scan", ())}
    binary = [topic for topic, measured in seen.measured.items() if measured.binary]
    return [topic for topic in binary if topic in scans]


def _robots(seen: BridgeFacts) -> Iterator[Finding]:
    robots = seen.findings.robots
    source = "The bridge lists its topics"
    if seen.topics_given:
        source = "The topics come from the given list"
    which = "robots checked" if seen.configured else "robots found"
    if not robots:
        notes = " ".join(seen.findings.notes)
        yield Finding("wrong", BRIDGE, f"No robot was found. {notes}", GIVE_TOPICS)
        return
    names = ", ".join(robot.name for robot in robots)
    yield Finding("good", BRIDGE, f"{source}; {which}: {names}.")
    if seen.others:
        yield Finding(
            "note",
            BRIDGE,
            f"Discovery also found robots that are not configured; they were not "
            f"checked: {', '.join(seen.others)}.",
        )
    if len(robots) > MOST_ROBOTS:
        yield Finding(
            "note",
            BRIDGE,
            f"Only the first {MOST_ROBOTS} of {len(robots)} robots were measured.",
        )


def _reaction(clock: Clock, asked: str) -> Finding:
    trip = f"{asked} takes {clock.round_trip * 1000:.0f} ms"
    near = "Use a faster connection, such as a cable or a better radio link."
    if clock.round_trip > NO_LOOP:
        return Finding("wrong", BRIDGE, f"{trip}: too long for driving.", near)
    if clock.round_trip > SLOW_LOOP:
        return Finding("warning", BRIDGE, f"{trip}: the robot reacts late.", near)
    return Finding("good", BRIDGE, f"{trip}.")


def _clock(clock: Clock) -> Finding:
    off = abs(clock.ahead)
    side = "ahead of" if clock.ahead > 0 else "behind"
    if off > SIMULATED:
        return Finding("note", BRIDGE, "The robot uses the clock of a simulator.")
    if off - clock.round_trip / 2 > CLOCK_OFF:
        return Finding(
            "warning",
            BRIDGE,
            f"The robot's clock is {off:.1f} s {side} this machine's.",
            "Synchronise both clocks with one server (chrony, systemd-timesyncd). "
            "WebMap's safety does not depend on them, but stamps of the two machines "
            "do not match.",
        )
    return Finding("good", BRIDGE, "Both clocks agree.")


ON_THE_ROBOT = (
    "On the robot, run webmap doctor with the address of the rosbridge itself."
)


def _unreachable_agent(seen: BridgeFacts) -> Finding:
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


def _agent(seen: BridgeFacts) -> Iterator[Finding]:
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
        yield advice.no_result(seen.link, ON_THE_ROBOT)
