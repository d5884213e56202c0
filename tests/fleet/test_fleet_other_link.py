"""Another kind of link: a bridge uses it, and its robots can only be watched."""

import asyncio
import contextlib
import math
import re
import subprocess
import sys
from pathlib import Path

import pytest
from lines_robot import LinesRobot

from equipment.fake_rosbridge import until
from examples.link.lines_link import PORT, LinesLink
from webmap import Bridge, Robot
from webmap.base.errors import BridgeClosed, ConfigError
from webmap.console import make_robot
from webmap.discovery import discover
from webmap.discovery.doctor import BridgeFacts, judge
from webmap.discovery.doctor.measure import observe, tried
from webmap.fleet.overrides import Overrides
from webmap.ros import names
from webmap.ros.messages import LaserScanMsg, OccupancyGridMsg

ROOT = Path(__file__).parents[2]
URL = "lines://loft:7"
KINDS = """
from examples.link.lines_link import LinesLink
from webmap.ros.bridge import LINKS


class OtherConstructor(LinesLink):
    def __init__(self, url: str) -> None: ...


class OtherMethod(LinesLink):
    def publish(self, topic: str) -> None: ...  # type: ignore[override]


class OtherGraph(LinesLink):
    graph: None  # type: ignore[assignment]


LINKS["lines"] = LinesLink
LINKS["a"] = OtherConstructor  # wrong
LINKS["b"] = OtherMethod  # wrong
LINKS["c"] = OtherGraph  # wrong
LINKS["d"] = dict  # wrong
"""
TOPICS = {
    "/odom": "nav_msgs/Odometry",
    "/cmd_vel": "geometry_msgs/Twist",
    "/initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    "/move_base_simple/goal": "geometry_msgs/PoseStamped",
}


def test_an_address_with_the_scheme_of_another_link_makes_a_bridge_of_its_kind():
    bridge = Bridge(f"Lines://Loft:{PORT}/")
    assert (bridge.url, bridge.state) == ("lines://loft", "new")
    assert isinstance(bridge._link, LinesLink)


@contextlib.asynccontextmanager
async def watched(*extra):
    """Run a robot and a bridge that is connected to it."""
    async with LinesRobot() as robot:
        robot.extra = list(extra)
        bridge = Bridge(robot.url)
        bridge.start(asyncio.get_running_loop())
        try:
            await until(lambda: bridge.state == "open")
            yield robot, bridge
        finally:
            await bridge.stop()


def run(scenario):
    asyncio.run(asyncio.wait_for(scenario(), 30))


def test_the_link_of_the_example_shows_pose_map_and_scan_of_a_robot():
    async def scenario():
        async with watched() as (_, bridge):
            robot, scans, grids = Robot("Bob"), [], []
            robot.set_odometry_topic(bridge, "/odom")
            bridge.subscribe("/scan", scans.append, decode=LaserScanMsg)
            bridge.subscribe("/map", grids.append, decode=OccupancyGridMsg)
            await until(lambda: scans and grids and robot.pose.x == 1.5)
            assert str(list(scans[0].range_values.values)) == "[2.0, nan, 3.0]"
            assert grids[0].info.width == 2
            robot.destroy()

    run(scenario)


def test_the_link_of_the_example_publishes_and_connects_again():
    async def scenario():
        async with watched() as (robot, bridge):
            got, reasons = [], []
            bridge.subscribe("/odom", got.append)
            bridge.on_close(reasons.append)
            bridge.publish("/hello", {"data": "hi"}, "std_msgs/String")
            await until(lambda: robot.received)
            assert robot.received == [
                {"topic": "/hello", "type": "std_msgs/String", "msg": {"data": "hi"}}
            ]
            with pytest.raises(ValueError, match="JSON compliant"):
                bridge.publish("/hello", {"data": math.nan}, "std_msgs/String")
            await robot.stop()
            await until(lambda: reasons)
            assert (bridge.state, bridge.lost) == ("connecting", True)
            with pytest.raises(BridgeClosed):
                bridge.publish("/hello", {"data": "hi"})
            got.clear()
            await robot.start()
            await until(lambda: got)
            assert (bridge.state, bridge.stats.links) == ("open", 2)

    run(scenario)


@pytest.mark.parametrize("bad", [b"{\n", b"\xff\n", b"[]\n", b'{"topic": 1}\n', b"\n"])
def test_the_link_of_the_example_reads_on_after_an_invalid_line(bad, caplog):
    async def scenario():
        async with watched(bad, bad) as (_, bridge):
            got = []
            bridge.subscribe("/odom", got.append)
            await until(lambda: got)
            assert bridge.stats.malformed == 2
            assert caplog.text.count("a line without a message") == 1

    run(scenario)


def test_a_robot_behind_another_link_is_examined_and_reported_as_not_driven():
    async def scenario():
        async with LinesRobot() as robot:
            return await tried(await observe(robot.url, seconds=1.0))

    seen = asyncio.run(asyncio.wait_for(scenario(), 60))
    found = {finding.text: finding for finding in judge(seen)}
    assert "The bridge lists its topics; robots found: robot." in found
    assert any("/odom" in text and "in the frame odom" in text for text in found)
    wrong = [text for text, finding in found.items() if finding.level == "wrong"]
    assert wrong == [
        "The robots behind this kind of bridge can be watched and not driven."
    ]
    assert not any("/cmd_vel" in text or "stop test" in text for text in found)
    assert not any("rosbridge" in text or "rosapi" in text for text in found)


def test_another_kind_of_bridge_that_is_not_there_is_no_rosbridge():
    (finding,) = judge(BridgeFacts(URL, trouble="nothing listens there"))
    assert finding.text == "The bridge cannot be reached: nothing listens there."


@pytest.mark.slow
def test_mypy_accepts_a_right_kind_of_link_and_refuses_wrong_ones(tmp_path):
    file = tmp_path / "kinds.py"
    file.write_text(KINDS)
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", file],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    found = [int(n) for n in re.findall(r"kinds\.py:(\d+): error: ", run.stdout)]
    lines = enumerate(KINDS.splitlines(), 1)
    assert found == [n for n, line in lines if "wrong" in line], run.stdout
    assert f"Found {len(found)} errors" in run.stdout  # and none in lines_link.py


def test_a_robot_that_is_found_behind_another_link_is_shown_and_not_driven(caplog):
    bridge = Bridge(URL)
    (found,) = discover(TOPICS, "loft").robots
    config = Overrides().config(bridge.url, found)
    assert "no gate can move robots behind" in caplog.text
    robot = make_robot(config, [bridge])
    assert robot.motion.spec() is None
    robot.destroy()


def test_the_address_of_another_link_is_refused_for_driving():
    robot = Robot("Bob")
    with pytest.raises(ConfigError, match="can only be watched"):
        robot.set_twist_topic(Bridge(URL), "/cmd_vel")
    robot.destroy()


@pytest.mark.parametrize("wrong", ["http://loft", "", "lines://", "lines://a@loft"])
def test_an_error_about_an_address_does_not_name_one_kind_of_link(wrong):
    with pytest.raises(ConfigError, match="address of a bridge"):
        names.normalise_url(wrong)
