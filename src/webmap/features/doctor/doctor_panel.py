"""The readiness check on the page: a button for each bridge, and the findings."""

import asyncio
import itertools
import logging
import math
import time
import weakref
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Sequence
from typing import TYPE_CHECKING

from webmap import html, svg

# The console opens without the check's own modules: they are imported for a check.
if TYPE_CHECKING:
    from webmap import Bridge, Element, Map
    from webmap.discovery.doctor import BridgeFacts, ConfiguredRobot, Finding

LEVEL_NAMES = {"wrong": "Wrong", "warning": "Warning", "note": "Note", "good": "Good"}

SHAPES = {
    "wrong": ("M8 2.5h8L21.5 8v8L16 21.5H8L2.5 16V8z", "M8 8l8 8M16 8l-8 8"),
    "warning": ("M12 2.5L22.5 21h-21z", "M12 9v6M12 18v.01"),
    "note": ("M12 2.5a9.5 9.5 0 1 0 .01 0z", "M12 11v6M12 7v.01"),
    "good": ("", "M4 12.5l5.5 5.5L20 6.5"),
}
"""The outline of each level, filled, and the symbol drawn on it."""

OLD = 3600.0
"""Seconds after which a report is stale."""

_numbers = itertools.count(1)


class DoctorReports:
    """What prevents driving, for each bridge; a module of maps.

    Args:
        map: The map.
        element: The page's element for the reports; each is a popover of it.
    """

    def __init__(self, map: "Map", element: "Element") -> None:
        self.map = map
        self._element = element
        map.add_browser_part(
            self,
            "features/doctor/doctor_panel.js",
            {},
            "features/doctor/doctor_panel.css",
        )
        self._reports: list[Report] = []

    def add(self, bridge: "Bridge") -> "Element":
        """Add a bridge; return the button that opens its report and makes the first."""
        report = Report(bridge, self.map)
        self._element.insert(len(self._reports), report.element)
        self._reports.append(report)
        return report.opener

    def poll(self) -> None:
        """Update the reports that have changed."""
        for report in self._reports:
            report.poll()


class Report:
    """The report of one bridge on one page.

    Args:
        bridge: The bridge.
        map: The page's map; the report is about its robots.
    """

    def __init__(self, bridge: "Bridge", map: "Map") -> None:
        self._checkup: Checkup = checkup_of(bridge)
        self._bridge = bridge
        self._map = map
        self._try = TryCall(self._checkup, map.page.viewer.role)
        self._shown = -1
        name = bridge.name or bridge.url
        where = f"doctor-{next(_numbers)}"
        self.opener: Element = html.button(
            "Check",
            type="button",
            class_="button",
            popovertarget=where,
            aria_label=f"Check {name} for problems with driving",
        )
        self.opener.on("click", lambda event: self._opened(), role="viewer")
        close = html.button(_close_icon(), type="button", class_="button square quiet")
        close.set("popovertarget", where).set("aria-label", "Close the report")
        self._doing = html.span()
        self._age = html.span(class_="age")
        self._age.set_age(math.inf, limit=OLD, age_text=True)
        self._checked = html.span("Checked ", self._age, " ago. ", hidden=True)
        self._again = html.button("Check again", type="button", class_="button")
        self._again.on("click", lambda event: self._start())
        self._copy = html.button(
            html.span(text="Copy as text", class_="before"),
            html.span(text="Copied", class_="after"),
            type="button",
            class_="button copy",
            data_copy="doctor",
        )
        self._list = html.div(class_="findings")
        self._text = html.pre(class_="as-text", tabindex="0")
        status = html.p(self._checked, self._doing, class_="status", role="status")
        self.element: Element = html.section(
            html.div(html.h2(text=f"Check of {name}"), close, class_="doctor-head"),
            status,
            html.div(
                self._again,
                self._copy,
                self._try.button,
                class_="webmap-row wraps doctor-actions",
            ),
            self._try.question,
            self._list,
            self._text,
            class_="doctor webmap-surface",
            id=where,
            popover="auto",
            aria_label=f"Check of {name}",
        )
        self.poll()

    def poll(self) -> None:
        """Update the report if it has changed."""
        checkup = self._checkup
        if self._shown == checkup.version:
            return
        self._shown = checkup.version
        self._try.poll()
        running, known = checkup.is_running, checkup.ended is not None
        doing = checkup.doing.removesuffix(".")  # the page adds animated dots
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
        """Make the first report; an existing report stays until a new check."""
        if self._checkup.ended is None:
            self._start()

    def _start(self) -> None:
        """Check the robots that are shown now, with the topics that they use now."""
        from webmap.features.doctor.configured_robots import configured_robots

        made = self._map.module_arguments()
        self._checkup.start(configured_robots(self._map.robots, self._bridge, made))


def groups(findings: Sequence["Finding"]) -> "Iterator[Element]":
    """Return the findings under headings: the bridge, then each robot."""
    for about, each in itertools.groupby(findings, key=lambda one: one.about):
        yield html.h3(text="The bridge" if about == "bridge" else about)
        yield html.ul(*map(line, each))


def line(finding: "Finding") -> "Element":
    """Return one finding: a shape, a word, the fact, and the advice."""
    return entry(
        finding.level, f"{LEVEL_NAMES[finding.level]}: ", finding.text, finding.advice
    )


def _close_icon() -> "Element":
    return svg.svg(svg.use(href="#icon-close"), class_="icon", aria_hidden="true")


def entry(level: str, word: str, words: str, advice: str = "") -> "Element":
    """Return a line of a list with the shape of its level.

    Args:
        level: ``"wrong"``, ``"warning"``, ``"note"`` or ``"good"``.
        word: The highlighted word.
        words: The fact.
        advice: The text below, if any.
    """
    outline, mark = SHAPES[level]
    shape = svg.svg(
        svg.path(d=outline, class_="solid"),
        svg.path(d=mark, class_="slot" if outline else ""),
        viewBox="0 0 24 24",
        class_="icon",
    )
    message = html.div(html.p(html.strong(text=word), words))
    if advice:
        message.append(html.p(text=advice, class_="webmap-muted advice"))
    item = html.li(shape.set("aria-hidden", "true"), message, class_="finding")
    return item.set("data-level", level)


log = logging.getLogger("webmap.console")

SECONDS = 3.0
"""Seconds for which the check listens to topics."""

PLURAL = {"wrong": "wrong", "warning": "warnings", "note": "notes", "good": "good"}

Observe = Callable[..., Awaitable["BridgeFacts"]]


class Checkup:
    """The readiness check of one bridge, and its last findings.

    One check runs at a time for all pages, with one socket for listening; the bridge's
    own connections are not used.

    Args:
        url: The bridge's address.
        observe: Observes a bridge; that of ``measure`` if not given.
        tried: Takes the observation, tries a call that hangs, and adds the result; that
            of ``measure`` if not given.
    """

    def __init__(
        self, url: str, observe: Observe | None = None, tried: Observe | None = None
    ) -> None:
        self.url = url
        self.version = 0
        """Increases with every change."""
        self.doing = ""
        """The current step, as a sentence; empty if no check runs."""
        self.findings: Sequence[Finding] = ()
        """The last findings: the bridge first, then each robot, worst first."""
        self.ended: float | None = None
        """Last time of listening to topics, on the monotonic clock; None if never."""
        self._observe = observe
        self._tried = tried
        self._seen: BridgeFacts | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def is_running(self) -> bool:
        """Whether a check is running, from any page."""
        return self._task is not None and not self._task.done()

    @property
    def can_try(self) -> bool:
        """Whether a hanging call can be tried: the check reached the bridge."""
        seen = self._seen
        return seen is not None and not seen.trouble and not self.is_running

    @property
    def summary(self) -> str:
        """The number of findings of each level, as text."""
        numbers = {level: 0 for level in PLURAL}
        for finding in self.findings:
            numbers[finding.level] += 1
        texts = [
            f"{number} {level if number == 1 else PLURAL[level]}"
            for level, number in numbers.items()
            if number
        ]
        free = not numbers["wrong"] and not numbers["warning"]
        return ("No problems: " if free else "") + ", ".join(texts)

    @property
    def text(self) -> str:
        """All findings as plain text."""
        from webmap.discovery.doctor.verdict import report

        return report(self.url, self.findings)

    def start(self, robots: "Sequence[ConfiguredRobot]" = ()) -> None:
        """Check the bridge, unless a check is running already.

        Args:
            robots: The page's robots on this bridge, with the topics in use; if empty,
                the discovered robots are checked.
        """
        if not self.is_running:
            self._begin(self._look(robots))

    def try_call(self) -> None:
        """Test what a hanging call blocks; the rest of the report stays.

        Does nothing while a check runs, or if the bridge was unreachable.
        """
        if self._seen is not None and self.can_try:
            self._begin(self._try(self._seen))

    def _begin(self, work: "Coroutine[None, None, BridgeFacts]") -> None:
        self._show_progress("Starting.")
        self._task = asyncio.get_running_loop().create_task(self._run(work))

    async def _look(self, robots: "Sequence[ConfiguredRobot]") -> "BridgeFacts":
        from webmap.discovery.doctor.measure import observe

        try:
            return await (self._observe or observe)(
                self.url,
                seconds=SECONDS,
                configured=lambda _: robots,
                progress=self._show_progress,
            )
        finally:
            self.ended = time.monotonic()

    async def _try(self, seen: "BridgeFacts") -> "BridgeFacts":
        from webmap.discovery.doctor.measure import TRYING, tried

        self._show_progress(TRYING)
        return await (self._tried or tried)(seen)

    async def _run(self, work: "Coroutine[None, None, BridgeFacts]") -> None:
        from webmap.discovery.doctor import Finding, judge

        try:
            self._seen = await work
            self.findings = judge(self._seen)
        except Exception as error:
            log.exception("the readiness check of %s failed", self.url)
            words = f"The check failed: {error!r}."
            advice = f"Run webmap doctor {self.url} in a terminal and read the log."
            self._seen = None
            self.findings = [Finding("wrong", "bridge", words, advice)]
        self._show_progress("")

    def _show_progress(self, doing: str) -> None:
        self.doing = doing
        self.version += 1


_checkups: "weakref.WeakKeyDictionary[Bridge, Checkup]" = weakref.WeakKeyDictionary()


def checkup_of(bridge: "Bridge") -> Checkup:
    """Return the check of a bridge, shared by all pages."""
    return _checkups.setdefault(bridge, Checkup(bridge.url))


MAY_TRY = ("operator", "admin")
"""Roles that may try a call."""

TRY_EXPLANATION = (
    "Does one slow service call delay later calls on the same connection? To test "
    "this, WebMap advertises a service of its own with a unique name, calls it over a "
    "separate connection, waits one second before the answer, and meanwhile asks "
    "rosapi for the time.",
    "No node of a robot is called, and velocity uses other connections. In the worst "
    "case the bridge delays all clients for one second: test while nobody drives.",
)


class TryCall:
    """A button and its confirmation question, on one page.

    Args:
        checkup: The check that tries the call, and has the report.
        role: The role of the page's user.
    """

    def __init__(self, checkup: "Checkup", role: str) -> None:
        self._checkup = checkup
        self._may = role in MAY_TRY
        self.button: Element = html.button(
            "Test for delays", type="button", class_="button", hidden=not self._may
        )
        self.button.on("click", lambda event: self._ask(True))
        self._yes = html.button("Run test", type="button", class_="button")
        self._yes.on("click", lambda event: self._agreed())
        no = html.button("Cancel", type="button", class_="button")
        no.on("click", lambda event: self._ask(False))
        self.question: Element = html.div(
            *(html.p(text=text) for text in TRY_EXPLANATION),
            html.div(self._yes, no, class_="webmap-row wraps doctor-answers"),
            class_="webmap-muted doctor-question",
            role="group",
            aria_label="Test for delays",
            hidden=True,
        )
        self.poll()

    def poll(self) -> None:
        """Update whether the call can be tried now."""
        for button in (self.button, self._yes):
            button.set(disabled=not self._checkup.can_try)

    def _ask(self, asked: bool) -> None:
        self.question.set(hidden=not (asked and self._may))

    def _agreed(self) -> None:
        self._ask(False)
        # Viewers cannot answer, whatever their page sends.
        if self._may:
            self._checkup.try_call()
