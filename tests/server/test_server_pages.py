"""Pages as they come and go: what a page function makes lasts as long as its page."""

import gc
import json
import threading
import time
from pathlib import Path

import pytest

import webmap
from webmap.core.layer import Layer
from webmap.core.page import PageEntry
from webmap.core.runtime import Runtime
from webmap.core.tasks import spawn
from webmap.scope import Removal, keep
from webmap.server import page_host as host_module
from webmap.server.model import Model
from webmap.server.published import Published
from webmap.server.viewer import Viewer

ANN = Viewer("v1", "Ann")
HELLO = {
    "op": "hello",
    "page": "page0001",
    "url": "/",
    "width": 800,
    "height": 600,
    "containers": {"webmap_container": [700, 500]},
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
        import asyncio

        async def live() -> None:
            runtime = self.runtime
            runtime._loop = asyncio.get_running_loop()
            runtime._thread = self.thread
            self.over = asyncio.Event()
            ticking = spawn(runtime._tick_on())
            self.ready.set()
            await self.over.wait()
            ticking.cancel()

        asyncio.run(live())

    def call(self, fn, *args):
        """Call in the model's thread and return what it returned."""
        done, result = threading.Event(), []

        def run() -> None:
            try:
                result.append(fn(*args))
            finally:
                done.set()

        self.runtime.call(run)
        assert done.wait(30)
        assert result, "it raised; the log says what"
        return result[0]

    def end(self) -> None:
        self.runtime.call(self.over.set)
        self.thread.join(10)


class Outbox:
    def __init__(self) -> None:
        self.frames: list[bytes] = []
        self.reason: str | None = None

    def offer(self, data: bytes) -> None:
        self.frames.append(data)

    def close(self, reason: str) -> None:
        self.reason = reason


@pytest.fixture
def loop():
    loop = Loop()
    yield loop
    loop.end()


def make_model(loop, function):
    entry = PageEntry("/", function, None, Path(), "test")
    return Model(loop.runtime, {"/": entry}, Published())


def open_page(model, page_id="page0001", viewer=ANN):
    outbox = Outbox()
    handle = model.open_scene("/", page_id, viewer, outbox)
    handle.receive(json.dumps({**HELLO, "page": page_id}))
    return handle, outbox


def wait_for(condition):
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline, "it did not happen"
        time.sleep(0.01)


def test_the_page_function_knows_the_container_and_a_frame_comes(loop):
    seen = []

    def build(page):
        map = webmap.Map(page.element("webmap_container"))
        seen.append((map.canvas_width, map.canvas_height, page.viewer.name))

    model = make_model(loop, build)
    _, outbox = open_page(model)
    wait_for(lambda: outbox.frames)
    assert seen == [(700, 500, "Ann")]
    loop.call(lambda: model.close() or True)


def test_an_async_page_function_may_wait(loop):
    import asyncio

    done = []

    async def build(page):
        await asyncio.sleep(0)
        webmap.Map(page.element("webmap_container"))
        done.append(True)

    model = make_model(loop, build)
    open_page(model)
    wait_for(lambda: done)
    loop.call(lambda: model.close() or True)


def test_an_exception_shows_on_that_page_and_the_others_go_on(loop):
    def build(page):
        if page.viewer.name == "Bob":
            raise RuntimeError("no robot today")
        webmap.Map(page.element("webmap_container"))

    model = make_model(loop, build)
    _, bad = open_page(model, "page0002", Viewer("v2", "Bob"))
    _, good = open_page(model)
    wait_for(lambda: good.frames and bad.frames)
    assert b"no robot today" in b"".join(bad.frames)
    assert b"no robot today" not in b"".join(good.frames)
    loop.call(lambda: model.close() or True)


@pytest.mark.parametrize(
    "garbage", ["", "{", "[]", '{"op": "hello"}', '{"op": "fly"}', "x" * 20_000]
)
def test_garbage_from_a_page_is_refused_and_the_page_goes_on(loop, garbage):
    model = make_model(loop, lambda page: None)
    handle, outbox = open_page(model)
    handle.receive(garbage)
    handle.receive(json.dumps(HELLO))
    loop.call(lambda: True)
    assert outbox.reason is None
    loop.call(lambda: model.close() or True)


def test_the_map_is_kept_for_a_viewer_who_comes_back(loop):
    made = []

    def build(page):
        made.append(webmap.Map(page.element("webmap_container")))

    model = make_model(loop, build)
    handle, _ = open_page(model)
    wait_for(lambda: made)
    handle.closed()
    _, outbox = open_page(model)
    wait_for(lambda: outbox.frames)
    assert len(made) == 1
    loop.call(lambda: model.close() or True)


def test_another_viewer_does_not_get_the_page_of_the_first(loop):
    made = []
    model = make_model(loop, made.append)
    handle, _ = open_page(model)
    wait_for(lambda: made)
    handle.closed()
    open_page(model, viewer=Viewer("v2", "Eve"))
    wait_for(lambda: len(made) == 2)
    loop.call(lambda: model.close() or True)


def test_a_viewer_who_stays_away_loses_the_map(loop, monkeypatch):
    monkeypatch.setattr(host_module, "KEPT_FOR", 0.01)
    ended = []

    def build(page):
        page.on_close(lambda: ended.append(True))

    model = make_model(loop, build)
    handle, _ = open_page(model)
    handle.closed()
    wait_for(lambda: ended)


class Link:
    """A bridge that counts who listens."""

    url = "ws://test:9090"

    def __init__(self) -> None:
        self.listeners: list = []

    def subscribe(self, topic, callback, type=None, **options):
        self.listeners.append(callback)
        return keep(Removal(lambda: self.listeners.remove(callback)))

    def on_open(self, fn):
        self.listeners.append(fn)
        return keep(Removal(lambda: self.listeners.remove(fn)))


class Grid(Layer):
    def __init__(self, link) -> None:
        super().__init__()
        self.link = link
        self.decoded = 0

    def start(self) -> None:
        self.link.subscribe("/map", self.take)

    def take(self, message) -> None:
        self.decoded += 1
        self.svg.clear()
        self.svg.append(webmap.svg.rect(width=message, height=1))


def test_a_thousand_pages_opened_and_closed_leave_nothing_behind(loop, monkeypatch):
    monkeypatch.setattr(host_module, "KEPT_FOR", 0.0)
    link = Link()
    bob = webmap.Robot("Bob")
    built = []

    def build(page):
        built.append(page.viewer.name)
        map = webmap.Map(page.element("webmap_container"), 700, 500)
        map.add_module("MouseViewControl")
        map.add_module("ShowSelected", page.element("selected"))
        map.add_module("Teleop", 1.0, 1.5)
        map.add_layer(Grid.shared(link))
        map.add_robot(bob)
        map.set_selected(bob)
        map.on(bob.svg, "click", print)
        bob.svg.on("dblclick", print)
        link.on_open(print)
        link.subscribe("/own", print)

    model = make_model(loop, build)
    nodes = len(bob.fragment)

    def round_of(count):
        for number in range(count):
            handle, outbox = open_page(model, f"page{number:04}")
            handle.closed()
            del outbox
        loop.call(lambda: True)
        wait_for(lambda: not model._hosts)

    round_of(50)
    gc.collect()
    before = len(gc.get_objects())
    round_of(1000)
    gc.collect()
    after = len(gc.get_objects())
    assert len(built) == 1050
    assert link.listeners == []
    assert Layer._shared == {}
    assert bob.maps == []
    assert not bob.selected
    assert bob.svg.handlers("dblclick") == ()
    assert len(bob.fragment) == nodes
    assert loop.runtime._watchers == {}
    assert after - before < 2000, "fewer than two objects for each page"
    loop.call(lambda: bob.destroy() or True)


def test_fifty_viewers_of_one_grid_cost_one_decode_and_one_encoding(loop):
    link = Link()
    layers = []

    def build(page):
        map = webmap.Map(page.element("webmap_container"), 700, 500)
        layers.append(Grid.shared(link))
        map.add_layer(layers[-1])

    model = make_model(loop, build)
    pages = [open_page(model, f"page{number:04}") for number in range(50)]
    wait_for(lambda: all(outbox.frames for _, outbox in pages))
    for handle, outbox in pages:
        count = len(outbox.frames)
        for frame in range(1, count + 1):
            handle.receive(json.dumps({"op": "seen", "frame": frame}))
    loop.call(lambda: True)
    assert len(link.listeners) == 1
    said = [len(outbox.frames) for _, outbox in pages]
    loop.call(lambda: link.listeners[0](7) or True)
    wait_for(
        lambda: all(
            len(outbox.frames) > count
            for (_, outbox), count in zip(pages, said, strict=True)
        )
    )
    assert layers[0].decoded == 1
    assert all(layer is layers[0] for layer in layers)
    bodies = {
        outbox.frames[count][15:]
        for (_, outbox), count in zip(pages, said, strict=True)
    }
    assert len(bodies) == 1
    loop.call(lambda: model.close() or True)
