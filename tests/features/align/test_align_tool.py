"""Who may align which maps, and which alignments are saved."""

import asyncio
import json
import math
import os
from types import SimpleNamespace

import pytest
from module_fakes import Channel, Link, pose

from webmap import Map, Robot
from webmap.base.geometry import Pose
from webmap.core import alignment_store
from webmap.core.alignment_store import AlignmentStore, name_of
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.poses.alignment import align_bridge, alignments

NAME = "ws://test:9090 Bob"


class KeepingChannel(Channel):
    """Records the messages to the browser parts."""

    def send(self, instance, message):
        self.__dict__.setdefault("received", []).append(message)


@pytest.fixture
def channel():
    return KeepingChannel()


@pytest.fixture
def store(tmp_path, monkeypatch):
    fresh = AlignmentStore(tmp_path / "state")
    monkeypatch.setattr("webmap.features.align.align_tool.store", fresh)
    return fresh


@pytest.fixture
def robot(robot, link):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    return robot


@pytest.fixture
def tool(map, robot, store):
    map.add_robot(robot)
    return map.add_module("AlignTool")


def answer(channel, key):
    (found,) = [message[key] for message in channel.received if key in message]
    channel.received.clear()
    return found


def save(tool, robot, x=1.0, y=2.0, angle=90.0, *, whole=False) -> None:
    async def save_and_wait():
        wanted = {"robot": robot.id, "whole": whole, "x": x, "y": y, "angle": angle}
        tool.on_message({"save": wanted})
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        if tasks:
            await asyncio.wait(tasks)

    asyncio.run(save_and_wait())


def test_begin_sends_the_robot_and_its_alignments_to_the_page(
    tool, robot, channel, link
):
    ann = Robot("Ann")
    ann.set_odometry_topic(link, "/ann/odom", type="geometry_msgs/PoseStamped")
    tool.map.add_robot(ann)
    align_bridge(link, 3.0, 0.0, 90.0)
    tool.on_message({"begin": robot.id})
    received = answer(channel, "align")
    assert (received["robot"], received["name"], received["whole"]) == (
        robot.id,
        "Bob",
        True,
    )
    assert received["together"] == [robot.id, ann.id]
    assert received["own"] == received["common"] == (3.0, 0.0, 90.0)
    assert received["mark"] == alignments.mark(link)
    ann.set_alignment(0.0, 0.0, 0.0)
    tool.on_message({"begin": ann.id})
    received = answer(channel, "align")
    assert (received["whole"], received["own"]) == (False, (0.0, 0.0, 0.0))
    ann.destroy()


def test_a_saved_alignment_is_applied_and_restored(tool, robot, channel, store, link):
    save(tool, robot)
    line = "alignment = [1.0, 2.0, 90.0] # metres, metres, degrees"
    assert answer(channel, "saved") == {"line": line, "lost": ""}
    assert robot.pose_source.own_alignment == Pose(1.0, 2.0, math.pi / 2)
    again = AlignmentStore(store._folder)
    bob = Robot("Bob")
    bob.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    again.restore(bob)
    assert bob.pose_source.own_alignment == Pose(1.0, 2.0, math.pi / 2)
    kept = json.loads(store.path(NAME).read_text())
    assert (kept["by"], kept["of"], kept["instead_of"]) == ("Ann", NAME, None)
    bob.destroy()


def test_a_changed_configuration_overrides_the_saved_alignment(
    tool, robot, store, link, caplog
):
    robot.set_alignment(5.0, 0.0, 0.0)
    save(tool, robot)
    same, other = Robot("Bob"), Robot("Bob")
    for bob, stated in ((same, 5.0), (other, 6.0)):
        bob.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
        bob.set_alignment(stated, 0.0, 0.0)
        AlignmentStore(store._folder).restore(bob)
    assert same.pose_source.own_alignment == Pose(1.0, 2.0, math.pi / 2)
    assert other.pose_source.own_alignment == Pose(6.0, 0.0, 0.0)
    assert "now states another one" in caplog.text
    assert not store.path(NAME).exists()
    for bob in (same, other):
        bob.destroy()


def test_saving_for_the_whole_bridge_removes_the_alignment_of_the_robot(
    tool, robot, store, link
):
    save(tool, robot)
    save(tool, robot, 7.0, 0.0, 0.0, whole=True)
    assert alignments.of(link) == Pose(7.0, 0.0, 0.0)
    assert robot.pose_source.own_alignment is None
    assert not store.path(NAME).exists()
    fresh = Link()
    AlignmentStore(store._folder).restore_bridge(fresh)
    assert alignments.of(fresh) == Pose(7.0, 0.0, 0.0)


@pytest.mark.parametrize("state", ["driving", "stopping"])
def test_a_driven_robot_cannot_be_aligned(tool, robot, channel, state):
    robot.report = SimpleNamespace(state=state)
    tool.on_message({"begin": robot.id})
    assert "Bob is being driven" in answer(channel, "refused")
    save(tool, robot)
    assert "Bob is being driven" in answer(channel, "refused")
    assert robot.pose_source.own_alignment is None


def test_a_bridge_with_a_driven_robot_cannot_be_aligned(tool, robot, channel, link):
    ann = Robot("Ann")
    ann.set_odometry_topic(link, "/ann/odom", type="geometry_msgs/PoseStamped")
    tool.map.add_robot(ann)
    ann.report = SimpleNamespace(state="driving")
    save(tool, robot, whole=True)
    assert "Ann is being driven" in answer(channel, "refused")
    save(tool, robot)
    assert robot.pose_source.own_alignment is not None
    ann.destroy()


@pytest.mark.parametrize("wrong", ["far", None, math.inf, 1e9])
def test_invalid_alignment_values_are_refused(tool, robot, channel, wrong):
    save(tool, robot, wrong)
    assert "metres and an angle in degrees" in answer(channel, "refused")
    assert robot.pose_source.own_alignment is None


def test_a_viewer_cannot_align_robots(tmp_path, robot, channel, store):
    entry = PageEntry("/", lambda page: None, None, tmp_path, "test")
    page = Page(entry, channel, Viewer("v1", "Ann", "viewer"), None, {})
    map = Map(page.element("map"), 700, 500)
    map.add_robot(robot)
    tool = map.add_module("AlignTool")
    tool.on_message({"begin": robot.id})
    assert answer(channel, "refused") == "Only admins can align maps."
    save(tool, robot)
    assert answer(channel, "refused") == "Only admins can align maps."
    assert robot.pose_source.own_alignment is None
    page.close()


def test_a_robot_without_a_pose_cannot_be_aligned(tool, channel):
    lost = Robot("Lost")
    tool.map.add_robot(lost)
    tool.on_message({"begin": lost.id})
    assert "Cannot align Lost: its pose is unknown" in answer(channel, "refused")
    tool.on_message({"begin": "r0"})
    assert answer(channel, "refused") == "Select a robot first."
    lost.destroy()


def test_an_alignment_that_cannot_be_saved_is_applied_with_a_warning(
    tool, robot, channel, store
):
    store._folder.parent.mkdir(exist_ok=True)
    store._folder.write_text("a file where the folder should be")
    save(tool, robot)
    saved = answer(channel, "saved")
    assert saved["lost"].startswith("Cannot save the alignment: ")
    assert saved["lost"].endswith(". It is lost when WebMap ends.")
    assert robot.pose_source.own_alignment is not None


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"alignment": [1, 2], "instead_of": 0}']
)
def test_an_invalid_alignment_file_is_logged_and_ignored(robot, store, caplog, text):
    store.path(NAME).parent.mkdir(exist_ok=True)
    store.path(NAME).write_text(text)
    store.restore(robot)
    assert robot.pose_source.own_alignment is None
    assert "cannot be read" in caplog.text


def test_the_name_of_a_saved_alignment_omits_secrets_of_the_url():
    link = SimpleNamespace(url="wss://ann:secret@south.example:9443/ros?token=secret")
    assert name_of(link, "Bob") == "wss://south.example:9443/ros Bob"


def test_alignment_files_are_in_the_state_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))
    assert alignment_store.store.path("x").parent == tmp_path


def test_an_unknown_command_of_a_page_is_logged(tool, caplog):
    tool.on_message({"align": 1})
    assert "unknown message" in caplog.text


def test_a_robot_added_later_gets_its_saved_alignment(tool, robot, store, link):
    store.save("ws://test:9090 Eve", None, Pose(4.0, 0.0, 0.0), "Ann")
    store._stated.clear()
    eve = Robot("Eve")
    eve.set_odometry_topic(link, "/eve/odom", type="geometry_msgs/PoseStamped")
    tool.map.add_robot(eve)
    link.publish("/eve/odom", {"header": {}, "pose": pose(1.0, 0.0)})
    assert eve.position.x == pytest.approx(5.0)
    eve.destroy()


@pytest.mark.parametrize("kind", ["deep", "pipe"])
def test_a_deeply_nested_alignment_file_or_a_pipe_is_logged(store, robot, caplog, kind):
    file = store.path(NAME)
    file.parent.mkdir(parents=True, exist_ok=True)
    if kind == "pipe":
        os.mkfifo(file)
    else:
        file.write_bytes(b"[" * 100_000)
    AlignmentStore(store._folder).restore(robot)
    assert "saved alignment ignored" in caplog.text
