"""The view saved as SVG and PNG: an opened file looks the same as the page."""

import io
import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of, simulator

pytestmark = pytest.mark.browser

HERE = Path(__file__).parents[1]
SVG = "{http://www.w3.org/2000/svg}"
SIZE = (900, 700)


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with page_of(HERE / "scene_of_export.py", PYTHONPATH=str(HERE)) as found:
        yield found


@pytest.fixture(scope="module")
def tab(chromium: Browser, url: str) -> Iterator[Page]:
    with watched_tab(chromium, *SIZE) as page:
        page.goto(url)
        for shown in (".occupancy-grid.map image", ".images image", ".marker.text"):
            page.wait_for_selector(f"{shown}", state="attached")
        page.wait_for_function(
            "[...document.querySelectorAll('.world image')].length === 3 &&"
            " [...document.querySelectorAll('.world image')].every("
            "(i) => i.hasAttribute('href'))"
        )
        # Stale elements stay stale, so the picture does not change any more.
        page.wait_for_selector(".robot.stale > .path.stale", state="attached")
        page.wait_for_selector(".webmap-export-go")
        page.wait_for_load_state("networkidle")
        page.evaluate(DECODED)
        yield page


DECODED = """() => Promise.all(
  [...document.querySelectorAll(".world image")].map((image) => {
    const bitmap = new Image();
    bitmap.src = image.getAttribute("href");
    return bitmap.decode();
  })).then(() => true)"""
"""Whether the images are decoded; they have addresses earlier."""


def saved(tab: Page, kind: str, folder: Path) -> Path:
    """Save the view with only the keyboard; return the file."""
    tab.locator(".webmap-export-go").focus()
    tab.keyboard.press("Enter")
    expect(tab.locator(".webmap-export-svg")).to_be_focused()
    if kind == "png":
        tab.keyboard.press("Tab")
    with tab.expect_download() as download:
        tab.keyboard.press("Enter")
    name = download.value.suggested_filename
    assert re.fullmatch(rf"webmap-20\d\d-\d\d-\d\d-\d{{6}}\.{kind}", name)
    download.value.save_as(folder / name)
    return folder / name


def pixels(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def drawn_alone(chromium: Browser, file: Path, width: int, height: int) -> np.ndarray:
    """Return a screenshot of a file that a browser opens offline."""
    context = chromium.new_context(
        viewport={"width": width, "height": height}, offline=True
    )
    page = context.new_page()
    page.goto(file.as_uri())
    picture = pixels(page.screenshot())
    context.close()
    return picture


def differing(one: np.ndarray, other: np.ndarray) -> float:
    """Return the share of pixels whose colours clearly differ."""
    assert one.shape == other.shape
    return float((np.abs(one - other).max(axis=2) > 24).mean())


HIDE = "for (const e of document.querySelectorAll(%r)) e.style.visibility = 'hidden'"


def test_the_exported_svg_looks_like_the_page(tab, chromium, tmp_path):
    file = saved(tab, "svg", tmp_path)
    page = pixels(tab.screenshot())
    alone = drawn_alone(chromium, file, *SIZE)
    beside = np.s_[80:660, :]  # the tool is above, the frame of the scale below
    assert differing(page[beside], alone[beside]) < 0.002
    for colour in [(0xCF, 0xE8, 0xD5), (250, 120, 0), (0, 0, 255)]:
        assert (np.abs(alone - colour).max(axis=2) < 4).sum() > 100, colour


def test_the_exported_svg_contains_the_scale_bar_and_its_text(tab, chromium, tmp_path):
    box = tab.locator(".webmap-scale-bar").bounding_box()
    words = tab.locator(".webmap-scale-bar-text").inner_text()
    file = saved(tab, "svg", tmp_path)
    texts = [t.text for t in ElementTree.parse(file).iter(f"{SVG}text")]
    assert words in texts
    alone = drawn_alone(chromium, file, *SIZE)
    part = np.s_[
        int(box["y"]) : int(box["y"] + box["height"]),
        int(box["x"]) : int(box["x"] + box["width"]),
    ]
    assert differing(pixels(tab.screenshot())[part], alone[part]) < 0.15


def test_the_exported_svg_has_no_external_references_and_no_scripts(tab, tmp_path):
    text = saved(tab, "svg", tmp_path).read_text("utf-8")
    root = ElementTree.fromstring(text)
    assert root.tag == f"{SVG}svg"
    for element in root.iter():
        assert element.tag.startswith(SVG)
        assert element.tag not in {f"{SVG}script", f"{SVG}style", f"{SVG}foreignObject"}
        for name, value in element.attrib.items():
            assert not name.lower().startswith("on"), name
            assert name not in ("class", "style"), name
            if name.endswith("href"):
                assert value.startswith(("#", "data:image/png;base64,")), value[:40]
            assert "url(" not in value.replace('url("#', "").replace("url(#", "")
    images = list(root.iter(f"{SVG}image"))
    assert len(images) == 3
    assert "<b>Küche</b>" in [t.text for t in root.iter(f"{SVG}text")]
    assert tab.url.split("/")[2] not in text
    # Without the page's fonts, a font of the same kind has about the same size.
    families = [e.get("font-family") for e in root.iter() if e.get("font-family")]
    assert families
    for family in families:
        assert re.search(r"\b(sans-serif|serif|monospace)\b", family), family
    for words in root.iter(f"{SVG}text"):
        assert words.text is None or float(words.get("textLength", 0)) > 0, words.text


def test_an_exported_line_has_all_digits_of_its_numbers(tab, tmp_path):
    root = ElementTree.parse(saved(tab, "svg", tmp_path))
    lines = [line.get("points") for line in root.iter(f"{SVG}polyline")]
    assert "12345.678,-1.25 5000000.5,0.1" in lines


def test_exported_texts_have_the_same_width_in_another_font(tab, chromium, tmp_path):
    file = saved(tab, "svg", tmp_path)
    text = file.read_text("utf-8")
    other = tmp_path / "other.svg"
    other.write_text(re.sub(r'font-family="[^"]*"', 'font-family="monospace"', text))
    assert other.read_text() != text
    measure = "[...document.querySelectorAll('text')].map(t => t.getBBox().width)"
    widths = []
    for each in (file, other):
        page = chromium.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        page.goto(each.as_uri())
        widths.append(page.evaluate(measure))
        page.close()
    assert len(widths[0]) > 1
    assert widths[1] == pytest.approx(widths[0], rel=0.02)


def test_the_exported_png_looks_like_the_page(tab, chromium, tmp_path):
    file = saved(tab, "png", tmp_path)
    page, image = pixels(tab.screenshot()), pixels(file.read_bytes())
    beside = np.s_[80:660, :]
    assert differing(page[beside], image[beside]) < 0.002


def test_hidden_images_are_not_exported(tab, tmp_path):
    tab.evaluate("document.querySelector('.images image').style.display = 'none'")
    root = ElementTree.parse(saved(tab, "svg", tmp_path))
    tab.evaluate("document.querySelector('.images image').style.display = ''")
    assert len(list(root.iter(f"{SVG}image"))) == 2


def test_escape_closes_the_export_menu_and_restores_the_focus(tab):
    go = tab.locator(".webmap-export-go")
    go.click()
    expect(tab.locator(".webmap-export-menu")).to_be_visible()
    expect(go).to_have_attribute("aria-expanded", "true")
    tab.keyboard.press("Escape")
    expect(tab.locator(".webmap-export-menu")).to_be_hidden()
    expect(go).to_be_focused()
    go.click()
    tab.mouse.click(450, 350)
    expect(tab.locator(".webmap-export-menu")).to_be_hidden()


def test_an_image_that_cannot_be_loaded_is_left_out_with_a_notice(tab, tmp_path):
    tab.evaluate(
        "document.querySelector('.images image').setAttribute("
        "'href', '/_webmap/images/gone')"
    )
    tab.allowed.append("404")
    root = ElementTree.parse(saved(tab, "svg", tmp_path))
    assert len(list(root.iter(f"{SVG}image"))) == 2
    expect(tab.locator(".webmap-notice")).to_contain_text("without 1 image that")


FLEET = """\
[bridges]
hall = "{url}"

[map]
topic = "/map"

[[robots]]
name = "Bob"
odometry = "/robot_0/odom"

[[robots]]
name = "Ann"
odometry = "/robot_1/odom"
"""


@pytest.fixture(scope="module")
def console(tmp_path_factory) -> Iterator[str]:
    file = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    with simulator("--robots", "2") as bridge:
        file.write_text(FLEET.format(url=bridge))
        with page_of(file) as found:
            yield found


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_export_button_of_the_console_saves_its_map(
    chromium, console, scheme, tmp_path
):
    with watched_tab(chromium, 1280, 800) as tab:
        tab.emulate_media(color_scheme=scheme)
        tab.goto(console)
        expect(tab.locator(".robot:not(.unplaced)")).to_have_count(2)
        tab.wait_for_selector(".occupancy-grid image[href]", state="attached")
        tab.locator("#robots .row").first.click()
        expect(tab.locator(".robot.selected")).to_have_count(1)
        tab.locator("#show-all").click()
        expect(tab.locator(".tools .webmap-export-go")).to_have_count(1)
        file = saved(tab, "svg", tmp_path)
        tab.evaluate(HIDE % ".map-tools, .stop-place, .webmap-frame")
        box = tab.locator("svg.webmap").bounding_box()
        page = pixels(tab.screenshot(clip=box))
        alone = drawn_alone(chromium, file, int(box["width"]), int(box["height"]))
    # The scale is hidden on the page and in the file.
    assert differing(page[:-60], alone[:-60]) < 0.003


def test_the_export_menu_fits_on_a_phone_screen(chromium, console):
    with watched_tab(chromium, 390, 844) as tab:
        tab.goto(console)
        tab.get_by_role("button", name="More tools").click()
        tab.locator(".webmap-export-go").click()
        expect(tab.locator(".webmap-export-png")).to_be_visible()
        box = tab.locator(".webmap-export-menu").bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 390
        assert tab.evaluate("scrollX") == 0
