"""Servers that lie, stall or flood: each costs a clear sentence and nothing else."""

import asyncio
import json
import struct
import time
from contextlib import asynccontextmanager

import pytest
from websockets.asyncio.server import serve

from equipment.waiting import until
from webmap.base.errors import BridgeClosed, BridgeError, ProtocolError, ServiceError
from webmap.ros.foxglove import calls, link, session
from webmap.ros.limits import MAX_FRAME
from webmap.ros.messages import OdometryMsg
from webmap.ros.temporary_bridge import TemporaryBridge

STRING = {"encoding": "cdr", "schemaEncoding": "ros2msg", "schema": "string data"}
HELLO = b"\0\1\0\0\6\0\0\0hello\0"


def run(scenario):
    asyncio.run(scenario())


def text(**fields):
    return json.dumps(fields)


def channel(id, topic, type="std_msgs/msg/String", **fields):
    return {"id": id, "topic": topic, "schemaName": type, **STRING, **fields}


class FakeServer:
    """A Foxglove server that sends what a test says."""

    def __init__(self, *first, subprotocols=("foxglove.sdk.v1",)):
        self.first = first
        self.links = []
        self.received = []
        self.subprotocols = list(subprotocols)

    async def start(self):
        self._server = await serve(
            self._serve,
            "127.0.0.1",
            0,
            subprotocols=self.subprotocols,
            compression=None,
            max_size=None,
        )
        port = self._server.sockets[0].getsockname()[1]
        self.url = f"foxglove://127.0.0.1:{port}"

    async def stop(self):
        self._server.close()
        await self._server.wait_closed()

    async def _serve(self, link):
        self.links.append(link)
        for each in self.first:
            await link.send(each)
        async for frame in link:
            self.received.append(frame)

    async def send(self, *frames, to=0):
        for frame in frames:
            await self.links[to].send(frame)

    def subscriptions(self):
        """Return the ids of subscriptions by channel."""
        found = {}
        for frame in self.received:
            asked = json.loads(frame) if isinstance(frame, str) else {}
            for each in asked.get("subscriptions", ()):
                found[each["channelId"]] = each["id"]
        return found

    async def message(self, channel, payload, stamp=1):
        await until(lambda: channel in self.subscriptions())
        head = struct.pack("<BIQ", 1, self.subscriptions()[channel], stamp)
        await self.send(head + payload)


INFO = text(op="serverInfo", name="fake", capabilities=["services", "clientPublish"])


@asynccontextmanager
async def fake(*channels, first=(INFO,), **options):
    offered = (text(op="advertise", channels=channels),) if channels else ()
    server = FakeServer(*first, *offered, **options)
    await server.start()
    errors = []
    async with TemporaryBridge(server.url) as bridge:
        bridge.on_error(errors.append)
        await bridge.open()
        yield server, bridge, errors
    await server.stop()


@pytest.mark.parametrize(
    ("schema", "reason"),
    [
        ({"schema": "string data\nodd_msgs/Odd odd"}, "odd_msgs/Odd"),
        ({"schema": "std_msgs/String again"}, "nested"),
        ({"schema": "12 is no definition"}, "is no field"),
        ({"schema": "int8[4000000000] data"}, "longer than any message"),
        (
            {"schema": "\n".join(f"int8 a{i}" for i in range(5000))},
            "more than 2000 lines",
        ),
        ({"schema": "module std_msgs {", "schemaEncoding": "ros2idl"}, "IDL"),
    ],
)
def test_a_schema_that_cannot_be_used(schema, reason):
    async def scenario():
        async with fake(channel(1, "/bad", **schema), channel(2, "/good")) as found:
            server, bridge, errors = found
            good = []
            bridge.subscribe("/bad", print)
            bridge.subscribe("/good", good.append)
            for _ in range(3):
                await server.message(1, HELLO)
            await server.message(2, HELLO)
            await until(lambda: good and errors)
            assert good == [{"data": "hello"}]
            assert len(errors) == 1
            assert "/bad" in str(errors[0])
            assert "schema of std_msgs/msg/String cannot be used" in str(errors[0])
            assert reason in str(errors[0])

    run(scenario)


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"", "CDR begins with 4 bytes"),
        (HELLO[:7], "ends before its last field"),
        (HELLO + b"too much", "after its last field"),
        (b"\0\1\0\0\xff\xff\xff\x7fhello", "ends before its last field"),
        (b"\0\7\0\0" + HELLO[4:], "XCDR2"),
    ],
)
def test_a_message_that_does_not_fit_its_schema(payload, reason):
    async def scenario():
        async with fake(channel(1, "/a")) as (server, bridge, errors):
            got = []
            bridge.subscribe("/a", got.append)
            await server.message(1, payload)
            await until(lambda: errors)
            assert reason in str(errors[0])
            await server.message(1, HELLO)
            await until(lambda: got)
            assert got == [{"data": "hello"}]

    run(scenario)


def test_a_view_that_the_schema_has_not():
    async def scenario():
        async with fake(channel(1, "/odom", "nav_msgs/msg/Odometry")) as found:
            server, bridge, errors = found
            bridge.subscribe("/odom", print, decode=OdometryMsg)
            await server.message(1, HELLO)
            await until(lambda: errors)
            assert "/odom" in str(errors[0])

    run(scenario)


def test_a_channel_that_changes_its_schema_is_read_anew():
    async def scenario():
        async with fake(channel(1, "/a")) as (server, bridge, errors):
            got = []
            bridge.subscribe("/a", got.append)
            await server.message(1, HELLO)
            await until(lambda: got)
            changed = channel(1, "/a", "std_msgs/msg/Int8", schema="int8 data")
            server.received.clear()
            await server.send(text(op="advertise", channels=[changed]))
            await server.message(1, b"\0\1\0\0\7")
            await until(lambda: len(got) == 2)
            assert got[1] == {"data": 7}
            assert not errors

    run(scenario)


def test_json_channels_are_read_and_others_left_out():
    async def scenario():
        channels = [
            channel(1, "/a", encoding="json", schemaEncoding="jsonschema"),
            channel(2, "/b", encoding="protobuf"),
            channel(3, "/c", "foxglove.SceneUpdate"),
            channel(4, "not a topic"),
            channel(5, "/e", schemaEncoding="flatbuffer"),
        ]
        async with fake(*channels) as (server, bridge, errors):
            assert await bridge.topics() == {"/a": "std_msgs/msg/String"}
            got = []
            bridge.subscribe("/a", got.append)
            await server.message(1, b'{"data":"hello"}')
            await until(lambda: got)
            await server.message(1, b'{"data":')
            await until(lambda: errors)
            assert "not JSON" in str(errors[0])

    run(scenario)


def test_operations_of_tomorrow_and_bytes_that_are_no_protocol():
    async def scenario():
        async with fake(channel(1, "/a")) as (server, bridge, errors):
            got = []
            bridge.subscribe("/a", got.append)
            for _ in range(5):
                await server.send(b"\x63later", text(op="later"), b"\2", "[]", b"")
            await server.message(1, HELLO)
            await until(lambda: got)
            assert bridge.stats.unknown == 15
            assert bridge.stats.malformed == 10
            assert len(errors) == 1
            assert "not Foxglove's protocol" in str(errors[0])
            assert bridge.state == "open"

    run(scenario)


def test_messages_and_answers_that_nobody_asked_for():
    async def scenario():
        async with fake(channel(1, "/a")) as (server, bridge, errors):
            await server.send(
                struct.pack("<BIQ", 1, 77, 0) + HELLO,
                struct.pack("<BIII", 3, 1, 99, 3) + b"cdr",
                text(op="serviceCallFailure", serviceId=1, callId=99, message="no"),
                text(op="parameterValues", parameters=[], id="other"),
                text(op="unadvertise", channelIds=[5, 6]),
                text(op="unadvertiseServices", serviceIds=[5]),
                text(op="connectionGraphUpdate", removedTopics=["/x"]),
                text(op="removeStatus", statusIds=["a"]),
            )
            assert await bridge.topics() == {"/a": "std_msgs/msg/String"}
            await server.send(text(op="status", level=2, message="last"))
            await until(lambda: errors)
            assert "last" in str(errors[0])

    run(scenario)


def test_ten_thousand_channels_and_no_more():
    async def scenario():
        many = [channel(id, f"/t{id}") for id in range(12_000)]
        async with fake(channel(20_000, "/a")) as (server, bridge, errors):
            began = time.process_time()
            for start in range(0, 12_000, 1000):
                part = many[start : start + 1000]
                await server.send(text(op="advertise", channels=part))
            await until(lambda: len(errors) == 3)
            assert time.process_time() - began < 3.0
            assert "more channels than 10000" in str(errors[-1])
            assert len(await bridge.topics()) == session.MOST_OFFERED
            await server.send(text(op="unadvertise", channelIds=list(range(12_000))))
            got = []
            bridge.subscribe("/a", got.append)
            await server.message(20_000, HELLO)
            await until(lambda: got)
            assert await bridge.topics() == {"/a": "std_msgs/msg/String"}

    run(scenario)


def test_a_message_that_is_too_long_ends_no_connection():
    async def scenario():
        async with fake(channel(1, "/a"), channel(2, "/b")) as found:
            server, bridge, errors = found
            got = []
            bridge.subscribe("/a", print)
            bridge.subscribe("/b", got.append)
            await server.message(1, bytes(MAX_FRAME + 1))
            await server.message(2, HELLO)
            await until(lambda: got and errors)
            assert "got a message of 64.0 MiB" in str(errors[0])
            assert bridge.stats.links == 1

    run(scenario)


def test_a_server_that_does_not_introduce_itself(monkeypatch):
    monkeypatch.setattr(link, "PATIENCE", 0.2)

    async def scenario():
        server = FakeServer()
        await server.start()
        async with TemporaryBridge(server.url) as bridge:
            with pytest.raises(BridgeError, match="did not introduce itself"):
                await bridge.open()
            with pytest.raises(BridgeClosed, match="not open"):
                bridge.publish("/a", {"data": "x"}, "std_msgs/String")
        await server.stop()

    run(scenario)


def test_another_subprotocol_is_refused():
    async def scenario():
        server = FakeServer(INFO, subprotocols=["foxglove.sdk.v9"])
        await server.start()
        async with TemporaryBridge(server.url) as bridge:
            with pytest.raises(BridgeClosed, match="none of the subprotocols"):
                await bridge.open()
        await server.stop()

    run(scenario)


def test_a_call_without_an_answer_gives_up_and_the_next_has_a_new_connection():
    async def scenario():
        services = [
            {"id": 1, "name": "/slow", "type": "std_srvs/srv/Trigger"}
            | {"requestSchema": "", "responseSchema": "bool success"}
        ]
        offer = text(op="advertiseServices", services=services)
        encodings = text(
            op="serverInfo", capabilities=["services"], supportedEncodings=["cdr"]
        )
        async with fake(first=(encodings, offer)) as (server, bridge, _):
            for links in (2, 3):
                with pytest.raises(ServiceError, match=r"not answer within 0\.3 s"):
                    await bridge.call_service("/slow", timeout=0.3)
                assert len(server.links) == links
            call = asyncio.ensure_future(bridge.call_service("/slow"))
            await until(lambda: len(server.links) == 4)
            await until(lambda: isinstance(server.received[-1], bytes))
            await until(lambda: len(server.received) == 3)
            (id,) = struct.unpack_from("<I", server.received[-1], 5)
            head = struct.pack("<BIII", 3, 1, id, 3) + b"cdr"
            await server.send(head + b"\0\1", to=3)
            with pytest.raises(ServiceError, match="response of /slow is invalid"):
                await call
            call = asyncio.ensure_future(bridge.call_service("/slow"))
            await until(lambda: len(server.received) == 4)
            await server.links[3].close()
            with pytest.raises(BridgeClosed):
                await call

    run(scenario)


def test_services_in_an_unknown_encoding_or_with_a_bad_schema(monkeypatch):
    monkeypatch.setattr(calls, "OFFERED_WITHIN", 0.5)

    async def scenario():
        part = {"schemaName": "a", "schemaEncoding": "x", "schema": ""}
        services = [
            {"id": 1, "name": "/odd", "type": "std_srvs/srv/Empty"}
            | {"request": {**part, "encoding": "xml"}},
            {"id": 2, "name": "/bad", "type": "std_srvs/srv/Empty"}
            | {"request": {**part, "encoding": "cdr"}, "responseSchema": ""},
            {"id": 3, "name": "/bare", "type": "std_srvs/srv/Empty"},
        ]
        offer = text(op="advertiseServices", services=services)
        async with fake(first=(INFO, offer)) as (_, bridge, _errors):
            for name, reason in (
                ("/odd", "xml; expected cdr, ros1 or json"),
                ("/bad", "in 'x'; expected ros2msg"),
                ("/bare", "is not stated"),
            ):
                with pytest.raises(ServiceError, match=reason):
                    await bridge.call_service(name)

    run(scenario)


def test_a_flood_delays_nothing_else():
    async def scenario():
        async with fake(channel(1, "/a")) as (server, bridge, _):
            got = []
            bridge.subscribe("/a", got.append, throttle=100)
            await until(lambda: 1 in server.subscriptions())
            head = struct.pack("<BIQ", 1, server.subscriptions()[1], 1)
            worst, before = 0.0, time.monotonic()

            async def flood():
                for _ in range(400):
                    await server.send(*[head + HELLO] * 50)
                    await asyncio.sleep(0)

            flooding = asyncio.ensure_future(flood())
            while not flooding.done() or bridge.stats.frames < 20_000:
                await asyncio.sleep(0.001)
                now = time.monotonic()
                worst, before = max(worst, now - before), now
            await until(lambda: len(got) >= 2)
            assert worst < 1.0
            assert len(got) < 1000  # the others were not decoded

    run(scenario)


def test_a_server_that_stalls_is_left(monkeypatch):
    monkeypatch.setattr("webmap.ros.sockets.connection.Liveness.LIMIT", 0.3)
    monkeypatch.setattr("webmap.ros.sockets.connection.Liveness.PERIOD", 0.05)

    async def scenario():
        async with fake(channel(1, "/a")) as (server, bridge, _):
            reasons = []
            bridge.on_close(reasons.append)
            server.links[0].transport.pause_reading()
            await until(lambda: reasons)
            assert "no answer to a ping" in reasons[0]

    run(scenario)


def test_faults_of_channels_are_reported_once_for_each_operation():
    async def scenario():
        async with fake(channel(1, "/a")) as (server, bridge, errors):
            bad = [{"id": "x", "topic": "/b"}] * 100
            await server.send(text(op="advertise", channels=[*bad, channel(2, "/c")]))
            await until(lambda: errors)
            assert len(errors) == 1
            assert isinstance(errors[0], ProtocolError)
            assert "100 channels that cannot be used" in str(errors[0])
            assert set(await bridge.topics()) == {"/a", "/c"}

    run(scenario)
