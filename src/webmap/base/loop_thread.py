"""An event loop in a thread, for code that blocks."""

import asyncio
import gc
import threading
import warnings
from collections.abc import Callable, Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


class LoopThread:
    """Runs an event loop in a separate thread.

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
