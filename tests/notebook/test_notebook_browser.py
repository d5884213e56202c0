"""The widget in a real Chromium, with a page that gives what anywidget's host gives."""

import json
import time
from pathlib import Path

import pytest
from notebook_page import NotebookPage
from PIL import Image

import webmap
from webmap.base.geometry import Quaternion, Vector3
from webmap.poses.placing import PoseReading

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def moved(robot: webmap.Robot, x: float, y: float = 0.0) -> None:
    """Set the pose of a robot, in metres."""
    pose = PoseReading(Vector3(x, y, 0.0), Quaternion.from_yaw(0.0))
    webmap.call(robot.show_pose, pose, time.monotonic())


def robot(name: str) -> webmap.Robot:
    return webmap.Robot(name, webmap.svg.circle(r=0.2, fill="rgb(255, 0, 0)"))


def x_of(notebook: NotebookPage, cell: str) -> float:
    box = notebook.tab.locator(f"#{cell} .robot").bounding_box()
    assert box is not None
    return box["x"]


@pytest.fixture
def bob():
    return robot("Bob")


@pytest.fixture
def notebook(tab, bob):
    def page(page):
        page.map = webmap.Map(page.element("webmap_container"))
        page.map.add_robot(bob)

    with_widget = webmap.widget(page, height=300)
    moved(bob, 0.0)
    return NotebookPage(
        tab, with_widget, "body { background: #fff } svg { opacity: 0 }"
    )


def test_the_map_moves_with_the_robot_and_each_frame_is_answered(notebook, bob) -> None:
    notebook.show("one")
    notebook.until(lambda: notebook.count("#one .robot circle"))
    before = x_of(notebook, "one")
    for step in range(1, 21):
        moved(bob, step / 10)
        notebook.carry()
    # 20 pixels per metre, as on a page that WebMap makes.
    notebook.until(lambda: x_of(notebook, "one") - before == pytest.approx(40, abs=0.5))
    answers = [text for text in notebook.to_python if '\\"seen\\"' in text]
    assert len(answers) > 2


def test_the_styles_of_the_notebook_and_of_the_map_do_not_meet(notebook) -> None:
    notebook.show("one")
    notebook.until(lambda: notebook.count("#one svg.webmap"))
    opacity = "(e) => getComputedStyle(e).opacity"
    assert notebook.tab.locator("#one svg.webmap").evaluate(opacity) == "1"
    assert notebook.tab.evaluate("document.adoptedStyleSheets.length") == 0
    assert notebook.count("head > style, head > link") == 1


def test_it_states_that_it_is_for_looking_only_and_has_no_button(notebook) -> None:
    notebook.show("one")
    notebook.until(lambda: notebook.count("#one .robot"))
    words = notebook.tab.locator("#one .webmap-widget-words")
    assert "looking only" in words.inner_text()
    assert "STOP" in words.inner_text()
    assert notebook.count("#one button") == 0
    notebook.tab.locator("#one .robot").click()
    for _ in range(20):
        notebook.carry()
    ops = {json.loads(json.loads(text)["text"])["op"] for text in notebook.to_python}
    assert ops <= {"hello", "seen", "unseen", "view"}


def test_two_cells_have_views_of_their_own_and_a_cleared_one_is_closed(
    notebook, bob
) -> None:
    notebook.show("one")
    notebook.show("two")
    notebook.until(lambda: notebook.count(".robot") == 2)
    notebook.tab.locator("#one svg.webmap").hover()
    notebook.tab.mouse.wheel(0, -300)
    notebook.until(lambda: x_of(notebook, "one") != x_of(notebook, "two"))
    notebook.close("one")
    moved(bob, 1.0)
    before = x_of(notebook, "two")
    moved(bob, 2.0)
    notebook.until(lambda: x_of(notebook, "two") > before)
    assert notebook.count("#one") == 0


def test_a_view_out_of_sight_gets_no_more_than_two_frames(notebook, bob) -> None:
    notebook.show("one")
    notebook.until(lambda: notebook.count("#one .robot"))
    hide = "document.getElementById('one').style.display = 'none'"
    notebook.tab.evaluate(hide)
    for _ in range(20):
        notebook.carry()
    frames = 0
    for step in range(40):
        moved(bob, step / 10)
        time.sleep(0.02)
        frames += notebook.comm.sent.qsize()
        notebook.carry()
    assert frames <= 2
    notebook.tab.evaluate("document.getElementById('one').style.display = ''")
    before = x_of(notebook, "one")
    notebook.until(lambda: x_of(notebook, "one") > before + 50)


def test_the_pictures_of_a_map_come_with_the_frame(tab, tmp_path: Path) -> None:
    Image.new("L", (8, 8), 128).save(tmp_path / "floor.png")

    def page(page):
        map = webmap.Map(page.element("webmap_container"))
        map.add_image(str(tmp_path / "floor.png"), -1, -1, 2, 2)

    notebook = NotebookPage(tab, webmap.widget(page))
    for cell in ("one", "two"):
        notebook.show(cell)
    notebook.until(lambda: notebook.count("image") == 2)
    for image in tab.locator("image").all():
        assert (image.get_attribute("href") or "").startswith("data:image/png;base64,")


@pytest.mark.parametrize(("text", "scheme"), [("#eee", "dark"), ("#111", "light")])
def test_the_theme_is_that_of_the_notebook_or_the_chosen_one(
    tab, text: str, scheme: str
) -> None:
    # The opposite of what the notebook has.
    tab.emulate_media(color_scheme="light" if scheme == "dark" else "dark")
    widget = webmap.widget(lambda page: webmap.Map(page.element("webmap_container")))
    notebook = NotebookPage(tab, widget, f"body {{ color: {text} }}")
    notebook.show("one")
    notebook.until(lambda: notebook.count("#one .webmap-metre-grid"))
    accent = "(e) => getComputedStyle(e).getPropertyValue('--webmap-accent')"
    colours = {"dark": "#6db3ff", "light": "#0b62c4"}
    shown = notebook.tab.locator("#one svg.webmap")
    assert shown.evaluate(accent) == colours[scheme]
    for theme in ("light", "dark"):
        notebook.set(theme=theme)
        assert shown.evaluate(accent) == colours[theme]


def test_a_part_that_needs_the_gate_is_not_there_and_is_named(tab) -> None:
    def page(page):
        map = webmap.Map(page.element("webmap_container"))
        map.add_module("StopButton")

    widget = webmap.widget(page)
    notebook = NotebookPage(tab, widget)
    notebook.show("one")
    missing = tab.locator("#one li", has_text="Not in a notebook: stop_button.")
    notebook.until(missing.count)
    assert notebook.count("#one button") == 0
    assert '$modules["features/stop/' not in widget._esm
    assert "WebSocket" not in widget._esm
    assert "fetch(" not in widget._esm


def test_a_failure_of_the_page_function_is_shown(tab) -> None:
    def page(page):
        raise ValueError("no robots today")

    notebook = NotebookPage(tab, webmap.widget(page))
    notebook.show("one")
    failure = tab.locator("#one .failure", has_text="no robots today")
    notebook.until(failure.count)


def test_a_kernel_that_falls_silent_and_comes_back_is_shown(notebook, bob) -> None:
    notebook.show("one")
    notebook.until(lambda: notebook.count("#one .robot"))
    silent = notebook.tab.locator("#one .failure", has_text="No data from the kernel")
    silent.wait_for()
    moved(bob, 1.0)
    notebook.until(lambda: silent.count() == 0)
