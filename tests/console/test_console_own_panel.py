"""The example with a panel of its own in the console."""

import asyncio
import runpy
from pathlib import Path

import pytest

from webmap.core.base_page import PageEntry, Viewer
from webmap.core.page import Page, site
from webmap.scene.wire.session import SceneSession

EXAMPLE = Path(__file__).parents[2] / "examples" / "console" / "panel.py"


def test_the_panel_of_the_example_shows_the_battery_of_the_selected_robot(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(site, "pages", {})
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))

    async def run() -> None:
        example = runpy.run_path(str(EXAMPLE), run_name="example")
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
