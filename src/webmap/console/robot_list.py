"""The list of robots: name, age of the pose, battery, operator."""

import math
from typing import Any

from webmap import Element, Map, Robot, html, svg
from webmap.config.robot import BATTERY_LOW
from webmap.console.robot_looks import GROUPS, LOOKS, battery_tone, needs_person

FULL = 18.0
"""Width of the charge in the battery symbol when the battery is full."""

AGE_LIMIT = 1.0
"""Seconds after which a pose is shown as stale."""

FEW = 8
"""Robots that need no search."""


class BatteryMark:
    """A battery symbol that shows the robot's charge, with the percentage beside it."""

    def __init__(self) -> None:
        self._fill = svg.rect(
            x=2.5, y=2.5, width=0, height=8, rx=1, class_="solid charge"
        )
        self._text = html.span()
        picture = svg.svg(
            svg.rect(x=0.75, y=0.75, width=21.5, height=11.5, rx=2.5),
            self._fill,
            svg.rect(x=23.5, y=4, width=2, height=5, rx=1, class_="solid"),
            viewBox="0 0 26 13",
            aria_hidden="true",
        )
        name = html.span(text="battery ", class_="unseen")
        self.element = html.span(
            picture, name, self._text, class_="minor battery", hidden=True
        )

    def show(self, charge: float | None, low: float = BATTERY_LOW) -> None:
        """Show a charge from 0 to 1, low below ``low``; hide an unknown charge."""
        self.element.set(hidden=charge is None)
        if charge is None:
            return
        self._fill.set(width=round(FULL * charge, 1))
        self._text.text = f"{round(100 * charge)} %"
        self.element.set("data-tone", battery_tone(charge, low) or None)


class RobotList:
    """A line for each robot of a map, to see and select the robot; a module of maps.

    Args:
        map: The map.
        element: The page's ``ul``.
        none: What the page shows without robots.
        search: What the page shows with many robots.
    """

    def __init__(
        self, map: Map, element: Element, *, none: Element, search: Element
    ) -> None:
        self.map = map
        self.element = element
        self._none = none
        self._search = search
        self._rows: dict[int, Row] = {}
        for robot in map.robots:
            self.on_add_robot(robot)

    def destroy(self) -> None:
        """Remove all lines."""
        for row in tuple(self._rows.values()):
            self.on_remove_robot(row.robot)

    def on_add_robot(self, robot: Robot) -> None:
        """Add the robot's line."""
        row = robot.add_module(Row, self.map)
        self._rows[id(robot)] = row
        self.element.append(row.element)
        row.on_state()
        self._show_count()

    def on_remove_robot(self, robot: Robot) -> None:
        """Remove the robot's line."""
        row = self._rows.pop(id(robot), None)
        if row is not None:
            robot.remove_module(row)
        self._show_count()

    def on_select(self) -> None:
        """Mark the line of the selected robot."""
        for row in self._rows.values():
            row.show_selected(self.map.selected is row.robot)

    def on_mark(self) -> None:
        """Mark the lines of the other robots that are selected for goals."""
        for row in self._rows.values():
            row.show_marked(row.robot in self.map.marked)

    def poll(self) -> None:
        """Update the values without a trigger, such as ages."""
        for row in self._rows.values():
            row.poll()

    def _show_count(self) -> None:
        self._none.set(hidden=bool(self._rows))
        self._search.set(hidden=len(self._rows) <= FEW)


class Row:
    """One robot's line in the list on one page; a module of robots."""

    def __init__(self, robot: Robot, map: Map) -> None:
        self.robot = robot
        self._person = map.page.viewer.operator.person
        self._shape = StateShape()
        self._words = StateWords(html.span())
        self._battery = BatteryMark()
        self._age = html.span(class_="minor age")
        self._button = html.button(
            *self._shape.elements,
            html.span(text=robot.name, class_="name", dir="auto", title=robot.name),
            self._words.element,
            self._battery.element,
            self._age,
            type="button",
            aria_pressed="false",
        )
        self._button.on("click", lambda event: map.pick(robot, event), role="viewer")
        self._besides = html.input(
            type="checkbox",
            aria_label=f"Also select {robot.name}",
            title="Also select this robot for goals",
        )
        self._besides.on(
            "change",
            lambda event: map.set_marked(robot, bool(event.checked)),
            role="viewer",
        )
        label = html.label(self._besides, class_="besides")
        self.element = html.li(self._button, label, class_="row", data_robot=robot.id)
        self._age.set_age(math.inf, limit=AGE_LIMIT, age_text=True)
        self.element.set_age(math.inf, limit=AGE_LIMIT)
        self._shown: tuple[object, ...] | None = None

    def destroy(self) -> None:
        """Remove the line."""
        self.element.remove()

    def on_state(self, state: object = None) -> None:
        """Show the state, and what the list is ordered and grouped by."""
        robot, now = self.robot, self.robot.shown_state
        charge, bridge = robot.charge, robot.pose_source.bridge
        tag = next(iter(robot.tags), "")
        address = "" if bridge is None else bridge.name or bridge.url
        shown = (now, charge, robot.battery_low, tag, address)
        if shown == self._shown:
            return  # as nearly always, of each robot four times a second
        self._shown = shown
        look = LOOKS[now.name]
        # One fault of a bridge is one group, whatever else is lost.
        apart = address if now.name == "no_bridge" else ""
        self._shape.show(look.symbol)
        self._words.show(self.robot, self._person)
        self._battery.show(charge, robot.battery_low)
        for name, value in {
            "tone": look.tone,
            "state": now.name,
            "group": f"without a connection to {apart}" if apart else look.group,
            "need": "one" if apart else "each" if needs_person(robot) else "",
            "rank": str(GROUPS.index(look.group)),
            "tag": tag,
            "bridge": address,
            "charge": "" if charge is None else str(round(100 * charge)),
        }.items():
            self.element.set(f"data-{name}", value or None)

    def on_battery_update(self, battery: Any) -> None:
        """Show the charge, by which the list may be ordered."""
        self.on_state()

    def show_selected(self, selected: bool) -> None:
        """Mark the line if its robot is selected."""
        self._button.set("aria-pressed", "true" if selected else "false")

    def show_marked(self, marked: bool) -> None:
        """Tick the box if the robot is also selected for goals."""
        self._besides.set(checked=marked)
        self.element.set("data-marked", "" if marked else None)

    def poll(self) -> None:
        """Update the age of the pose, and the tag and the bridge of the robot."""
        age = self.robot.pose_age
        if age is not None:
            self._age.set_age(age)
            self.element.set_age(age)
        self.on_state()


class StateWords:
    """The words of a robot's activity and of its conditions, each in its own colour.

    Args:
        element: The element to fill.
    """

    def __init__(self, element: Element) -> None:
        self.element = element.set("class", "state")
        self._shown: object = None
        self._activity = html.span(class_="holder")
        self._own = html.span(class_="you")
        self._conditions = html.span()
        old = html.span(text="Stale data", class_="old")
        element.append(old, self._activity, self._own)

    def show(self, robot: Robot, person: str) -> None:
        """Show the state of a robot on a page of a person."""
        state = robot.shown_state
        if state == self._shown:
            return  # a status that is written again may be read aloud again
        self._shown = state
        tone = LOOKS[state.activity].tone or None
        self._activity.set("data-tone", tone).text = state.activity_for(person)
        self._own.set("data-tone", tone).text = state.own_text
        self._conditions.remove()
        if state.conditions:
            self._conditions.text = state.besides_text
            self._conditions.set("data-tone", LOOKS[state.conditions[0]].tone)
            self.element.append(self._conditions)


class StateShape:
    """The shape of a robot's state; for a stale pose the page shows a clock."""

    def __init__(self) -> None:
        self._use = svg.use(href="#state-waiting")
        old = svg.use(href="#state-old")
        self.elements = (
            svg.svg(self._use, class_="shape now", aria_hidden="true"),
            svg.svg(old, class_="shape old", aria_hidden="true"),
        )

    def show(self, shape: str) -> None:
        """Show a symbol of console.html."""
        self._use.set(href=f"#{shape}")
