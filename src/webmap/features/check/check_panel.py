"""The check before driving on the card: one button, and each result on a line."""

import asyncio
import hashlib
import logging
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.plain_files import read_file, write_file
from webmap.base.tasks import spawn
from webmap.core.alignment_store import name_of
from webmap.core.map import Map
from webmap.core.robot import Robot
from webmap.core.shift_log import shift_log
from webmap.features.check.check import Check, Facts, Line
from webmap.gate.locks import state_folder
from webmap.gate.protocol import RobotReport
from webmap.scene import html
from webmap.scene.element import Element

log = logging.getLogger("webmap.check")

LARGEST = 1 << 16
"""Most bytes of a file."""

STANDS = ("free", "held", "barred", "barred_held", "stopped", "unconfirmed", "down")
"""The activities of a robot that a STOP does not interrupt."""

Entry = Callable[[str, str, str, str], Element]
"""Returns a line of a list: its level, its name, its text and its advice."""


class Result(msgspec.Struct, frozen=True):
    """A check that is over."""

    robot: str
    at: float
    """When, in seconds since 1970."""
    by: str
    passed: bool
    lines: list[Line]
    why: str = ""


_known: dict[str, Result | None] = {}


class CheckPanel:
    """The check of the selected robot; a module of maps.

    It is at the top of the card while a check is due or was made just now, and among
    the folded parts otherwise.

    Args:
        map: The map.
        urgent: The element for a check that is due.
        folded: The element for the check otherwise.
        entry: Makes a line of the list.

    """

    def __init__(
        self, map: Map, urgent: Element, folded: Element, entry: Entry
    ) -> None:
        self.map = map
        self._entry = entry
        self._robot: Robot | None = None
        self._checks: dict[str, Check] = {}
        """The checks of this page that run or were just made, by robot."""
        self._shown: object = None
        self._places = (urgent, folded)
        self._status = html.p(class_="minor", role="status")
        self._list = html.ul()
        self._button = html.button(
            "Check before driving", type="button", class_="button", data_act="check"
        )
        self._button.on("click", lambda event: self._begin())
        self.element: Element = html.section(
            html.h3(text="Check before driving"),
            self._status,
            self._list,
            html.div(self._button, class_="webmap-row wraps"),
            class_="card-health card-check",
            aria_label="Check before driving",
        )
        self._place: Element | None = None
        self.browser_part = map.add_browser_part(
            self, "features/check/check_panel.js", {}
        )
        self.on_select()

    def destroy(self) -> None:
        """Remove the panel."""
        self.element.remove()

    def on_select(self) -> None:
        """Show the check of the robot that is selected now."""
        robot = self.map.selected
        if self._robot is not None and robot is not self._robot:
            check = self._checks.get(self._robot.id)
            if check is not None and check.is_over:
                del self._checks[self._robot.id]
        self._robot = robot
        self.poll()

    def poll(self) -> None:
        """Go on with the checks of this page, and show that of the selected robot."""
        for each in self.map.robots:
            check = self._checks.get(each.id)
            if check is not None and each.report is not None:
                self._go_on(each, each.report, check)
        robot, report = self._robot, None if self._robot is None else self._robot.report
        drivable = robot is not None and robot.motion.config.twist is not None
        self.element.set(hidden=not drivable or report is None)
        if robot is not None and report is not None and drivable:
            self._show(robot, report)

    def _go_on(self, robot: Robot, report: RobotReport, check: Check) -> None:
        over = check.is_over
        if check.look(facts_of(robot, report), time.monotonic()):
            self.browser_part.send({"op": "check", "robot": robot.id})
        if check.is_over and not over:
            person = self.map.page.viewer.operator
            shift_log.note("check", status_of(check), robot=robot, person=person)
            result = keep_result(robot, check, person.logged)
            spawn(asyncio.to_thread(write_result, robot, result))

    def _show(self, robot: Robot, report: RobotReport) -> None:
        check, last = self._checks.get(robot.id), last_result(robot)
        due = is_due(report)
        why = self._why_not(robot, report, check)
        place = self._places[0 if due or check is not None else 1]
        if place is not self._place:
            place.append(self.element)  # moves it
            self._place = place
        may = self.map.page.viewer.may_drive(robot.id)
        self._button.set(disabled=bool(why), hidden=not may)
        self._button.set("title", why or None)
        if check is not None:
            status, found = status_of(check), check.lines
        else:
            found = [] if last is None or last.passed else last.lines
            status = last_check(report, last, due)
        if why and not (check and not check.is_over):
            status = f"{status} {why}".strip()
        self._status.text = status
        if found != self._shown:
            self._shown = found
            self._list.clear()
            self._list.append(*map(self._line, found))
            self._list.set(hidden=not found)

    def _line(self, line: Line) -> Element:
        return self._entry(line.level, f"{line.name}: ", line.text, line.advice)

    def _why_not(self, robot: Robot, report: RobotReport, check: Check | None) -> str:
        """Return why a check cannot begin now, as a sentence; empty if it can."""
        if not self.map.page.viewer.may_drive(robot.id):
            return "Only operators of this robot can check it."
        if check is not None and not check.is_over:
            return "A check is going on."
        holder, you = report.holder, self.map.page.viewer.operator.person
        if holder is not None and (
            holder.identity is None or holder.identity.person != you
        ):
            return f"{holder.name} has control."
        if report.doing not in STANDS:
            return "The robot moves: the check begins with a STOP."
        return ""

    def _begin(self) -> None:
        robot = self._robot
        report = None if robot is None else robot.report
        if robot is None or report is None:
            return
        if self._why_not(robot, report, self._checks.get(robot.id)):
            return
        self._checks[robot.id] = Check(
            time.monotonic(),
            None if report.stop is None else report.stop.id,
            None if report.check is None else report.check.at,
        )
        self.browser_part.send({"op": "stop", "robot": robot.id})
        self.poll()


def facts_of(robot: Robot, report: RobotReport) -> Facts:
    """Return what is known of a robot now."""
    bridge = robot.pose_source.bridge
    now = time.monotonic()
    cameras = {
        module.name: None if module.stamp is None else now - module.stamp
        for module in robot.modules
        if hasattr(module, "watch") and hasattr(module, "stamp")
    }
    return Facts(
        report,
        0.0 if bridge is None else bridge.lag,
        robot.feed is not None,
        robot.pose_age,
        cameras,
    )


def is_due(report: RobotReport) -> bool:
    """Return whether a check is demanded and there is none that is recent enough."""
    check = report.check
    if check is None or check.every is None:
        return False
    return check.at is None or time.time() - check.at > check.every


def status_of(check: Check) -> str:
    """Return what a check waits for, or its result, as a sentence."""
    if not check.is_over:
        return check.doing
    if check.passed:
        return "The check has passed."
    return f"The check has failed{': ' if check.why else ''}{check.why}."


def last_check(report: RobotReport, last: Result | None, due: bool) -> str:
    """Return when the robot was checked last, and by whom, as sentences."""
    parts = []
    if due:
        parts.append("A check is due: until then the robot drives slowly.")
    newest = report.check
    if newest is not None and newest.at is not None:
        parts.append(f"Passed {when(newest.at)} by {newest.by}.")
    if last is not None and not last.passed:
        parts.append(f"Failed {when(last.at)} by {last.by}.")
    return " ".join(parts) or "Not checked yet."


def when(at: float) -> str:
    """Return a day and a time, for people; ``at`` is in seconds since 1970."""
    return f"{datetime.fromtimestamp(at).astimezone():%d %b, %H:%M}"


def last_result(robot: Robot) -> Result | None:
    """Return the last check of a robot; its file is read once."""
    file = _file_of(robot)
    if file.name not in _known:
        _known[file.name] = _read(file)
    return _known[file.name]


def keep_result(robot: Robot, check: Check, by: str) -> Result:
    """Remember a check that is over, and return its result for the file."""
    result = Result(robot.name, time.time(), by, check.passed, check.lines, check.why)
    _known[_file_of(robot).name] = result
    # The place where the shift log notes a check, with the person and the lines.
    passed = "passed" if check.passed else "failed"
    log.info("%s: the check before driving by %s has %s", robot.name, by, passed)
    return result


def write_result(robot: Robot, result: Result) -> None:
    """Write a result to the disk; may take long, and logs an error."""
    file = _file_of(robot)
    try:
        write_file(file, msgspec.json.encode(result))
    except OSError as error:
        log.error("%s: the check of %s is not kept: %s", file, robot.name, error)


def _file_of(robot: Robot) -> Path:
    bridge = robot.pose_source.bridge
    name = robot.id if bridge is None else name_of(bridge, robot.name)
    digest = hashlib.sha256(name.encode()).hexdigest()[:24]
    return state_folder() / "checks" / f"{digest}.json"


def _read(file: Path) -> Result | None:
    try:
        data = read_file(file, LARGEST, links=False)
        return msgspec.json.decode(data, type=Result)
    except FileNotFoundError:
        return None
    except (OSError, ConfigError, msgspec.DecodeError, RecursionError) as error:
        log.warning("%s cannot be read (%s): no check is shown", file, error)
        return None
