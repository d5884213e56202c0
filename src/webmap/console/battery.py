"""The charge of a battery, as a picture and in percent."""

from typing import Protocol

from webmap import html, svg
from webmap.console.words import battery_tone

FULL = 18.0
"""The width of the picture's charge when the battery is full."""


class Charge(Protocol):
    """Something that knows a charge between 0 and 1, or None."""

    charge: float | None


class BatteryMark:
    """A battery that is as full as the robot's, with the percentage beside it."""

    def __init__(self) -> None:
        self._fill = svg.rect(x=2.5, y=2.5, width=0, height=8, rx=1, class_="charge")
        self._text = html.span()
        picture = svg.svg(
            svg.rect(x=0.75, y=0.75, width=21.5, height=11.5, rx=2.5),
            self._fill,
            svg.rect(x=23.5, y=4, width=2, height=5, rx=1, class_="pole"),
            viewBox="0 0 26 13",
        )
        picture.set("aria-hidden", "true")
        name = html.span(text="battery ", class_="unseen")
        self.element = html.span(
            picture, name, self._text, class_="battery", hidden=True
        )

    def show(self, battery: Charge) -> None:
        """Show a charge; nothing is shown of one that is not known."""
        charge = battery.charge
        self.element.set(hidden=charge is None)
        if charge is None:
            return
        self._fill.set(width=round(FULL * charge, 1))
        self._text.text = f"{round(100 * charge)} %"
        self.element.set("data-tone", battery_tone(charge) or None)
