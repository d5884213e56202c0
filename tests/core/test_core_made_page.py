"""A page whose HTML is made by WebMap."""

import asyncio
from pathlib import Path

import pytest

from webmap import Map
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.scene.wire.session import SceneSession


def completed(function, html: Path | None = None) -> tuple[list[str], float]:
    """Return the modules of a page's map and its pixels per metre."""

    async def run() -> tuple[list[str], float]:
        entry = PageEntry("/", function, html, Path(), "test")
        sizes = {"webmap_container": (800.0, 600.0)}
        page = Page(entry, SceneSession(), Viewer("v1", "Ann"), None, sizes)
        with page.scope.active():
            map = Map(page.element("webmap_container"))
            function(map)
            page.complete()
        names = [type(module).__name__ for module in map.modules]
        scale = map.world.tf.a
        page.close()
        return names, scale

    return asyncio.run(run())


def test_a_map_on_a_made_page_gets_a_grid_a_view_control_and_a_view():
    assert completed(lambda map: None) == (["MetreGrid", "MouseViewControl"], 20.0)


def test_a_view_and_a_module_set_by_the_program_are_kept():
    def function(map: Map) -> None:
        map.add_module("MouseViewControl")
        map.scale(50)

    assert completed(function) == (["MouseViewControl", "MetreGrid"], 50.0)


@pytest.mark.parametrize("scale", [1.0, 30.0])
def test_a_page_with_html_of_the_program_is_not_changed(scale):
    def function(map: Map) -> None:
        if scale != 1.0:
            map.scale(scale)

    assert completed(function, Path("index.html")) == ([], scale)
