"""Pages whose viewers left: how long they are kept, and what runs meanwhile."""

import asyncio
import gc
import threading
import weakref
from types import SimpleNamespace

import pytest
from page_loop import begin_page, make_model, open_page

import webmap
from equipment.waiting import wait_for
from webmap.base.errors import ConfigError
from webmap.core.operators import Viewer
from webmap.server import open_pages as host_module


def test_an_endless_page_function_is_cancelled_with_its_page(loop, monkeypatch):
    monkeypatch.setattr(host_module, "KEPT_FOR", 0.0)
    began, ended = [], []

    async def build(page):
        began.append(page)
        try:
            while True:
                await asyncio.sleep(0.001)
        finally:
            ended.append(page.closed)

    async def others():
        return len(asyncio.all_tasks())

    before = loop.wait(others())
    handle, _ = open_page(make_model(loop, build))
    wait_for(lambda: began)
    assert loop.wait(others()) == before + 1
    handle.closed()
    wait_for(lambda: ended)
    assert ended == [True]
    wait_for(lambda: loop.wait(others()) == before)


def test_an_exception_in_a_cancelled_page_function_is_not_logged_as_a_failure(
    loop, monkeypatch, caplog
):
    monkeypatch.setattr(host_module, "KEPT_FOR", 0.0)
    began, errors = [], []

    async def build(page):
        began.append(page)
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            try:
                webmap.Map(page.element("webmap_container"))
            except ConfigError as error:
                errors.append(str(error))
                raise

    handle, _ = open_page(make_model(loop, build))
    wait_for(lambda: began)
    handle.closed()
    wait_for(lambda: errors)
    loop.call(lambda: True)
    assert "page '/' of Ann was closed" in errors[0]
    assert "the page function failed" not in caplog.text


def test_pages_that_close_before_their_turn_are_not_built(loop):
    built, busy = [], threading.Event()
    model = make_model(loop, lambda page: built.append(page.viewer.name))
    loop.runtime.call(busy.wait, 30)
    for number in range(300):
        begin_page(model, f"page{number:04}")[0].closed()
    begin_page(model, "page0000", Viewer("v2", "Ben"))
    busy.set()
    wait_for(lambda: built)
    assert loop.call(lambda: len(model._hosts)) == 1
    assert (built, model._unbuilt, model._closed) == (["Ben"], {}, 0)
    loop.call(lambda: model.close() or True)


def test_the_viewers_take_turns_and_the_thread_works_between_two_pages(loop):
    done, busy = [], threading.Event()
    model = make_model(loop, lambda page: done.append(page.viewer.name))
    loop.runtime.call(busy.wait, 30)
    for number in range(20):
        begin_page(model, f"page{number:04}")
    begin_page(model, "page0000", Viewer("v2", "Ben"))
    loop.runtime.call(loop.runtime.call, done.append, "a tick")
    busy.set()
    wait_for(lambda: len(done) == 22)
    assert done[:4] == ["Ann", "a tick", "Ben", "Ann"]
    loop.call(lambda: model.close() or True)


def test_garbage_of_closed_pages_is_not_collected_while_somebody_drives(
    loop, monkeypatch
):
    collected = []
    monkeypatch.setattr(gc, "collect", lambda: collected.append(len(collected)))
    bob = webmap.Robot("Bob")
    model = make_model(loop, lambda page: None)
    bob.report = SimpleNamespace(holder="Ann")
    loop.call(lambda: setattr(model, "_closed", host_module.CLOSED_AT_MOST - 1) or True)
    open_page(model)
    assert collected == []
    loop.call(lambda: setattr(model, "_closed", host_module.CLOSED_AT_MOST) or True)
    open_page(model, "page0002")
    assert collected == [0]
    bob.report = SimpleNamespace(holder=None)
    loop.call(lambda: setattr(model, "_closed", host_module.CLOSED) or True)
    open_page(model, "page0003")
    assert collected == [0, 1]
    loop.call(lambda: [model.close(), bob.destroy()])


def test_at_the_page_limit_the_page_that_was_lost_first_is_removed(loop):
    model = make_model(loop, lambda page: None, max_pages=3)

    def opened():
        loop.call(lambda: True)
        return [page_id for _, page_id, _ in model._hosts]

    handles = [open_page(model, f"page000{number}")[0] for number in (1, 2, 3)]
    handles[1].closed()
    handles[0].closed()
    assert opened() == ["page0001", "page0002", "page0003"]
    open_page(model, "page0004")
    assert opened() == ["page0001", "page0003", "page0004"]
    open_page(model, "page0001")  # the viewer returns
    open_page(model, "page0005")
    assert opened() == ["page0001", "page0003", "page0004", "page0005"]
    loop.call(lambda: model.close() or True)


@pytest.mark.slow
def test_the_number_of_lost_pages_with_new_ids_is_limited(loop):
    built, closed, hosts = [], [], weakref.WeakSet()

    def build(page):
        built.append(page.viewer.name)
        webmap.Map(page.element("webmap_container"))
        page.on_close(lambda: closed.append(True))

    model = make_model(loop, build, max_pages=5)
    for number in range(100):
        open_page(model, f"page{number:04}")[0].closed()
        loop.call(lambda: hosts.update(model._hosts.values()) or True)
    assert (len(built), len(closed)) == (100, 95)
    assert len(model._hosts) == 5
    assert len(hosts) <= 6 + host_module.CLOSED, "the others were collected"
    gc.unfreeze()
    gc.collect()
    assert len(hosts) <= 6, "timers hold too many pages; the last tick may hold one"
    loop.call(lambda: model.close() or True)
