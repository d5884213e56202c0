"""Messages that displays get from an agent's rosbridge, and refused commands."""

import json
import zlib
from types import SimpleNamespace

import pytest

from webmap.agents import data_messages
from webmap.agents.address import Sender
from webmap.agents.bridge_proxy import BridgeProxy
from webmap.base.errors import WireError
from webmap.fleet.agent import Agent
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.protocol import Protocol

ANN, BEN = Sender("ann", "4f", "1"), Sender("ben", "5e", "1")


class Bench:
    def __init__(self, **options):
        self.up, self.replies, self.notes, self.calls = [], [], [], []
        self.clients = BridgeProxy(
            upstream=lambda frame: self.up.append(json.loads(frame)),
            reply=lambda client, frame: self.replies.append((client, frame)),
            note=lambda client, pong: self.notes.append((client, pong)),
            call=self.calls.append,
            **options,
        )
        self.clients.opened("s1", 0.0)

    def send(self, client, frame, now=0.0):
        self.clients.receive(client, data_messages.pack_frame(frame), now)

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
    bench.send(ANN, ops.unsubscribe("/map", id="1"), 2.0)
    assert bench.took() == []
    bench.send(BEN, ops.unsubscribe("/map", id="1"), 2.0)
    assert [op["op"] for op in bench.took()] == ["unsubscribe"]
    assert bench.clients.topics == []


def test_the_subscription_serves_the_display_that_wants_most(bench):
    bench.subscribe(ANN, "/odom", throttle_rate=200)
    assert bench.took()[0]["throttle_rate"] == 200
    bench.subscribe(BEN, "/odom", throttle_rate=100, now=2.0)
    assert [(op["op"], op.get("throttle_rate")) for op in bench.took()] == [
        ("unsubscribe", None),
        ("subscribe", 100),
    ]


def test_the_agent_limits_the_rate_of_a_topic():
    bench = Bench(throttles={"/scan": 500})
    bench.subscribe(ANN, "/scan", throttle_rate=100)
    assert bench.took()[0]["throttle_rate"] == 500


def test_the_agent_does_not_limit_the_rate_of_changes_as_each_of_them_counts():
    bench = Bench(throttles={"/markers": 500})
    type = "visualization_msgs/MarkerArray"
    bench.subscribe(ANN, "/markers", throttle_rate=1, type=type)
    assert bench.took()[0]["throttle_rate"] == 1


def test_the_agent_gets_video_in_a_binary_encoding_and_with_a_queue(bench):
    type = "foxglove_msgs/CompressedVideo"
    wanted = {"type": type, "queue_length": 10, "compression": "cbor"}
    bench.subscribe(ANN, "/video", throttle_rate=1, **wanted)
    asked = bench.took()[0]
    assert {key: asked[key] for key in wanted} == wanted


@pytest.mark.parametrize(
    ("topic", "type", "every"),
    [
        ("/markers", "visualization_msgs/MarkerArray", True),
        ("/map_updates", "map_msgs/OccupancyGridUpdate", True),
        ("/tf_static", "tf2_msgs/TFMessage", True),
        ("/video", "foxglove_msgs/CompressedVideo", True),
        ("/ffmpeg", "ffmpeg_image_transport_msgs/FFMPEGPacket", True),
        ("/map", "nav_msgs/OccupancyGrid", False),
        ("/odom", None, False),
    ],
)
def test_an_agent_leaves_out_no_message_that_changes_earlier_ones(
    bench, topic, type, every
):
    sent, agent = [], object.__new__(Agent)
    agent.name, agent._proxy, agent._protocol = "bay3", bench.clients, Protocol()
    agent._beams, agent._whole = {}, set()
    put = lambda _key, _data, *, all=False, size=0: sent.append(all)  # noqa: E731
    agent._peer = SimpleNamespace(put_data=put)
    bench.subscribe(ANN, topic, type=type)
    agent._received(ops.publish(topic, {}))
    assert sent == [every]


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
    bench.clients.opened("s2", 1.0)
    assert [op["topic"] for op in bench.took()] == ["/map", "/odom"]


def test_a_ping_is_answered_with_the_state_of_the_rosbridge(bench):
    bench.clients.receive(ANN, data_messages.pack_note(data_messages.Ping(1)), 0.0)
    bench.clients.closed("nothing listens there")
    bench.clients.receive(ANN, data_messages.pack_note(data_messages.Ping(2)), 0.0)
    assert bench.notes == [
        (ANN, data_messages.Pong(1, "s1")),
        (ANN, data_messages.Pong(2, "", "nothing listens there")),
    ]


@pytest.mark.parametrize("how", ["bye", "silent"])
def test_a_display_that_is_gone_holds_no_subscription(bench, how):
    bench.subscribe(ANN)
    bench.took()
    if how == "bye":
        bench.clients.receive(ANN, data_messages.pack_note(data_messages.Bye()), 1.0)
    else:
        bench.clients.check(9.0)
        assert bench.took() == []
        bench.clients.check(11.0)
    assert [op["op"] for op in bench.took()] == ["unsubscribe"]


def test_a_display_calls_services_that_only_read(bench):
    bench.send(ANN, ops.call_service("/rosapi/topics", {}, id="7"))
    (call,) = bench.calls
    assert (call.client, call.id, call.service) == (ANN, "7", "/rosapi/topics")


@pytest.mark.parametrize(
    "frame",
    [
        ops.call_service("/rosapi/message_details", {"type": "std_msgs/Bool"}, id="7"),
        ops.call_service("/rosapi/get_param", {"name": "/x"}, id="7"),
        ops.call_service("/rosapi/node_details", {"node": "/x"}, id="7"),
        ops.advertise("/lamp", "std_msgs/String", id="7"),
        ops.call_service("/rosapi/set_param", {"name": "x", "value": "1"}, id="7"),
        ops.call_service("/dock", id="7"),
        ops.advertise("/cmd_vel", "geometry_msgs/Twist", id="7"),
        b'{"op":"publish","id":"7","topic":"/cmd_vel","msg":{"linear":{"x":1.0}}}',
        b'{"op":"send_action_goal","action":"/go","id":"7"}',
        b'{"op":"call_service","service":"/rosapi/topics/../set_param","id":"7"}',
    ],
)
def test_everything_else_is_refused_and_reaches_no_robot(frame):
    bench = Bench(publishes=lambda: {"/lamp": "std_msgs/Bool"})
    bench.send(ANN, frame)
    assert (bench.took(), bench.calls) == ([], [])
    ((client, answer),) = bench.replies
    status = json.loads(answer)
    assert (client, status["op"], status["level"]) == (ANN, "status", "error")
    assert "the agent does not let a display" in status["msg"]
    assert status["id"] == "7"


def test_the_buttons_of_the_agent_may_be_pressed_on_a_display():
    bench = Bench(publishes=lambda: {"/lamp": "std_msgs/Bool"}, calls=lambda: {"/dock"})
    bench.send(ANN, ops.call_service("/dock", id="7"))
    bench.send(ANN, ops.advertise("/lamp", "std_msgs/Bool", id="8"))
    bench.send(ANN, ops.publish("/lamp", {"data": True}))
    assert [call.service for call in bench.calls] == ["/dock"]
    assert [op["op"] for op in bench.took()] == ["advertise", "publish"]
    bench.clients.receive(ANN, data_messages.pack_note(data_messages.Bye()), 1.0)
    assert [op["op"] for op in bench.took()] == ["unadvertise"]


@pytest.mark.parametrize(
    "piece",
    [b"", b"\x09x", b"\0{", b"\1{", b"\2no zlib", b"\1[]", b'\1{"op":1}'],
)
def test_data_that_cannot_be_read_is_refused(bench, piece):
    with pytest.raises(WireError):
        bench.clients.receive(ANN, piece, 0.0)


def test_a_frame_that_unpacks_to_too_much_is_refused():
    packing = zlib.compressobj(9, zdict=data_messages.DICTIONARY)
    packed = packing.compress(bytes(data_messages.MOST + 1)) + packing.flush()
    bomb = data_messages.PACKED + packed
    with pytest.raises(WireError, match="more than"):
        data_messages.unpack(bomb)


@pytest.mark.parametrize("size", [data_messages.MOST_OF_DISPLAY + 1, 50_000_000])
@pytest.mark.parametrize(
    "pack", [lambda frame: data_messages.FRAME + frame, data_messages.pack_frame]
)
def test_what_a_display_sends_is_small_packed_and_unpacked(bench, size, pack):
    frame = ops.subscribe("/map", id="1") + b" " * size
    with pytest.raises(WireError, match=f"{data_messages.MOST_OF_DISPLAY}"):
        bench.clients.receive(ANN, pack(frame), 0.0)
    assert bench.took() == []


@pytest.mark.parametrize("frame", [b"{}", b"x" * 10_000, bytes(range(256)) * 8])
def test_a_frame_arrives_as_it_was(frame):
    piece = data_messages.pack_frame(frame)
    assert data_messages.unpack(piece) == frame
    assert len(piece) <= len(frame) + 1


def test_too_many_connections_of_displays_are_refused(bench, monkeypatch):
    monkeypatch.setattr("webmap.agents.bridge_proxy.MOST_CLIENTS", 1)
    bench.subscribe(ANN)
    with pytest.raises(WireError, match="more than 1 connections of the user ann"):
        bench.subscribe(Sender("ann", "4f", "2"))
    bench.subscribe(BEN)  # another user has places of its own


def test_a_user_has_so_many_subscriptions_and_others_have_theirs(bench, monkeypatch):
    monkeypatch.setattr("webmap.agents.bridge_proxy.MOST_SUBSCRIPTIONS", 2)
    bench.subscribe(ANN, "/a")
    bench.subscribe(ANN, "/a")
    bench.subscribe(ANN, "/b")
    with pytest.raises(WireError, match="more than 2 subscriptions of the user ann"):
        bench.subscribe(ANN, "/c")
    bench.subscribe(BEN, "/c")
    bench.send(ANN, ops.unsubscribe("/a", id="1"))
    bench.subscribe(ANN, "/d")


def test_calls_that_are_not_answered_count_for_their_user(bench):
    others = [Sender("ann", f"{number}", "1") for number in range(3)]
    for display in others:
        for _ in range(20):
            bench.send(display, ops.call_service("/rosapi/topics", {}, id="7"))
    per_display = [call.client for call in bench.calls]
    assert [per_display.count(each) for each in others] == [16, 16, 0]
    assert "too many calls" in json.loads(bench.replies[-1][1])["values"]
    bench.send(BEN, ops.call_service("/rosapi/topics", {}, id="7"))
    assert bench.calls[-1].client == BEN
    bench.clients.returned(bench.calls[0])
    bench.send(others[0], ops.call_service("/rosapi/topics", {}, id="7"))
    assert bench.calls[-1].client == others[0]


SCAN = "sensor_msgs/LaserScan"


@pytest.mark.parametrize(
    "wish",
    [
        {"type": SCAN, "compression": "none"},
        {"type": SCAN, "compression": "png"},
        {"type": SCAN, "compression": "cbor-raw"},
        {"type": SCAN, "compression": "cbor", "queue_length": 100_000},
        {"compression": "none"},
    ],
)
@pytest.mark.parametrize("is_known", [False, True])
def test_a_display_does_not_change_how_others_get_a_topic(bench, wish, is_known):
    if is_known:
        bench.clients.typed({"/scan": "sensor_msgs/msg/LaserScan"}, 0.0)
    good = {"type": SCAN, "throttle_rate": 100, "compression": "cbor"}
    bench.subscribe(ANN, "/scan", **good)
    (before,) = bench.took()
    bench.subscribe(BEN, "/scan", **{"throttle_rate": 300_000, **wish}, now=2.0)
    assert bench.took() == []
    assert (before["compression"], before["throttle_rate"]) == ("cbor", 100)


def test_of_two_types_the_rosbridge_knows_the_right_one(bench):
    bench.subscribe(BEN, "/scan", type="std_msgs/String")
    bench.subscribe(ANN, "/scan", type=SCAN, compression="cbor", now=2.0)
    assert "type" not in bench.took()[-1]
    assert bench.clients.asks_types
    bench.clients.typed({"/scan": "sensor_msgs/msg/LaserScan"}, 4.0)
    op = bench.took()[-1]
    assert (op["type"], op["compression"]) == (SCAN, "cbor")
    assert not bench.clients.asks_types
    bench.subscribe(Sender("eve", "6d", "1"), "/scan", type="std_msgs/String", now=9.0)
    assert bench.took() == []


def test_a_display_that_wants_all_at_once_is_served_at_the_least_throttle(bench):
    bench.subscribe(ANN, "/scan", type=SCAN, throttle_rate=0, queue_length=50)
    (op,) = bench.took()
    assert (op["throttle_rate"], op["queue_length"]) == (50, 1)


def test_a_subscription_changes_once_a_second_at_most(bench):
    bench.subscribe(ANN, "/odom", throttle_rate=1000)
    for step in range(100):
        bench.subscribe(BEN, "/odom", throttle_rate=100 + step % 2, now=step / 100)
    assert len(bench.took()) == 1
    bench.clients.check(1.5)
    assert [op.get("throttle_rate") for op in bench.took()] == [None, 101]


def test_a_map_too_large_for_cbor_comes_in_json_and_another_one_does_not(bench):
    large = {"type": "nav_msgs/OccupancyGrid", "compression": "none"}
    bench.subscribe(ANN, **large)
    (op,) = bench.took()
    assert (op["compression"], op["throttle_rate"]) == ("none", 300_000)
    bench.clients.message("/map", b"{}", 3.0, in_parts=True)
    bench.clients.check(4.0)
    assert bench.took() == []
    bench.clients.message("/map", b"{}", 5.0)
    bench.clients.check(6.0)
    assert bench.took()[-1]["compression"] == "cbor"


@pytest.mark.parametrize(("ros", "answers"), [("sensor_msgs", 1), ("x/msg", 0)])
def test_only_a_rosbridge_of_ros_1_is_asked_for_the_types_of_buttons(ros, answers):
    bench = Bench(details=lambda: {"my_msgs/Dock"})
    bench.clients.typed({"/scan": f"{ros}/LaserScan"}, 0.0)
    for type in ("my_msgs/Dock", "std_msgs/Bool"):
        call = ops.call_service("/rosapi/message_details", {"type": type}, id="7")
        bench.send(ANN, call)
    assert len(bench.calls) == answers


def test_a_late_subscription_that_comes_again_and_again_gets_the_map_rarely(bench):
    bench.subscribe(ANN)
    bench.clients.message("/map", b"x" * (10 << 20), 1.0)
    for step in range(200):
        bench.subscribe(BEN, now=2.0 + step / 100)
    assert len(bench.replies) <= 5
