"""The model's thread with pages, without sockets, in place of the server."""

import asyncio
import gc
import json
import threading
from pathlib import Path

from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.runtime import Runtime
from webmap.server.files import Published
from webmap.server.open_pages import OpenPages

ANN = Viewer("v1", "Ann")
HELLO = {
    "op": "hello",
    "page": "page0001",
    "url": "/",
    "width": 800,
    "height": 600,
    "containers": {"webmap_container": [700, 500], "map": [700, 500]},
}


class Loop:
    """The runtime's thread, without gate and bridges."""

    def __init__(self) -> None:
        self.runtime = Runtime()
        self.ready = threading.Event()
        self.thread = threading.Thread(target=self._run)
        self.thread.start()
        assert self.ready.wait(10)

    def _run(self) -> None:
        async def live() -> None:
            runtime = self.runtime
            runtime._loop = asyncio.get_running_loop()
            runtime._thread = self.thread
            self.over = asyncio.Event()
            self.ready.set()
            await self.over.wait()

        asyncio.run(live())

    def call(self, fn, *args):
        """Call a function in the model's thread and return its result."""
        done, result = threading.Event(), []

        def run() -> None:
            try:
                result.append(fn(*args))
            finally:
                done.set()

        self.runtime.call(run)
        assert done.wait(30)
        assert result, "the call raised an exception; see the log"
        return result[0]

    def wait(self, work):
        """Run a coroutine in the model's thread and return its result."""
        return asyncio.run_coroutine_threadsafe(work, self.runtime._loop).result(30)

    def end(self) -> None:
        self.runtime.call(self.over.set)
        self.thread.join(10)


class PageSocket:
    def __init__(self) -> None:
        self.frames: list[bytes] = []
        self.reason: str | None = None

    def offer(self, data: bytes) -> None:
        self.frames.append(data)

    def end(self, code: int, reason: str) -> None:
        self.reason = reason


def make_model(loop, function, max_pages=1000):
    entry = PageEntry("/", function, None, Path(), "test")
    return OpenPages(loop.runtime, {"/": entry}, Published(), max_pages=max_pages)


def begin_page(model, page_id="page0001", viewer=ANN):
    """Open a page; it is built later, when it is the turn of its viewer."""
    socket = PageSocket()
    handle = model.open_scene("/", page_id, viewer, socket)
    handle.receive(json.dumps({**HELLO, "page": page_id}))
    return handle, socket


def open_page(model, page_id="page0001", viewer=ANN):
    """Open a page; the page function has begun when this returns."""
    opened = begin_page(model, page_id, viewer)
    for _ in range(2):
        done = threading.Event()
        model.runtime.call(done.set)
        assert done.wait(30)
    return opened


def objects_left(round_of, rounds: int, pages: int) -> list[int]:
    """Return how many objects are added in each round of some pages.

    A leak adds objects in every round; an import in another thread only in one.
    """
    left = []
    gc.collect()
    for _ in range(rounds):
        before = len(gc.get_objects())
        round_of(pages)
        gc.collect()
        left.append(len(gc.get_objects()) - before)
    return left
