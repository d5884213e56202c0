"""An async page function that takes longer than its viewer stays."""

import asyncio

from page_loop import make_model, open_page, wait_for

import webmap
from webmap.errors import ConfigError
from webmap.server import page_host as host_module


def test_a_page_function_that_is_late_makes_no_map_and_is_no_failure(
    loop, monkeypatch, caplog
):
    monkeypatch.setattr(host_module, "KEPT_FOR", 0.0)
    ended, said = [], []
    robots_told = asyncio.Event()

    async def build(page):
        page.on_close(lambda: ended.append(True))
        await robots_told.wait()
        try:
            webmap.Map(page.element("webmap_container"))
        except ConfigError as error:
            said.append(str(error))
            raise

    handle, _ = open_page(make_model(loop, build))
    handle.closed()
    wait_for(lambda: ended)
    loop.call(lambda: robots_told.set() or True)
    wait_for(lambda: said)
    loop.call(lambda: True)
    assert "page '/' of Ann was closed" in said[0]
    assert "the page function failed" not in caplog.text
