"""Messages above ``max_message_size``, which a bridge of ROS 2 never sends in CBOR."""

import asyncio
import contextlib
import json

import pytest

from equipment.fake_rosbridge import bridged
from equipment.waiting import until
from webmap.base.scope import Scope
from webmap.ros.bridge import Bridge
from webmap.ros.rosbridge import wire_subscription
from webmap.ros.rosbridge.server.dialect import Dialect, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer
from webmap.ros.rosbridge.wire_subscription import (
    IN_CBOR,
    MOST_LOST,
    PATIENCE,
    THROTTLE,
    InJson,
    TopicSilence,
)

pytestmark = pytest.mark.slow

MAP = "nav_msgs/OccupancyGrid"
LIMIT = 5000


class TestDecision:
    @pytest.mark.parametrize(
        "type",
        [
            "nav_msgs/msg/OccupancyGrid",
            "sensor_msgs/PointCloud2",
            "sensor_msgs/Image",
            "sensor_msgs/CompressedImage",
        ],
    )
    def test_a_silent_map_image_or_point_cloud_is_requested_in_json_once(self, type):
        in_json = InJson()
        assert in_json.silent(type, "cbor") == "ask"
        assert in_json.on
        assert in_json.silent(type, "cbor") is None
        assert in_json.received(in_parts=True) is True
        assert in_json.received(in_parts=True) is None
        assert in_json.on

    @pytest.mark.parametrize(
        ("type", "compression"),
        [
            (None, "cbor"),
            (MAP, None),
            (MAP, "none"),
            (MAP, "cbor-raw"),
            ("map_msgs/OccupancyGridUpdate", "cbor"),
            ("visualization_msgs/MarkerArray", "cbor"),
            ("sensor_msgs/LaserScan", "cbor"),
        ],
    )
    def test_no_other_type_or_compression_is_requested_in_json(self, type, compression):
        in_json = InJson()
        assert in_json.silent(type, compression) is None
        assert not in_json.on

    def test_a_late_small_message_switches_back_to_cbor(self):
        in_json = InJson()
        in_json.silent(MAP, "cbor")
        assert in_json.received(in_parts=False) is False
        assert not in_json.on
        assert in_json.silent(MAP, "cbor") is None
        in_json.begin()
        assert in_json.silent(MAP, "cbor") == "ask", (
            "a new link may send a large message"
        )

    def test_json_is_given_up_after_several_lost_links(self):
        in_json = InJson()
        for _ in range(MOST_LOST):
            assert in_json.silent(MAP, "cbor") == "ask"
            in_json.begin()
            assert not in_json.on
        assert in_json.silent(MAP, "cbor") == "given up"
        assert in_json.silent(MAP, "cbor") is None


class TestSilence:
    def looks(self, answers, until=60):
        """When a silent topic counts as not sent, at ten looks a second."""
        silence = TopicSilence(0.0)
        for tenth in range(10 * until):
            now = tenth / 10
            if silence.due(now):
                silence.answered(answers(now), now)
                if silence.is_unsent(now):
                    return now
        return None

    def test_a_published_topic_counts_as_unsent_after_ten_silent_seconds(self):
        assert self.looks(lambda _: True) == IN_CBOR == 10

    def test_the_silence_is_counted_from_the_first_publisher(self):
        at = self.looks(lambda now: now >= 20)
        assert 30 <= at <= 40

    @pytest.mark.parametrize("published", [False, None])
    def test_a_topic_without_a_known_publisher_never_counts_as_unsent(self, published):
        assert self.looks(lambda _: published) is None


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(wire_subscription, "PERIOD", 0.01)
    monkeypatch.setattr(wire_subscription, "FIRST", 0.02)
    monkeypatch.setattr(wire_subscription, "LONGEST", 0.05)
    monkeypatch.setattr(wire_subscription, "IN_CBOR", 0.2)


@contextlib.asynccontextmanager
async def ros2(cells, *, limit=LIMIT, published=True):
    """A simulated bridge with a map, and a link to it."""
    quirks = parse_quirks("real", "ros2")
    schema = Schema(Dialect("ros2"))
    graph, node = Graph(schema), object()
    Rosapi(graph, quirks).start()

    def publish():
        grid = {"info": {"width": cells, "height": 1}, "data": [100] * cells}
        graph.publish(node, "/map", graph.conform(MAP, grid, finite=True))

    graph.advertise(node, "/map", MAP, latch=True)
    if published:
        publish()
    server = RosbridgeServer(graph, Encoder(schema, quirks, limit))
    url = await server.start("127.0.0.1", 0)
    bridge = Bridge(url)
    bridge.start(asyncio.get_running_loop())
    try:
        yield server, bridge, publish
    finally:
        await bridge.stop()
        await server.stop()


def test_a_map_too_large_for_cbor_is_received_in_json_and_reported(quick, caplog):
    async def scenario():
        got, seen = [], []
        scope = Scope("page", lambda text, about: seen.append((text, about)))
        async with ros2(cells=10_000) as (server, bridge, _):
            with scope.active():
                listener = bridge.subscribe("/map", got.append, MAP)
            await until(lambda: got)
            assert got[0]["info"]["width"] == 10_000
            ((text, about),) = seen
            assert about is listener
            assert text.startswith("/map is larger than the bridge sends in CBOR: set")
            assert "set max_message_size of rosbridge_websocket to " in text
            assert text in caplog.text
            (subscription,) = (
                session._topics._subscriptions["/map"]
                for session in server.sessions
                if session._topics._subscriptions
            )
            merged = subscription.merged
            assert (merged.throttle, merged.compression) == (THROTTLE / 1000, "none")
            assert merged.queue_length == 1

    asyncio.run(scenario())


def test_a_map_published_late_returns_to_cbor_without_a_report(quick):
    async def scenario():
        got, seen = [], []
        scope = Scope("page", lambda text, about: seen.append(text))
        async with bridged(publishers={"publishers": ["/slam"]}) as (server, bridge):
            with scope.active():
                bridge.subscribe("/map", got.append, MAP)

            def asked():
                return [m.get("compression") for m in server.ops("subscribe")]

            await until(lambda: "none" in asked())
            (json_request,) = server.ops("subscribe", compression="none")
            assert json_request["throttle_rate"] == THROTTLE
            await server.publish("/map", {"info": {}})
            await until(lambda: asked()[-1] == "cbor")
            await until(lambda: len(got) == 1)
            count = len(asked())
            await asyncio.sleep(0.6)
            assert len(asked()) == count, "the topic is requested again and again"
            assert seen == []

    asyncio.run(scenario())


def test_after_several_lost_links_json_requests_end_and_this_is_reported(quick):
    async def scenario():
        seen = []
        scope = Scope("page", lambda text, about: seen.append(text))
        async with bridged(publishers={"publishers": ["/map_server"]}) as both:
            server, bridge = both
            with scope.active():
                bridge.subscribe("/map", print, MAP)
            for number in range(1, MOST_LOST + 1):
                await server.wait_for("subscribe", number, compression="none")
                server.drop()
                await until(lambda n=number: bridge.stats.links > n)
            await until(lambda: seen)
            assert "the connection ended before one came in JSON" in seen[0]
            assert "max_message_size" in seen[0]
            assert len(server.ops("subscribe", compression="none")) == MOST_LOST

    asyncio.run(scenario())


def test_a_fragmented_message_is_marked_as_received_in_parts(quick):
    async def scenario():
        got = []
        async with bridged() as (server, bridge):
            listener = bridge.subscribe("/a", got.append, "std_msgs/String")
            listener.undecoded = True
            text = json.dumps({"op": "publish", "topic": "/a", "msg": {"data": "x"}})
            await server.send(text)
            for number, piece in enumerate((text[:20], text[20:])):
                part = {"op": "fragment", "id": 0, "data": piece}
                await server.send(json.dumps({**part, "num": number, "total": 2}))
            await until(lambda: len(got) == 2)
            assert [message.in_parts for message in got] == [False, True]

    asyncio.run(scenario())


def test_a_bridge_counts_as_busy_only_while_the_first_map_is_pending(monkeypatch):
    async def scenario():
        async with bridged() as (server, bridge):
            busy = bridge._link.lane._busy
            bridge.subscribe("/text", print, "std_msgs/String")
            bridge.subscribe("/scan", print, "sensor_msgs/LaserScan")
            assert not busy()
            bridge.subscribe("/map", print, MAP)
            assert busy()
            await server.publish("/map", {"info": {}})
            await until(lambda: not busy())
            bridge.subscribe("/other", print, MAP)
            assert busy()
            monkeypatch.setitem(PATIENCE, "cbor", 0.0)
            assert not busy()

    asyncio.run(scenario())
