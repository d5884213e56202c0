"""Parts of the card of the selected robot: speeds, command timeout, goal, health."""

import math
import time
from typing import Any

from webmap import Element, Map, Robot, html, svg
from webmap.base.geometry import Twist
from webmap.base.text import counted
from webmap.console.robot_looks import UNKNOWN, number, sentence
from webmap.features.doctor.doctor_panel import entry

COLUMNS = ("Sent", "Arrived", "Measured")

OF_THE_PAGE = "normal limit"
"""Why a robot is driven slower than its own limits allow."""

NOBODY_KNOWS = "unknown"


class SpeedTable:
    """A robot's commanded, echoed and measured velocity, which normally agree.

    Args:
        most: The greatest speeds that this page asks for, in m/s and rad/s.
    """

    def __init__(self, most: tuple[float, float]) -> None:
        self._most = most
        self._linear = [html.td() for _ in COLUMNS]
        self._turn = [html.td() for _ in COLUMNS]
        self._cap = html.span()
        self._why = html.div(class_="why")
        self._reasons: tuple[str, ...] = ()
        self.elements: list[Element] = [self._table(), self._limits()]

    def show(self, robot: Robot) -> None:
        """Show the three velocities, and the speed limit with its reasons."""
        report = robot.report
        sent = echoed = measured = None
        if report is not None:
            sent, echoed, measured = report.sent, report.echoed, report.measured
        seen = robot.motion.axes.seen(robot.measured_twist)
        if measured is None and seen is not None:
            measured = seen.numbers
        for index, velocity in enumerate((sent, echoed, measured)):
            self._linear[index].text = linear(velocity)
            self._turn[index].text = (
                UNKNOWN if velocity is None else number(velocity[2])
            )
        self.elements[1].set(hidden=report is None)
        if report is not None:
            # Before an operator has control, the report has only the robot's own
            # limits.
            self._cap.text = cap(
                min(report.v, self._most[0]), min(report.w, self._most[1])
            )
            lower = report.v > self._most[0] or report.w > self._most[1]
            self._show_reasons((*report.why, OF_THE_PAGE) if lower else report.why)

    def _show_reasons(self, reasons: tuple[str, ...]) -> None:
        if reasons == self._reasons:
            return
        self._reasons = reasons
        self._why.clear()
        for reason in reasons:
            warns = "not verified" in reason or "not checked" in reason
            tone = "warn" if warns else None
            self._why.append(html.span(text=reason, class_="badge", data_tone=tone))

    def _table(self) -> Element:
        head = html.tr(
            html.td(), *(html.th(text=name, scope="col") for name in COLUMNS)
        )
        rows = [
            html.tr(
                html.th(
                    f"{name} ", html.span(text=unit, class_="minor unit"), scope="row"
                ),
                *cells,
            )
            for name, unit, cells in (
                ("Speed", "m/s", self._linear),
                ("Turn", "rad/s", self._turn),
            )
        ]
        return html.table(html.thead(head), html.tbody(*rows), class_="speeds")

    def _limits(self) -> Element:
        return html.dl(
            html.div(
                html.dt(text="Speed limit"),
                html.dd(self._cap, self._why),
                class_="wide",
            ),
            class_="facts",
        )


def linear(velocity: tuple[float, ...] | None) -> str:
    """Return the speed in any direction as text; backward is negative."""
    if velocity is None:
        return UNKNOWN
    twist = Twist(*velocity)
    return number(math.copysign(twist.speed, twist.vx))


def cap(v: float, w: float) -> str:
    """Return the speed limits as text."""
    return f"{number(v)} m/s, {number(w)} rad/s"


class OwnStop:
    """The stopping bound that applies when WebMap, its machine or the link fails.

    Args:
        fastest: The greatest speed at which this page drives a robot, in m/s.
    """

    def __init__(self, fastest: float) -> None:
        self._fastest = fastest
        self._bound = html.span()
        self._how = html.span(class_="minor how")
        self._test = html.p(class_="test", role="status")
        self.elements: list[Element] = [
            html.dl(
                html.div(
                    html.dt(text="If commands end"),
                    html.dd(self._bound, self._how),
                    class_="own-stop",
                ),
                class_="facts",
            ),
            self._test,
        ]

    def show(self, robot: Robot) -> None:
        """Show a robot's command timeout, and the state of the stop test."""
        report = robot.report
        self.elements[0].set(hidden=report is None)
        if report is None:
            self._test.text = ""
            return
        self._bound.text, self._how.text = bound(
            report.stop_time,
            f"tested {report.stop_date or ''}".strip()
            if report.stop_source == "tested"
            else report.stop_source,
            min(report.v, self._fastest),
            report.brake,
        )
        self.elements[0].set("data-tone", "warn" if report.stop_time is None else None)
        test = report.test
        # What ended the test, such as a STOP, may be over when control has ended.
        over = ("done",) if report.holder else ("done", "failed")
        shown = test is not None and test.state not in over
        self._test.text = f"Stop test: {sentence(test.text)}" if test and shown else ""


def bound(
    stop_time: float | None, source: str | None, v: float, brake: float
) -> tuple[str, str]:
    """Return the time within which a robot stops without commands, and its reason.

    Args:
        stop_time: Command timeout of the base in seconds; ``None`` if unknown.
        source: The source of the command timeout; ``None`` if unknown.
        v: The speed limit, in m/s.
        brake: The robot's deceleration, in m/s².
    """
    if stop_time is None:
        if source is None:
            return NOBODY_KNOWS, " The command timeout of the base is unknown."
        return "does not stop", f" {sentence(source)}"
    braking = v / brake
    return (
        f"stops within {number(stop_time + braking)} s",
        f" {number(stop_time)} s command timeout ({source}) + {number(braking)} s "
        f"of braking from {number(v)} m/s",
    )


GOALS = {
    "sent": ("Goal sent", "sent", "active"),
    "accepted": ("Goal accepted", "sent", "active"),
    "under way": ("Navigating to goal", "way", "active"),
    "cancelling": ("Cancelling goal", "cancelled", "warn"),
    "unknown": ("State of the goal unknown", "unknown", "warn"),
    "reached": ("Goal reached", "reached", "good"),
    "failed": ("Goal failed", "failed", "bad"),
    "cancelled": ("Goal cancelled", "cancelled", ""),
}
"""The text, the shape and the tone of each state of a goal.

The page has a table of the texts and shapes, made from this one. console.html has a
symbol ``goal-SHAPE`` for each shape.
"""


NO_GOAL = "No goal"

GOAL_ON_MAP = "Goal shown on the map"
"""Shown while the map shows a goal or plan of the robot, whoever sent it."""

LINGER = 30.0
"""Seconds for which a reached or canceled goal is shown.

A failed goal is shown until the next goal.
"""


class GoalLine:
    """A line of the card: the state of the robot's goal, and the progress."""

    def __init__(self) -> None:
        self._use = svg.use(href="#goal-sent")
        shape = svg.svg(self._use, class_="shape", aria_hidden="true")
        self._words = html.span(text=NO_GOAL)
        self._figures = html.span(class_="minor figures")
        self.element = html.p(
            shape, html.span(self._words, self._figures), class_="goal"
        )

    def show(self, robot: Robot) -> None:
        """Show the state of a robot's goal; the line keeps its place without one."""
        goal = None if robot.report is None else robot.report.goal
        ended = robot.goal_ended_at
        past = ended is not None and time.monotonic() - ended > LINGER
        if goal is None or (past and goal.state != "failed"):
            self.element.set("data-tone", "none")
            self._words.text = GOAL_ON_MAP if robot.has_own_goal else NO_GOAL
            self._figures.text = ""
            return
        words, shape, tone = GOALS[goal.state]
        self._use.set(href=f"#goal-{shape}")
        self.element.set("data-tone", tone or None)
        self._words.text = f"{words}: {goal.why}" if goal.why else words
        self._figures.text = figures(robot)


def figures(robot: Robot) -> str:
    """Return the figures of the goal of a robot, with units; empty without progress."""
    goal = None if robot.report is None else robot.report.goal
    if goal is None or goal.state not in ("under way", "cancelling"):
        return ""
    parts = []
    if goal.left is not None:
        parts.append(f"{goal.left:.1f} m to go")
    if goal.eta is not None:
        parts.append(f"about {goal.eta:.0f} s left")
    if goal.time is not None:
        parts.append(f"{goal.time:.0f} s elapsed")
    if goal.recoveries:
        one = goal.recoveries == 1
        parts.append("1 recovery" if one else f"{goal.recoveries} recoveries")
    return ", ".join(parts)


MOST = 6
"""The greatest number of parts that are listed; the worst come first."""

LEVELS = {
    "error": ("wrong", "Error"),
    "stale": ("note", "Stale"),
    "warn": ("warning", "Warning"),
    "ok": ("good", "OK"),
}
"""The shape with colour, and the text, of each level of diagnostics."""


class RobotHealth:
    """Lists the parts of the selected robot that are not well; a module of maps.

    A robot without diagnostics has no list. The list is one line if all parts are well,
    or if no diagnostics were received.

    Args:
        map: The map.
        card: The page's element to append to.
    """

    def __init__(self, map: Map, card: Element) -> None:
        self.map = map
        self._list = html.ul()
        self.element: Element = html.section(
            html.h3(text="Health"),
            self._list,
            class_="card-health",
            aria_label="Health",
            hidden=True,
        )
        card.append(self.element)
        self._shown: list[tuple[str, str, str]] = []
        self.on_select()

    def destroy(self) -> None:
        """Remove the list."""
        self.element.remove()

    def on_select(self) -> None:
        """Show the diagnostics of another robot at once, not at the next poll."""
        self.poll()

    def poll(self) -> None:
        """Update the parts; a part without new messages becomes stale by this."""
        robot = self.map.selected
        modules = [] if robot is None else robot.modules
        # Modules that follow diagnostics.
        found = [m for m in modules if hasattr(m, "parts") and hasattr(m, "hold")]
        lines = _lines([part for module in found for part in module.parts])
        if found and not lines:
            lines = [("note", "No data: ", "no diagnostics of this robot received yet")]
        if lines == self._shown:
            return
        self._shown = lines
        self._list.clear()
        for level, word, text in lines:
            self._list.append(entry(level, word, text))
        self.element.set(hidden=not lines)


def _lines(parts: list[Any]) -> list[tuple[str, str, str]]:
    """Return the problems, or that all is well; nothing if no part has diagnostics."""
    bad = [part for part in parts if part.level != "ok"]
    lines = []
    for part in bad[:MOST]:
        level, word = LEVELS[part.level]
        # A count of seconds would change the line every second.
        words = "" if part.level == "stale" else f": {part.message}"
        whose = " (robot unknown)" if part.shared else ""
        lines.append((level, f"{word}: ", f"{part.name}{whose}{words}"))
    if len(bad) > MOST:
        lines.append(("note", "", f"and {counted(len(bad) - MOST, 'more part')}"))
    # Good parts that belong to no known robot do not show that this robot is well.
    if not bad and any(not part.shared for part in parts):
        lines.append(("good", "All OK: ", counted(len(parts), "part")))
    return lines
