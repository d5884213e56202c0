"""Robots with only a shared ``/tf`` are found while other robots are already shown."""

import asyncio
import time

import pytest
from frames_only import TF, publishing

from equipment.waiting import until
from webmap import Bridge
from webmap.base.audience import audience
from webmap.base.geometry import Pose
from webmap.console import Console
from webmap.discovery import discover
from webmap.discovery.frames import FrameCollector, frame_collector
from webmap.discovery.tf_robots import Trees
from webmap.fleet.periodic_search import LayerSearch, RobotSearch
from webmap.fleet.view_robots import ViewRobots

pytestmark = pytest.mark.slow

CLOUD = "sensor_msgs/PointCloud2"


def chain(name: str, x: float, y: float) -> list:
    """The frames of a robot; their names begin with the robot's name."""
    odom, base = f"{name}/odom", f"{name}/base_footprint"
    return [("map", odom, Pose(x, 0.0, 0.0)), (odom, base, Pose(0.0, y, 0.5))]


@pytest.fixture
def quick(monkeypatch):
    """Make discovery look again after a short time."""
    monkeypatch.setattr(RobotSearch, "period", 0.05)
    monkeypatch.setattr(LayerSearch, "period", 0.05)
    monkeypatch.setitem(FrameCollector.listen.__kwdefaults__, "seconds", 0.3)


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_robot_whose_frames_appear_later_is_shown_at_the_pose_from_its_frames(
    quick, dialect, capsys
):
    received = {"/tf": chain("ann", 1.0, 2.0)}
    extra = {"/ann/points": CLOUD, "/bob/points": CLOUD}
    with publishing(received, dialect, extra) as url:

        async def scenario() -> None:
            loop = asyncio.get_running_loop()
            bridge = Bridge(url)
            console = Console()
            late = ViewRobots(console)
            topics = {"/tf": TF, **extra}
            trees = Trees()
            for parent, child, _ in received["/tf"]:
                trees.take("", parent, child)
            (ann,) = discover(topics, "host", trees).robots
            looking = RobotSearch(bridge, [ann], late.show_news)
            drawing = LayerSearch(bridge, late)
            bridge.start(loop)
            for service in (looking, drawing):
                service.start(loop)
            try:
                await until(lambda: frame_collector(bridge).trees.parents)
                received["/tf"] += chain("bob", 5.0, 3.0)
                await until(lambda: late.robots)
                (bob,) = late.robots
                assert (bob.name, console.robots) == ("bob", [bob])
                assert bob.tf["base_frame"] == "bob/base_footprint"
                await until(lambda: bob.valid)
                assert (bob.position.x, bob.position.y) == pytest.approx((5.0, 3.0))
                assert bob.yaw == pytest.approx(0.5)
                # Topics in the robot's namespace are drawn for the robot.
                await until(lambda: "/bob/points" in bridge._topics)
                assert "/ann/points" not in bridge._topics
                bob.destroy()
                await looking.stop()
                assert "/tf" not in bridge._topics, (
                    "discovery is still subscribed to /tf"
                )
            finally:
                for service in (looking, drawing, bridge):
                    await service.stop()

        asyncio.run(scenario())
    assert capsys.readouterr().err.count("A robot appeared") == 1


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_robot_that_is_localised_later_is_drawn_in_the_map_frame(
    quick, dialect, capsys
):
    """A localiser, for example, may wait for its initial pose."""
    base = ("odom", "base_link", Pose(0.0, 3.0, 0.5))
    received = {"/tf": [base]}
    with publishing(received, dialect) as url:

        async def scenario() -> None:
            loop = asyncio.get_running_loop()
            bridge = Bridge(url)
            late = ViewRobots(Console())
            looking = RobotSearch(bridge, [], late.show_news)
            bridge.start(loop)
            looking.start(loop)
            try:
                await until(lambda: late.robots and late.robots[0].valid)
                (robot,) = late.robots
                assert (robot.position.x, robot.position.y) == (0.0, 3.0)
                received["/tf"] = [("map", "odom", Pose(5.0, 1.0, 0.0)), base]
                await until(lambda: robot.position.x)
                at = (robot.position.x, robot.position.y)
                assert at == pytest.approx((5.0, 4.0))
                received["/tf"] = [base]
                seen = bridge._topics["/tf"].count
                await until(lambda: bridge._topics["/tf"].count > seen + 20)
                assert robot.tf["map_frame"] == "map", "the map frame stays 'map'"
                robot.destroy()
            finally:
                for service in (looking, bridge):
                    await service.stop()

        asyncio.run(scenario())
    assert capsys.readouterr().err.count("now is drawn by base_link in map") == 1


def test_a_bridge_without_frame_topics_is_not_listened_to():
    async def scenario() -> None:
        late = frame_collector(Bridge("ws://127.0.0.1:9"))
        began = time.monotonic()
        assert (await late.listen({"/odom": "nav_msgs/Odometry"})).parents == {}
        assert time.monotonic() - began < 0.5

    asyncio.run(scenario())


def test_received_frames_are_kept_for_the_next_discovery():
    with publishing({"/tf": chain("ann", 1.0, 2.0)}) as url:

        async def scenario() -> None:
            bridge = Bridge(url)
            bridge.start(asyncio.get_running_loop())
            try:
                await until(lambda: bridge.state == "open")
                late = frame_collector(bridge)
                seen = await late.listen({"/tf": TF}, seconds=0.5)
                assert [base.space for base in seen.bases()] == ["/ann"]
                assert frame_collector(bridge).trees.bases() == seen.bases()
            finally:
                await bridge.stop()

        asyncio.run(scenario())


def test_no_frames_are_asked_for_while_nobody_looks(monkeypatch):
    asked = []
    bridge = Bridge("ws://127.0.0.1:9")
    monkeypatch.setattr(
        bridge, "subscribe", lambda topic, *_, **__: asked.append(topic)
    )
    monkeypatch.setattr(audience, "present", False)
    trees = asyncio.run(FrameCollector(bridge).listen({"/tf": TF}))
    assert (asked, trees.parents) == ([], {})
