"""The lanes of the gate at a bridge of Foxglove."""

import asyncio
import contextlib
import json
import struct
import time

import pytest
from link_bench import in_loop
from test_gate_serialization import GOAL_FIELDS, STORES, actionlib, make, written
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed

from equipment.gate_harness import spec
from equipment.waiting import until
from webmap.base.errors import ProtocolError
from webmap.base.geometry import Twist
from webmap.config.motion import StopHook
from webmap.gate.actions import SendGoal, SendPose
from webmap.gate.clock import now
from webmap.gate.events import (
    EchoReceived,
    GoalEnded,
    Key,
    LinkDown,
    LinkUp,
    OdometryReceived,
    PingAnswered,
    ScanReceived,
)
from webmap.gate.lanes import foxglove, lane, sockets
from webmap.gate.lanes.calls import ServiceCalls
from webmap.gate.lanes.control import MOST, ControlLane
from webmap.gate.lanes.odometry import OdometryLane
from webmap.gate.lanes.tasks import TasksLane, goal_topics, hook_topics
from webmap.ros.names import web_socket_url

SDK, OLD = "foxglove.sdk.v1", "foxglove.websocket.v1"
ZERO, SLOW = Twist(), Twist(0.125)
TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
TRIGGER = {"id": 5, "name": "/e_stop", "type": "std_srvs/srv/Trigger"}
OTHER = {"id": 4, "name": "/other", "type": "std_srvs/srv/Trigger"}


@pytest.fixture(autouse=True)
def no_dead_link(monkeypatch):
    """Cut no link because the answer to a ping is late, as on a busy machine."""
    monkeypatch.setattr(lane, "DEAD", 60.0)


class Server:
    """A bridge whose messages the test sends; used as an async context manager."""

    def __init__(self, protocol=SDK, *, greets=True, **info):
        self.received = []
        self.clients = []
        self._protocols = None if protocol is None else [protocol]
        self._greets = greets
        fields = {"capabilities": ["clientPublish"], "supportedEncodings": ["cdr"]}
        self.info = {"op": "serverInfo", "name": "test", **fields, **info}
        self.answer = lambda frame: None
        """Called with each binary frame; returns what to answer."""

    async def __aenter__(self):
        self._server = await serve(
            self._serve,
            "127.0.0.1",
            0,
            subprotocols=self._protocols,
            compression=None,
            ping_interval=None,
        )
        port = self._server.sockets[0].getsockname()[1]
        self.url = f"foxglove://127.0.0.1:{port}"
        return self

    async def __aexit__(self, *_):
        self._server.close()
        await self._server.wait_closed()

    async def _serve(self, client):
        self.clients.append(client)
        if self._greets:
            await client.send(json.dumps(self.info))
        with contextlib.suppress(ConnectionClosed):
            async for frame in client:
                if isinstance(frame, str):
                    self.received.append(json.loads(frame))
                else:
                    self.received.append(frame)
                    answer = self.answer(frame)
                    if answer is not None:
                        await client.send(answer)

    async def send(self, message):
        """Send to the newest client."""
        text = json.dumps(message) if isinstance(message, dict) else message
        await self.clients[-1].send(text)

    async def offer(self, *channels):
        """Offer channels, each given as id, topic and type."""
        offered = [
            {"id": id, "topic": topic, "encoding": "cdr", "schemaName": type}
            for id, topic, type in channels
        ]
        await self.send({"op": "advertise", "channels": offered})

    def of(self, op):
        return [m for m in self.received if isinstance(m, dict) and m["op"] == op]

    @property
    def published(self):
        """The binary frames: opcode, number, bytes."""
        return [
            (m[0], struct.unpack("<I", m[1:5])[0], m[5:])
            for m in self.received
            if isinstance(m, bytes)
        ]

    async def subscribed(self, times=1):
        """Return the newest subscription: its number and the channel."""
        each = await until(
            lambda: self.of("subscribe")[times - 1 :], "the subscription"
        )
        (one,) = each[-1]["subscriptions"]
        return one["id"], one["channelId"]


def data(number, message):
    return b"\1" + struct.pack("<IQ", number, 0) + message


def twist(vx, wz=0.0):
    return struct.pack("<4s6d", b"\0\1\0\0", vx, 0.0, 0.0, 0.0, 0.0, wz)


class Noting:
    """A lane and its events."""

    def __init__(self, make):
        self.events = []
        self.lane = make(self.events.append)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.lane.lane.close()

    def of(self, type):
        return [event for event in self.events if isinstance(event, type)]

    async def up(self):
        return (await until(lambda: self.of(LinkUp), "the link"))[-1]


def control(url):
    noting = Noting(lambda emit: ControlLane(url, emit))
    noting.lane.attach("/cmd_vel", "geometry_msgs/Twist")
    return noting


class TestControl:
    @in_loop
    async def test_a_velocity_is_published_in_cdr_and_its_echo_received(self):
        async with Server() as server:
            with control(server.url) as noting:
                assert await noting.up() == LinkUp(server.url, "control")
                (offer,) = await until(lambda: server.of("advertise"), "the topic")
                (channel,) = offer["channels"]
                assert channel == {
                    "id": channel["id"],
                    "topic": "/cmd_vel",
                    "encoding": "cdr",
                    "schemaName": TWIST,
                    "schema": "",
                    "schemaEncoding": "ros2msg",
                }
                await server.offer((7, "/odom", TWIST), (8, "/cmd_vel", TWIST))
                number, wanted = await server.subscribed()
                assert wanted == 8
                assert noting.lane.write("/cmd_vel", SLOW)
                await until(lambda: server.published, "the velocity")
                assert server.published == [(1, channel["id"], twist(0.125))]
                await server.send(data(number, twist(0.125)))
                echo = EchoReceived(Key(server.url, "/cmd_vel"), SLOW)
                await until(lambda: echo in noting.events, "the echo")
                await until(lambda: noting.of(PingAnswered), "the answer to a ping")

    @in_loop
    async def test_a_bridge_of_ros_1_gets_its_own_serialization(self):
        async with Server(OLD, supportedEncodings=["ros1"]) as server:
            with control(server.url) as noting:
                assert (await noting.up()).only_echoes
                (offer,) = await until(lambda: server.of("advertise"), "the topic")
                (channel,) = offer["channels"]
                assert channel["schemaName"] == "geometry_msgs/Twist"
                assert channel["schemaEncoding"] == "ros1msg"
                assert noting.lane.write_zeros({Key(server.url, "/cmd_vel"): ""})
                await until(lambda: server.published, "the velocity")
                assert server.published == [(1, channel["id"], bytes(48))]

    @in_loop
    async def test_only_an_echo_makes_room_where_a_pong_proves_nothing(self):
        async with Server(OLD) as server:
            with control(server.url) as noting:
                await noting.up()
                await server.offer((8, "/cmd_vel", TWIST))
                number, _ = await server.subscribed()
                noting.lane.listen("/cmd_vel")
                for _ in range(MOST):
                    assert noting.lane.write("/cmd_vel", SLOW)
                pings = len(noting.of(PingAnswered))
                await until(
                    lambda: len(noting.of(PingAnswered)) > pings + 2, "answered pings"
                )
                assert not noting.lane.write("/cmd_vel", SLOW)
                assert noting.lane.write("/cmd_vel", ZERO)
                await server.send(data(number, twist(0.125)))
                await until(lambda: noting.of(EchoReceived), "the echo")
                assert noting.lane.write("/cmd_vel", SLOW)

    @in_loop
    async def test_nothing_is_written_before_the_server_has_greeted(self):
        async with Server(greets=False) as server:
            with control(server.url) as noting:
                await until(lambda: noting.lane.lane.subprotocol, "the connection")
                await until(lambda: server.clients, "the client")
                assert not noting.lane.write("/cmd_vel", ZERO)
                assert noting.lane.write_zeros({Key(server.url, "/cmd_vel"): ""}) == []
                await server.send(data(1, twist(1.0)))
                await until(lambda: noting.of(PingAnswered), "the answer to a ping")
                assert noting.of(LinkUp) == []
                await server.send(server.info)
                await noting.up()
                assert noting.lane.write("/cmd_vel", ZERO)

    @in_loop
    async def test_another_type_is_announced_anew(self):
        async with Server() as server:
            with control(server.url) as noting:
                await noting.up()
                await server.offer((8, "/cmd_vel", TWIST), (9, "/cmd_vel", STAMPED))
                assert (await server.subscribed())[1] == 8
                noting.lane.attach("/cmd_vel", STAMPED)
                assert (await server.subscribed(2))[1] == 9
                offers = await until(lambda: server.of("advertise")[1:], "the type")
                (first,) = server.of("advertise")[0]["channels"]
                assert server.of("unadvertise")[0]["channelIds"] == [first["id"]]
                (second,) = offers[0]["channels"]
                assert second["id"] != first["id"]
                assert second["schemaName"] == STAMPED
                noting.lane.detach("/cmd_vel", STAMPED)
                noting.lane.detach("/cmd_vel", "geometry_msgs/Twist")
                await until(lambda: len(server.of("unsubscribe")) == 3, "the end")

    @in_loop
    async def test_a_topic_that_is_offered_again_is_subscribed_again(self):
        async with Server() as server:
            with control(server.url) as noting:
                await noting.up()
                await server.offer((8, "/cmd_vel", TWIST))
                first, _ = await server.subscribed()
                await server.send({"op": "unadvertise", "channelIds": [8, 99]})
                await until(lambda: server.of("unsubscribe"), "the end of the first")
                await server.offer((9, "/cmd_vel", TWIST))
                second, channel = await server.subscribed(2)
                assert channel == 9
                await server.send(data(first, twist(1.0)))
                await server.send(data(second, twist(2.0)))
                await until(lambda: noting.of(EchoReceived), "the echo")
                assert noting.of(EchoReceived)[0].twist == Twist(2.0)

    @in_loop
    async def test_a_channel_in_another_encoding_is_not_subscribed(self):
        async with Server() as server:
            with control(server.url) as noting:
                await noting.up()
                channel = {"id": 1, "topic": "/cmd_vel", "schemaName": TWIST}
                offer = {
                    "op": "advertise",
                    "channels": [{**channel, "encoding": "json"}],
                }
                await server.send(offer)
                await server.offer((8, "/cmd_vel", TWIST))
                assert (await server.subscribed())[1] == 8

    @in_loop
    async def test_a_lost_link_is_announced_again(self):
        async with Server() as server:
            with control(server.url) as noting:
                await noting.up()
                noting.lane.lane.cut("for the test")
                await until(lambda: noting.of(LinkDown), "the end")
                assert not noting.lane.write("/cmd_vel", ZERO)
                await until(lambda: len(noting.of(LinkUp)) == 2, "the next link")
                await until(lambda: len(server.of("advertise")) == 2, "the topic")


REFUSED = "takes no messages of clients"


class TestServers:
    @pytest.mark.parametrize(
        "info",
        [{"capabilities": []}, {"supportedEncodings": ["json"]}],
    )
    @in_loop
    async def test_a_server_that_takes_no_messages_is_left(self, info, caplog):
        async with Server(**info) as server:
            with control(server.url) as noting:
                await until(lambda: REFUSED in caplog.text, "the warning")
                assert noting.of(LinkUp) == []

    @in_loop
    async def test_a_server_without_a_subprotocol_of_foxglove_is_left(self, caplog):
        async with Server(None) as server:
            with control(server.url) as noting:
                what = "no bridge of Foxglove at this address"
                await until(lambda: what in caplog.text, "the warning")
                assert noting.of(LinkUp) == []

    @in_loop
    async def test_a_new_session_of_the_server_begins_a_new_link(self, caplog):
        async with Server() as server:
            with control(server.url) as noting:
                await noting.up()
                await server.send(server.info)
                await until(lambda: len(noting.of(LinkUp)) == 2, "the next link")
        assert "new session" in caplog.text

    @in_loop
    async def test_too_many_channels_end_the_link(self, caplog, monkeypatch):
        monkeypatch.setattr(foxglove, "MOST_CHANNELS", 2)
        async with Server() as server:
            with control(server.url) as noting:
                await noting.up()
                await server.offer(*((id, f"/t{id}", TWIST) for id in range(3)))
                await until(lambda: noting.of(LinkDown), "the end")
        assert "more than 2 topics" in caplog.text

    @pytest.mark.parametrize(
        ("frame", "why"),
        [
            ('{"op": "status", "level": 2, "message": "no such type"}', "no such type"),
            ('{"op": "status"', "not Foxglove's protocol"),
            ('{"op": "advertise", "channels": [7]}', "not Foxglove's protocol"),
            (f'{{"op": "status", "message": "{"m" * 65536}"}}', "operation status of"),
            (b"\2", ""),
            (b"\1", "message data of 1 bytes"),
            (b"\1" + bytes(sockets.MAX_FRAME), "a message of 1048577 bytes"),
        ],
    )
    @in_loop
    async def test_errors_are_logged_and_the_link_goes_on(self, frame, why, caplog):
        async with Server() as server:
            with control(server.url) as noting:
                await noting.up()
                await server.send('{"op": "status", "level": 1, "message": "hm"}')
                await server.send('{"op": "time"}')
                await server.send(frame)
                if why != "message data of 1 bytes":  # has no subscription either
                    await until(lambda: why in caplog.text, "the warning")
                await server.offer((8, "/cmd_vel", TWIST))
                await server.subscribed()
        assert "hm" not in caplog.text

    @in_loop
    async def test_what_comes_with_the_handshake_is_not_lost(self):
        with control("foxglove://127.0.0.1:1") as noting:
            wire = noting.lane._wire
            wire._on_frame(json.dumps(Server().info).encode())
            wire._on_frame(b"{")
            assert noting.of(LinkUp) == []
            wire._opened()
            assert noting.of(LinkUp) == [
                LinkUp("foxglove://127.0.0.1:1", "control", True)
            ]


def odometry(url):
    return Noting(lambda emit: OdometryLane(url, emit))


class TestOdometry:
    @in_loop
    async def test_odometry_of_any_type_is_received(self):
        async with Server() as server:
            key = Key(server.url, "/cmd_vel")
            with odometry(server.url) as noting:
                noting.lane.watch("/odom", None, key)
                noting.lane.watch("/odom", None, Key(server.url, "/other"))
                await noting.up()
                await server.offer((8, "/odom", "nav_msgs/msg/Odometry"))
                number, _ = await server.subscribed()
                message = make(
                    "cdr", "nav_msgs/Odometry", twist={"twist": {"linear": {"x": 0.5}}}
                )
                await server.send(data(99, b""))
                await server.send(data(number, written("cdr", message)))
                await until(lambda: len(noting.of(OdometryReceived)) == 2, "odometry")
                seen = noting.of(OdometryReceived)[0]
                assert (seen.key, seen.twist) == (key, Twist(0.5))
                noting.lane.unwatch("/odom", key)

    @in_loop
    async def test_scans_are_received_at_most_twenty_times_a_second(self):
        async with Server() as server:
            key = Key(server.url, "/cmd_vel")
            with odometry(server.url) as noting:
                noting.lane.watch_scan("/scan", key)
                noting.lane.watch("/odom", "nav_msgs/Odometry", key)
                await noting.up()
                await server.offer((8, "/scan", "sensor_msgs/msg/LaserScan"))
                number, _ = await server.subscribed()
                message = make("cdr", "sensor_msgs/LaserScan", range_max=8.0)
                frame = data(number, written("cdr", message))
                before = now()
                for _ in range(10):
                    await server.send(frame)
                await until(lambda: noting.of(ScanReceived), "the scan")
                await asyncio.sleep(0.06)
                await server.send(frame)
                await until(lambda: len(noting.of(ScanReceived)) >= 2, "the next scan")
                assert len(noting.of(ScanReceived)) <= 2 + (now() - before) / 0.05
                scan = noting.of(ScanReceived)[0]
                assert (scan.key, scan.topic, scan.sweep.range_max) == (
                    key,
                    "/scan",
                    8.0,
                )
                await server.send(data(99, b""))
                noting.lane.unwatch_scan("/scan", key)


LOCK = StopHook(topic="/lock", type="std_msgs/Bool")
E_STOP = StopHook(service="/e_stop", type="std_srvs/Trigger")


class Tasks(Noting):
    def __init__(self, url):
        self.calls = ServiceCalls(url)
        super().__init__(lambda emit: TasksLane(url, emit, self.calls))
        self.lane.lane.hold("robots")

    def __exit__(self, *_):
        self.lane.close()
        self.calls.close()


def response(call, message):
    encoding = b"cdr" if call else b"ros1"
    return b"\3" + struct.pack("<III", 5, 1, len(encoding)) + encoding + message


DONE = b"\0\1\0\0" + b"\1\0\0\0" + struct.pack("<I", 1) + b"\0"
FAILED = b"\0\1\0\0" + b"\0\0\0\0" + struct.pack("<I", 4) + b"hot\0"


class TestTasks:
    @in_loop
    async def test_goals_cancels_poses_and_flags_are_published(self):
        async with Server() as server:
            robot = spec(pose_topic="/initialpose", stop_hooks=(LOCK,))
            with Tasks(server.url) as noting:
                noting.lane.attach([*goal_topics(robot), *hook_topics(robot)])
                noting.lane.attach(goal_topics(robot))
                noting.lane.detach(goal_topics(robot))
                await noting.up()
                await until(lambda: server.of("advertise"), "the topics")
                names = {
                    each["id"]: (each["topic"], each["schemaName"])
                    for offer in server.of("advertise")
                    for each in offer["channels"]
                }
                goal = SendGoal(*(*GOAL_FIELDS, "topic"))
                at = SendPose(Key(server.url, "/cmd_vel"), "r1", 1.0, 2.0, 0.0, "a")
                ended = []
                assert noting.lane.send(robot, goal)
                assert noting.lane.send_pose(robot, at)
                noting.lane.cancel(robot)
                noting.lane.run_hook(LOCK, True, ended.append)
                await until(lambda: len(server.published) == 4, "the messages")
                assert ended == [None]
                assert [names[number] for _, number, _ in server.published] == [
                    ("/goal", "geometry_msgs/msg/PoseStamped"),
                    ("/initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped"),
                    ("/cancel", "actionlib_msgs/msg/GoalID"),
                    ("/lock", "std_msgs/msg/Bool"),
                ]

    @in_loop
    async def test_nothing_is_sent_before_the_server_has_greeted(self):
        async with Server(greets=False) as server:
            with Tasks(server.url) as noting:
                robot = spec(stop_hooks=(LOCK,))
                noting.lane.attach([*goal_topics(robot), *hook_topics(robot)])
                await until(lambda: noting.lane.lane.subprotocol, "the connection")
                ended = []
                assert not noting.lane.send(robot, SendGoal(*(*GOAL_FIELDS, "topic")))
                noting.lane.run_hook(LOCK, True, ended.append)
                assert ended == ["not sent: no connection"]

    @in_loop
    async def test_the_progress_of_a_move_base_goal_is_received(self):
        async with Server(OLD, supportedEncodings=["ros1"]) as server:
            robot = spec(
                action="/move_base", action_type="move_base_msgs/MoveBaseAction"
            )
            with Tasks(server.url) as noting:
                noting.lane.attach(goal_topics(robot))
                await noting.up()
                assert noting.lane.send(robot, SendGoal(*(*GOAL_FIELDS, "move_base")))
                status = {"goal_id": {"id": "g1"}, "status": 3, "text": ""}
                type, message = actionlib("Result", status=status)
                channel = {"id": 8, "topic": "/move_base/result", "encoding": "ros1"}
                offer = {
                    "op": "advertise",
                    "channels": [{**channel, "schemaName": type}],
                }
                await server.send(offer)
                number, _ = await server.subscribed()
                await server.send(data(99, message))
                await server.send(data(number, message))
                (end,) = await until(lambda: noting.of(GoalEnded), "the end")
                assert (end.id, end.outcome) == ("g1", "reached")

    @pytest.mark.parametrize(
        ("answer", "why"),
        [
            (response(True, DONE), None),
            (response(True, FAILED), "the service reported a failure (hot)"),
            (
                '{"op": "serviceCallFailure", "callId": 1, "message": "hung"}',
                "refused (hung)",
            ),
        ],
    )
    @in_loop
    async def test_a_stop_hook_calls_its_service(self, answer, why):
        async with Server(greets=False) as server:
            server.answer = lambda frame: answer if frame[:1] == b"\2" else None
            with Tasks(server.url) as noting:
                ended = []
                noting.lane.run_hook(E_STOP, True, ended.append)
                await until(lambda: len(server.clients) == 2, "the connections")
                await server.send(response(True, DONE))  # before anything was called
                services = {"op": "advertiseServices", "services": [OTHER, TRIGGER]}
                await server.send(services)  # before the greeting: of no use
                await server.send(server.info)
                await server.send(services)
                await server.send(services)
                await until(lambda: ended, "the answer")
                assert ended == [why]
        _, number, rest = server.published[0]
        assert number == 5
        assert rest == struct.pack("<II", 1, 3) + b"cdr" + b"\0\1\0\0\0"

    @in_loop
    async def test_a_service_of_ros_1_is_called_without_bytes(self):
        async with Server(OLD, supportedEncodings=["ros1"]) as server:
            done = b"\1" + struct.pack("<I", 0)
            server.answer = lambda frame: response(False, done)
            with Tasks(server.url) as noting:
                ended = []
                noting.lane.run_hook(E_STOP, True, ended.append)
                await until(lambda: len(server.clients) == 2, "the connections")
                call = next(c for c in server.clients if c is not None)
                services = {"op": "advertiseServices", "services": [TRIGGER]}
                for call in server.clients:
                    await call.send(json.dumps(services))
                await until(lambda: ended, "the answer")
                assert ended == [None]
        assert server.published[0][2] == struct.pack("<II", 1, 4) + b"ros1"

    @in_loop
    async def test_the_goals_of_an_action_are_cancelled_by_its_hidden_service(
        self, caplog, monkeypatch
    ):
        monkeypatch.setattr("webmap.gate.lanes.calls.CALL_TIMEOUT", 0.3)
        cancel = {"id": 5, "name": "/go/_action/cancel_goal", "type": ""}
        async with Server() as server:
            server.answer = lambda frame: response(True, b"")
            with Tasks(server.url) as noting:
                noting.lane.cancel(spec(cancel_topic=None, action="/go"))
                await noting.calls.settle()
                what = "does not offer /go/_action/cancel_goal"
                assert what in caplog.text
                # The bridge has time to offer the service now.
                monkeypatch.setattr("webmap.gate.lanes.calls.CALL_TIMEOUT", 20.0)
                noting.lane.cancel(spec(cancel_topic=None, action="/go"))
                await until(lambda: len(server.clients) == 3, "the call")
                await server.send({"op": "advertiseServices", "services": [cancel]})
                await noting.calls.settle()
                assert caplog.text.count("cancelling") == 1
        (_, number, rest) = server.published[-1]
        assert number == 5
        assert rest[-24:] == bytes(24)


@pytest.mark.parametrize("part", [b"[],", b"1,", b'{"id":1,"topic":"","encoding":""},'])
def test_a_long_list_of_channels_blocks_nobody_for_long(part):
    count = sockets.MAX_OFFER // len(part) - 10
    text = b'{"op":"advertise","channels":[' + part * count + b"[]]}"
    begun = time.thread_time()
    with pytest.raises(ProtocolError, match="not Foxglove's protocol"):
        foxglove.read_text(text)
    assert time.thread_time() - begun < 0.25


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        ("foxglove://robot", "ws://robot:8765"),
        ("foxgloves://robot:9", "wss://robot:9"),
        ("ws://robot:9090", "ws://robot:9090"),
    ],
)
def test_the_address_of_the_socket_has_the_port_of_foxglove(url, expected):
    assert web_socket_url(url) == expected


@in_loop
async def test_an_action_goal_that_cannot_be_written_is_dropped():
    with Tasks("ws://127.0.0.1:1") as noting:
        goal = SendGoal(*(*GOAL_FIELDS, "navigate_to_pose"))
        assert not noting.lane.send(spec(action="/go"), goal)


def test_the_message_of_rosbags_is_that_of_this_test():
    message = make("cdr", "geometry_msgs/Twist", linear={"x": 0.5}, angular={"z": 1.0})
    assert written("cdr", message)[:52] == twist(0.5, 1.0)
    assert STORES
