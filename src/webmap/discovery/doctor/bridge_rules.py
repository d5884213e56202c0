"""Findings of the diagnosis about a bridge."""

from collections.abc import Iterator

from webmap.discovery.doctor import agent_rules
from webmap.discovery.doctor.observed import MOST_ROBOTS, Clock, Observed
from webmap.ros.names import is_agent_url
from webmap.ros.rosbridge import advice
from webmap.ros.rosbridge.advice import BRIDGE, Finding

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


def bridge_findings(seen: Observed) -> Iterator[Finding]:
    """Yield the findings about the connection and everything behind it."""
    by_agent = is_agent_url(seen.url)
    if seen.trouble:
        yield (
            agent_rules.unreachable(seen)
            if by_agent
            else advice.unreachable(seen.trouble)
        )
        return
    dialect = seen.findings.dialect
    if by_agent:
        yield from agent_rules.agent_findings(seen)
    else:
        yield advice.openness(seen.link, seen.url, seen.shown, dialect)
    if seen.unlisted:
        yield advice.topics_not_listed(
            seen.unlisted, "" if seen.topics_given else GIVE_TOPICS
        )
    if seen.topics_given or not seen.unlisted:
        yield from _robots(seen)
    if seen.clock is not None:
        yield from _clock(seen.clock)
    elif not seen.unlisted:
        text = "The bridge does not report its time, so clocks are not compared."
        yield Finding("note", BRIDGE, text)
    if not by_agent:
        yield advice.blocking(seen.link, seen.url, dialect)
        yield advice.compression(seen.link, _packed_scans(seen))


def _packed_scans(seen: Observed) -> list[str]:
    robots = seen.findings.robots
    scans = {scan.topic for one in robots for scan in one.guesses.get("scan", ())}
    binary = [topic for topic, measured in seen.measured.items() if measured.binary]
    return [topic for topic in binary if topic in scans]


def _robots(seen: Observed) -> Iterator[Finding]:
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


def _clock(clock: Clock) -> Iterator[Finding]:
    trip = f"A service call takes {clock.round_trip * 1000:.0f} ms"
    near = "Use a faster connection, such as a cable or a better radio link."
    if clock.round_trip > NO_LOOP:
        yield Finding("wrong", BRIDGE, f"{trip}: too long for driving.", near)
    elif clock.round_trip > SLOW_LOOP:
        yield Finding("warning", BRIDGE, f"{trip}: the robot reacts late.", near)
    else:
        yield Finding("good", BRIDGE, f"{trip}.")
    off = abs(clock.ahead)
    side = "ahead of" if clock.ahead > 0 else "behind"
    if off > SIMULATED:
        yield Finding("note", BRIDGE, "The robot uses the clock of a simulator.")
    elif off - clock.round_trip / 2 > CLOCK_OFF:
        yield Finding(
            "warning",
            BRIDGE,
            f"The robot's clock is {off:.1f} s {side} this machine's.",
            "Synchronise both clocks with one server (chrony, systemd-timesyncd). "
            "WebMap's safety does not depend on them, but stamps of the two machines "
            "do not match.",
        )
    else:
        yield Finding("good", BRIDGE, "Both clocks agree.")
