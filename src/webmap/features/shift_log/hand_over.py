"""The page that hands over a shift: one page, made for print."""

import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from webmap.core.base_page import BasePage
from webmap.core.shift_choice import SINCE, Choice, may_see
from webmap.core.shift_files import Entry
from webmap.core.shift_log import shift_log
from webmap.scene import html
from webmap.scene.element import Event

HTML = Path(__file__).with_name("hand_over.html")

MOST_ROWS = 100
"""Rows of one table; the log has the rest."""

PERIODS = {"shift": "This shift", "12": "12 hours", "24": "24 hours", "all": "All kept"}


class RobotNow(NamedTuple):
    """A robot at the time of the hand-over."""

    id: str
    name: str
    bridge: str
    why: str
    """Why it is out of service; empty if it is not."""


class HandOver:
    """Fills one page with a shift.

    Args:
        page: The page.
        robots: Returns the robots of now.
        alerts: Returns the alerts of the bell.
    """

    def __init__(
        self,
        page: BasePage,
        robots: Callable[[], Sequence[RobotNow]],
        alerts: Callable[[], Iterable[Any]],
    ) -> None:
        self._role = page.viewer.role
        self._who = page.viewer.operator.logged
        self._robots = robots
        self._alerts = alerts
        self._sheet = page.element("sheet")
        self._period = page.element("period")
        choice = html.select(aria_label="Period")
        for value, text in PERIODS.items():
            choice.append(html.option(text=text, value=value))
        choice.on("change", self._choose, role="viewer")
        self._period.append(choice)
        self.show("shift")

    def _choose(self, event: Event) -> None:
        self.show(event.value if event.value in SINCE else "shift")

    def show(self, since: str) -> None:
        """Show a period: a key of ``SINCE``."""
        now, entries = time.time(), shift_log.entries()
        begins = Choice(since).begins(entries, now)
        begins = max(begins, entries[0].unix if entries else now)
        chosen = [e for e in entries if e.unix >= begins and may_see(e, self._role)]
        robots = self._robots()
        self._sheet.clear().append(
            html.p(
                text=f"{_date(begins)} to {_date(now)}, printed by {self._who}",
                class_="period",
            )
        )
        if shift_log.trouble:
            self._sheet.append(html.p(text=shift_log.trouble, class_="trouble"))
        out = [(robot.name, robot.why) for robot in robots if robot.why]
        self._table("Robots out of service", ("Robot", "Why"), out)
        self._table(
            "Open alerts",
            ("Since", "Robot", "Alert", "Acknowledged by"),
            _alert_rows(self._alerts()),
        )
        self._table(
            "Stops",
            ("Time", "Robot", "By", "Result", "Reset"),
            _stop_rows(chosen),
        )
        notes = [
            (_time(e.unix), _name(e), e.robot_name, e.text)
            for e in chosen
            if e.kind == "note"
        ]
        self._table("Notes", ("Time", "By", "Robot", "Note"), notes)
        self._table(
            "Driving",
            ("Robot", "By", "Distance", "Time", "Top speed", "Command age"),
            _driving_rows(chosen),
        )
        on = running(entries, begins, now)
        rows = [
            (
                robot.name,
                _share(uptime(on, unreachable(entries, robot.id, robot.bridge, now))),
            )
            for robot in robots
        ]
        self._table("Robots reachable", ("Robot", "Share of the time"), rows)
        if any(e.verified is False for e in chosen):
            self._sheet.append(html.p(text="* This name is not verified."))

    def _table(
        self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]
    ) -> None:
        head = html.tr(*(html.th(text=column, scope="col") for column in columns))
        part = html.section(html.h2(text=f"{title} ({len(rows)})"))
        if not rows:
            part.append(html.p(text="None."))
        else:
            body = html.tbody(
                *(
                    html.tr(*(html.td(text=cell) for cell in row))
                    for row in rows[-MOST_ROWS:]
                )
            )
            part.append(html.table(html.thead(head), body))
        if len(rows) > MOST_ROWS:
            more = len(rows) - MOST_ROWS
            part.append(html.p(text=f"{more} earlier rows are in the shift log."))
        self._sheet.append(part)


def _alert_rows(alerts: Iterable[Any]) -> list[tuple[str, ...]]:
    """Return the alerts that are active, or that nobody has acknowledged."""
    return [
        (
            _time(alert.began),
            alert.name,
            alert.text if alert.ended is None else f"{alert.text} (over)",
            "" if alert.by is None else str(alert.by),
        )
        for alert in alerts
        if alert.ended is None or alert.by is None
    ]


def _stop_rows(entries: Iterable[Entry]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for stop in stops_of(entries):
        reset = "active"
        if stop.reset is not None:
            reset = f"{_time(stop.reset.unix)} {_name(stop.reset)}"
        entry = stop.entry
        rows.append(
            (_time(entry.unix), entry.robot_name, _name(entry), stop.result, reset)
        )
    return rows


def _driving_rows(entries: Iterable[Entry]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for (robot, person), drive in driving_of(entries).items():
        age = ""
        if drive.ages:
            usual, worst = (max(ages) for ages in zip(*drive.ages, strict=True))
            age = f"{usual:.0f} ms, at worst {worst:.0f} ms"
        rows.append(
            (
                robot,
                person,
                f"{drive.metres:.0f} m",
                _span(drive.seconds),
                f"{drive.top:.2f} m/s",
                age,
            )
        )
    return sorted(rows)


def _name(entry: Entry) -> str:
    mark = "*" if entry.verified is False else ""
    place = f" ({entry.place})" if entry.place else ""
    return f"{entry.person}{mark}{place}" if entry.person else ""


def _date(unix: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M", time.localtime(unix))


def _time(unix: float) -> str:
    return time.strftime("%m-%d %H:%M:%S", time.localtime(unix))


def _span(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 60 else f"{seconds / 60:.0f} min"


def _share(share: float | None) -> str:
    if share is None:
        return "unknown"
    # 99.97 % is not the whole time.
    return "100 %" if share == 1.0 else f"{min(100 * share, 99.9):.1f} %"


# What happened in a shift, from the entries of the log; no I/O and no clock.

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
