"""How it stands with the selected robot's goal, on its card."""

import time
from typing import TYPE_CHECKING, Protocol

from webmap import html, svg

if TYPE_CHECKING:
    from webmap import Robot

LOOKS = {
    "sent": ("Goal sent", "goal-sent", "active"),
    "accepted": ("Goal accepted", "goal-sent", "active"),
    "under way": ("Goal under way", "goal-way", "active"),
    "cancelling": ("Cancelling its goal", "goal-cancelled", "warn"),
    "unknown": ("Goal: not known how it goes", "goal-unknown", "warn"),
    "reached": ("Reached its goal", "goal-reached", "good"),
    "failed": ("Goal failed", "goal-failed", "bad"),
    "cancelled": ("Goal cancelled", "goal-cancelled", ""),
}
"""The words, the symbol of console.html and the tone of each state."""


LINGER = 30.0
"""Seconds for which a goal that was reached or cancelled is shown; one that failed is
shown until the next."""


class Goal(Protocol):
    """What a robot's report says of its goal, as far as it is told in numbers."""

    @property
    def state(self) -> str:
        """How it stands."""

    @property
    def left(self) -> float | None:
        """The rest of the way, in metres."""

    @property
    def eta(self) -> float | None:
        """The rest of the time, in seconds."""

    @property
    def time(self) -> float | None:
        """How long it has been under way, in seconds."""

    @property
    def recoveries(self) -> int | None:
        """How often the robot had to free itself."""


class GoalLine:
    """One line of the card: what the robot's goal has come to, and how far it is."""

    def __init__(self) -> None:
        self._use = svg.use(href="#goal-sent")
        shape = svg.svg(self._use, class_="shape").set("aria-hidden", "true")
        self._words = html.span()
        self._figures = html.span(class_="figures")
        self.element = html.p(
            shape, html.span(self._words, self._figures), class_="goal", hidden=True
        )

    def show(self, robot: "Robot") -> None:
        """Show how it stands with the goal of a robot; nothing if it has none."""
        goal = None if robot.report is None else robot.report.goal
        ended = robot.goal_ended_at
        past = ended is not None and time.monotonic() - ended > LINGER
        if goal is None or (past and goal.state != "failed"):
            self.element.set(hidden=True)
            return
        self.element.set(hidden=False)
        words, shape, tone = LOOKS[goal.state]
        self._use.set(href=f"#{shape}")
        self.element.set("data-tone", tone or None)
        self._words.text = f"{words}: {goal.why}" if goal.why else words
        self._figures.text = figures(goal)


def figures(goal: Goal) -> str:
    """Return what the robot tells of a goal that it follows, in numbers with units."""
    if goal.state not in ("under way", "cancelling"):
        return ""
    parts = []
    if goal.left is not None:
        parts.append(f"{goal.left:.1f} m to go")
    if goal.eta is not None:
        parts.append(f"about {goal.eta:.0f} s")
    if goal.time is not None:
        parts.append(f"{goal.time:.0f} s under way")
    if goal.recoveries:
        times = "once" if goal.recoveries == 1 else f"{goal.recoveries} times"
        parts.append(f"got stuck {times}")
    return ", ".join(parts)
