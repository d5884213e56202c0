"""The texts and symbols of states, numbers and sentences."""

import math
import re
from typing import TYPE_CHECKING

from webmap import svg

if TYPE_CHECKING:
    from webmap import Element, Robot

UNKNOWN = "\N{EN DASH}"
"""Shown in place of an unknown number."""

LOW, EMPTY = 0.2, 0.1
"""Charges below which a battery is low or nearly empty."""

NAME = re.compile(r"[\d/_:.]")
"""Characters that occur in a URL, topic or robot name, but not in plain words."""

LOOKS = {
    "no_bridge": ("state-down", "bad"),
    "connecting": ("state-waiting", ""),
    "gone": ("state-old", ""),
    "watched": ("state-watched", ""),
    "stopped": ("state-stopped", "bad"),
    "unconfirmed": ("state-stopped", "bad"),
    "down": ("state-down", "bad"),
    "changing": ("state-stopping", "warn"),
    "stopping": ("state-stopping", "warn"),
    "blocked": ("state-driving", "warn"),
    "driven": ("state-driving", "active"),
    "navigating": ("goal-way", "active"),
    "navigating_held": ("goal-way", "active"),
    "settling": ("state-stopping", "warn"),
    "moving": ("goal-way", "active"),
    "barred": ("state-down", "warn"),
    "barred_held": ("state-down", "warn"),
    "other": ("state-driving", "warn"),
    "held": ("state-held", "active"),
    "free": ("state-free", ""),
}
"""The symbol of console.html and the tone of each state of a robot."""


def icon(symbol: str) -> "Element":
    """Return a symbol of console.html as a decorative picture."""
    return svg.svg(svg.use(href=f"#{symbol}"), class_="icon").set("aria-hidden", "true")


def look_of(robot: "Robot") -> tuple[str, str]:
    """Return the symbol and the tone of a robot's state."""
    shape, tone = LOOKS[robot.state.name]
    another = robot.report is not None and robot.report.other_writer is not None
    if another and robot.state.name not in ("no_bridge", "connecting", "other"):
        tone = "bad"
    return shape, tone


def battery_tone(charge: float) -> str:
    """Return the tone of a charge between 0 and 1."""
    if charge < EMPTY:
        return "bad"
    return "warn" if charge < LOW else ""


def number(value: float, digits: int = 2) -> str:
    """Return a number as text: with a real minus sign, and never minus zero."""
    if not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.{digits}f}"
    if float(text) == 0:
        text = text.removeprefix("-")
    return text.replace("-", "\N{MINUS SIGN}")


def heading(yaw: float) -> str:
    """Return a yaw in radians as whole degrees from 0 to 359."""
    return str(round(math.degrees(yaw)) % 360)


def sentence(text: str) -> str:
    """Return a text of the gate as a sentence.

    A name at the beginning, such as a URL or a topic, keeps its small letter.
    """
    if not text.strip():
        return ""
    first = text.split(maxsplit=1)[0].rstrip(".,:;")
    start = text[:1] if NAME.search(first) else text[:1].upper()
    return f"{start}{text[1:].rstrip('.')}."
