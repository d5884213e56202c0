"""The readiness check on the page: a button for each bridge, and what it finds."""

import itertools
import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from webmap import html, svg
from webmap.console.checkup import Checkup, checkup_of
from webmap.console.in_use import in_use
from webmap.console.robot_card import icon
from webmap.console.try_call import TryCall

if TYPE_CHECKING:
    from webmap import Bridge, Element, Map
    from webmap.discovery.doctor import Finding

WORDS = {"wrong": "Wrong", "warning": "Warning", "note": "Note", "good": "Good"}

SHAPES = {
    "wrong": ("M8 2.5h8L21.5 8v8L16 21.5H8L2.5 16V8z", "M8 8l8 8M16 8l-8 8"),
    "warning": ("M12 2.5L22.5 21h-21z", "M12 9v6M12 18v.01"),
    "note": ("M12 2.5a9.5 9.5 0 1 0 .01 0z", "M12 11v6M12 7v.01"),
    "good": ("", "M4 12.5l5.5 5.5L20 6.5"),
}
"""The outline of each level, which is filled, and what is drawn on it."""

OLD = 3600.0
"""Seconds after which a report counts as old."""

_numbers = itertools.count(1)


class DoctorReports:
    """What stands in the way of driving, for each bridge; a module of maps.

    Args:
        map: The map.
        element: The page's element for the reports; each is a popover of it.
        bridges: The bridges.

    """

    def __init__(
        self, map: "Map", element: "Element", bridges: Sequence["Bridge"]
    ) -> None:
        self.map = map
        folder = Path(__file__).parent
        map.add_browser_half(self, folder / "doctor.js", {}, folder / "doctor.css")
        self._reports = [Report(bridge, map) for bridge in bridges]
        self.buttons = [report.opener for report in self._reports]
        """For each bridge what opens its report, and makes the first."""
        element.append(*(report.element for report in self._reports))

    def poll(self) -> None:
        """Look whether there is something new."""
        for report in self._reports:
            report.poll()


class Report:
    """The report of one bridge on one page.

    Args:
        bridge: The bridge.
        map: The page's map, whose robots it is about.

    """

    def __init__(self, bridge: "Bridge", map: "Map") -> None:
        self._checkup: Checkup = checkup_of(bridge)
        self._bridge = bridge
        self._map = map
        self._try = TryCall(self._checkup, map.page.viewer.role)
        self._shown = -1
        name = bridge.name or bridge.url
        where = f"doctor-{next(_numbers)}"
        self.opener: Element = html.button("Check", type="button", class_="button")
        self.opener.set("popovertarget", where)
        self.opener.set("aria-label", f"Check {name}: what is in the way of driving")
        self.opener.on("click", lambda event: self._opened())
        close = html.button(
            icon("icon-close"), type="button", class_="button square quiet"
        )
        close.set("popovertarget", where).set("aria-label", "Close the report")
        self._doing = html.span()
        self._age = html.span(class_="age")
        self._age.set_age(math.inf, limit=OLD, age_text=True)
        self._checked = html.span("Checked ", self._age, " ago. ", hidden=True)
        self._again = html.button("Check again", type="button", class_="button")
        self._again.on("click", lambda event: self._start())
        copy = html.button(
            html.span(text="Copy as text", class_="before"),
            html.span(text="Copied", class_="after"),
            type="button",
            class_="button copy",
        )
        self._copy = copy.set("data-copy", "doctor")
        self._list = html.div(class_="findings")
        self._text = html.pre(class_="as-text", tabindex="0")
        status = html.p(self._checked, self._doing, class_="status")
        status.set("role", "status")
        self.element: Element = html.section(
            html.div(html.h2(text=f"Is {name} ready?"), close, class_="doctor-head"),
            status,
            html.div(
                self._again, self._copy, self._try.button, class_="doctor-actions"
            ),
            self._try.question,
            self._list,
            self._text,
            class_="doctor",
            id=where,
            popover="auto",
        )
        self.element.set("aria-label", f"Readiness of {name}")
        self.poll()

    def poll(self) -> None:
        """Look whether there is something new."""
        checkup = self._checkup
        if self._shown == checkup.version:
            return
        self._shown = checkup.version
        self._try.poll()
        running, known = checkup.is_running, checkup.ended is not None
        doing = checkup.doing.removesuffix(".")  # the page puts dots that go on
        self._doing.text = doing if running or not known else checkup.summary
        self.element.set("aria-busy", "true" if running else None)
        self._checked.set(hidden=running or not known)
        self._again.set(disabled=running)
        self._copy.set(hidden=running or not known)
        if running or checkup.ended is None:
            return
        self._age.set_age(time.monotonic() - checkup.ended)
        self._text.text = checkup.text
        self._list.clear()
        self._list.append(*groups(checkup.findings))

    def _opened(self) -> None:
        """Make the first report; one that is there is kept until asked for anew."""
        if self._checkup.ended is None:
            self._start()

    def _start(self) -> None:
        """Look at the robots that are shown now, by the topics that they use now."""
        made = self._map.module_arguments()
        self._checkup.start(in_use(self._map.robots, self._bridge, made))


def groups(findings: Sequence["Finding"]) -> "Iterator[Element]":
    """Return the findings under headings: the bridge, then each robot."""
    for about, each in itertools.groupby(findings, key=lambda one: one.about):
        yield html.h3(text="The bridge" if about == "bridge" else about)
        yield html.ul(*map(line, each))


def line(finding: "Finding") -> "Element":
    """Return one finding: a shape, a word, what is so, and what to do."""
    return entry(
        finding.level, f"{WORDS[finding.level]}: ", finding.words, finding.advice
    )


def entry(level: str, word: str, words: str, advice: str = "") -> "Element":
    """Return a line of a list with the shape of its level.

    Args:
        level: ``"wrong"``, ``"warning"``, ``"note"`` or ``"good"``.
        word: What stands out.
        words: What is so.
        advice: What stands below it, if anything.

    """
    outline, mark = SHAPES[level]
    shape = svg.svg(
        svg.path(d=outline, class_="solid"),
        svg.path(d=mark, class_="cut"),
        viewBox="0 0 24 24",
        class_="icon",
    )
    said = html.div(html.p(html.strong(text=word), words))
    if advice:
        said.append(html.p(text=advice, class_="advice"))
    item = html.li(shape.set("aria-hidden", "true"), said, class_="finding")
    return item.set("data-level", level)
