"""Compare what pages draw with recordings.

A recording has a line for each element: see ``drawn_reader.js``. ``WEBMAP_DRAWN=write``
in the environment writes new recordings as soon as the pages no longer change. Look at
the difference before you commit it. Boxes depend on the fonts, which are those of the
tests on every machine.
"""

import difflib
import itertools
import os
import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Browser, Page

from equipment.chromium import watched_tab

HERE = Path(__file__).parent
RECORDINGS = HERE / "drawn"
WRITES = os.environ.get("WEBMAP_DRAWN") == "write"

WIDTH, HEIGHT = 1280, 800
"""The size of the window in pixels."""

PIXELS = 2.0
"""The tolerance of boxes, and of colour components from 0 to 255."""

SMALL = 0.002
"""The tolerance of all other numbers."""

LONGEST, LOOKS = 25.0, 40
"""The time in seconds, and the number of looks, until a page must match its recording.

A look takes longer on a busy machine, where pages sometimes show that data is old.
"""

STILL = 1.0
"""The time in seconds after which the page must match again."""

SHOWN = 12
"""The number of differences that a failure lists."""

CLOSED = ("svg.sprite", "#help")
"""Only the number of elements inside is compared: they come from an HTML file."""

CONSOLE = (
    "svg.webmap-view-control",
    *(
        f".webmap-{name}"
        for name in ("alerts", "align", "export", "goal", "labels", "layers")
    ),
    *(f".webmap-{name}" for name in ("measure", "rosout", "route", "scale-bar")),
    *(f".webmap-{name}" for name in ("stop", "teleop", "teleop-stop")),
)
"""The elements of the browser modules on the console."""

OF_BROWSER = (".webmap-alert-note",)
"""Not compared: not every Chromium can show notifications."""

UNORDERED = (".webmap-overlay", ".webmap-corner", "#stop-place", ".drive-bar")
"""Here the elements of browser modules are in the order of their loading."""

_READER = (HERE / "drawn_reader.js").read_text().strip().removesuffix(";")
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_PARTS = re.compile(
    r"(?P<token>~\d+|#[\da-f]+\b)"
    r"|(?P<box>@-?\d+,-?\d+ \d+x\d+|\{[-\d |]+\})"
    r"|(?P<points><[^>]+>)"
    rf"|{_NUMBER.pattern}"
)


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a recording, with its numbers separated from the text."""

    text: str
    shape: str
    """The text with a placeholder for each number."""

    numbers: tuple[float, ...]
    tolerances: tuple[float, ...]

    @classmethod
    def of(cls, text: str) -> "Line":
        """Separate the numbers of a line from its text."""
        numbers: list[float] = []
        tolerances: list[float] = []

        def take(match: re.Match[str]) -> str:
            if match["token"]:
                return match[0]
            found = [float(number) for number in _NUMBER.findall(match[0])]
            numbers.extend(found)
            # Points are rounded; the direction of the rounding does not matter.
            largest = max(map(abs, found), default=0.0)
            near = max(SMALL, largest / 2000) if match["points"] else SMALL
            tolerances.extend(PIXELS if match["box"] else near for _ in found)
            return _NUMBER.sub("%", match[0])

        shape = _PARTS.sub(take, text)
        return cls(text, shape, tuple(numbers), tuple(tolerances))

    def matches(self, other: "Line") -> bool:
        """Return whether another line differs only within the tolerances."""
        return self.shape == other.shape and all(
            abs(mine - its) <= tolerance + 1e-9
            for mine, its, tolerance in zip(
                self.numbers, other.numbers, self.tolerances, strict=True
            )
        )


@contextmanager
def opened(chromium: Browser, url: str, *shown: str) -> Iterator[Page]:
    """Open a page in a window of a fixed size, and wait for some elements."""
    with watched_tab(chromium, WIDTH, HEIGHT) as page:
        page.goto(url)
        for selector in shown:
            page.locator(selector).first.wait_for(state="attached")
        yield page


def robots(count: int) -> str:
    """Return a selector that matches when ``count`` robots are placed."""
    placed = ".robot:not(.unplaced)"
    return f"{placed}:nth-child({count} of {placed})"


def expect_drawn(
    page: Page,
    name: str,
    *,
    hidden: str = "svg.webmap",
    absent: Sequence[str] = (),
    level: Sequence[str] = (),
    unstable: Sequence[tuple[str, str]] = (),
) -> None:
    """Check that a page draws what was recorded, or record it.

    Args:
        page: The page; it shows the recorded elements now or soon.
        name: The name of the recording.
        hidden: A selector of elements; inside these, the content of hidden elements
            is compared, too.
        absent: Selectors of elements that are not compared.
        level: Selectors of elements in which neighbours of one kind may have any order.
        unstable: Selectors, each with an attribute that is not compared.

    """
    __tracebackhide__ = True
    options = {
        "hidden": hidden,
        "closed": CLOSED,
        "absent": [*OF_BROWSER, *absent],
        "unordered": UNORDERED,
        "level": list(level),
        "unstable": list(unstable),
    }

    def read() -> list[str]:
        return page.evaluate(_READER, options)

    file = RECORDINGS / f"{name}.txt"
    if WRITES:
        lines = _still(page, read)
        file.write_text("\n".join(lines) + "\n")
        return
    assert file.exists(), f"{file} is not there; WEBMAP_DRAWN=write writes it"
    recorded = file.read_text().splitlines()
    deadline, first = time.monotonic() + LONGEST, None
    for looks in itertools.count(1):
        found = differences(recorded, read())
        now = time.monotonic()
        if found and now > deadline and looks > LOOKS:
            break
        if not found and first is not None and now - first >= STILL:
            return
        if not found and first is None:
            first = now
        page.wait_for_timeout(1000 * (STILL / 2 if found else STILL))
    more = [f"... and {len(found) - SHOWN} more"] if len(found) > SHOWN else []
    listed = "\n".join([*found[:SHOWN], *more])
    raise AssertionError(
        f"{name}: the drawing differs from the recording "
        f"(- recorded, + drawn; WEBMAP_DRAWN=write records it again):\n{listed}"
    )


def _still(page: Page, read: Callable[[], list[str]]) -> list[str]:
    """Return what a page draws as soon as it has not changed for some seconds."""
    deadline = time.monotonic() + 4 * LONGEST
    seen: dict[tuple[str, ...], float] = {}
    while True:
        lines, now = read(), time.monotonic()
        if now - seen.setdefault(tuple(lines), now) >= 4 * STILL:
            return lines
        assert now < deadline, "the page does not stop changing:\n" + "\n".join(
            differences(list(seen)[-2], lines)
        )
        page.wait_for_timeout(500)


def differences(recorded: Sequence[str], drawn: Sequence[str]) -> list[str]:
    """Return the differences, each with the elements around the line."""
    if recorded == drawn:
        return []
    before, after = ([Line.of(text) for text in lines] for lines in (recorded, drawn))
    shapes = ([line.shape for line in lines] for lines in (before, after))
    found = []
    matcher = difflib.SequenceMatcher(None, *shapes, autojunk=False)
    for tag, i1, i2, j1, j2 in matcher.get_opcodes():
        if tag == "equal":
            pairs = zip(range(i1, i2), range(j1, j2), strict=True)
            for i, j in pairs:
                if not before[i].matches(after[j]):
                    found.append(_difference(recorded, [i], drawn, [j]))
        else:
            found.append(_difference(recorded, range(i1, i2), drawn, range(j1, j2)))
    return found


def _difference(
    recorded: Sequence[str],
    old: Sequence[int],
    drawn: Sequence[str],
    new: Sequence[int],
) -> str:
    path = _element_path(recorded, old[0]) if old else _element_path(drawn, new[0])
    lines = [
        *(f"  - {recorded[i].strip()}" for i in old[:SHOWN]),
        *(f"  + {drawn[j].strip()}" for j in new[:SHOWN]),
    ]
    return "\n".join([f"in {path}:", *lines])


def _element_path(lines: Sequence[str], index: int) -> str:
    """Return the elements around a line, the innermost last."""
    depth = _depth(lines[index])
    path: list[str] = []
    for line in reversed(lines[:index]):
        if _depth(line) < depth:
            depth = _depth(line)
            path.append(line.split()[0])
    return " > ".join(reversed(path[:4])) or "the page"


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip(" "))
