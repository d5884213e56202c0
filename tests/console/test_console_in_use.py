"""The topics that the robots of a page use, as given to the check of the bridge."""

import asyncio
from pathlib import Path

import pytest

from equipment.waiting import until
from webmap import Bridge, Map, Robot, RobotConfig
from webmap.console import make_robot
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.discovery import discover
from webmap.discovery.doctor import BridgeFacts
from webmap.discovery.doctor.facts import merge_configured
from webmap.features.doctor.configured_robots import configured_robots
from webmap.features.doctor.doctor_panel import DoctorReports, checkup_of
from webmap.scene.element import Event
from webmap.scene.wire.session import SceneSession


@pytest.fixture
def bridge():
    return Bridge("ws://localhost:9090")


@pytest.fixture
def other():
    return Bridge("ws://localhost:9091")


def only(found):
    (one,) = found
    return one


def test_a_configured_robot_uses_the_topics_of_its_configuration(bridge):
    cameras = ["/front/image_raw", "/rear/image_raw/compressed"]
    config = RobotConfig.from_dict(
        {
            "name": "Bob",
            "bridge": bridge.url,
            "odometry": "/odom",
            "twist": {"topic": "/cmd_vel", "type": "geometry_msgs/TwistStamped"},
            "scan": "/scan",
            "battery": "/battery",
            "cameras": cameras,
            "move": {"action": "/navigate_to_pose"},
        }
    )
    bob = only(configured_robots([make_robot(config, [bridge])], bridge))
    assert bob.name == "Bob"
    assert bob.topics["odometry"] == (("/odom", ""),)
    assert bob.topics["velocity"] == (("/cmd_vel", "geometry_msgs/TwistStamped"),)
    assert bob.topics["scan"] == (("/scan", ""),)
    assert bob.topics["battery"] == (("/battery", ""),)
    assert [topic for topic, _ in bob.topics["camera"]] == cameras
    assert bob.topics["action"] == (("/navigate_to_pose/_action/feedback", ""),)
    assert bob.topics["cloud"] == bob.topics["plan"] == ()
    assert "tf" not in bob.topics, "frames are used as they are found"


def test_topics_of_modules_are_in_use_with_positional_and_keyword_arguments(bridge):
    bob = Robot("Bob")
    bob.add_module("LaserScanner", bridge, "/front")
    bob.add_module("LaserScanner", topic="/rear", bridge=bridge)
    bob.add_module("Path", bridge)
    bob.add_module("PointCloud", bridge, "/points")
    bob.add_module("OnMaps", "OccupancyGrid", bridge, "/costs", palette="costmap")
    topics = only(configured_robots([bob], bridge)).topics
    assert topics["scan"] == (("/front", ""), ("/rear", ""))
    assert topics["plan"] == (("/plan", ""),)
    assert topics["cloud"] == (("/points", ""),)
    assert topics["costmap"] == (("/costs", ""),)


def test_a_shared_map_is_used_by_all_robots_and_a_costmap_only_by_its_robot(bridge):
    bob, ann = Robot("Bob"), Robot("Ann")
    for robot in (bob, ann):
        robot.set_odometry_topic(bridge, "/odom")
    shared = ("OccupancyGrid", (bridge, "/hall"), {})
    own = (
        "OccupancyGrid",
        (bridge, "/ann/costs"),
        {"palette": "costmap", "robot": ann},
    )
    bobs, anns = (
        one.topics for one in configured_robots([bob, ann], bridge, [shared, own])
    )
    assert bobs["map"] == anns["map"] == (("/hall", ""),)
    assert bobs["costmap"] == ()
    assert anns["costmap"] == (("/ann/costs", ""),)


def test_a_robot_with_two_bridges_has_at_each_bridge_only_its_topics_there(
    bridge, other
):
    bob = Robot("Bob")
    bob.set_odometry_topic(other, "/odom", type="nav_msgs/Odometry")
    bob.set_twist_topic(bridge, "/cmd_vel", type="geometry_msgs/Twist")
    here, there = (
        only(configured_robots([bob], bridge)),
        only(configured_robots([bob], other)),
    )
    assert here.topics["odometry"] == there.topics["velocity"] == ()
    assert here.elsewhere == {"odometry"}
    assert there.elsewhere == {"velocity"}
    assert there.topics["odometry"] == (("/odom", "nav_msgs/Odometry"),)


def test_a_robot_of_another_bridge_is_not_listed_at_this_bridge(bridge, other):
    bob = Robot("Bob")
    bob.set_odometry_topic(other, "/odom")
    assert (
        configured_robots([bob], bridge, [("OccupancyGrid", (bridge, "/map"), {})])
        == []
    )


def test_a_robot_with_tf_uses_its_tf_topic_and_its_frames(bridge):
    bob = Robot("Bob")
    bob.set_tf(bridge, namespace="/bob", map_frame="site")
    configured = only(configured_robots([bob], bridge))
    assert configured.topics["tf"] == (("/bob/tf", ""),)
    topics = {"/bob/tf": "tf2_msgs/TFMessage"}
    (robot,) = merge_configured(discover(topics), [configured], topics)[0].robots
    assert robot.tf_alone
    assert (robot.base_frame, configured.map_frame) == ("bob/base_link", "bob/site")


def test_a_robot_without_a_source_of_poses_uses_no_tf_topic(bridge):
    bob = Robot("Bob")
    bob.set_twist_topic(bridge, "/cmd_vel", type="geometry_msgs/Twist")
    assert only(configured_robots([bob], bridge)).topics["tf"] == ()


# The report on a page.


class Publisher:
    """Accepts the files of the page; no browser loads them."""

    def publish_file(self, file):
        assert Path(file).is_file(), file
        return f"/_webmap/{Path(file).name}"


def map_of(viewer):
    entry = PageEntry("/", lambda page: None, None, Path(), "test")
    sizes = {"map": (800.0, 600.0)}
    page = Page(entry, SceneSession(), viewer, Publisher(), sizes)
    with page.scope.active():
        return Map(page.element("map"))


def press(report, label):
    """Press the button of a report with this label, as a page can do at any time."""
    (button,) = [
        each
        for each in report.walk()
        if getattr(each, "tag", "") == "button" and each.text == label
    ]
    (handler,) = button.handlers("click")
    handler(Event(kind="click"))
    return button


@pytest.fixture
def checkup(bridge):
    """The check of the bridge; it observes nothing and records its arguments."""
    checkup = checkup_of(bridge)
    checkup.asked = []

    async def observe(url, *, seconds, configured, progress):
        checkup.asked.append(configured(None))
        return BridgeFacts(url)

    async def tried(seen):
        checkup.asked.append("tried")
        return seen

    checkup._observe, checkup._tried = observe, tried
    return checkup


def report_for(viewer, bridge):
    """Return a page's map and the report on that page."""
    map = map_of(viewer)
    with map.page.scope.active():
        element = map.page.element("bridges")
        map.add_module(DoctorReports, element).add(bridge)
    (report,) = element.children
    return map, report


def test_the_report_includes_robots_added_to_the_page_later(bridge, checkup):
    async def run():
        map, report = report_for(Viewer("v1", "Ann"), bridge)
        for name in ("Bob", "Eve"):
            robot = Robot(name)
            robot.set_odometry_topic(bridge, f"/{name}/odom")
            map.add_robot(robot)
            press(report, "Check again")
            await until(lambda: not checkup.is_running)
        map.page.close()

    asyncio.run(run())
    names = [[one.name for one in asked] for asked in checkup.asked]
    assert names == [["Bob"], ["Bob", "Eve"]]


@pytest.mark.parametrize(("role", "may"), [("operator", True), ("viewer", False)])
def test_only_an_operator_can_run_the_slow_call_test(bridge, checkup, role, may):
    async def run():
        map, report = report_for(Viewer("v1", "Ann", role), bridge)
        press(report, "Check again")
        await until(lambda: not checkup.is_running)
        asking = press(report, "Test for delays")
        assert (asking.get("hidden") is None) is may
        press(report, "Run test")
        await until(lambda: not checkup.is_running)
        map.page.close()

    asyncio.run(run())
    assert ("tried" in checkup.asked) is may


def test_the_slow_call_test_asks_for_confirmation_and_can_be_cancelled(bridge, checkup):
    async def run():
        map, report = report_for(Viewer("v1", "Ann"), bridge)
        press(report, "Check again")
        await until(lambda: not checkup.is_running)
        divs = [each for each in report.walk() if getattr(each, "tag", "") == "div"]
        (question,) = [each for each in divs if each.get("role") == "group"]
        assert question.get("hidden") is not None
        press(report, "Test for delays")
        assert question.get("hidden") is None
        assert "test while nobody drives" in question.text
        press(report, "Cancel")
        assert question.get("hidden") is not None
        map.page.close()

    asyncio.run(run())
    assert "tried" not in checkup.asked
