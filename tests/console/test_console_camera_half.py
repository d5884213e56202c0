"""The Python half of the camera panel, without a browser."""

from pathlib import Path

import pytest

from webmap import Map, Robot
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.features.cameras.camera import CameraFeed
from webmap.features.cameras.camera_panel import (
    CameraPanel,
    CameraViews,
    camera_number,
)
from webmap.scene.wire.session import SceneSession


class Feed(CameraFeed):
    """A camera with pictures that a test provides."""

    def begin(self) -> None:
        pass

    def end(self) -> None:
        pass


class Files:
    def publish_file(self, path):
        assert path.is_file()
        return f"/_webmap/files/x/{path.name}"


@pytest.fixture
def robot():
    robot = Robot("Bob")
    yield robot
    robot.destroy()


@pytest.fixture
def map(robot):
    entry = PageEntry("/", lambda page: None, None, Path(), "test")
    session = SceneSession()
    session.sent = []
    session.send = lambda instance, message: session.sent.append(message)
    page = Page(entry, session, Viewer("v1", "Ann"), Files(), {"map": (800.0, 600.0)})
    with page.scope.active():
        map = Map(page.element("map"))
        map.add_robot(robot)
        yield map
    page.close()


@pytest.fixture
def panel(map):
    return map.add_module(CameraPanel)


@pytest.fixture
def said(map):
    return map.page.channel.sent


def test_the_page_receives_the_cameras_of_the_selected_robot(map, robot, panel, said):
    front = robot.add_module(Feed, "Front")
    map.set_selected(robot)
    assert said[-1]["cameras"] == [{"id": camera_number(front), "name": "Front"}]
    assert (said[-1]["robot"], said[-1]["name"]) == (robot.id, "Bob")
    map.set_selected(None)
    assert said[-1]["cameras"] == []


def test_the_page_receives_cameras_added_or_removed_later(map, robot, panel, said):
    map.set_selected(robot)
    panel.poll()
    received = len(said)
    panel.poll()
    assert len(said) == received
    rear = robot.add_module(Feed, "Rear")
    panel.poll()
    assert [camera["name"] for camera in said[-1]["cameras"]] == ["Rear"]
    robot.remove_module(rear)
    panel.poll()
    assert said[-1]["cameras"] == []


def test_pictures_are_sent_of_the_watched_camera(map, robot, panel, said):
    front, rear = robot.add_module(Feed, "Front"), robot.add_module(Feed, "Rear")
    map.set_selected(robot)
    panel.on_message({"op": "watch", "camera": camera_number(front)})
    assert front.watched
    assert not rear.watched
    front.show(b"picture", "image/jpeg")
    assert said[-1] == {
        "op": "picture",
        "camera": camera_number(front),
        "url": front.url,
        "stamp": front.stamp,
    }
    panel.on_message({"op": "watch", "camera": camera_number(rear)})
    assert (front.watched, rear.watched) == (False, True)
    panel.on_message({"op": "watch", "camera": None})
    assert not rear.watched


def test_a_page_cannot_watch_a_camera_with_a_foreign_or_invalid_id(map, robot, panel):
    front = robot.add_module(Feed, "Front")
    elsewhere = Robot("Al")
    other = elsewhere.add_module(Feed, "Front")
    map.set_selected(robot)
    wrong = [camera_number(other), 10**30, -1, 0, "1", 1.0, True, [1], {}, None]
    for number in wrong:
        panel.on_message({"op": "watch", "camera": number})
        assert not other.watched
        assert not front.watched
    panel.on_message({"camera": camera_number(front)})
    assert not front.watched
    elsewhere.destroy()


def test_a_camera_is_not_watched_after_deselection_or_removal_of_the_panel(
    map, robot, panel
):
    front = robot.add_module(Feed, "Front")
    for leave in (lambda: map.set_selected(None), lambda: map.remove_module(panel)):
        map.set_selected(robot)
        panel.on_message({"op": "watch", "camera": camera_number(front)})
        assert front.watched
        leave()
        assert not front.watched


def test_a_camera_added_later_is_also_on_the_card(robot):
    views = CameraViews()
    views.show(robot)
    assert len(views.element.children) == 0
    robot.add_module(Feed, "Front")
    views.poll()
    views.poll()
    assert len(views.element.children) == 1
    views.show(None)
    assert len(views.element.children) == 0
