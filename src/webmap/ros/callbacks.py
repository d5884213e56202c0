"""Callbacks, each called in the scope in which it was added."""

import asyncio
import inspect
import logging
from collections.abc import Callable
from typing import Any

from webmap.base.scope import (
    Removal,
    break_off,
    current_scope,
    enter_scope,
    leave_scope,
)

log = logging.getLogger("webmap.ros")


class Callback:
    """One callback, which may raise.

    Args:
        fn: The function. A coroutine function runs as a task, until :meth:`end` at the
            latest.
        what: The occasion of the call, for the log.
        report: Called with each error that the function raises.

    """

    __slots__ = ("_report", "_scope", "_tasks", "fn", "removed", "what")

    def __init__(
        self, fn: Callable[..., Any], what: str, report: Callable[[Exception], None]
    ) -> None:
        self.fn = fn
        self.what = what
        self.removed = False
        """Whether it has ended and is no longer called."""
        self._report = report
        self._scope = current_scope()
        self._tasks: set[asyncio.Future[Any]] = set()

    def __call__(self, *args: Any) -> None:
        """Call the function; its errors are logged and reported, never raised."""
        if self.removed:
            return
        try:
            before = enter_scope(self._scope)
            try:
                result = self.fn(*args)
                if result is not None and inspect.isawaitable(result):
                    task = asyncio.ensure_future(result)
                    self._tasks.add(task)
                    task.add_done_callback(self._finished)
            finally:
                leave_scope(before)
        except Exception as error:
            self._failed(error)

    def end(self) -> None:
        """Stop calling the function, and cancel its running tasks."""
        self.removed = True
        for task in tuple(self._tasks):
            break_off(task)

    def _finished(self, task: "asyncio.Future[Any]") -> None:
        self._tasks.discard(task)
        error = None if task.cancelled() else task.exception()
        if isinstance(error, Exception):
            self._failed(error)

    def _failed(self, error: Exception) -> None:
        log.error("%s: a callback raised", self.what, exc_info=error)
        self._report(error)
        if self._scope is not None and self._scope.report is not None:
            what = f"{self.what}: {type(error).__name__}: {error}"
            self._scope.report(what, None)


class Callbacks:
    """The callbacks of one occasion, in the order in which they were added."""

    def __init__(self, what: str, report: Callable[[Exception], None]) -> None:
        self._what = what
        self._report = report
        self._each: dict[int, Callback] = {}
        self._count = 0

    def __len__(self) -> int:
        return len(self._each)

    def add(self, fn: Callable[..., Any]) -> tuple[Callback, Removal]:
        """Add a function until the current scope ends or the function is removed."""
        key, self._count = self._count, self._count + 1
        callback = self._each[key] = Callback(fn, self._what, self._report)
        scope = current_scope()

        def undo() -> None:
            callback.end()
            self._each.pop(key, None)
            if scope is not None:
                scope.discard(removal)

        removal = Removal(undo)
        if scope is not None:
            scope.add(removal)
        return callback, removal

    def call(self, *args: Any) -> None:
        """Call every function; an error in one does not stop the others."""
        for callback in list(self._each.values()):
            callback(*args)
