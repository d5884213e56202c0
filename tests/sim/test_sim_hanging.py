"""Faults of rosbridge 2.1.0 that the simulator plays: the endless queue, large CBOR."""

import asyncio
import contextlib
import json

import cbor2
import pytest
from simulated import Bench, room
from websockets.asyncio.client import connect

from equipment.waiting import until
from webmap.ros.rosbridge.server.dialect import Dialect, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer

pytestmark = pytest.mark.slow

TYPE = "std_msgs/String"
TOPIC = "/latched"


@contextlib.asynccontextmanager
async def serving(quirks):
    schema, behaviour = Schema(Dialect("ros2")), parse_quirks(quirks, "ros2")
    graph = Graph(schema)
    node = object()
    graph.advertise(node, TOPIC, TYPE, latch=True)
    graph.publish(node, TOPIC, {"data": "x"})
    server = RosbridgeServer(graph, Encoder(schema, behaviour))
    url = await server.start("127.0.0.1", 0)
    try:
        yield url, server
    finally:
        await server.stop()


async def answers(url):
    """Return whether the server answers a new client."""
    try:
        async with connect(url, open_timeout=0.5, proxy=None):
            return True
    except TimeoutError:
        return False


async def leave_by_reset(client):
    client.transport.abort()


async def leave_by_closing(client):
    await client.close()


async def leave_by_unsubscribing(client):
    await client.send(json.dumps({"op": "unsubscribe", "id": "a", "topic": TOPIC}))


@pytest.mark.parametrize(
    "leave", [leave_by_reset, leave_by_closing, leave_by_unsubscribing]
)
@pytest.mark.parametrize(
    ("quirks", "throttle", "queue", "hangs"),
    [
        ("real", 0, 1, True),
        ("real", 1, 1, False),
        ("real", 0, 0, False),
        ("real,-spinning_queue", 0, 1, False),
    ],
)
def test_a_bridge_hangs_only_if_a_client_leaves_a_queue_without_throttle(
    quirks, throttle, queue, hangs, leave
):
    async def scenario():
        async with serving(quirks) as (url, server):
            other = await connect(url, proxy=None)
            client = await connect(url, proxy=None)
            request = {"op": "subscribe", "id": "a", "topic": TOPIC}
            asked = {"throttle_rate": throttle, "queue_length": queue}
            await client.send(json.dumps(request | asked))
            assert json.loads(await client.recv())["msg"] == {"data": "x"}
            await leave(client)
            if leave is not leave_by_unsubscribing:
                await until(lambda: len(server.sessions) <= 1)
            assert await answers(url) is not hangs
            # Clients that were connected before get no answer either.
            await other.send(json.dumps(request))
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(0.5 if hangs else 5):
                    await other.recv()
                    assert not hangs
                    return
            assert hangs

    asyncio.run(scenario())


@pytest.mark.parametrize("compression", ["cbor", "cbor-raw"])
def test_a_cbor_message_above_the_size_limit_is_logged_and_not_sent(
    compression, caplog
):
    bench = Bench("ros2", "real", plan=room())
    small = bench.client()
    small.send(op="subscribe", topic="/map", compression=compression)
    (frame,) = small.session.next_frames()
    assert cbor2.loads(frame)["topic"] == "/map"
    bench.encoder.max_message_size = 1000
    client = bench.client()
    client.send(op="subscribe", topic="/map", compression=compression)
    assert client.session.next_frames() == []
    assert "above max_message_size (1000)" in caplog.text


def test_a_json_message_above_the_size_limit_is_sent_in_fragments():
    bench = Bench("ros2", "real", plan=room())
    bench.encoder.max_message_size = 10_000
    client = bench.client()
    client.send(op="subscribe", topic="/map")
    parts = [json.loads(frame) for frame in client.session.next_frames()]
    assert len(parts) > 1
    assert {part["op"] for part in parts} == {"fragment"}
    whole = json.loads("".join(part["data"] for part in parts))
    info = whole["msg"]["info"]
    assert len(whole["msg"]["data"]) == info["width"] * info["height"] > 10_000
