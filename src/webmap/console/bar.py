"""The page's bar: lists of bridges and of refused messages, and the person's name."""

import logging
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from datetime import datetime, timedelta
from typing import Any, ClassVar

from webmap import Bridge, Element, Map, html, refusals
from webmap.base.text import counted
from webmap.console.robot_looks import icon
from webmap.poses.frames import frame_faults

log = logging.getLogger("webmap.console")

WORST = ("lost", "connecting", "late", "faulty")
"""States that are not well, the worst first; ``faulty`` is about the frames."""

LATE = 0.5
"""Seconds of delay from which a bridge's connection is shown as slow."""

MOST_FAULTS = 3
"""The greatest number of faults of frames that the line of a bridge names."""


class BridgeList:
    """A summary of the routers and bridges that unfolds into a list of them.

    Args:
        element: The page's element to fill.
        bridges: The bridges; more may be added to the list later.
        button_of: Returns the button of a bridge.
        routers: The routers with agents, as in :attr:`Console.routers`.
        waiting: The page's element for sentences about routers without agents.
    """

    def __init__(
        self,
        element: Element,
        bridges: Sequence[Bridge],
        button_of: Callable[[Bridge], Element],
        routers: Mapping[str, Callable[[], tuple[str, str]]],
        waiting: Element,
    ) -> None:
        self._bridges = bridges
        self._button_of = button_of
        self._routers = routers
        self._waiting = waiting
        self._text = html.span(class_="text")
        self._shown = ""
        self._summary = html.summary(
            html.span(class_="dot", aria_hidden="true"),
            self._text,
            icon("icon-chevron"),
        )
        self._lines: dict[Bridge | str, tuple[Element, Element]] = {}
        self._list = html.ul(class_="bridge-list")
        element.append(html.details(self._summary, self._list, data_webmap_menu=""))
        self.poll()

    def poll(self) -> None:
        """Show the present state of each router and bridge, and the worst of all."""
        routers = {url: describe() for url, describe in self._routers.items()}
        bridges = {bridge: describe_link(bridge) for bridge in self._bridges}
        for url, state in routers.items():
            self._show(url, state)
        for bridge, state in bridges.items():
            self._show(bridge, state)
        of_routers = [link for link, _ in routers.values()]
        of_bridges = [link for link, _ in bridges.values()]
        links = {*of_routers, *of_bridges}
        worst = next((name for name in WORST if name in links), "open")
        self._summary.set("data-link", worst)
        self._show_summary(summary(of_bridges, of_routers))
        self._waiting.text = " ".join(
            f"{text[0].upper()}{text[1:]}."
            for link, text in routers.values()
            if link != "open"
        )

    def _show_summary(self, text: str) -> None:
        if text == self._shown:
            return
        self._shown = text
        self._summary.set("title", text)
        self._text.clear()
        # Each part is shown as a whole, or not at all where the bar has no room for it.
        for part in re.split(r"(?<=, )", text):
            self._text.append(html.span(text=part))

    def _show(self, key: Bridge | str, state: tuple[str, str]) -> None:
        line, word = self._lines.get(key) or self._add(key)
        line.set("data-link", state[0])
        word.text = state[1]

    def _add(self, key: Bridge | str) -> tuple[Element, Element]:
        """Add the line of a bridge, or of the router at an address."""
        name, url = (key, key) if isinstance(key, str) else (key.name, key.url)
        word = html.span(class_="word")
        dot = html.span(class_="dot", aria_hidden="true")
        shown = html.span(text=name or url, class_="url")
        line = html.li(dot, shown, word, title=url)
        if not isinstance(key, str):
            line.append(self._button_of(key))
        self._lines[key] = line, word
        self._list.append(line)
        return line, word


def describe_link(bridge: Bridge) -> tuple[str, str]:
    """Return the page's name for a bridge's state, and a sentence that describes it."""
    if bridge.state == "open":
        late, faults = bridge.lag >= LATE, frame_faults(bridge)
        text = f"slow connection, {bridge.lag:.1f} s" if late else "open"
        state = "late" if late else "faulty" if faults else "open"
        return state, "; ".join([text, *faults[:MOST_FAULTS]])
    if bridge.lost:
        why = f": {bridge.trouble}" if bridge.trouble else ""
        return "lost", f"no connection{why}; reconnecting"
    return "connecting", "connecting"


def summary(links: Sequence[str], routers: Sequence[str] = ()) -> str:
    """Return a short text for the states of all bridges and routers."""
    total, open_ = len(links), sum(link not in WORST[:2] for link in links)
    late, lost = links.count("late"), "lost" in routers
    if lost and not open_:
        return "No connection to the router"
    if total == 0:
        return "No agent yet" if routers else "No bridge yet"
    if total == 1:
        text = {
            "open": "Bridge connected",
            "lost": "No connection to the bridge",
            "late": "Bridge slow",
            "faulty": "Frames faulty",
        }.get(links[0], "Connecting to the bridge")
    elif open_ == total and not late:
        text = f"{total} bridges connected"
    else:
        slow = f", {late} slow" if late else ""
        text = f"{open_} of {total} bridges connected{slow}"
    if total > 1 and "faulty" in links:
        text += ", faulty frames"
    return f"{text}, no connection to a router" if lost else text


SHOWN = 12
"""The greatest number of people that the list shows."""

REFUSED_SHOWN = timedelta(minutes=1)


def now() -> datetime:
    """Return the time, with a time zone."""
    return datetime.now().astimezone()


class RefusedList:
    """A count of refused messages that unfolds into their senders and contents.

    Shown for a minute after each refused message, and never to viewers. The log of
    WebMap has every refusal.

    Args:
        element: The page's element to fill.
        role: The role of the page's user.
    """

    def __init__(self, element: Element, role: str) -> None:
        self._may = role != "viewer"
        self._text = html.span()
        self._newest = html.span(class_="newest")
        self._list = html.ul(class_="bridge-list refused-list")
        summary = html.summary(self._text, self._newest, icon("icon-chevron"))
        summary.set(title="Refused messages from pages. They did not move any robot.")
        self._details = html.details(
            summary, self._list, hidden=True, data_webmap_menu=""
        )
        element.append(self._details)
        self._shown: object = ()
        self.poll()

    def poll(self) -> None:
        """Show the present counts to an administrator, if they changed."""
        rows = refusals.rows
        is_recent = bool(rows) and now() - rows[0].at < REFUSED_SHOWN
        if not self._may or (rows, is_recent) == self._shown:
            return
        self._shown = rows, is_recent
        self._details.set(hidden=not is_recent)
        self._text.text = f"{refusals.total} refused"
        self._newest.text = rows[0].last if rows else ""
        self._list.clear()
        for row in rows[:SHOWN]:
            self._list.append(line(row.by, row.count, row.last, row.at))


def line(by: str, count: int, last: str, at: datetime) -> Element:
    """Return the number of one person's refused messages, and the last of them."""
    messages = counted(count, "message")
    return html.li(
        html.span(text=by, class_="url"),
        html.span(
            text=f"{messages}, the last at {at.astimezone():%H:%M:%S}", class_="word"
        ),
        html.span(text=last, class_="refused-last"),
    )


class OperatorName:
    """Asks a person for a name and a place, and shows them; a module of maps.

    Everything else works without a name. The name has a way of its own to WebMap: no
    command carries it.

    Args:
        map: The map.
    """

    MAY_SEND: ClassVar[Mapping[str, str]] = {"name": "viewer", "place": "viewer"}

    def __init__(self, map: Map) -> None:
        self.map = map
        self._shown: object = None
        self.browser_part = map.add_browser_part(self, "console/operator_name.js", {})

    def on_ready(self) -> None:
        """Send the name: a page that was loaded again does not know it."""
        self._shown = None
        self.poll()

    def poll(self) -> None:
        """Send the page the name, if it has changed, also by another page."""
        operator = self.map.page.viewer.operator
        if operator != self._shown:
            self._shown = operator
            viewer = self.map.page.viewer
            self.browser_part.send(
                asdict(operator)
                | {"label": str(operator), "role": viewer.role}
                | {"signsOut": viewer.signs_out}
            )

    def on_message(self, message: dict[str, Any]) -> None:
        """Set the name that the page states."""
        name, place = message.get("name"), message.get("place")
        if not isinstance(name, str) or not isinstance(place, str):
            log.warning("%r: an unknown message of the page was ignored", self.map)
            return
        refused = self.map.page.viewer.rename(name, place)
        self.poll()
        self.browser_part.send({"refused": refused})
