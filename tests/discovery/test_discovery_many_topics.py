"""10,000 topics need few service calls and an amount of work linear in their number."""

import asyncio
import threading

import pytest

from equipment.fake_rosbridge import bridged
from webmap.config.fleet import dump
from webmap.console import Console
from webmap.discovery import discover
from webmap.discovery.doctor.measure import observe
from webmap.discovery.fleet_toml import fleet_toml
from webmap.discovery.tables import report
from webmap.fleet import periodic_search
from webmap.fleet.periodic_search import LayerSearch, RobotSearch
from webmap.fleet.search import search_bridges
from webmap.fleet.view_robots import ViewRobots
from webmap.modules import declaration

pytestmark = pytest.mark.slow

KINDS = {
    "odom": "nav_msgs/msg/Odometry",
    "cmd_vel": "geometry_msgs/msg/Twist",
    "scan": "sensor_msgs/msg/LaserScan",
    "map": "nav_msgs/msg/OccupancyGrid",
    "plan": "nav_msgs/msg/Path",
    "battery_state": "sensor_msgs/msg/BatteryState",
    "points": "sensor_msgs/msg/PointCloud2",
    "image/compressed": "sensor_msgs/msg/CompressedImage",
}
STATES = {f"/plc/state_{number}": "std_msgs/msg/Float64" for number in range(9_992)}


def fleet(robots: int) -> dict[str, str]:
    return {
        f"/robot_{number}/{name}": type
        for number in range(robots)
        for name, type in KINDS.items()
    }


MANY = {**fleet(1), **STATES}
ANSWER = {"topics": [*MANY], "types": [*MANY.values()]}


def test_a_search_asks_a_bridge_of_10_000_topics_two_questions():
    async def scenario() -> None:
        async with bridged(opened=False, topics=ANSWER) as (server, bridge):
            (found,) = await search_bridges([bridge.url], wait=5.0)
            assert len(found.topics) == len(MANY) == 10_000
            (robot,) = found.findings.robots
            assert robot.topic("odometry") == "/robot_0/odom"
            asked = [call["service"] for call in server.ops("call_service")]
            assert asked == ["/rosapi/topics", "/rosapi/action_servers"]
            assert server.ops("subscribe") == []

    asyncio.run(scenario())


def test_the_doctor_asks_about_the_topics_of_the_robot_alone():
    async def scenario() -> None:
        nodes = {"publishers": {"publishers": []}, "subscribers": {"subscribers": []}}
        async with bridged(opened=False, topics=ANSWER, **nodes) as (server, bridge):
            await observe(bridge.url, seconds=0.1)
            asked = {call["service"] for call in server.ops("call_service")}
            about = [
                call["args"]["topic"]
                for call in server.ops("call_service")
                if "topic" in call.get("args", {})
            ]
            assert len(server.ops("call_service")) <= 20, asked
            assert all(topic.startswith("/robot_0/") for topic in about)

    asyncio.run(scenario())


def test_topics_that_did_not_change_are_matched_once_and_beside_the_picture(
    monkeypatch,
):
    threads = []

    def counted(*args):
        threads.append(threading.current_thread())
        return discover(*args)

    monkeypatch.setattr(periodic_search, "discover", counted)

    class Open:
        url = "ws://127.0.0.1:9"
        state = "open"

    async def scenario() -> None:
        shown = ViewRobots(Console())
        robots = RobotSearch(Open(), [], lambda *news: None)
        layers = LayerSearch(Open(), shown)
        for looking in (robots, layers):
            for _ in range(5):
                await looking.take(dict(STATES))
            await looking.take({**STATES, "/new": "std_msgs/msg/String"})

    asyncio.run(scenario())
    assert len(threads) == 4
    assert threading.main_thread() not in threads


def test_a_fleet_file_visits_each_remark_once():
    class Remarks(dict):
        visits = 0

        def __iter__(self):
            type(self).visits += 1
            return super().__iter__()

    robots = [{"name": f"r{number}", "tf": {"quiet": True}} for number in range(50)]
    remarks = Remarks({("robots", number, "tf", "quiet"): "x" for number in range(50)})
    assert dump({"robots": robots}, remarks=remarks).count("tf.quiet = true # x") == 50
    assert Remarks.visits == 1


def test_the_layers_of_many_topics_are_declared_once(monkeypatch):
    found = discover(fleet(20))
    looks = []
    declaration._declared.cache_clear()
    look = declaration._without_taken_kinds

    def counted(declared, first):
        looks.append(declared)
        return look(declared, first)

    monkeypatch.setattr(declaration, "_without_taken_kinds", counted)
    report("ws://127.0.0.1:9", found)
    fleet_toml([("robot", "ws://127.0.0.1:9", found)])
    assert len(looks) == len(set(map(id, looks)))
