"""WebMap's log: one line for each record, of limited length and limited rate.

Text of robots, bridges, browsers and files gets into the log. A filter on each of
WebMap's loggers escapes that text before any handler sees the record, so this also
holds for the logging that a program sets up for itself.
"""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from webmap.base.text import one_line

LOGGERS = (
    "webmap",
    "webmap.agent",
    "webmap.alignment",
    "webmap.bags",
    "webmap.buttons",
    "webmap.check",
    "webmap.cli",
    "webmap.console",
    "webmap.gate",
    "webmap.incidents",
    "webmap.layer",
    "webmap.map",
    "webmap.modules",
    "webmap.modules.alerts",
    "webmap.modules.align_tool",
    "webmap.modules.goal_tool",
    "webmap.modules.initial_pose",
    "webmap.modules.labels",
    "webmap.modules.route_tool",
    "webmap.modules.several_robots",
    "webmap.notebook",
    "webmap.operators",
    "webmap.page",
    "webmap.robot",
    "webmap.ros",
    "webmap.server",
    "webmap.sim",
    "webmap.ros.tf",
)
"""Every logger of WebMap."""

OTHERS = ("uvicorn.error", "websockets.client", "websockets.server")
"""Loggers of libraries that log text of WebMap's peers."""

BURST = 30
"""Lines in a row that one source may log."""

PAUSE = 5.0
"""Seconds until a source that has used up its lines may log one more."""

MOST_SOURCES = 1000
"""Most sources that are counted separately, by default."""

MOST_LINES = 80
"""Lines of a traceback that are logged."""

FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"


@dataclass(slots=True)
class _Budget:
    lines: float = BURST
    at: float = 0.0
    left_out: int = 0


class Budgets:
    """Counts how many lines each source may log. No I/O.

    Args:
        clock: A clock in seconds that never goes back.
        pause: Seconds until a source that has used up its lines may log one more.
        sources: Most sources that are counted separately; a peer can invent names.

    """

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        pause: float = PAUSE,
        sources: int = MOST_SOURCES,
    ) -> None:
        self._clock = clock
        self._pause = pause
        self._most = sources
        self._lock = threading.Lock()
        self._sources: dict[tuple[object, ...], _Budget] = {}

    def note(self, place: tuple[object, ...], about: str) -> str | None:
        """Return the suffix of the next line of a source; None to drop the line.

        Args:
            place: The place in the code that logs the line.
            about: The subject of the line, such as the name of a bridge.

        """
        with self._lock:
            now = self._clock()
            source = (*place, about)
            if source not in self._sources and len(self._sources) >= self._most:
                self._forget(now)
                if len(self._sources) >= self._most:
                    source = place
            budget = self._sources.setdefault(source, _Budget(at=now))
            budget.lines = min(BURST, budget.lines + (now - budget.at) / self._pause)
            budget.at = now
            if budget.lines < 1:
                budget.left_out += 1
                return None
            budget.lines -= 1
            suffix = f" ({budget.left_out} more were left out)" * (budget.left_out > 0)
            budget.left_out = 0
            if budget.lines < 1:
                rest = f"except one every {self._pause:g} s"
                suffix += f" (similar lines are left out, {rest})"
            return suffix

    def clear(self) -> None:
        """Forget all counts, so that every source may log again at once."""
        with self._lock:
            self._sources.clear()

    def _forget(self, now: float) -> None:
        """Forget the sources that have all of their lines again."""
        full = BURST * self._pause
        self._sources = {
            source: budget
            for source, budget in self._sources.items()
            if now - budget.at < full
        }


class OutsideText(logging.Filter):
    """Escapes the text of records, and drops records of a source that logs too much."""

    def __init__(self, budgets: Budgets) -> None:
        super().__init__()
        self._budgets = budgets

    def filter(self, record: logging.LogRecord) -> bool:
        """Escape the text of the record; return whether the record is logged."""
        if getattr(record, "webmap_checked", False):
            return True  # filtered by its logger; this is a handler
        place = (record.name, record.pathname, record.lineno)
        added = self._budgets.note(place, _source(record))
        if added is None:
            return False
        record.msg, record.args = one_line(_message(record)) + added, None
        if record.exc_info and record.exc_info[0] is not None:
            # Formatters use this text instead of formatting the exception themselves.
            record.exc_text = _traceback(record)
        record.webmap_checked = True
        return True


budgets = Budgets()
"""The budgets of this process."""

_filter = OutsideText(budgets)


def guard_loggers() -> None:
    """Filter all records of WebMap's loggers, for any handler."""
    for name in (*LOGGERS, *OTHERS):
        logging.getLogger(name).addFilter(_filter)


def set_up_logging(
    level: int = logging.INFO,
    handler: logging.Handler | None = None,
    format: str = FORMAT,
) -> None:
    """Log to standard error, as a process of WebMap without other logging does.

    Args:
        level: The least level that is logged.
        handler: The handler, with a formatter; standard error if None.
        format: A format of :mod:`logging`; used if there is no handler.

    """
    if handler is None:
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter(format))
    handler.addFilter(_filter)  # records of other libraries
    logging.basicConfig(level=level, handlers=[handler])
    for noisy in ("websockets", "uvicorn", "asyncio", "PIL"):
        logging.getLogger(noisy).setLevel(logging.WARNING)


def _source(record: logging.LogRecord) -> str:
    """Return the subject of a record: ``extra={"source": ...}``, or the first argument.

    A single argument is often the whole text, which differs in every record, and is not
    used.
    """
    source = getattr(record, "source", None)
    if source is None and isinstance(record.args, tuple) and len(record.args) > 1:
        source = record.args[0]
    return "" if source is None else one_line(source, 100)


def _message(record: logging.LogRecord) -> str:
    try:
        return record.getMessage()
    except Exception:  # a wrong format must not end the caller
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
    # Indented, so that no line looks like the beginning of another record.
    return "\n".join(f"  {one_line(line)}" for line in lines)
