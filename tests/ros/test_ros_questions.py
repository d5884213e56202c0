"""Service calls to a bridge, encodings of messages, and short connections."""

import asyncio

import pytest

from equipment.fake_rosbridge import FakeRosbridge, bridged
from equipment.waiting import until
from webmap.base.errors import BridgeClosed, ConfigError, ServiceError
from webmap.base.lifecycle import lifecycle
from webmap.ros.bridge import Bridge
from webmap.ros.rosbridge.calls import Calls
from webmap.ros.temporary_bridge import TemporaryBridge

NODES = {"publishers": ["/base", "/rosbridge_websocket"], "subscribers": ["/webmap"]}


def asked(question, **answers):
    """Return the result of a service call to a bridge whose rosapi answers so."""

    async def scenario():
        async with bridged(opened=False, **answers) as (_, bridge):
            return await question(bridge)

    return asyncio.run(scenario())


@pytest.mark.parametrize(
    ("question", "expected"),
    [
        (lambda bridge: bridge.publishers("/a"), ["/base", "/rosbridge_websocket"]),
        (lambda bridge: bridge.other_publishers("/a"), ["/base"]),
        (lambda bridge: bridge.subscribers("/a"), ["/webmap"]),
        (lambda bridge: bridge.service_type("/dock"), "std_srvs/Trigger"),
        (lambda bridge: bridge.topic_type("/a"), "std_msgs/Bool"),
        (lambda bridge: bridge.time(), 7.5),
    ],
)
def test_a_query_returns_the_answer_of_rosapi_or_none(question, expected):
    answers = {name: {name: nodes} for name, nodes in NODES.items()}
    answers["service_type"] = {"type": "std_srvs/Trigger"}
    answers["topic_type"] = {"type": "std_msgs/Bool"}
    answers["get_time"] = {"time": {"secs": 7, "nsecs": 500_000_000}}
    assert asked(question, **answers) == expected
    assert asked(question) is None
    assert asked(question, **{name: {"odd": 1} for name in answers}) is None


def test_a_parameter_is_set_and_read_back():
    def of(value):
        answers = {"set_param": {}, "get_param": {"value": value}}
        return asked(lambda bridge: bridge.set_parameter("/speed", 0.5), **answers)

    assert of("0.25") == 0.25
    assert of("fast") == "fast"
    assert of(None) is None
    with pytest.raises(ServiceError):
        asked(lambda bridge: bridge.set_parameter("/speed", 0.5))


@pytest.mark.parametrize(
    ("encoding", "compression"),
    [("text", "none"), ("binary", "cbor"), ("raw", "cbor-raw")],
)
def test_an_encoding_is_subscribed_under_its_rosbridge_name(encoding, compression):
    async def scenario():
        async with bridged() as (server, bridge):
            bridge.subscribe("/a", print, encoding=encoding)
            (asked,) = await server.wait_for("subscribe")
            assert asked["compression"] == compression

    asyncio.run(scenario())


def test_an_unknown_encoding_is_refused():
    bridge = Bridge("ws://127.0.0.1:1")
    with pytest.raises(ConfigError, match="text, binary, raw, got 'cbor'"):
        bridge.subscribe("/a", print, encoding="cbor")


def test_a_temporary_bridge_is_open_only_inside_its_with_block():
    async def scenario():
        server = FakeRosbridge()
        await server.start()
        async with TemporaryBridge(server.url) as bridge:
            assert bridge not in lifecycle._services
            assert bridge.state == "new"
            await bridge.open()
            assert bridge.state == "open"
            bridge.subscribe("/a", print)
            await server.wait_for("subscribe")
        assert bridge.state == "closed"
        await until(lambda: not server.links)
        await server.stop()

    asyncio.run(scenario())


def test_opening_an_unreachable_temporary_bridge_raises_the_reason():
    async def scenario():
        async with TemporaryBridge("ws://127.0.0.1:1") as bridge:
            with pytest.raises(BridgeClosed) as raised:
                await bridge.open()
            assert "nothing listens there" in raised.value.why

    asyncio.run(scenario())


class SlowLane:
    """A connection that opens when the test says so."""

    def __init__(self, url, *, opened, **events):
        self.opened = opened
        self.sent = []
        self.state = "opening"
        lanes.append(self)

    def start(self, loop):
        pass

    def send(self, frame):
        self.sent.append(frame)


lanes: list[SlowLane] = []


def test_calls_wait_for_the_connection_in_order_and_those_that_ended_are_not_sent():
    async def scenario():
        calls = Calls("ws://127.0.0.1:9", SlowLane)
        running = [
            asyncio.create_task(calls.call(name, None, None, 60.0))
            for name in ("/first", "/second", "/third")
        ]
        await asyncio.sleep(0)
        running[1].cancel()
        await asyncio.wait(running[1:2])
        (lane,) = lanes
        assert lane.sent == []
        lane.opened()
        assert [b"/first" in lane.sent[0], b"/third" in lane.sent[1]] == [True, True]
        assert len(lane.sent) == 2
        for each in running:
            each.cancel()
        await asyncio.wait(running)

    asyncio.run(scenario())
