"""The page that hands over a shift: one page, made for print."""

import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from webmap.core.base_page import BasePage
from webmap.core.shift_choice import SINCE, Choice, may_see
from webmap.core.shift_files import Entry
from webmap.core.shift_log import shift_log
from webmap.features.shift_log.shift_summary import (
    driving_of,
    running,
    stops_of,
    unreachable,
    uptime,
)
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
