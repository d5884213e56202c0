"""A robot's button on one page: pressed, asked back, filled in, and what came of it."""

import asyncio
import time
from typing import Any

from webmap.core.form_view import FormView
from webmap.core.page import page_of
from webmap.core.robot_button import RobotButton, values_of
from webmap.core.tasks import spawn
from webmap.errors import WebMapError
from webmap.ros.form_fields import UnknownType
from webmap.ros.message_forms import FormError
from webmap.scene import html
from webmap.scene.element import Element
from webmap.scene.events import Event

MAY_PRESS = ("operator", "admin")
"""Roles of viewers who may."""

ASKED_FOR = 0.3
"""Seconds for which a question stands before its answer counts: no double click."""


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
        self._asked = 0.0
        spec = button.spec
        self._press = html.button(text=spec.label, type="button", class_="button go")
        self._press.on("click", self._pressed)
        self._age = html.span(class_="since")
        self._progress = html.progress()
        self._progress.set("aria-label", f"{spec.label}: under way")
        self._running = html.span(self._progress, self._age, class_="running")
        self._result = html.p(class_="result")
        self._result.set("role", "status")
        self._question = html.div(class_="question", hidden=True)
        self._sheet = html.div(class_="sheet", hidden=True)
        self._head = html.div(self._press, self._running, class_="head")
        self.element: Element = html.div(
            self._head, self._question, self._sheet, self._result, class_="robot-button"
        )
        self.element.set("data-label", spec.label)
        parent.append(self.element)
        button.on_change(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show how the button is now."""
        button = self.button
        running = button.state == "running"
        why = self._barred()
        self.element.set("data-state", button.state)
        self._press.set(disabled=why is not None)
        self._press.set(title=None if why is None else f"Not now: {why}")
        self._running.set(hidden=not running)
        if running:
            self._age.set_age(
                time.monotonic() - button.since,
                limit=button.spec.timeout,
                age_text=True,
            )
        self._result.text = _said(button, why)

    def _barred(self) -> str | None:
        if self._viewer.role not in MAY_PRESS:
            return "only an operator may"
        return self.button.barred

    async def _pressed(self, event: Event) -> None:
        if self._barred() is not None:
            return
        if self.button.spec.form:
            self._open_form()
        else:
            await self._ask_or_run(None)

    async def _ask_or_run(self, values: Any) -> None:
        confirm = self.button.spec.confirm
        if confirm is None:
            await self._run(values)
            return
        self._values, self._asked = values, time.monotonic()
        yes = html.button(text="Yes", type="button", class_="button danger yes")
        no = html.button(text="No", type="button", class_="button no")
        yes.on("click", self._confirmed)
        no.on("click", lambda event: self._close(self._question))
        self._question.clear().append(html.p(text=confirm), no, yes)
        self._question.set(hidden=False)

    async def _confirmed(self, event: Event) -> None:
        if time.monotonic() - self._asked < ASKED_FOR:
            return
        self._close(self._question)
        await self._run(self._values)

    async def _run(self, values: Any) -> None:
        # Whoever is no operator any more, or was never one, has no say.
        if self._barred() is None:
            self._close(self._sheet)
            # A press is the robot's: it goes on when the viewer looks elsewhere.
            await asyncio.shield(spawn(self.button.press(values, by=self._viewer.name)))

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
            self._sheet.clear().append(form.element, self._buttons("Do it", self._fill))
        self._sheet.set(hidden=False)

    def _unknown(self, error: UnknownType) -> list[Element]:
        return [
            html.p(text=f"The fields of {error.type} are not known here."),
            self._buttons("Ask the robot", self._ask_robot),
        ]

    def _buttons(self, words: str, act: Any) -> Element:
        go = html.button(text=words, type="button", class_="button yes")
        no = html.button(text="Cancel", type="button", class_="button no")
        go.on("click", act)
        no.on("click", lambda event: self._close(self._sheet))
        return html.div(no, go, class_="answers")

    async def _ask_robot(self, event: Event) -> None:
        if self._barred() is not None:
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
        except FormError as error:
            self._result.text = f"Not done: {error}"
            return
        is_value = self.button.spec.kind == "parameter"
        await self._ask_or_run(message["value"] if is_value else message)

    def _close(self, part: Element) -> None:
        part.clear().set(hidden=True)
        if part is self._sheet:
            self._form = None


def _said(button: RobotButton, why: str | None) -> str:
    """Return what stands under a button that cannot be pressed because of ``why``."""
    if button.state == "running":
        return f"Under way, for {button.by}"
    return button.words or (f"Not now: {why}" if why else "")
