"""Lists that unfold from the page's bar: bridges and refused messages."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from webmap import html, refusals
from webmap.base.counted import counted
from webmap.console.texts import icon

if TYPE_CHECKING:
    from datetime import datetime

    from webmap import Bridge, Element

WORST = ("lost", "connecting", "late")
"""States that are not well, the worst first."""

LATE = 0.5
"""Seconds of delay from which a bridge's connection is shown as slow."""


class BridgeList:
    """A summary of the bridges that unfolds into a list of them.

    Args:
        element: The page's element to fill.
        bridges: The bridges; more may be added to the list later.
        button_of: Returns the button of a bridge.
    """

    def __init__(
        self,
        element: "Element",
        bridges: Sequence["Bridge"],
        button_of: Callable[["Bridge"], "Element"],
    ) -> None:
        self._bridges = bridges
        self._button_of = button_of
        self._text = html.span()
        self._summary = html.summary(
            html.span(class_="dot").set("aria-hidden", "true"),
            self._text,
            icon("icon-chevron"),
        )
        self._words: list[Element] = []
        self._lines: list[Element] = []
        self._list = html.ul(class_="bridge-list")
        element.append(
            html.details(self._summary, self._list).set("data-webmap-menu", "")
        )
        self.poll()

    def _add(self, bridge: "Bridge") -> None:
        word = html.span(class_="word")
        line = html.li(
            html.span(class_="dot").set("aria-hidden", "true"),
            html.span(text=bridge.name or bridge.url, class_="url"),
            word,
            self._button_of(bridge),
        ).set("title", bridge.url)
        self._words.append(word)
        self._lines.append(line)
        self._list.append(line)

    def poll(self) -> None:
        """Update the list."""
        for bridge in self._bridges[len(self._lines) :]:
            self._add(bridge)
        states = [describe_link(bridge) for bridge in self._bridges]
        for line, word, (link, text) in zip(
            self._lines, self._words, states, strict=True
        ):
            line.set("data-link", link)
            word.text = text
        links = {link for link, _ in states}
        worst = next((name for name in WORST if name in links), "open")
        self._summary.set("data-link", worst)
        self._text.text = summary([link for link, _ in states])


def describe_link(bridge: "Bridge") -> tuple[str, str]:
    """Return the page's name for a bridge's state, and a sentence that describes it."""
    if bridge.state == "open" and bridge.lag >= LATE:
        return "late", f"slow connection, {bridge.lag:.1f} s"
    if bridge.state == "open":
        return "open", "open"
    if bridge.lost:
        why = f": {bridge.trouble}" if bridge.trouble else ""
        return "lost", f"no connection{why}; reconnecting"
    return "connecting", "connecting"


def summary(links: Sequence[str]) -> str:
    """Return a short text for the states of all bridges."""
    total, open_ = len(links), sum(link in ("open", "late") for link in links)
    if total == 0:
        return "No bridge yet"
    late = links.count("late")
    if total == 1:
        return {
            "open": "Bridge open",
            "lost": "No connection to the bridge",
            "late": "Bridge slow",
        }.get(links[0], "Connecting to the bridge")
    if late:
        return f"{open_} of {total} bridges open, {late} slow"
    if open_ == total:
        return f"{total} bridges open"
    return f"{open_} of {total} bridges open"


SHOWN = 12
"""The greatest number of people that the list shows."""


class RefusedList:
    """A count of refused messages that unfolds into their senders and contents.

    Hidden until a message is refused, and always hidden from viewers.

    Args:
        element: The page's element to fill.
        role: The role of the page's user.
    """

    def __init__(self, element: "Element", role: str) -> None:
        self._may = role != "viewer"
        self._text = html.span()
        self._newest = html.span(class_="newest")
        self._list = html.ul(class_="bridge-list refused-list")
        summary = html.summary(self._text, self._newest, icon("icon-chevron"))
        summary.set(
            "title", "Refused messages from pages. They did not move any robot."
        )
        self._details = html.details(summary, self._list).set(hidden=True)
        self._details.set("data-webmap-menu", "")
        element.append(self._details)
        self._shown: object = ()
        self.poll()

    def poll(self) -> None:
        """Update the counts."""
        rows = refusals.rows
        if not self._may or rows == self._shown:
            return
        self._shown = rows
        self._details.set(hidden=not rows)
        self._text.text = f"{counted(refusals.total, 'message')} refused"
        self._newest.text = rows[0].last if rows else ""
        self._list.clear()
        for row in rows[:SHOWN]:
            self._list.append(line(row.by, row.count, row.last, row.at))


def line(by: str, count: int, last: str, at: "datetime") -> "Element":
    """Return the number of one person's refused messages, and the last of them."""
    messages = counted(count, "message")
    return html.li(
        html.span(text=by, class_="url"),
        html.span(
            text=f"{messages}, the last at {at.astimezone():%H:%M:%S}", class_="word"
        ),
        html.span(text=last, class_="refused-last"),
    )
