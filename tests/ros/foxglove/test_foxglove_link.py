"""A bridge to real Foxglove servers, of both subprotocols."""

import asyncio
from contextlib import asynccontextmanager

import pytest
from foxglove.websocket import Capability

from equipment.fake_rosbridge import FakeRosbridge
from equipment.foxglove_server import (
    SERVICE,
    VELOCITY,
    old_server,
    sdk_server,
)
from equipment.waiting import until
from webmap.base.errors import BridgeClosed, BridgeError, ServiceError
from webmap.ros.bridge import Bridge
from webmap.ros.foxglove import address
from webmap.ros.foxglove.address import recognised
from webmap.ros.foxglove.link import _is_large
from webmap.ros.messages import LaserScanMsg, OccupancyGridMsg, OdometryMsg
from webmap.ros.temporary_bridge import TemporaryBridge

ODOM = {"/odom": ("nav_msgs/Odometry", None, 0)}


def run(scenario):
    asyncio.run(scenario())


@asynccontextmanager
async def server_of(kind, **options):
    if kind == "sdk":
        with sdk_server(**options) as server:
            yield server
    else:
        async with old_server(**options) as server:
            yield server


@asynccontextmanager
async def bridged(server):
    errors = []
    async with TemporaryBridge(server.url) as bridge:
        bridge.on_error(errors.append)
        bridge.errors = errors
        await bridge.open()
        yield bridge


@pytest.fixture(params=["sdk", "old"])
def kind(request):
    return request.param


def test_topics_and_types_without_an_open_connection(kind):
    async def scenario():
        async with server_of(kind) as server, TemporaryBridge(server.url) as bridge:
            topics = await bridge.topics()
            expected = server.robot.type_name("nav_msgs/Odometry")
            assert topics["/odom"] == expected
            assert set(topics) >= {"/scan", "/map", "/tf", VELOCITY}
            assert await bridge.topic_type("/odom") == expected
            assert await bridge.topic_type("/nothing") is None
            assert bridge.state == "new"

    run(scenario)


def test_a_message_is_read_as_a_view_and_as_a_plain_mapping(kind):
    async def scenario():
        async with server_of(kind) as server, bridged(server) as bridge:
            views, plain = [], []
            bridge.subscribe("/odom", views.append, decode=OdometryMsg)
            bridge.subscribe("/odom", plain.append, "nav_msgs/Odometry")
            await until(lambda: "/odom" in server.subscribed)
            server.robot.x, server.robot.speed = 2.5, 0.25
            await server.publish("/odom", server.robot.odometry())
            await until(lambda: views and plain)
            assert views[0].pose.pose.position.x == 2.5
            assert views[0].header.frame_id == "odom"
            assert plain[0]["twist"]["twist"]["linear"]["x"] == 0.25
            assert plain[0]["header"]["stamp"].keys() >= (
                {"sec"} if kind == "sdk" else {"secs"}
            )
            assert abs(await bridge.time() - views[0].header.stamp.seconds) < 5
            assert not bridge.errors

    run(scenario)


def test_large_topics_have_a_connection_of_their_own(kind):
    async def scenario():
        async with server_of(kind) as server, bridged(server) as bridge:
            grids, scans = [], []
            bridge.subscribe("/map", grids.append, decode=OccupancyGridMsg)
            bridge.subscribe("/scan", scans.append, decode=LaserScanMsg)
            await until(lambda: {"/map", "/scan"} <= set(server.subscribed))
            main, large = bridge._link._main, bridge._link._large
            assert "/map" not in main._id_of
            assert "/scan" not in large._id_of
            await server.publish("/map", server.robot.map(1000, 800))
            await server.publish("/scan", server.robot.scan())
            await until(lambda: grids and scans)
            assert grids[0].info.width == 1000
            assert len(grids[0].data) == 800_000
            assert scans[0].ranges[0] == 2.0

    run(scenario)


def test_video_comes_over_the_connection_for_large_topics():
    assert _is_large("foxglove_msgs/msg/CompressedVideo")
    assert not _is_large("nav_msgs/msg/Odometry")


def test_without_large_topics_there_is_one_connection(kind):
    async def scenario():
        async with server_of(kind) as server, bridged(server) as bridge:
            bridge.subscribe("/scan", print)
            await until(lambda: "/scan" in server.subscribed)
            assert bridge._link._large.connection.state == "new"

    run(scenario)


def test_a_topic_that_appears_later_and_one_that_ends(kind):
    async def scenario():
        async with server_of(kind, topics=ODOM) as server, bridged(server) as bridge:
            got = []
            bridge.subscribe("/late", got.append, "std_msgs/String")
            await until(lambda: bridge._link._main.info)
            added = server.add("/late", "std_msgs/String")
            if kind == "old":
                await added
            await until(lambda: "/late" in server.subscribed)
            hello = server.robot.data("std_msgs/String", data="hello")
            await server.publish("/late", hello)
            await until(lambda: got)
            assert got == [{"data": "hello"}]
            removed = server.remove("/late")
            if kind == "old":
                await removed
            await until(lambda: bridge._link.graph.known("/late") is None)
            if kind == "old":
                await server.add("/late", "std_msgs/String")
            else:
                server.add("/late", "std_msgs/String")
            await until(lambda: "/late" in bridge._link._main._id_of)
            await until(
                lambda: server.subscribed.count("/late") == (2, 1)[kind == "sdk"]
            )
            await server.publish("/late", hello)
            await until(lambda: len(got) == 2)

    run(scenario)


def test_messages_are_published_in_the_dialect_of_the_server(kind):
    async def scenario():
        async with server_of(kind) as server, bridged(server) as bridge:
            await until(lambda: bridge._link._main.info)
            for number in (1, 2):
                bridge.publish("/talk", {"data": f"hi {number}"}, "std_msgs/String")
            await until(lambda: len(server.received) == 2)
            topic, data = server.received[0]
            assert topic == "/talk"
            assert server.robot.read("std_msgs/String", data).data == "hi 1"
            goal = {
                "header": {"frame_id": "map"},
                "pose": {"position": {"x": 1.5}, "orientation": {"w": 1.0}},
            }
            bridge.publish("/place", goal, "geometry_msgs/PoseStamped")
            await until(lambda: len(server.received) == 3)
            read = server.robot.read("geometry_msgs/PoseStamped", server.received[2][1])
            assert read.pose.position.x == 1.5
            assert read.header.frame_id == "map"
            if kind == "sdk":
                sent = server.advertised[1]
                assert sent.encoding == "cdr"
                assert sent.schema_name == "geometry_msgs/msg/PoseStamped"
                assert b"MSG: geometry_msgs/Pose" in sent.schema
            with pytest.raises(ValueError, match="position"):
                bridge.publish("/place", {"pose": {"position": 3}})
            with pytest.raises(BridgeError, match="not known"):
                bridge.publish("/odd", {}, "odd_msgs/Odd")
            bridge.unadvertise("/talk")
            if kind == "sdk":
                await until(lambda: len(server.advertised) == 1)

    run(scenario)


def test_a_service_is_called(kind):
    async def scenario():
        async with server_of(kind) as server, bridged(server) as bridge:
            answer = await bridge.call_service(SERVICE)
            assert answer == {"success": True, "message": "docked"}
            assert server.robot.docked == 1
            assert await bridge.service_type(SERVICE) in (
                "std_srvs/srv/Trigger",
                "std_srvs/Trigger",
            )
            with pytest.raises(ServiceError, match="offers no service /none"):
                await bridge.call_service("/none")

    run(scenario)


def test_a_service_that_fails_or_gets_a_wrong_request():
    async def scenario():
        with sdk_server() as server:
            async with bridged(server) as bridge:
                server.robot.docked = 12
                with pytest.raises(ServiceError, match="no dock here"):
                    await bridge.call_service(SERVICE)
                with pytest.raises(ServiceError, match="no such field"):
                    await bridge.call_service(SERVICE, {"speed": 3})

    run(scenario)


def test_a_parameter_is_set(kind):
    async def scenario():
        async with server_of(kind) as server, bridged(server) as bridge:
            assert await bridge.set_parameter("/robot.gain", 2.0) == 2.0
            assert server.robot.parameters["/robot.gain"] == 2.0
            if kind == "sdk":
                with pytest.raises(ServiceError, match="returned no value"):
                    await bridge.set_parameter("/robot.none", 2)

    run(scenario)


def test_nodes_are_known_when_the_server_names_them():
    async def scenario():
        with sdk_server() as server:
            async with bridged(server) as bridge:
                await until(lambda: bridge._link._main.info and server.graph_watched)
                assert await bridge.publishers("/odom") is None
                await asyncio.sleep(0.1)  # the listener of the server has returned
                server.graph({"/odom": ["/base", "/foxglove_bridge"]}, {"/odom": []})
                await until(lambda: bridge._link._main.publishers)
                nodes = await bridge.publishers("/odom")
                assert sorted(nodes) == ["/base", "/foxglove_bridge"]
                assert await bridge.other_publishers("/odom") == ["/base"]
                assert await bridge.subscribers("/odom") == []

    run(scenario)


def test_definitions_of_types_that_webmap_does_not_know(kind):
    async def scenario():
        async with server_of(kind, topics=ODOM) as server, bridged(server) as bridge:
            found = await bridge.definitions("nav_msgs/Odometry")
            names = [each.name for each in found.definition("nav_msgs/Odometry").fields]
            assert names == ["header", "child_frame_id", "pose", "twist"]
            assert found.ros2 is (kind == "sdk")
            request = await bridge.definitions("std_srvs/Trigger", "srv")
            assert request.definition("std_srvs/Trigger").fields == ()
            with pytest.raises(ServiceError, match="offers nothing of type odd"):
                await bridge.definitions("odd_msgs/Odd")

    run(scenario)


def test_the_time_of_a_simulator_and_remarks_of_the_server():
    async def scenario():
        with sdk_server() as server:
            async with bridged(server) as bridge:
                await until(lambda: bridge._link._main.info)
                assert await bridge.time() is None
                server.time(12.5)
                await until(lambda: bridge._link._main.time)
                assert 12.5 <= await bridge.time() < 20
                for _ in range(3):
                    server.status("Send buffer limit reached")
                await until(lambda: bridge.errors)
                await asyncio.sleep(0.1)
                assert len(bridge.errors) == 1
                assert "Send buffer limit reached" in str(bridge.errors[0])

    run(scenario)


def test_a_server_that_comes_back_gets_everything_again():
    async def scenario():
        with sdk_server() as server:
            async with bridged(server) as bridge:
                got = []
                bridge.subscribe("/odom", got.append)
                bridge.subscribe("/map", got.append)
                bridge.publish("/talk", {"data": "a"}, "std_msgs/String")
                await until(lambda: {"/odom", "/map"} <= set(server.subscribed))
                port = server.port
                server.stop()
                await until(lambda: bridge.state != "open")
                with pytest.raises(BridgeClosed):
                    bridge.publish("/talk", {"data": "b"})
                with sdk_server(port) as second:
                    await until(lambda: {"/odom", "/map"} <= set(second.subscribed))
                    await until(lambda: second.advertised)
                    bridge.publish("/talk", {"data": "c"})
                    await until(lambda: second.received)
                    (_topic, data), *_ = second.received
                    assert second.robot.read("std_msgs/String", data).data == "c"
                    await second.publish("/odom", second.robot.odometry())
                    await second.publish("/map", second.robot.map())
                    await until(lambda: len(got) == 2)
                    assert bridge.stats.links == 2

    run(scenario)


def test_the_bytes_themselves_for_a_listener_that_wants_them():
    async def scenario():
        with sdk_server() as server:
            async with bridged(server) as bridge:
                got = []
                bridge.subscribe("/odom", got.append, encoding="raw")
                await until(lambda: "/odom" in server.subscribed)
                data = server.robot.odometry()
                await server.publish("/odom", data)
                await until(lambda: got)
                assert got[0]["bytes"] == data
                assert got[0]["secs"] > 1e9

    run(scenario)


def test_a_wrong_type_is_explained(monkeypatch):
    monkeypatch.setattr("webmap.ros.topic_faults.SILENCE", 0.2)

    async def scenario():
        with sdk_server() as server:
            async with bridged(server) as bridge:
                bridge.subscribe("/odom", print, "sensor_msgs/LaserScan")
                await until(lambda: bridge.errors)
                assert "expected sensor_msgs/LaserScan" in str(bridge.errors[0])
                assert "nav_msgs/msg/Odometry" in str(bridge.errors[0])

    run(scenario)


def test_a_rosbridge_is_no_foxglove_bridge_and_the_other_way_round():
    async def scenario():
        rosbridge = FakeRosbridge()
        await rosbridge.start()
        url = rosbridge.url.replace("ws:", "foxglove:")
        async with TemporaryBridge(url) as bridge:
            with pytest.raises(BridgeClosed, match=r"such as a rosbridge.*ws://"):
                await bridge.open()
        await rosbridge.stop()
        with sdk_server() as server:
            url = server.url.replace("foxglove:", "ws:")
            async with TemporaryBridge(url) as bridge:
                with pytest.raises(BridgeClosed, match=r"foxglove://127"):
                    await bridge.open()

    run(scenario)


def test_a_foxglove_bridge_is_recognised_by_the_subprotocol_that_it_answers(kind):
    async def scenario():
        rosbridge = FakeRosbridge()
        await rosbridge.start()
        closed = "ws://127.0.0.1:1/path"
        async with server_of(kind) as server:
            url = server.url.replace("foxglove:", "ws:")
            given = [rosbridge.url, url, closed, "fleet.toml", "zenoh://h/a"]
            found = await recognised(given)
        await rosbridge.stop()
        assert found == [rosbridge.url, server.url, closed, "fleet.toml", "zenoh://h/a"]

    run(scenario)


def test_a_bridge_that_answers_nothing_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(address, "PATIENCE", 0.1)

    async def scenario():
        held = asyncio.Event()

        async def hold(_reader, writer):
            await held.wait()
            writer.close()

        silent = await asyncio.start_server(hold, "127.0.0.1", 0)
        url = f"ws://127.0.0.1:{silent.sockets[0].getsockname()[1]}"
        assert await recognised([url]) == [url]
        held.set()
        silent.close()
        await silent.wait_closed()

    run(scenario)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("ws://robot", "foxglove://robot:80"),
        ("wss://robot/way", "foxgloves://robot:443/way"),
        ("wss://robot:8765", "foxgloves://robot:8765"),
    ],
)
def test_the_address_of_a_recognised_bridge_names_its_port(
    monkeypatch, given, expected
):
    async def connect(_url, _subprotocols):
        return None

    async def close(_socket):
        pass

    monkeypatch.setattr(address, "connect_to", connect)
    monkeypatch.setattr(address, "close_soon", close)
    assert asyncio.run(recognised([given])) == [expected]


def test_a_server_that_offers_little():
    async def scenario():
        with sdk_server(capabilities=[Capability.Time], services=False) as server:
            async with bridged(server) as bridge:
                await until(lambda: bridge._link._main.info)
                with pytest.raises(BridgeError, match="lacks clientPublish"):
                    bridge.publish("/talk", {"data": "a"}, "std_msgs/String")
                with pytest.raises(ServiceError, match="lacks services"):
                    await bridge.call_service("/none")
                with pytest.raises(ServiceError, match="lacks parameters"):
                    await bridge.set_parameter("/a", 1)

    run(scenario)


def test_addresses():
    assert Bridge("Foxglove://Robot:8765/").url == "foxglove://robot"
    bridge = Bridge("foxgloves://robot/x?y=1")
    assert bridge._link.lane.url == "wss://robot:8765/x?y=1"
    assert Bridge("foxglove://[::1]:9000")._link.lane.url == "ws://[::1]:9000"
