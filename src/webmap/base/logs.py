"""What WebMap logs: on one line, of a limited length, and not without end.

Text of robots, bridges, browsers and files gets into the log. A filter on each of
WebMap's loggers makes it harmless before any handler sees the record, so this holds
for the logging that a program sets up for itself, too.
"""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from webmap.base.outside_text import one_line

LOGGERS = (
    "webmap",
    "webmap.alignment",
    "webmap.bags",
    "webmap.buttons",
    "webmap.cli",
    "webmap.console",
    "webmap.gate",
    "webmap.layer",
    "webmap.map",
    "webmap.modules",
    "webmap.modules.align_tool",
    "webmap.modules.goal_tool",
    "webmap.modules.initial_pose",
    "webmap.modules.labels",
    "webmap.modules.route_tool",
    "webmap.page",
    "webmap.robot",
    "webmap.ros",
    "webmap.server",
    "webmap.sim",
    "webmap.ros.tf",
)
"""Every logger of WebMap."""

OTHERS = ("uvicorn.error", "websockets.client", "websockets.server")
"""Loggers of libraries that log what WebMap's peers send."""

BURST = 30
"""Lines in a row that one source may log."""

PAUSE = 5.0
"""Seconds until a source that has used up its lines may log one more."""

MOST_SOURCES = 1000
"""Sources that are told apart; a peer can invent names."""

MOST_LINES = 80
"""Lines of a traceback that are logged."""

FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"


@dataclass(slots=True)
class _Budget:
    lines: float = BURST
    at: float = 0.0
    left_out: int = 0


class Budgets:
    """How many lines each source may log. No I/O.

    Args:
        clock: Seconds that only go forward.

    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._sources: dict[tuple[object, ...], _Budget] = {}

    def note(self, place: tuple[object, ...], about: str) -> str | None:
        """Return what is added to the next line of a source; None leaves it out.

        Args:
            place: Where in the code the line is logged.
            about: What the line is about, such as the name of a bridge.

        """
        with self._lock:
            now = self._clock()
            source = (*place, about)
            if source not in self._sources and len(self._sources) >= MOST_SOURCES:
                self._forget(now)
                if len(self._sources) >= MOST_SOURCES:
                    source = place
            budget = self._sources.setdefault(source, _Budget(at=now))
            budget.lines = min(BURST, budget.lines + (now - budget.at) / PAUSE)
            budget.at = now
            if budget.lines < 1:
                budget.left_out += 1
                return None
            budget.lines -= 1
            words = f" ({budget.left_out} more were left out)" * (budget.left_out > 0)
            budget.left_out = 0
            if budget.lines < 1:
                words += f" (more like this is left out, but for one in {PAUSE:g} s)"
            return words

    def clear(self) -> None:
        """Forget what was logged so far."""
        with self._lock:
            self._sources.clear()

    def _forget(self, now: float) -> None:
        """Forget the sources that have all of their lines again."""
        full = BURST * PAUSE
        self._sources = {
            source: budget
            for source, budget in self._sources.items()
            if now - budget.at < full
        }


class OutsideText(logging.Filter):
    """Makes a record harmless and drops what a source logs without end."""

    def __init__(self, budgets: Budgets) -> None:
        super().__init__()
        self._budgets = budgets

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether the record is logged; its text is made harmless."""
        if getattr(record, "webmap_checked", False):
            return True  # by its logger; this is a handler
        place = (record.name, record.pathname, record.lineno)
        added = self._budgets.note(place, _source(record))
        if added is None:
            return False
        record.msg, record.args = one_line(_message(record)) + added, None
        if record.exc_info and record.exc_info[0] is not None:
            # Formatters take this in place of what they would make of the exception.
            record.exc_text = _traceback(record)
        record.webmap_checked = True
        return True


budgets = Budgets()
"""Of this process."""

_filter = OutsideText(budgets)


def guard_loggers() -> None:
    """Have everything that WebMap logs made harmless, whoever handles it."""
    for name in (*LOGGERS, *OTHERS):
        logging.getLogger(name).addFilter(_filter)


def set_up_logging(
    level: int = logging.INFO,
    handler: logging.Handler | None = None,
    format: str = FORMAT,
) -> None:
    """Log to standard error, as a process of WebMap does that has no other logging.

    Args:
        level: The least level that is logged.
        handler: What writes the records, formatted already; standard error if None.
        format: As :mod:`logging` takes it, if there is no handler.

    """
    if handler is None:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter(format))
    handler.addFilter(_filter)  # what other libraries log
    logging.basicConfig(level=level, handlers=[handler])
    for noisy in ("websockets", "uvicorn", "asyncio", "PIL"):
        logging.getLogger(noisy).setLevel(logging.WARNING)


def _source(record: logging.LogRecord) -> str:
    """Return what a record is about: ``extra={"source": ...}``, or its first argument.

    An only argument is the whole text, and no two texts need be the same.
    """
    source = getattr(record, "source", None)
    if source is None and isinstance(record.args, tuple) and len(record.args) > 1:
        source = record.args[0]
    return "" if source is None else one_line(source, 100)


def _message(record: logging.LogRecord) -> str:
    try:
        return record.getMessage()
    except Exception:  # a text that cannot be made must not end who logs
        return str(record.msg)


def _traceback(record: logging.LogRecord) -> str:
    assert record.exc_info
    try:
        lines = logging.Formatter().formatException(record.exc_info).splitlines()
    except Exception:
        lines = ["the traceback cannot be shown"]
    if len(lines) > MOST_LINES:
        half = MOST_LINES // 2
        left_out = f"... {len(lines) - 2 * half} lines are left out ..."
        lines = [*lines[:half], left_out, *lines[-half:]]
    # Indented, so that no line of it looks like the beginning of another record.
    return "\n".join(f"  {one_line(line)}" for line in lines)
