"""What was sent, what the robot's ROS said back, what was measured, and the cap."""

import math
from typing import TYPE_CHECKING

from webmap import html
from webmap.console.words import UNKNOWN, number
from webmap.geometry import Twist

if TYPE_CHECKING:
    from webmap import Element, Robot

COLUMNS = ("Sent", "Echoed", "Measured")


OF_THE_PAGE = "limit of the page"
"""Why a robot is driven no faster that might be."""


class SpeedTable:
    """Three views of one motion, which agree as long as all is well.

    Args:
        most: What this page asks for at most, in m/s and rad/s.

    """

    def __init__(self, most: tuple[float, float]) -> None:
        self._most = most
        self._linear = [html.td() for _ in COLUMNS]
        self._turn = [html.td() for _ in COLUMNS]
        self._cap = html.span()
        self._why = html.div(class_="why")
        self._reasons: tuple[str, ...] = ()
        self.elements: list[Element] = [self._table(), self._limits()]

    def show(self, robot: "Robot") -> None:
        """Show what is known of a robot's motion."""
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
            # Before somebody has it, its own limits alone are in the report.
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
            badge = html.span(text=reason, class_="badge")
            if "unverified" in reason:
                badge.set("data-tone", "warn")
            self._why.append(badge)

    def _table(self) -> "Element":
        head = html.tr(
            html.td(), *(html.th(text=name, scope="col") for name in COLUMNS)
        )
        rows = [
            html.tr(
                html.th(f"{name} ", html.span(text=unit, class_="unit"), scope="row"),
                *cells,
            )
            for name, unit, cells in (
                ("Speed", "m/s", self._linear),
                ("Turn", "rad/s", self._turn),
            )
        ]
        return html.table(html.thead(head), html.tbody(*rows), class_="speeds")

    def _limits(self) -> "Element":
        return html.dl(
            html.div(
                html.dt(text="Speed cap"), html.dd(self._cap, self._why), class_="wide"
            ),
            class_="facts",
        )


def linear(velocity: tuple[float, ...] | None) -> str:
    """Return the speed, whatever the direction; backwards is below zero."""
    if velocity is None:
        return UNKNOWN
    twist = Twist(*velocity)
    return number(math.copysign(twist.speed, twist.vx))


def cap(v: float, w: float) -> str:
    """Return the speeds in force as people read them."""
    return f"{number(v)} m/s, {number(w)} rad/s"
