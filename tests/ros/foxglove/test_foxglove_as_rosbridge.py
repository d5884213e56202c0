"""The operations of rosbridge, carried out at Foxglove bridges, as an agent does."""

import asyncio

import pytest

from equipment.foxglove_server import (
    SERVICE,
    VELOCITY,
    old_server,
    sdk_server,
)
from equipment.waiting import until
from webmap.base.errors import BridgeClosed, ServiceError
from webmap.ros import bridge as bridge_module
from webmap.ros import names
from webmap.ros.foxglove.as_rosbridge import RosbridgeOfFoxglove
from webmap.ros.messages import LaserScanMsg, OccupancyGridMsg, OdometryMsg
from webmap.ros.rosbridge.link import RosbridgeLink
from webmap.ros.temporary_bridge import TemporaryBridge


class LaneOfAgent(RosbridgeOfFoxglove):
    def __init__(self, url, **options):
        super().__init__(url.replace("agent:", "foxglove:"), **options)


class LinkOfAgent(RosbridgeLink):
    """The link of a display, without the way through a router."""

    lane_type = LaneOfAgent


@pytest.fixture(autouse=True)
def agents(monkeypatch):
    monkeypatch.setitem(bridge_module.LINKS, "agent", LinkOfAgent)
    monkeypatch.setitem(names.DEFAULT_PORTS, "agent", 1)


class Display(TemporaryBridge):
    """A bridge whose link speaks rosbridge."""

    def __init__(self, url):
        super().__init__(url.replace("foxglove:", "agent:"))
        self.errors = []
        self.on_error(self.errors.append)


def run(scenario, kind="sdk"):
    async def with_server():
        if kind == "sdk":
            with sdk_server() as server:
                async with Display(server.url) as display:
                    await scenario(server, display)
        else:
            async with old_server() as server, Display(server.url) as display:
                await scenario(server, display)

    asyncio.run(with_server())


@pytest.fixture(params=["sdk", "old"])
def kind(request):
    return request.param


def test_messages_come_in_json_and_in_cbor(kind):
    async def scenario(server, display):
        await display.open()
        got = {}
        for topic, view, encoding in (
            ("/odom", OdometryMsg, "text"),
            ("/scan", LaserScanMsg, "binary"),
            ("/map", OccupancyGridMsg, "binary"),
        ):
            type = f"{view.__name__.removesuffix('Msg')}"
            package = "sensor_msgs" if type == "LaserScan" else "nav_msgs"
            display.subscribe(
                topic,
                lambda message, topic=topic: got.setdefault(topic, message),
                f"{package}/{type}",
                decode=view,
                encoding=encoding,
            )
        await until(lambda: {"/odom", "/scan", "/map"} <= set(server.subscribed))
        server.robot.x = 4.5
        await server.publish("/odom", server.robot.odometry())
        await server.publish("/scan", server.robot.scan())
        await server.publish("/map", server.robot.map(300, 200))
        await until(lambda: len(got) == 3)
        assert got["/odom"].pose.pose.position.x == 4.5
        assert got["/scan"].ranges[0] == 2.0
        assert len(got["/map"].data) == 60_000
        assert not display.errors

    run(scenario, kind)


def test_a_picture_in_json_is_base64(kind):
    async def scenario(server, display):
        await display.open()
        got = []
        display.subscribe(
            "/camera/image/compressed",
            got.append,
            "sensor_msgs/CompressedImage",
            encoding="text",
        )
        await until(lambda: server.subscribed)
        await server.publish("/camera/image/compressed", server.robot.picture())
        await until(lambda: got)
        assert got[0]["data"].startswith("/9j/")  # the head of a JPEG

    run(scenario, kind)


def test_questions_for_rosapi_and_calls(kind):
    async def scenario(server, display):
        topics = await display.topics()  # without an open connection
        assert topics["/odom"] == server.robot.type_name("nav_msgs/Odometry")
        await display.open()
        assert await display.topic_type(VELOCITY) == topics[VELOCITY]
        assert "Trigger" in await display.service_type(SERVICE)
        assert await display.publishers("/odom") is None
        assert await display.time() is None
        answer = await display.call_service(SERVICE)
        assert answer == {"success": True, "message": "docked"}
        with pytest.raises(ServiceError, match="offers no service /none"):
            await display.call_service("/none")

    run(scenario, kind)


def test_what_a_button_publishes_arrives(kind):
    async def scenario(server, display):
        await display.open()
        display.publish("/talk", {"data": "hi"}, "std_msgs/String")
        await until(lambda: server.received)
        assert server.received[0][0] == "/talk"
        display.publish("/talk", {"data": 5})
        await until(lambda: display.errors)
        assert "data" in str(display.errors[0])
        display.unadvertise("/talk")

    run(scenario, kind)


def test_a_bridge_that_is_lost_and_comes_back():
    async def scenario(server, display):
        await display.open()
        got, closed = [], []
        display.on_close(closed.append)
        display.subscribe("/odom", got.append, "nav_msgs/Odometry")
        await until(lambda: "/odom" in server.subscribed)
        port = server.port
        server.stop()
        await until(lambda: closed)
        with pytest.raises(BridgeClosed):
            await display.call_service(SERVICE)
        with sdk_server(port) as second:
            await until(lambda: "/odom" in second.subscribed)
            await second.publish("/odom", second.robot.odometry())
            await until(lambda: got)
            assert (await display.call_service(SERVICE))["success"]

    run(scenario)
