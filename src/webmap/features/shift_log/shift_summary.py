"""What happened in a shift, from the entries of the log. No I/O and no clock."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from webmap.core.shift_files import Entry

Interval = tuple[float, float]
"""From and until, in seconds since 1970."""

DOWN = ("lost", "commands", "bridge")
"""The kinds of alerts of a robot that cannot be reached."""


@dataclass(slots=True)
class Stop:
    """A STOP of one robot, which may still be active."""

    entry: Entry
    result: str = ""
    """Whether the robot stood, and why."""
    reset: Entry | None = None


@dataclass(slots=True)
class Driving:
    """The driving of one person with one robot."""

    metres: float = 0.0
    seconds: float = 0.0
    top: float = 0.0
    ages: list[tuple[float, float]] = field(default_factory=list)
    """The median and the 99th percentile of each drive, in ms."""


def stops_of(entries: Iterable[Entry]) -> list[Stop]:
    """Return each STOP with its confirmation and its reset, the oldest first."""
    found: dict[object, Stop] = {}
    for entry in entries:
        stop = (entry.robot, entry.facts.get("stop"))
        if entry.kind == "stop" and "confirmed" not in entry.facts:
            found[stop] = Stop(entry)
        elif entry.kind == "stop" and stop in found:
            found[stop].result = entry.text
        elif entry.kind == "reset" and stop in found:
            found[stop].reset = entry
    return list(found.values())


def driving_of(entries: Iterable[Entry]) -> dict[tuple[str, str], Driving]:
    """Return the sums of all drives, by the names of robot and person.

    A name that is not verified ends with an asterisk.
    """
    found: dict[tuple[str, str], Driving] = {}
    for entry in entries:
        facts = entry.facts
        if entry.kind != "drive" or "distance_m" not in facts:
            continue
        person = f"{entry.person}{'*' if entry.verified is False else ''}"
        drive = found.setdefault((entry.robot_name, person), Driving())
        drive.metres += _number(facts.get("distance_m"))
        drive.seconds += _number(facts.get("seconds"))
        drive.top = max(drive.top, _number(facts.get("top_m_s")))
        if facts.get("age_p50_ms") is not None:
            ages = _number(facts["age_p50_ms"]), _number(facts.get("age_p99_ms"))
            drive.ages.append(ages)
    return found


def running(entries: Iterable[Entry], begins: float, ends: float) -> list[Interval]:
    """Return when WebMap ran within a period, as far as the log shows it."""
    found: list[Interval] = []
    on = last = None
    for entry in entries:
        event = entry.facts.get("event") if entry.kind == "webmap" else None
        if event == "started":
            if on is not None and last is not None:  # it was killed
                found.append((on, last))
            on = entry.unix
        elif event == "ended":
            if on is not None:
                found.append((on, entry.unix))
            on = None
        elif on is None:
            on = entry.unix
        last = entry.unix
    if on is not None:
        found.append((on, ends))
    return _within(found, begins, ends)


def unreachable(
    entries: Iterable[Entry], robot: str, bridge: str, ends: float
) -> list[Interval]:
    """Return when a robot could not be reached.

    Args:
        entries: All entries, the oldest first.
        robot: The id of the robot.
        bridge: The name of its bridge.
        ends: The end of the period.

    """
    found: list[Interval] = []
    down: Counter[str] = Counter()
    since = 0.0
    for entry in entries:
        kind = str(entry.facts.get("alert"))
        if entry.kind != "alert" or kind not in DOWN:
            continue
        about = entry.facts.get("bridge") == bridge and kind == "bridge"
        if not about and (kind == "bridge" or entry.robot != robot):
            continue
        before, event = down.total(), entry.facts.get("event")
        if event == "began":
            down[kind] = 1
            since = entry.unix if before == 0 else since
        elif event == "over":
            down[kind] = 0
            if before and not down.total():
                found.append((since, entry.unix))
    if down.total():
        found.append((since, ends))
    return found


def uptime(on: Sequence[Interval], down: Sequence[Interval]) -> float | None:
    """Return the share of the time for which a robot could be reached.

    Args:
        on: When WebMap ran.
        down: When the robot could not be reached.

    """
    total = sum(end - begin for begin, end in on)
    lost = sum(
        end - begin for first, last in on for begin, end in _within(down, first, last)
    )
    return None if total <= 0.0 else 1.0 - lost / total


def _within(
    intervals: Iterable[Interval], begins: float, ends: float
) -> list[Interval]:
    cut = [(max(begin, begins), min(end, ends)) for begin, end in intervals]
    return [(begin, end) for begin, end in cut if begin < end]


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else 0.0
