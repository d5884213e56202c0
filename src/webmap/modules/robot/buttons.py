"""Buttons that do one thing on a robot each: a call, a message, a parameter."""

from collections.abc import Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from webmap.core.button_spec import declared_motion, read_buttons
from webmap.core.button_view import ButtonView
from webmap.core.robot_button import RobotButton
from webmap.errors import ConfigError
from webmap.ros.bridge import Bridge
from webmap.scene import html
from webmap.scene.element import Element
from webmap.scope import Removable, Removal, Scope, keep

if TYPE_CHECKING:
    from webmap.core.robot import Robot


class Buttons:
    """Offers buttons: each calls a service, publishes a message or sets a parameter.

    Nothing that drives goes this way: velocity, goals and cancel are refused by name
    and by type, when the button is made and again at each press.

    Fires ``on_button(button)`` on the robot's modules whenever a press begins or ends.

    Args:
        robot: The robot.
        bridge: The link to its ROS system.
        buttons: A table for each, with ``label``, one of ``service``, ``topic`` and
            ``parameter``, and what goes with it.

    Raises:
        ConfigError: If a button makes no sense, or would move a robot; it is named.

    """

    def __init__(
        self, robot: "Robot", bridge: Bridge, buttons: Iterable[Mapping[str, Any]]
    ) -> None:
        self.robot = robot
        specs = read_buttons(buttons)
        for spec in specs:
            why = declared_motion(spec, bridge.url)
            if why is not None:
                raise ConfigError(f"button {spec.label!r}: {why}")
        self.buttons = [RobotButton(robot, bridge, spec) for spec in specs]
        self._latched = False
        for button in self.buttons:
            button.on_change(partial(robot.notify_modules, "on_button", button))

    def __getitem__(self, label: str) -> RobotButton:
        """Return the button with a label: ``await buttons["Dock"].press()``.

        Raises:
            KeyError: If there is none.

        """
        for button in self.buttons:
            if button.spec.label == label:
                return button
        raise KeyError(label)

    def show_buttons_in(self, element: Element) -> Removable:
        """Show the buttons in an element of a page.

        Args:
            element: What they are appended to.

        Returns:
            What takes them away; the end of the current scope does, too.

        """
        scope = Scope(f"buttons of {self.robot.name}", self._failed)
        holder = html.div(class_="robot-buttons")
        holder.set("role", "group")
        holder.set("aria-label", f"Buttons of {self.robot.name}")
        element.append(holder)
        with scope.active():
            keep(Removal(holder.remove))
            for button in self.buttons:
                ButtonView(button, holder)
        return keep(Removal(scope.close))

    def _failed(self, text: str, about: object) -> None:
        self.robot.report_error(text)

    def on_report(self, report: object) -> None:
        """Look whether STOP stands, which bars buttons."""
        latched = bool(getattr(report, "latched", False))
        if latched != self._latched:
            self._latched = latched
            for button in self.buttons:
                button.notify()
