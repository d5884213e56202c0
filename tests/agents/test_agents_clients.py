"""Messages that displays get from an agent's rosbridge, and refused commands."""

import json
import zlib

import pytest

from webmap.agents import data
from webmap.agents.address import Sender
from webmap.agents.clients import Clients
from webmap.base.errors import WireError
from webmap.ros.rosbridge import ops

ANN, BEN = Sender("ann", "4f", "1"), Sender("ben", "5e", "1")


class Bench:
    def __init__(self, **options):
        self.up, self.replies, self.notes, self.calls = [], [], [], []
        self.clients = Clients(
            upstream=lambda frame: self.up.append(json.loads(frame)),
            reply=lambda client, frame: self.replies.append((client, frame)),
            note=lambda client, pong: self.notes.append((client, pong)),
            call=self.calls.append,
            **options,
        )
        self.clients.opened("s1")

    def send(self, client, frame, now=0.0):
        self.clients.receive(client, data.pack_frame(frame), now)

    def subscribe(self, client, topic="/map", now=0.0, **options):
        self.send(client, ops.subscribe(topic, id="1", **options), now)

    def took(self):
        taken, self.up[:] = list(self.up), []
        return taken


@pytest.fixture
def bench():
    return Bench()


def test_the_agent_subscribes_once_for_all_displays(bench):
    bench.subscribe(ANN, type="nav_msgs/OccupancyGrid", compression="cbor")
    (op,) = bench.took()
    assert (op["op"], op["topic"], op["compression"]) == ("subscribe", "/map", "cbor")
    bench.subscribe(BEN, type="nav_msgs/OccupancyGrid", compression="cbor")
    assert bench.took() == []
    bench.send(ANN, ops.unsubscribe("/map", id="1"))
    assert bench.took() == []
    bench.send(BEN, ops.unsubscribe("/map", id="1"))
    assert [op["op"] for op in bench.took()] == ["unsubscribe"]
    assert bench.clients.topics == []


def test_the_subscription_serves_the_display_that_wants_most(bench):
    bench.subscribe(ANN, "/odom", throttle_rate=200)
    assert bench.took()[0]["throttle_rate"] == 200
    bench.subscribe(BEN, "/odom", throttle_rate=100)
    assert [(op["op"], op.get("throttle_rate")) for op in bench.took()] == [
        ("unsubscribe", None),
        ("subscribe", 100),
    ]


def test_the_agent_limits_the_rate_of_a_topic():
    bench = Bench(throttles={"/scan": 500})
    bench.subscribe(ANN, "/scan", throttle_rate=100)
    assert bench.took()[0]["throttle_rate"] == 500


def test_a_late_display_gets_the_only_message_of_a_latched_topic(bench):
    bench.subscribe(ANN)
    assert bench.clients.message("/map", b'{"op":"publish"}', 1.0)
    bench.took()
    bench.subscribe(BEN, now=60.0)
    assert bench.replies == [(BEN, b'{"op":"publish"}')]
    assert bench.took() == []


def test_a_late_display_of_a_rare_topic_makes_the_agent_subscribe_again(bench):
    bench.subscribe(ANN)
    for now in (1.0, 2.0):
        bench.clients.message("/map", b"{}", now)
    bench.took()
    bench.subscribe(BEN, now=60.0)
    assert [op["op"] for op in bench.took()] == ["unsubscribe", "subscribe"]


def test_a_late_display_of_a_busy_topic_waits_for_the_next_message(bench):
    bench.subscribe(ANN)
    for now in (1.0, 2.0):
        bench.clients.message("/map", b"{}", now)
    bench.took()
    bench.subscribe(BEN, now=2.5)
    assert (bench.took(), bench.replies) == ([], [])


def test_messages_that_no_display_wants_are_dropped(bench):
    assert not bench.clients.message("/map", b"{}", 0.0)


def test_a_new_connection_to_the_rosbridge_subscribes_again(bench):
    bench.subscribe(ANN)
    bench.took()
    bench.clients.closed("the connection was lost")
    bench.subscribe(BEN, "/odom")
    assert bench.took() == []
    bench.clients.opened("s2")
    assert [op["topic"] for op in bench.took()] == ["/map", "/odom"]


def test_a_ping_is_answered_with_the_state_of_the_rosbridge(bench):
    bench.clients.receive(ANN, data.pack_note(data.Ping(1)), 0.0)
    bench.clients.closed("nothing listens there")
    bench.clients.receive(ANN, data.pack_note(data.Ping(2)), 0.0)
    assert bench.notes == [
        (ANN, data.Pong(1, "s1")),
        (ANN, data.Pong(2, "", "nothing listens there")),
    ]


@pytest.mark.parametrize("how", ["bye", "silent"])
def test_a_display_that_is_gone_holds_no_subscription(bench, how):
    bench.subscribe(ANN)
    bench.took()
    if how == "bye":
        bench.clients.receive(ANN, data.pack_note(data.Bye()), 1.0)
    else:
        bench.clients.look(9.0)
        assert bench.took() == []
        bench.clients.look(11.0)
    assert [op["op"] for op in bench.took()] == ["unsubscribe"]


def test_a_display_calls_services_that_only_read(bench):
    bench.send(ANN, ops.call_service("/rosapi/topics", {}, id="7"))
    (call,) = bench.calls
    assert (call.client, call.id, call.service) == (ANN, "7", "/rosapi/topics")


@pytest.mark.parametrize(
    "frame",
    [
        ops.call_service("/rosapi/set_param", {"name": "x", "value": "1"}, id="7"),
        ops.call_service("/dock", id="7"),
        ops.advertise("/cmd_vel", "geometry_msgs/Twist", id="7"),
        ops.publish("/cmd_vel", {"linear": {"x": 1.0}}, id="7"),
        b'{"op":"send_action_goal","action":"/go","id":"7"}',
        b'{"op":"call_service","service":"/rosapi/topics/../set_param","id":"7"}',
    ],
)
def test_everything_else_is_refused_and_reaches_no_robot(bench, frame):
    bench.send(ANN, frame)
    assert (bench.took(), bench.calls) == ([], [])
    ((client, answer),) = bench.replies
    status = json.loads(answer)
    assert (client, status["op"], status["level"]) == (ANN, "status", "error")
    assert "the agent does not let a display" in status["msg"]
    assert status["id"] == "7"


def test_the_buttons_of_the_agent_may_be_pressed_on_a_display():
    bench = Bench(publishes=lambda: {"/lamp"}, calls=lambda: {"/dock"})
    bench.send(ANN, ops.call_service("/dock", id="7"))
    bench.send(ANN, ops.advertise("/lamp", "std_msgs/Bool", id="8"))
    bench.send(ANN, ops.publish("/lamp", {"data": True}))
    assert [call.service for call in bench.calls] == ["/dock"]
    assert [op["op"] for op in bench.took()] == ["advertise", "publish"]
    bench.clients.receive(ANN, data.pack_note(data.Bye()), 1.0)
    assert [op["op"] for op in bench.took()] == ["unadvertise"]


@pytest.mark.parametrize(
    "piece",
    [b"", b"\x09x", b"\0{", b"\1{", b"\2no zlib", b"\1[]", b'\1{"op":1}'],
)
def test_data_that_cannot_be_read_is_refused(bench, piece):
    with pytest.raises(WireError):
        bench.clients.receive(ANN, piece, 0.0)


def test_a_frame_that_unpacks_to_too_much_is_refused():
    packing = zlib.compressobj(9, zdict=data.DICTIONARY)
    packed = packing.compress(bytes(data.MOST + 1)) + packing.flush()
    bomb = data.PACKED + packed
    with pytest.raises(WireError, match="more than"):
        data.unpack(bomb)


@pytest.mark.parametrize("frame", [b"{}", b"x" * 10_000, bytes(range(256)) * 8])
def test_a_frame_arrives_as_it_was(frame):
    piece = data.pack_frame(frame)
    assert data.unpack(piece) == frame
    assert len(piece) <= len(frame) + 1


def test_too_many_connections_of_displays_are_refused(bench, monkeypatch):
    monkeypatch.setattr("webmap.agents.clients.MOST_CLIENTS", 1)
    bench.subscribe(ANN)
    with pytest.raises(WireError, match="more than 1 connections"):
        bench.subscribe(BEN)
