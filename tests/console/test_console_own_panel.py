"""The examples with a panel of its own in the console, and with a page beside it."""

import asyncio
import runpy
from pathlib import Path

import pytest

from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page, site
from webmap.scene.wire.session import SceneSession

EXAMPLES = Path(__file__).parents[2] / "examples" / "console"


def test_the_panel_of_the_example_shows_the_battery_of_the_selected_robot(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(site, "pages", {})
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))

    async def run() -> None:
        example = runpy.run_path(str(EXAMPLES / "panel.py"), run_name="example")
        sizes = {"map": (800.0, 600.0)}
        viewer = Viewer("v1", "Ann")
        entry = PageEntry("/", lambda page: None, None, Path(), "test")
        page = Page(entry, SceneSession(), viewer, None, sizes)
        with page.scope.active():
            site.pages["/"].function(page)
        (robot,) = example["console"].given
        panel = page.element("panel-body")
        assert "Select a robot." in panel.text
        page.maps[0].set_selected(robot)
        assert "Bob: unknown" in panel.text
        battery = next(m for m in robot.modules if hasattr(m, "charge"))
        battery.charge = 0.5
        page.maps[0].notify_modules("on_battery_update", battery)
        assert "Bob: 50%" in panel.text
        page.close()
        robot.destroy()

    asyncio.run(run())


def test_the_page_beside_the_console_shows_its_robots_without_controls(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(site, "pages", {})
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))

    async def run() -> None:
        example = runpy.run_path(str(EXAMPLES / "wall.py"), run_name="example")
        assert set(site.pages) == {"/", "/hand-over", "/wall"}
        entry, sizes = site.pages["/wall"], {"webmap_container": (800.0, 600.0)}
        page = Page(entry, SceneSession(), Viewer("v1", "Ann"), None, sizes)
        with page.scope.active():
            entry.function(page)
        (robot,) = example["console"].given
        (map,) = page.maps
        assert list(map.robots) == [robot]
        assert {type(module).__name__ for module in map.modules} <= {
            "MetreGrid",
            "MouseViewControl",
        }
        page.close()
        robot.destroy()

    asyncio.run(run())
