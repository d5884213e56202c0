"""A form for a message on one page: an input for each field, by its type."""

from collections.abc import Mapping, Sequence
from typing import Any

from webmap.ros.form_fields import FLOATS, INTEGERS, Field
from webmap.ros.message_forms import (
    FormError,
    entry_of,
    expectation,
    filled_in,
    initial,
    leaves,
)
from webmap.scene import html
from webmap.scene.element import Element
from webmap.scene.events import Event

HEADER = "std_msgs/Header"
"""What nobody fills in by hand: a stamp of zero, and no frame."""


class FormView:
    """Inputs for the fields of a type, and what stands in them.

    Args:
        fields: Those of the type.
        given: Plain data that stands in it at first; the defaults for the rest.

    """

    def __init__(self, fields: Sequence[Field], given: Mapping[str, Any]) -> None:
        self.fields = [field for field in fields if field.type != HEADER]
        kept = {name: given[name] for name in given if name != "header"}
        start = initial(self.fields, kept)
        self._header = {"header": given["header"]} if "header" in given else {}
        self.entries: dict[str, str | bool] = {
            way: entry_of(field, _at(start, way)) for way, field in leaves(self.fields)
        }
        self._inputs: dict[str, Element] = {}
        self._errors: dict[str, Element] = {}
        self.element: Element = html.div(class_="message-form")
        self._fill(self.element, self.fields, "")
        if not self.entries:
            self.element.append(html.p(text="There is nothing to fill in."))

    def message(self, *, ros2: bool) -> dict[str, Any]:
        """Return the message that stands in the form.

        Raises:
            FormError: If an entry makes no sense; the form shows which.

        """
        for way, error in self._errors.items():
            error.text = ""
            self._inputs[way].unset("aria-invalid")
        try:
            message = filled_in(self.fields, self.entries, ros2=ros2)
        except FormError as error:
            self._show(error)
            raise
        return {**self._header, **message}

    def _show(self, error: FormError) -> None:
        way = error.path
        while way and way not in self._errors:
            way = way[: max(way.rfind("."), way.rfind("["), 0)]
        if way:
            self._errors[way].text = error.words
            self._inputs[way].set("aria-invalid", "true")

    def _fill(self, parent: Element, fields: Sequence[Field], path: str) -> None:
        for field in fields:
            way = f"{path}.{field.name}" if path else field.name
            if field.fields is not None and not field.is_array:
                group = html.fieldset(html.legend(text=field.name))
                parent.append(group)
                self._fill(group, field.fields, way)
            else:
                parent.append(self._row(field, way))

    def _row(self, field: Field, way: str) -> Element:
        entry = self.entries[way]
        control = _control(field, entry)
        control.set("data-field", way)
        kind = "change" if control.tag == "select" or field.type == "bool" else "input"
        if field.is_array:
            kind = "input"
        control.on(kind, lambda event: self._changed(field, way, event))
        error = html.small(class_="wrong")
        error.set("role", "alert")
        self._inputs[way], self._errors[way] = control, error
        name = html.span(text=field.name, class_="name")
        hint = html.small(text=_hint(field), class_="hint")
        return html.label(name, control, hint, error, class_="field")

    def _changed(self, field: Field, way: str, event: Event) -> None:
        if field.type == "bool" and not field.is_array:
            self.entries[way] = bool(event.checked)
        else:
            self.entries[way] = event.value or ""


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
    if field.type in (*FLOATS, "time", "duration"):
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
        words = name.removeprefix(prefix).replace("_", " ").lower()
        option = html.option(text=f"{value} {words}".strip(), value=value)
        choice.append(option.set(selected=value == entry))
    return choice


def _hint(field: Field) -> str:
    if field.is_array or field.type in ("time", "duration"):
        return expectation(field)
    if field.constants is not None or field.type in ("bool", "string"):
        return ""
    low, high = INTEGERS.get(field.type, (0, 2**64))
    return f"{low} to {high}" if high < 2**16 else ""


def _at(message: Mapping[str, Any], way: str) -> Any:
    value: Any = message
    for name in way.split("."):
        value = value[name]
    return value
