"""The texts and symbols of states, numbers and sentences."""

import math
import re
from typing import TYPE_CHECKING, NamedTuple

from webmap import svg

if TYPE_CHECKING:
    from webmap import Element, Robot

UNKNOWN = "\N{EN DASH}"
"""Shown in place of an unknown number."""

EMPTY = 0.1
"""The charge below which a low battery is nearly empty."""

NAME = re.compile(r"[\d/_:.]")
"""Characters that occur in a URL, topic or robot name, but not in plain words."""


class Look(NamedTuple):
    """How a state of a robot is shown, besides its text."""

    symbol: str
    """The symbol of console.html."""

    tone: str
    """``bad``, ``warn``, ``active``, or empty: the colour."""

    group: str
    """The words under which the list counts the robots: 2 *lost*."""


LOOKS = {
    "disobeying": Look("state-disobeying", "bad", "not obeying"),
    "unreachable": Look("state-down", "bad", "lost"),
    "no_bridge": Look("state-down", "bad", "lost"),
    "connecting": Look("state-waiting", "", "connecting"),
    "gone": Look("state-old", "", "lost"),
    "lost": Look("state-down", "bad", "lost"),
    "down": Look("state-down", "bad", "lost"),
    "unconfirmed": Look("state-stopped", "bad", "stopped"),
    "stopped": Look("state-stopped", "bad", "stopped"),
    "blocked": Look("state-blocked", "warn", "blocked"),
    "goal_failed": Look("goal-failed", "warn", "goal failed"),
    "battery_low": Look("state-battery", "warn", "battery low"),
    "other": Look("state-moving", "warn", "moving, not by WebMap"),
    "moving": Look("state-moving", "active", "moving, not by WebMap"),
    "changing": Look("state-stopping", "warn", "driven"),
    "stopping": Look("state-stopping", "warn", "driven"),
    "driven": Look("state-driving", "active", "driven"),
    "settling": Look("state-stopping", "warn", "driven"),
    "navigating": Look("goal-way", "active", "navigating"),
    "navigating_held": Look("goal-way", "active", "navigating"),
    "barred": Look("state-barred", "warn", "cannot be driven"),
    "barred_held": Look("state-barred", "warn", "cannot be driven"),
    "watched": Look("state-watched", "", "view only"),
    "held": Look("state-held", "active", "in control"),
    "free": Look("state-free", "", "free"),
}
"""The look of each state of a robot, in the order of ``STATE_TEXTS``."""

GROUPS = tuple(dict.fromkeys(look.group for look in LOOKS.values()))
"""The groups, the worst first."""

NEED_A_PERSON = (
    "not obeying",
    "lost",
    "stopped",
    "blocked",
    "goal failed",
    "battery low",
)
"""Groups of states that end only when a person does something."""


def icon(symbol: str) -> "Element":
    """Return a symbol of console.html as a decorative picture."""
    return svg.svg(svg.use(href=f"#{symbol}"), class_="icon").set("aria-hidden", "true")


def look_of(robot: "Robot") -> Look:
    """Return the look of a robot's state."""
    return LOOKS[robot.state.name]


def battery_tone(charge: float, low: float) -> str:
    """Return the tone of a charge that is low below ``low``; both from 0 to 1."""
    if charge >= low:
        return ""
    return "bad" if charge < EMPTY else "warn"


def number(value: float, digits: int = 2) -> str:
    """Return a number as text, and never minus zero."""
    if not math.isfinite(value):
        return UNKNOWN
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0 else text


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
