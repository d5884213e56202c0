"""Background tasks on the model's event loop, and event loops in threads."""

import asyncio
import gc
import inspect
import logging
import threading
import warnings
from collections.abc import Awaitable, Callable, Coroutine
from functools import partial
from typing import Any, TypeVar

from webmap.base.scope import Removal, break_off, current_scope

T = TypeVar("T")

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


class LoopThread:
    """Runs an event loop in a separate thread, for code that blocks.

    Args:
        name: Name of the thread.

    """

    def __init__(self, name: str) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def call(self, work: Coroutine[Any, Any, T], timeout: float = 10.0) -> T:
        """Run a coroutine in the loop and return its result.

        Raises:
            TimeoutError: If it takes longer than ``timeout`` seconds.

        """
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(timeout)

    def do(self, act: Callable[..., T], *arguments: Any) -> T:
        """Call a function in the loop's thread and return its result."""

        async def work() -> T:
            return act(*arguments)

        return self.call(work())

    def end(self) -> None:
        """Cancel all tasks, and end the loop and its thread."""
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            self._loop.run_forever()
            for _ in range(3):  # a connection accepted just now creates its task later
                self._cancel_all()
                self._loop.run_until_complete(_settle())
            self._loop.run_until_complete(self._loop.shutdown_asyncgens())
        finally:
            self._loop.close()
            with warnings.catch_warnings():
                # A connection that was being opened at the end may remain.
                warnings.simplefilter("ignore", ResourceWarning)
                gc.collect()

    def _cancel_all(self) -> None:
        left = asyncio.all_tasks(self._loop)
        for task in left:
            task.cancel()
        if left:
            ended = asyncio.gather(*left, return_exceptions=True)
            self._loop.run_until_complete(ended)


async def _settle() -> None:
    """Let closed transports report it and close their sockets."""
    for _ in range(5):
        await asyncio.sleep(0)
