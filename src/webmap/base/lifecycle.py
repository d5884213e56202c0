"""The life cycle of services: constructors register, :func:`webmap.start` does the I/O.

A :class:`LifecycleService`, such as a bridge, adds itself to :data:`lifecycle` when it
is created. Nothing happens until the model's event loop runs; from then on an added
service starts at once.
"""

import asyncio
import logging
import threading
import weakref
from collections.abc import Callable
from typing import Any, Protocol

log = logging.getLogger("webmap")


class LifecycleService(Protocol):
    """An object with I/O of its own on the model's event loop."""

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin the work; called in the loop's thread."""

    async def stop(self) -> None:
        """End the work; :meth:`start` may begin it again."""


class Lifecycle:
    """The services of one process and the event loop that they run on."""

    def __init__(self) -> None:
        self.loop: asyncio.AbstractEventLoop | None = None
        self._thread: int | None = None
        self._services: weakref.WeakSet[Any] = weakref.WeakSet()
        self._stopping: set[asyncio.Task[None]] = set()

    @property
    def running(self) -> bool:
        """Whether the model's event loop runs now."""
        return self.loop is not None

    @property
    def services(self) -> list[Any]:
        """The services, in any order."""
        return list(self._services)

    def add(self, service: LifecycleService) -> None:
        """Start ``service`` with the process, or now if that has started."""
        self._services.add(service)
        if self.loop is not None:
            self.call(service.start, self.loop)

    def discard(self, service: LifecycleService) -> None:
        """Forget ``service``, without stopping it."""
        self._services.discard(service)

    def end_service(self, service: LifecycleService) -> None:
        """Forget ``service`` and stop it soon, if the process has started."""
        self.discard(service)
        if self.loop is not None:
            self.call(self._begin_to_stop, service)

    def _begin_to_stop(self, service: LifecycleService) -> None:
        task = asyncio.get_running_loop().create_task(_stop(service))
        self._stopping.add(task)
        task.add_done_callback(self._stopping.discard)

    def call(self, fn: Callable[..., object], /, *args: Any) -> None:
        """Call ``fn`` in the model's thread: now if this is it, else soon.

        Raises:
            RuntimeError: If the model's event loop does not run.

        """
        if self.loop is None:
            raise RuntimeError("WebMap has not been started: call webmap.start()")
        if threading.get_ident() == self._thread:
            fn(*args)
        else:
            self.loop.call_soon_threadsafe(fn, *args)

    def begin(self, loop: asyncio.AbstractEventLoop) -> None:
        """Start every service on ``loop``, from the loop's own thread."""
        self.loop, self._thread = loop, threading.get_ident()
        for service in list(self._services):
            service.start(loop)

    async def end(self) -> None:
        """Stop every service, also when one of them raises."""
        services, self.loop = list(self._services), None
        stopping = [_stop(service) for service in services]
        await asyncio.gather(*stopping, *self._stopping, return_exceptions=True)


async def _stop(service: LifecycleService) -> None:
    try:
        await service.stop()
    except Exception as error:
        log.error("%r did not stop cleanly", service, exc_info=error)


lifecycle = Lifecycle()
"""The only life cycle of this process."""
