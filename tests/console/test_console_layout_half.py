"""The view with which a page of the console begins."""

import struct
from pathlib import Path

import pytest

from webmap import Map, Robot
from webmap.console.page import MARGIN, Frame, Layout
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.scene.wire.session import SceneSession


class Publisher:
    """Accepts the files of the page; no browser loads them."""

    def publish_file(self, file: Path) -> str:
        assert Path(file).is_file(), file
        return f"/_webmap/{Path(file).name}"


@pytest.fixture
def map():
    entry = PageEntry("/", lambda page: None, None, Path(), "test")
    sizes = {"map": (800.0, 600.0)}
    page = Page(entry, SceneSession(), Viewer("v1", "Ann"), Publisher(), sizes)
    with page.scope.active():
        yield Map(page.element("map"))
    page.close()


@pytest.fixture
def robot(map: Map) -> Robot:
    robot = Robot("Bob")
    robot.valid = True
    map.add_robot(robot)
    return robot


@pytest.fixture
def frame(map: Map, robot: Robot) -> Frame:
    return map.add_module(Frame, "test", None)


@pytest.fixture
def layout(map: Map, frame: Frame) -> Layout:
    return map.add_module(Layout, of="hall")


def test_a_page_with_a_last_view_gets_no_other_view(map, frame, layout):
    before = map.world.tf
    layout.on_message({"own": True})
    frame.place()
    assert map.world.tf == before


def test_the_answer_to_the_page_is_sent_after_the_view_operations(map, frame, layout):
    map.page.channel.frame(0.0)
    frame.place()
    layout.on_message({"own": True})
    data = map.page.channel.frame(1.0)
    assert data.index(struct.pack("<d", -MARGIN)) < data.index(b'{"own":true}')


def test_a_reset_layout_shows_the_robots_again(map, frame, layout):
    layout.on_message({"own": True})
    before = map.world.tf
    layout.on_message({"found": True})
    assert map.world.tf != before


@pytest.mark.parametrize(
    "message", [{}, {"own": 1}, {"found": "yes"}, {"goal": [1, 2]}, {"select": "Bob"}]
)
def test_any_other_message_of_a_layout_is_ignored(map, robot, frame, layout, message):
    before = map.world.tf
    received = []
    layout.browser_part.send = received.append
    layout.on_message(message)
    assert (received, map.world.tf, map.selected) == ([], before, None)
