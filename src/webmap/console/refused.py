"""What pages sent in vain, for whoever looks after this installation."""

from typing import TYPE_CHECKING

from webmap import html, refusals
from webmap.console.robot_card import icon

if TYPE_CHECKING:
    from datetime import datetime

    from webmap import Element

SHOWN = 12
"""How many people are listed."""


class RefusedList:
    """A count of refused messages that unfolds into who sent them, and what.

    It is there once there is one, and not for those who may only look.

    Args:
        element: The page's element to fill.
        role: What the viewer may do.

    """

    def __init__(self, element: "Element", role: str) -> None:
        self._may = role != "viewer"
        self._text = html.span()
        self._newest = html.span(class_="newest")
        self._list = html.ul(class_="bridge-list refused-list")
        summary = html.summary(self._text, self._newest, icon("icon-chevron"))
        summary.set(
            "title", "Messages of pages that were not taken. They moved nothing."
        )
        self._details = html.details(summary, self._list).set(hidden=True)
        self._details.set("data-webmap-menu", "")
        element.append(self._details)
        self._shown: object = ()
        self.poll()

    def poll(self) -> None:
        """Look at the counts again."""
        rows = refusals.rows
        if not self._may or rows == self._shown:
            return
        self._shown = rows
        self._details.set(hidden=not rows)
        self._text.text = f"{refusals.total} refused"
        self._newest.text = rows[0].last if rows else ""
        self._list.clear()
        for row in rows[:SHOWN]:
            self._list.append(line(row.by, row.count, row.last, row.at))


def line(by: str, count: int, last: str, at: "datetime") -> "Element":
    """Return how many of one person's messages were refused, and the last of them."""
    return html.li(
        html.span(text=by, class_="url"),
        html.span(text=f"{count}, last at {at.astimezone():%H:%M:%S}", class_="word"),
        html.span(text=last, class_="refused-last"),
    )
