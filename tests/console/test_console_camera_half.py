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


def watch(panel, *cameras, wall=False):
    numbers = [camera_number(camera) for camera in cameras]
    panel.on_message({"op": "watch", "cameras": numbers, "wall": wall})


def test_pictures_are_sent_of_the_watched_camera(map, robot, panel, said):
    front, rear = robot.add_module(Feed, "Front"), robot.add_module(Feed, "Rear")
    map.set_selected(robot)
    watch(panel, front)
    assert front.watched
    assert not rear.watched
    front.show(b"picture", "image/jpeg")
    assert said[-1] == {
        "op": "picture",
        "camera": camera_number(front),
        "url": front.url,
        "stamp": front.stamp,
    }
    watch(panel, rear)
    assert (front.watched, rear.watched) == (False, True)
    watch(panel)
    assert not rear.watched


def test_a_page_cannot_watch_a_camera_with_a_foreign_or_invalid_id(map, robot, panel):
    front = robot.add_module(Feed, "Front")
    elsewhere = Robot("Al")
    other = elsewhere.add_module(Feed, "Front")
    map.set_selected(robot)
    wrong = [camera_number(other), 10**30, -1, 0, "1", 1.0, True, [1], {}, None]
    for cameras in (*([number] for number in wrong), 7, None, "1", {}):
        for wall in (False, True):
            panel.on_message({"op": "watch", "cameras": cameras, "wall": wall})
            assert not other.watched
            assert not front.watched
    panel.on_message({"cameras": [camera_number(front)]})
    assert not front.watched
    for robot in (elsewhere.id, 7, None, []):
        panel.on_message({"op": "select", "robot": robot})
    assert map.selected is not elsewhere
    elsewhere.destroy()


def test_a_camera_is_not_watched_after_deselection_or_removal_of_the_panel(
    map, robot, panel
):
    front = robot.add_module(Feed, "Front")
    for leave in (lambda: map.set_selected(None), lambda: map.remove_module(panel)):
        map.set_selected(robot)
        watch(panel, front)
        assert front.watched
        leave()
        assert not front.watched


@pytest.fixture
def others(map):
    """Further robots of the map, each with two cameras."""
    robots = [Robot(f"Robot {number}") for number in range(3)]
    for robot in robots:
        map.add_robot(robot)
    yield [
        (robot, robot.add_module(Feed, "Front"), robot.add_module(Feed, "Rear"))
        for robot in robots
    ]
    for robot in robots:
        robot.destroy()


def test_a_wall_watches_cameras_of_several_robots_whatever_is_selected(
    map, robot, panel, said, others
):
    front = robot.add_module(Feed, "Front")
    map.set_selected(robot)
    assert [message["op"] for message in said] == ["cameras"] * len(said)
    watch(panel, wall=True)
    assert said[-1]["op"] == "robots"
    names = [listed["name"] for listed in said[-1]["robots"]]
    assert names == ["Bob", "Robot 0", "Robot 1", "Robot 2"]
    (_, one, other), (second, two, _), _ = others
    watch(panel, front, one, two, other, wall=True)
    map.set_selected(second)
    map.set_selected(None)
    assert all(camera.watched for camera in (front, one, two, other))
    one.show(b"picture", "image/jpeg")
    assert said[-1]["camera"] == camera_number(one)
    panel.on_message({"op": "select", "robot": second.id})
    assert map.selected is second
    # Without the wall only the cameras of the selected robot are left.
    watch(panel, front, two)
    assert [c.watched for c in (front, one, two, other)] == [False, False, True, False]


def test_a_wall_has_no_more_than_four_cameras_and_none_of_a_removed_robot(
    map, robot, panel, said, others
):
    watch(panel, wall=True)
    cameras = [camera for _, front, rear in others for camera in (front, rear)]
    watch(panel, *cameras, wall=True)
    assert [camera.watched for camera in cameras] == [True] * 4 + [False] * 2
    map.remove_robot(others[0][0])
    panel.poll()
    assert [camera.watched for camera in cameras[:4]] == [False, False, True, True]
    assert [listed["name"] for listed in said[-1]["robots"]] == ["Robot 1", "Robot 2"]


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
