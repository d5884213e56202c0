"""The drawing of every layer from fixed messages matches its recording."""

import pytest
from drawn_files import make_files
from drawn_pictures import CONSOLE, HERE, expect_drawn, opened, robots
from fixed_bridge import FixedBridge, fixed_bridge
from fixed_site import STEPS
from playwright.sync_api import Page, expect

from equipment.webmap_process import page_of, webmap

# On a busy machine the pages may show for a long time that links are slow.
pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.timeout(600)]


@pytest.fixture(autouse=True)
def own_state(tmp_path, monkeypatch):
    """Use a separate state folder, without the marks of other tests."""
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path / "state"))


def go_along(page: Page, bridge: FixedBridge, *behind: str) -> None:
    """Move Anna step by step, once all layers that follow her are drawn."""
    for selector in behind:
        page.locator(selector).first.wait_for(state="attached")
    anna = page.locator('.robot[data-name="anna" i]')
    for step in range(1, len(STEPS)):
        before = anna.get_attribute("transform")
        bridge.step = step
        page.wait_for_function(
            "([robot, before]) => robot.getAttribute('transform') !== before",
            arg=[anna.element_handle(), before],
        )


def send_scans_again(page: Page) -> None:
    """Get the scans for this view: a page keeps finer ones of an earlier view."""
    scans = page.get_by_role("checkbox", name="Scans", exact=True)
    dots = page.locator(".laserscan > .dot[d^=M]")
    count = dots.count()
    scans.uncheck()
    expect(dots).to_have_count(0)
    scans.check()
    expect(dots).to_have_count(count)


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_discovered_robots_and_layers_match_the_recorded_drawing(chromium, dialect):
    with (
        fixed_bridge(dialect) as bridge,
        webmap("view", bridge.url, "--port", "0", "--no-browser") as url,
        opened(chromium, url, robots(4), *CONSOLE) as page,
    ):
        fix = ".navsatfix > .cross:not([visibility])"
        go_along(page, bridge, ".trail", fix, ".pointcloud > .band-7[d]")
        page.locator(".webmap-layers > summary").click()
        page.get_by_role("checkbox", name="Costmaps", exact=True).check()
        page.locator("#show-all").click()
        send_scans_again(page)
        # Layers that are found together are on the map in the order of the requests.
        expect_drawn(page, f"view_{dialect}", level=[".world"])


def test_every_pose_source_and_layer_option_matches_the_recorded_drawing(
    chromium, tmp_path
):
    make_files(tmp_path)
    with fixed_bridge("ros1") as bridge:
        received = {"DRAWN_BRIDGE": bridge.url, "DRAWN_FILES": str(tmp_path)}
        file = HERE / "page_of_drawn.py"
        with (
            page_of(file, PYTHONPATH=str(HERE), **received) as url,
            opened(chromium, url, robots(6)) as page,
        ):
            go_along(page, bridge, ".trail")
            expect_drawn(page, "page")


def test_a_fleet_file_matches_the_recorded_drawing(chromium, tmp_path):
    make_files(tmp_path)
    with fixed_bridge("ros2") as bridge:
        text = (HERE / "fixed_fleet.toml").read_text().replace("BRIDGE", bridge.url)
        fleet = tmp_path / "fleet.toml"
        fleet.write_text(text)
        shown = (robots(3), *CONSOLE)
        with page_of(fleet) as url, opened(chromium, url, *shown) as page:
            page.locator("#robots .row button").first.click()
            go_along(page, bridge)
            expect_drawn(page, "fleet")
