"""The button that tries a call that hangs, with what that does said before."""

from typing import TYPE_CHECKING

from webmap import html

if TYPE_CHECKING:
    from webmap import Element
    from webmap.console.checkup import Checkup

MAY_TRY = ("operator", "admin")
"""Roles of viewers who may."""

WORDS = (
    "Does a service that hangs hold up what comes after it on a socket? To find out, "
    "WebMap offers a service of its own to the ROS system for a moment, under a name "
    "that nobody else has. It calls that over a link of its own, leaves it unanswered "
    "for a second, and asks rosapi for the time meanwhile.",
    "No node of a robot is called, and velocity goes over other links. At the worst "
    "the bridge keeps everybody waiting for that second: try it while nobody drives.",
)


class TryCall:
    """A button and the question that it asks, on one page.

    Args:
        checkup: What tries it, and has the report.
        role: What the viewer may do.

    """

    def __init__(self, checkup: "Checkup", role: str) -> None:
        self._checkup = checkup
        self._may = role in MAY_TRY
        self.button: Element = html.button("Try a call", type="button", class_="button")
        self.button.set(hidden=not self._may)
        self.button.on("click", lambda event: self._ask(True))
        self._yes = html.button("Try it", type="button", class_="button")
        self._yes.on("click", lambda event: self._agreed())
        no = html.button("Not now", type="button", class_="button")
        no.on("click", lambda event: self._ask(False))
        self.question: Element = html.div(
            *(html.p(text=text) for text in WORDS),
            html.div(self._yes, no, class_="doctor-answers"),
            class_="doctor-question",
            role="group",
            hidden=True,
        )
        self.question.set("aria-label", "Try a call that hangs")
        self.poll()

    def poll(self) -> None:
        """Look whether it can be tried now."""
        for button in (self.button, self._yes):
            button.set(disabled=not self._checkup.can_try)

    def _ask(self, asked: bool) -> None:
        self.question.set(hidden=not (asked and self._may))

    def _agreed(self) -> None:
        self._ask(False)
        # Whoever may only look has no say, whatever their page sends.
        if self._may:
            self._checkup.try_call()
