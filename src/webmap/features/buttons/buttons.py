"""Buttons that each do one thing on a robot: call, publish or set a parameter."""

import asyncio
import time
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from webmap.base.errors import ConfigError, WebMapError
from webmap.base.scope import Removable, Removal, Scope, keep
from webmap.base.tasks import spawn
from webmap.config.buttons import read_buttons
from webmap.core.base_page import page_of
from webmap.core.registry import robot_modules
from webmap.core.robot import Robot
from webmap.features.buttons.robot_button import RobotButton, declared_motion, values_of
from webmap.ros.bridge import Bridge
from webmap.ros.definitions import FLOATS, INTEGERS, TIMES, Field, UnknownType
from webmap.ros.message_check import Misfit
from webmap.ros.message_forms import entry_of, filled_in, hint, initial, leaves
from webmap.scene import html
from webmap.scene.element import Element, Event

MIN_QUESTION_TIME = 0.3
"""Seconds before the answer to a question counts, against double clicks."""

HEADER = "std_msgs/Header"
"""Forms leave out this type: its stamp is zero and its frame empty."""


class ButtonView:
    """One button on one page.

    Args:
        button: The button.
        parent: An element of the page, to append to.

    """

    def __init__(self, button: RobotButton, parent: Element) -> None:
        self.button = button
        self._viewer = page_of(parent).viewer
        self._form: FormView | None = None
        self._values: Any = None
        self._asked_at = 0.0
        spec = button.spec
        self._press = html.button(text=spec.label, type="button", class_="button go")
        self._press.on("click", self._pressed)
        self._age = html.span(class_="since")
        self._progress = html.progress(aria_label=f"{spec.label}: running")
        self._running = html.span(
            self._progress, self._age, class_="webmap-row minor running"
        )
        self._result = html.p(class_="minor result", role="status")
        self._question = html.div(class_="question", hidden=True)
        self._sheet = html.div(class_="sheet", hidden=True)
        self._head = html.div(self._press, self._running, class_="webmap-row head")
        parts = (self._head, self._question, self._sheet, self._result)
        self.element = html.div(*parts, class_="robot-button", data_label=spec.label)
        parent.append(self.element)
        button.on_change(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show whether and for how long it runs, why it is disabled, the result."""
        button = self.button
        running = button.state == "running"
        why = self._why_disabled()
        by = self._viewer.calls(button.by)
        self.element.set("data-state", button.state)
        self._press.set(disabled=why is not None)
        self._press.set(title=None if why is None else f"Not available: {why}")
        self._running.set(hidden=not running)
        if running:
            self._age.set_age(
                time.monotonic() - button.since,
                limit=button.spec.timeout,
                age_text=True,
            )
        self._result.text = _result_text(button, by, why)

    def _why_disabled(self) -> str | None:
        if not self._viewer.may_drive(self.button.robot.id):
            return "only operators of this robot can press this button"
        why, by = self.button.why_disabled, self.button.by
        return why and why.replace(f"by {by}", f"by {self._viewer.calls(by)}")

    async def _pressed(self, event: Event) -> None:
        if self._why_disabled() is not None:
            return
        if self.button.spec.form:
            self._open_form()
        else:
            await self._ask_or_run(None)

    async def _ask_or_run(self, values: Any) -> None:
        confirm = self.button.spec.question
        if confirm is None:
            await self._run(values)
            return
        self._values, self._asked_at = values, time.monotonic()
        yes = html.button(text="Yes", type="button", class_="button danger yes")
        no = html.button(text="No", type="button", class_="button no")
        yes.on("click", self._confirmed)
        no.on("click", lambda event: self._close(self._question))
        self._question.clear().append(html.p(text=confirm), no, yes)
        self._question.set(hidden=False)

    async def _confirmed(self, event: Event) -> None:
        if time.monotonic() - self._asked_at < MIN_QUESTION_TIME:
            return
        self._close(self._question)
        await self._run(self._values)

    async def _run(self, values: Any) -> None:
        # Only a current operator may press, whatever the page sends.
        if self._why_disabled() is None:
            self._close(self._sheet)
            # The press belongs to the robot: it continues when the page shows another
            # robot.
            by = self._viewer.operator
            await asyncio.shield(spawn(self.button.press(values, by=by)))

    def _open_form(self) -> None:
        self._close(self._question)
        try:
            form = FormView(self.button.fields(), values_of(self.button.spec))
        except UnknownType as error:
            self._form = None
            self._sheet.clear().append(*self._unknown(error))
        except WebMapError as error:
            self._form = None
            self._sheet.clear().append(html.p(text=str(error), class_="wrong"))
        else:
            self._form = form
            self._sheet.clear().append(form.element, self._buttons("Run", self._fill))
        self._sheet.set(hidden=False)

    def _unknown(self, error: UnknownType) -> list[Element]:
        return [
            html.p(text=f"The fields of {error.type} are unknown."),
            self._buttons("Get from the robot", self._ask_robot),
        ]

    def _buttons(self, label: str, act: Any) -> Element:
        go = html.button(text=label, type="button", class_="button yes")
        no = html.button(text="Cancel", type="button", class_="button no")
        go.on("click", act)
        no.on("click", lambda event: self._close(self._sheet))
        return html.div(no, go, class_="answers")

    async def _ask_robot(self, event: Event) -> None:
        if self._why_disabled() is not None:
            return
        try:
            await self.button.ask_fields()
        except WebMapError as error:
            self._sheet.clear().append(html.p(text=f"{error}", class_="wrong"))
            return
        self._open_form()

    async def _fill(self, event: Event) -> None:
        if self._form is None:
            return
        try:
            message = self._form.message(ros2=self.button.ros2)
        except Misfit as error:
            self._result.text = f"Not done: {error}"
            return
        is_value = self.button.spec.kind == "parameter"
        await self._ask_or_run(message["value"] if is_value else message)

    def _close(self, part: Element) -> None:
        part.clear().set(hidden=True)
        if part is self._sheet:
            self._form = None


def _result_text(button: RobotButton, by: str, why: str | None) -> str:
    """Return the text under a button that cannot be pressed because of ``why``."""
    if button.state == "running":
        return f"Running, started by {by}"
    return button.result or (f"Not available: {why}" if why else "")


class FormView:
    """Inputs for the fields of a type, and their values.

    Args:
        fields: The fields of the type.
        given: Initial values as plain data; all other fields have their defaults.
    """

    def __init__(self, fields: Sequence[Field], given: Mapping[str, Any]) -> None:
        self.fields = [field for field in fields if field.type != HEADER]
        kept = {name: given[name] for name in given if name != "header"}
        start = initial(self.fields, kept)
        self._header = {"header": given["header"]} if "header" in given else {}
        self.entries: dict[str, str | bool] = {
            path: entry_of(field, _at(start, path))
            for path, field in leaves(self.fields)
        }
        self._inputs: dict[str, Element] = {}
        self._errors: dict[str, Element] = {}
        self.element: Element = html.div(class_="message-form")
        self._fill(self.element, self.fields, "")
        if not self.entries:
            self.element.append(html.p(text="No fields to fill in."))

    def message(self, *, ros2: bool) -> dict[str, Any]:
        """Return the message with the form's values.

        Raises:
            Misfit: If an entry is not valid; the form shows which.
        """
        for path, error in self._errors.items():
            error.text = ""
            self._inputs[path].unset("aria-invalid")
        try:
            message = filled_in(self.fields, self.entries, ros2=ros2)
        except Misfit as error:
            self._show(error)
            raise
        return {**self._header, **message}

    def _show(self, error: Misfit) -> None:
        path = error.path
        while path and path not in self._errors:
            path = path[: max(path.rfind("."), path.rfind("["), 0)]
        if path:
            self._errors[path].text = error.reason
            self._inputs[path].set("aria-invalid", "true")

    def _fill(self, parent: Element, fields: Sequence[Field], outer: str) -> None:
        for field in fields:
            path = f"{outer}.{field.name}" if outer else field.name
            if field.fields is not None and not field.is_array:
                group = html.fieldset(html.legend(text=field.name))
                parent.append(group)
                self._fill(group, field.fields, path)
            else:
                parent.append(self._row(field, path))

    def _row(self, field: Field, path: str) -> Element:
        entry = self.entries[path]
        control = _control(field, entry)
        control.set("data-field", path)
        kind = "change" if control.tag == "select" or field.type == "bool" else "input"
        if field.is_array:
            kind = "input"
        control.on(kind, lambda event: self._changed(field, path, event))
        error = html.small(class_="wrong", role="alert")
        self._inputs[path], self._errors[path] = control, error
        name = html.span(text=field.name, class_="name")
        hint = html.small(text=_hint(field), class_="minor hint")
        return html.label(name, control, hint, error, class_="webmap-field field")

    def _changed(self, field: Field, path: str, event: Event) -> None:
        if field.type == "bool" and not field.is_array:
            self.entries[path] = bool(event.checked)
        else:
            self.entries[path] = event.value or ""


def _control(field: Field, entry: str | bool) -> Element:
    if field.is_array:
        return html.textarea(value=entry, rows=2, spellcheck="false")
    if field.constants is not None:
        return _choice(field, str(entry))
    if field.type == "bool":
        return html.input(type="checkbox", checked=bool(entry))
    if field.type in INTEGERS:
        low, high = INTEGERS[field.type]
        return html.input(type="number", value=entry, min=low, max=high, step=1)
    if field.type in (*FLOATS, *TIMES):
        return html.input(type="number", value=entry, step="any")
    text = html.input(type="text", value=entry, autocomplete="off", spellcheck="false")
    return text if field.longest is None else text.set(maxlength=field.longest)


def _choice(field: Field, entry: str) -> Element:
    assert field.constants is not None
    prefix = f"{field.name.upper()}_"
    choice = html.select()
    values = {str(value): name for name, value in field.constants.items()}
    if entry not in values:
        values = {entry: "", **values}
    for value, name in values.items():
        label = name.removeprefix(prefix).replace("_", " ").lower()
        option = html.option(text=f"{value} {label}".strip(), value=value)
        choice.append(option.set(selected=value == entry))
    return choice


def _hint(field: Field) -> str:
    if field.is_array or field.type in TIMES:
        return hint(field)
    if field.constants is not None or field.type in ("bool", "string"):
        return ""
    low, high = INTEGERS.get(field.type, (0, 2**64))
    return f"{low} to {high}" if high < 2**16 else ""


def _at(message: Mapping[str, Any], path: str) -> Any:
    value: Any = message
    for name in path.split("."):
        value = value[name]
    return value


@robot_modules.register
class Buttons:
    """Offers buttons: each calls a service, publishes a message or sets a parameter.

    A button can never move a robot: velocity, goals and cancel are refused by name and
    by type, when the button is made and again at each press.

    Fires ``on_button(button)`` on the robot's modules whenever a press begins or ends.

    Args:
        robot: The robot.
        bridge: The bridge of the robot's ROS system.
        buttons: A table for each button, with ``label``, one of ``service``, ``topic``
            and ``parameter``, and their settings.

    Raises:
        ConfigError: If a button is not valid, or would move a robot; the error names
            the button.
    """

    def __init__(
        self, robot: Robot, bridge: Bridge, buttons: Iterable[Mapping[str, Any]]
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
            KeyError: If there is no button with the label.
        """
        for button in self.buttons:
            if button.spec.label == label:
                return button
        raise KeyError(label)

    def show_buttons_in(self, element: Element) -> Removable:
        """Show the buttons in an element of a page.

        Args:
            element: The element to append the buttons to.

        Returns:
            A handle that removes the buttons; the end of the current scope removes them
            too.
        """
        scope = Scope(f"buttons of {self.robot.name}", self._failed)
        name = f"Buttons of {self.robot.name}"
        holder = html.div(class_="robot-buttons", role="group", aria_label=name)
        element.append(holder)
        with scope.active():
            keep(Removal(holder.remove))
            for button in self.buttons:
                ButtonView(button, holder)
        return keep(Removal(scope.close))

    def _failed(self, text: str, about: object) -> None:
        self.robot.report_error(text)

    def on_report(self, report: object) -> None:
        """Update the buttons when STOP begins or ends; STOP bars some buttons."""
        latched = bool(getattr(report, "latched", False))
        if latched != self._latched:
            self._latched = latched
            for button in self.buttons:
                button.notify()
