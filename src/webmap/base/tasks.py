"""Background tasks on the model's event loop."""

import asyncio
import inspect
import logging
from collections.abc import Awaitable, Callable, Coroutine
from functools import partial
from typing import Any

from webmap.base.scope import Removal, break_off, current_scope

log = logging.getLogger("webmap")

_running: set[asyncio.Task[Any]] = set()


def spawn(work: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
    """Run ``work`` as a task that is kept until it ends; its errors are logged."""
    task = asyncio.get_running_loop().create_task(work)
    _running.add(task)
    task.add_done_callback(_ended)
    return task


def begin(work: Awaitable[Any], report: Callable[[Exception], object]) -> None:
    """Run the awaitable of a user's function as a task, in the current scope.

    The task is cancelled when that scope closes, unless it closes the scope itself.

    Args:
        work: Usually the result of a coroutine function.
        report: Called with an exception that the task raises.

    Raises:
        RuntimeError: If no event loop runs in this thread.

    """
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        _close(work)
        raise RuntimeError(
            "it is a coroutine, which only WebMap runs: after webmap.start(), and "
            "in the model's thread"
        ) from None

    async def finish() -> None:
        try:
            await work
        except Exception as error:
            report(error)

    task, scope = spawn(finish()), current_scope()
    task.add_done_callback(lambda _: _close(work))  # it may never have begun
    if scope is not None:
        ending = Removal(partial(break_off, task))
        task.add_done_callback(lambda _: scope.discard(ending))
        scope.add(ending)


def _close(work: Awaitable[Any]) -> None:
    """Close a coroutine; otherwise Python warns that it was never awaited."""
    if inspect.iscoroutine(work):
        work.close()


def _ended(task: asyncio.Task[Any]) -> None:
    _running.discard(task)
    if not task.cancelled() and task.exception() is not None:
        log.error("a background task failed", exc_info=task.exception())
