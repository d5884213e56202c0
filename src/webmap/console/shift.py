"""The page that hands over a shift, with the robots and alerts of the console."""

from typing import TYPE_CHECKING

import webmap
from webmap.features.alerts.alerts import conditions
from webmap.features.shift_log.hand_over import HTML, HandOver, OpenAlert, RobotNow

if TYPE_CHECKING:
    from webmap import Page, Robot
    from webmap.console.console import Console

HAND_OVER = "/hand-over"
"""The path of the page."""

OUT = ("disobeys", "bridge", "lost", "commands", "health")
"""The kinds of alerts with which a robot is out of service, besides an active STOP."""


def add_hand_over(opened: "Console") -> None:
    """Make the page that hands over a shift."""

    @webmap.page(HAND_OVER, html=HTML)
    def hand_over(page: "Page") -> None:
        HandOver(
            page,
            lambda: [robot_now(robot) for robot in opened.shown_robots()],
            lambda: open_alerts(opened),
        )


def robot_now(robot: "Robot") -> RobotNow:
    """Return a robot with the reason why it is out of service, if it is."""
    texts = conditions(robot)
    why = [texts[kind] for kind in OUT if kind in texts]
    report = robot.report
    if report is not None and report.stop is not None:
        why.insert(0, f"STOP active, pressed by {report.stop.by}")
    bridge = robot.pose_source.bridge
    name = "" if bridge is None else bridge.name or bridge.url
    return RobotNow(robot.id, robot.name, name, "; ".join(why))


def open_alerts(opened: "Console") -> list[OpenAlert]:
    """Return the alerts that are active, or that nobody has acknowledged."""
    return [
        OpenAlert(
            alert.began,
            alert.name,
            alert.text,
            alert.ended is not None,
            "" if alert.by is None else str(alert.by),
        )
        for alert in opened.alerts.listed.values()
        if alert.ended is None or alert.by is None
    ]
