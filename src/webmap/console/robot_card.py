"""The card of the selected robot: pose, motion and actions."""

import math
from collections.abc import Callable
from typing import Any

from webmap import Element, Map, Robot, html
from webmap.console.card_parts import GoalLine, OwnStop, SpeedTable
from webmap.console.robot_list import AGE_LIMIT, StateShape, StateWords
from webmap.console.robot_looks import UNKNOWN, heading, icon, look_of, number, sentence
from webmap.features.cameras.camera_panel import CameraViews

ACTIONS = (
    ("send", "icon-send", "Send goal…"),
    ("cancel", "icon-cancel", "Cancel goal"),
    ("remove", "icon-close", "Remove from page"),
)
"""``data-act``, the symbol and the text of each button that is always visible.

console.js handles follow and cancel, because they must work over a bad connection too.
"""

UNABLE = {
    "send": "No goal topic and no action is set for this robot",
    "cancel": "No cancel topic and no action is set for this robot",
    "locate": "No topic for the initial pose is set for this robot",
}
"""Why a button of the card is disabled."""

LOOKS = "Only operators of this robot can drive it and send goals"
"""In place of the buttons, for everybody else."""

TEST_WORDS = (
    ("take", "Stop test: take control"),
    ("ready", "Run stop test"),
    ("asking", "Robot will move slowly: press again"),
    ("running", "Stop test running"),
)
"""Texts of the stop test's button; console.js selects one with ``data-test``."""


class RobotCard:
    """Shows the robot that is selected on a map; a module of maps.

    Args:
        map: The map.
        element: The page's element to fill; hidden while nothing is selected.
        aim_goal: Called to make the next press on the map the goal.
        forget_goal: Called to remove the arrow of a robot's goal.
        aim_pose: Called to make the next press on the map the robot's pose.
        most: The greatest speeds at which this page drives a robot, in m/s and rad/s.
        remove: Called to remove a robot without poses from all pages.

    Attributes:
        notes: What needs attention, below the camera; other modules append to it.
        more: What is folded in; other modules append to it.
    """

    def __init__(
        self,
        map: Map,
        element: Element,
        *,
        aim_goal: Callable[[], object],
        forget_goal: Callable[[Robot], object],
        aim_pose: Callable[[], object],
        most: tuple[float, float],
        remove: Callable[[Robot], object],
    ) -> None:
        self.map = map
        self._remove = remove
        self.element = element
        self._aim_goal = aim_goal
        self._take_arrow = forget_goal
        self._aim_pose = aim_pose
        self.notes: Element = html.div(class_="notes")
        self.more: Element = html.details(class_="more")
        self._robot: Robot | None = None
        self._feed: RobotTriggers | None = None
        self._shape = StateShape()
        self._name = html.h2(dir="auto")
        self._words = StateWords(html.p())
        self._reason = html.p(class_="minor reason")
        self._problems = html.p(class_="problems", role="alert")
        self._x, self._y, self._heading = html.span(), html.span(), html.span()
        self._age = html.dd(class_="age")
        self._age.set_age(math.inf, limit=AGE_LIMIT, age_text=True)
        self.element.set_age(math.inf, limit=AGE_LIMIT)
        self._battery = html.dd()
        self._goal = GoalLine()
        self._cameras = CameraViews()
        self._speeds = SpeedTable(most)
        self._own_stop = OwnStop(most[0])
        element.append(*self._parts())
        self.on_select()

    def destroy(self) -> None:
        """Detach from the robot and empty the card."""
        self._let_go()
        self.element.clear()

    def on_select(self) -> None:
        """Show the robot that is selected now."""
        self._let_go()
        robot = self._robot = self.map.selected
        self.element.set(hidden=robot is None)
        if robot is None:
            self.element.unset("data-robot")
            return
        self.element.set("data-robot", robot.id)
        self._name.set("title", robot.name).text = robot.name
        self._battery.text = "unknown"
        self._show_age(math.inf)
        self._feed = robot.add_module(lambda owner: RobotTriggers(owner, self))
        self._cameras.show(robot)
        for module in robot.modules:
            if hasattr(module, "charge"):
                self.show_battery(module)
        self.show_pose()
        self.show_state()

    def poll(self) -> None:
        """Update the values that have no trigger."""
        if self._robot is not None:
            self.show_state()
            self._cameras.poll()
            age = self._robot.pose_age
            if age is not None:
                self._show_age(age)

    def _show_age(self, age: float) -> None:
        for element in (self.element, self._age):
            element.set_age(age)

    def show_pose(self) -> None:
        """Show the place in metres, the heading and the velocities, if known."""
        robot = self._robot
        assert robot is not None
        known = robot.valid
        self._x.text = number(robot.position.x) if known else UNKNOWN
        self._y.text = number(robot.position.y) if known else UNKNOWN
        self._heading.text = heading(robot.yaw) if known else UNKNOWN
        self._speeds.show(robot)

    def show_state(self) -> None:
        """Show who has control, the speed limit and the speed."""
        robot = self._robot
        assert robot is not None
        state, report = robot.shown_state, robot.report
        shape, tone, _ = look_of(robot)
        self._shape.show(shape)
        you = self.map.page.viewer.operator
        self._words.show(robot, you.person)
        self.element.set("data-state", state.name)
        reasons = (report.other_writer, report.reason) if report is not None else ()
        looks = not self.map.page.viewer.may_drive(robot.id)
        self.element.set("data-looks", "" if looks else None)
        reason = " ".join(
            sentence(each) for each in (*reasons, looks and LOOKS) if each
        )
        self._reason.text = reason.replace(f"by {you}", "by you")
        self._goal.show(robot)
        self._problems.text = " ".join(map(sentence, robot.problems.values()))
        self.element.set("data-tone", tone or None)
        self._speeds.show(robot)
        self._own_stop.show(robot)
        able = {
            "send": report is not None and report.method is not None,
            "cancel": report is not None and report.cancels,
            "locate": report is not None and report.locates,
        }
        for name, is_able in able.items():
            self._buttons[name].set(disabled=not is_able)
            self._buttons[name].set("title", None if is_able else UNABLE[name])

    def show_battery(self, battery: Any) -> None:
        """Show charge and voltage, as far as known."""
        parts = []
        if battery.charge is not None:
            parts.append(f"{round(100 * battery.charge)} %")
        if battery.voltage is not None:
            parts.append(f"{number(battery.voltage, 1)} V")
        self._battery.text = ", ".join(parts) or "unknown"

    def _let_go(self) -> None:
        if self._robot is not None and self._feed is not None:
            self._robot.remove_module(self._feed)
        self._cameras.show(None)
        self._robot = self._feed = None

    def _parts(self) -> list[Element]:
        quiet = {"type": "button", "class_": "button square quiet"}
        close = html.button(
            icon("icon-close"), aria_label="Deselect the robot", **quiet
        )
        close.on("click", lambda event: self.map.set_selected(None), role="viewer")
        follow = html.button(icon("icon-follow"), data_act="follow", **quiet)
        follow.set(title="Keep the robot in the middle", aria_label="Follow")
        head = html.div(
            *self._shape.elements, self._name, follow, close, class_="card-head"
        )
        state = self._words.element.set("role", "status")
        locate = action("locate", "icon-locate", "Set pose…")
        buttons = self._buttons = {about[0]: action(*about) for about in ACTIONS}
        actions = html.div(*buttons.values(), class_="actions")
        buttons["locate"] = locate
        buttons["send"].on("click", lambda event: self._aim_goal())
        locate.on("click", lambda event: self._aim_pose())
        buttons["cancel"].on("click", lambda event: self._forget_goal())
        buttons["remove"].on("click", lambda event: self._remove_robot())
        buttons["remove"].set(
            title="No data comes from this robot. The robot is shown again when data "
            "comes."
        )
        self.notes.append(self._problems)
        self.more.append(
            html.summary(text="More"),
            html.div(locate, stop_test(), class_="actions"),
            self._facts(),
            *self._speeds.elements,
            *self._own_stop.elements,
        )
        return [
            head,
            state,
            html.div(self._reason, self._goal.element, class_="reason-and-goal"),
            actions,
            self._cameras.element,
            self.notes,
            self.more,
        ]

    def _facts(self) -> Element:
        return html.dl(
            fact("x", self._x, " m"),
            fact("y", self._y, " m"),
            fact("Heading", self._heading, "°"),
            html.div(html.dt(text="Pose age"), self._age, class_="wide"),
            html.div(html.dt(text="Battery"), self._battery, class_="wide"),
            class_="facts",
        )

    def _remove_robot(self) -> None:
        robot, viewer = self._robot, self.map.page.viewer
        if robot is None or not viewer.may_drive(robot.id):
            return
        if robot.shown_state.name == "gone":
            self._remove(robot)

    def _forget_goal(self) -> None:
        if self._robot is not None:
            self._take_arrow(self._robot)


class RobotTriggers:
    """Forwards a robot's triggers to a card; a module of robots."""

    def __init__(self, robot: Robot, card: RobotCard) -> None:
        self.robot = robot
        self._card = card

    def on_odometry_update(self) -> None:
        """Show the pose."""
        self._card.show_pose()

    def on_report(self, report: object) -> None:
        """Show the drive state."""
        self._card.show_state()

    def on_state(self, state: object) -> None:
        """Show the state, which may change without a report."""
        self._card.show_state()

    def on_battery_update(self, battery: object) -> None:
        """Show the charge and the voltage that the message has."""
        self._card.show_battery(battery)


def fact(name: str, value: Element, unit: str) -> Element:
    """Return a value with its name above and its unit after it."""
    return html.div(
        html.dt(text=name), html.dd(value, html.span(text=unit, class_="minor unit"))
    )


def action(act: str, symbol: str, words: str) -> Element:
    """Return a button whose presses console.js handles."""
    return html.button(
        icon(symbol), words, type="button", class_="button", data_act=act
    )


def stop_test() -> Element:
    """Return the button that takes control, and then runs the stop test."""
    words = [html.span(text=text, class_=name) for name, text in TEST_WORDS]
    return html.button(
        icon("icon-test"),
        *words,
        type="button",
        class_="button",
        disabled=True,
        title="Moves the robot slowly, ends the commands and measures when the robot "
        "stops",
        data_act="stop-test",
        data_test="take",
    )


class RobotButtons:
    """Shows the buttons of the selected robot; a module of maps.

    Args:
        map: The map.
        card: The page's element to append to.
    """

    def __init__(self, map: Map, card: Element) -> None:
        self.map = map
        self.element = html.section(class_="card-buttons", aria_label="Buttons")
        card.append(self.element)
        self._shown: list[Any] = []
        self.on_select()

    def destroy(self) -> None:
        """Remove the buttons."""
        self._let_go()
        self.element.remove()

    def on_select(self) -> None:
        """Show the buttons of the robot that is selected now."""
        self._let_go()
        robot = self.map.selected
        modules = [] if robot is None else robot.modules
        self._shown = [
            module.show_buttons_in(self.element)
            for module in modules
            if hasattr(module, "show_buttons_in")
        ]

    def _let_go(self) -> None:
        for shown in self._shown:
            shown.remove()
        self._shown = []
