"""The tutorial of layers in the documentation, run in a real browser."""

from pathlib import Path

import pytest
from playwright.sync_api import Browser
from running_simulators import simulators

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of

pytestmark = pytest.mark.browser

EXAMPLE = Path(__file__).parents[3] / "examples" / "layers" / "layers.py"
DRAWN = (
    ".occupancy-grid.map > image[href]",
    ".occupancy-grid.costmap > image[href]",
    ".laserscan > .dot[d]",
    ".pointcloud > .dot.band-7[d]",
    ".range > .cone[d]",
    ".path > polyline",
    ".trail",
    ".posearray > .arrow[d]",
    ".pointstamped.lookahead > .point",
    ".covariance > .ellipse[rx]",
    ".polygon > polygon[points]",
    ".navsatfix > .cross:not([visibility])",
    ".diagnostics.ok",
    ".markers",
)


def test_the_layers_tutorial_draws_all_its_layers(chromium: Browser, tmp_path):
    with simulators("ros1") as found:
        text = EXAMPLE.read_text()
        assert text.count("ws://localhost:9090") == 1
        program = tmp_path / EXAMPLE.name
        program.write_text(text.replace("ws://localhost:9090", found["ros1"].url))
        with page_of(program) as url, watched_tab(chromium, 1000, 700) as tab:
            tab.set_default_timeout(30_000)
            tab.goto(url)
            for selector in DRAWN:
                tab.wait_for_selector(selector, state="attached")
            assert tab.locator(".webmap-notice").count() == 0
