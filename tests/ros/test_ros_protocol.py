import json
import math

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from captured_frames import CAPTURED
from webmap.base.errors import ProtocolError
from webmap.ros import messages
from webmap.ros.rosbridge.events import (
    CallService,
    Malformed,
    Publish,
    ServiceResponse,
    Status,
    Unknown,
)
from webmap.ros.rosbridge.protocol import Fragments, Protocol, topic_in_head
from webmap.ros.views import ODOMETRY_VIEWS

SERVERS = ["ros1", "ros2", "rs"]
VIEWS = (
    *ODOMETRY_VIEWS.values(),
    messages.TwistMsg,
    messages.LaserScanMsg,
    messages.BatteryStateMsg,
    messages.OccupancyGridMsg,
    messages.PathMsg,
    messages.TFMessage,
)


def files(*patterns, servers=SERVERS):
    found = [p for s in servers for g in patterns for p in (CAPTURED / s).glob(g)]
    assert found
    return [pytest.param(p, id=f"{p.parent.name}/{p.name}") for p in sorted(found)]


def read(path):
    return Protocol().receive(path.read_bytes(), 0.0)


@pytest.mark.parametrize("path", files("publish_*.json", "cbor*.bin"))
def test_every_captured_message_is_told_from_its_head_and_decodes(path):
    frame = path.read_bytes()
    event = Protocol().receive(frame, 0.0)
    if isinstance(event, Status):
        assert path.parent.name == "rs"
        return
    assert isinstance(event, Publish)
    assert topic_in_head(frame) == event.topic
    assert event.topic.startswith("/")
    assert isinstance(event.decode(), dict)


@pytest.mark.parametrize("path", files("publish_odom_nan*", "cbor_odom_nan*"))
def test_odometry_decodes_whatever_its_covariance_holds(path):
    odom = read(path).decode(messages.OdometryMsg)
    assert math.isfinite(odom.place.planar.x)
    assert odom.velocity.is_finite


@pytest.mark.parametrize(
    "path", files("publish_odom.*", "publish_odom_with_id.*", "cbor_odom.bin")
)
def test_captured_odometry_decodes(path):
    odom = read(path).decode(messages.OdometryMsg)
    assert odom.frame_id == "robot_0/odom"
    assert odom.child_frame_id == "robot_0/base_link"
    assert odom.stamp > 1.7e9
    assert odom.place.planar.x < -5
    assert -math.pi <= odom.place.planar.yaw <= math.pi
    assert odom.velocity.is_finite


@pytest.mark.parametrize("path", files("publish_scan*.json", "cbor_scan*.bin"))
def test_captured_scans_keep_what_the_link_can_carry(path):
    import numpy as np

    scan = read(path).decode(messages.LaserScanMsg)
    assert scan.frame_id == "robot_0/base_laser"
    assert scan.ranges.dtype == np.float32
    assert scan.ranges.shape == (720,)
    assert not scan.ranges.flags.writeable
    assert np.isnan(scan.ranges[0])
    if path.suffix == ".bin":
        assert np.isneginf(scan.ranges).any()
    finite = scan.ranges[np.isfinite(scan.ranges)]
    assert len(finite) > 500
    assert finite.max() <= scan.range_max


@pytest.mark.parametrize("path", files("publish_battery*.json", "cbor_battery*.bin"))
def test_captured_batteries_decode(path):
    battery = read(path).decode(messages.BatteryStateMsg)
    assert 0.5 < battery.percentage <= 1
    assert battery.voltage == pytest.approx(24, abs=1)


@pytest.mark.parametrize("path", files("publish_map*.json", "cbor_map.bin"))
def test_captured_maps_decode_to_the_same_cells(path):
    grid = read(path).decode(messages.OccupancyGridMsg)
    assert grid.cells.shape == (320, 400)
    assert grid.info.resolution == pytest.approx(0.05)
    assert grid.info.origin.planar.x == -10
    reference = read(CAPTURED / "ros1/cbor_map.bin").decode(messages.OccupancyGridMsg)
    assert grid.data == reference.data


@pytest.mark.parametrize("path", files("publish_amcl*.json"))
def test_captured_amcl_poses_decode(path):
    pose = read(path).decode(messages.PoseWithCovarianceStampedMsg)
    assert pose.frame_id == "map"
    assert pose.place.planar.x < -5


@pytest.mark.parametrize("path", files("publish_tf*.json", servers=["ros1", "ros2"]))
def test_captured_transforms_decode(path):
    tf = read(path).decode(messages.TFMessage)
    assert all("robot_" in t.child_frame_id for t in tf.transforms)
    assert all(math.isfinite(t.transform.planar.x) for t in tf.transforms)


@pytest.mark.parametrize("path", files("png_*.json"))
def test_captured_png_holds_the_message_it_hides(path):
    event = read(path)
    assert isinstance(event, Publish)
    message = event.decode()
    assert message["header"]["frame_id"] in (
        "map",
        "robot_0/odom",
        "robot_0/base_laser",
    )


@pytest.mark.parametrize("path", files("cborraw_*.bin"))
def test_captured_cbor_raw_is_left_raw(path):
    message = read(path).decode()
    assert set(message) == {"secs", "nsecs", "bytes"}
    assert isinstance(message["bytes"], bytes)
    with pytest.raises(ProtocolError):
        read(path).decode(messages.OdometryMsg)


@pytest.mark.parametrize("path", files("service_response_*.json"))
def test_every_captured_answer_is_an_answer(path):
    event = read(path)
    assert isinstance(event, ServiceResponse)
    assert isinstance(event.values, dict if event.result else str)


@pytest.mark.parametrize("path", files("call_service_*.json"))
def test_a_captured_call_to_the_client_is_told(path):
    event = read(path)
    assert isinstance(event, CallService)
    assert event.service == "/client_srv"
    assert event.args == {"data": True}


@pytest.mark.parametrize("path", files("status_*.json", servers=["rs"]))
def test_every_captured_status_is_told(path):
    event = read(path)
    assert isinstance(event, Status)
    assert event.level == "error"
    assert event.msg


def fragment_lines(path):
    return path.read_bytes().splitlines()


def whole(lines, **bounds):
    protocol = Protocol(Fragments(**bounds))
    events = [protocol.receive(line, 0.0) for line in lines]
    return [event for event in events if event is not None]


@pytest.mark.parametrize("path", files("fragments_map*.jsonl"))
@pytest.mark.parametrize("order", ["as sent", "reversed"])
def test_captured_fragments_of_a_map_make_the_map(path, order):
    lines = fragment_lines(path)
    events = whole(lines if order == "as sent" else lines[::-1])
    assert len(events) == 1
    assert events[0].topic == "/map"
    assert events[0].decode(messages.OccupancyGridMsg).cells.shape == (320, 400)


@pytest.mark.parametrize("path", files("fragments_odom*.jsonl"))
def test_captured_fragments_of_odometry_make_two_messages(path):
    events = whole(fragment_lines(path))
    assert [event.topic for event in events] == ["/robot_0/odom"] * 2
    assert all(event.decode(messages.OdometryMsg).frame_id for event in events)


@pytest.mark.parametrize("path", files("service_response_fragmented*.jsonl"))
def test_a_captured_answer_in_fragments_is_an_answer(path):
    events = whole(fragment_lines(path))
    assert [type(event) for event in events] == [ServiceResponse]


@pytest.mark.parametrize("path", files("png_fragments_map*.jsonl"))
def test_captured_fragments_of_a_png_make_the_map_where_so_many_are_allowed(path):
    events = whole(fragment_lines(path), max_count=256)
    assert len(events) == 1
    assert events[0].topic == "/map"


def test_more_fragments_than_allowed_are_refused():
    lines = fragment_lines(CAPTURED / "rs/png_fragments_map.ros2.jsonl")
    events = whole(lines)
    assert len(events) == len(lines)
    assert all("at most 64" in event.reason for event in events)


def test_topics_may_interleave_under_one_id():
    one = fragment_lines(CAPTURED / "ros1/fragments_map.ujson.jsonl")
    two = fragment_lines(CAPTURED / "ros1/fragments_odom.ujson.jsonl")[:3]
    mixed = [line for pair in zip(one, two, strict=False) for line in pair] + one[3:]
    events = whole(mixed)
    assert [event.topic for event in events] == ["/robot_0/odom", "/map"]


def test_two_messages_of_one_length_that_interleave_are_not_mixed_up():
    lines = fragment_lines(CAPTURED / "ros1/fragments_odom.ujson.jsonl")
    one, two = lines[:3], lines[3:]
    events = whole([one[0], two[0], one[1], two[1], one[2], two[2], *one])
    assert [type(event) for event in events] == [Malformed, Publish]
    assert "interleave" in events[0].reason


def test_a_fragment_that_waits_too_long_is_forgotten():
    lines = fragment_lines(CAPTURED / "ros1/fragments_odom.ujson.jsonl")
    protocol = Protocol()
    assert protocol.receive(lines[0], 0.0) is None
    assert protocol.receive(lines[1], 61.0) is None
    assert protocol.receive(lines[2], 61.1) is None


def test_fragments_that_wait_are_bounded():
    fragments = Fragments(max_bytes=1000)
    protocol = Protocol(fragments)
    piece = {"op": "fragment", "data": "x" * 300, "num": 0, "total": 5}
    events = [
        protocol.receive(json.dumps({**piece, "id": number}), 0.0)
        for number in range(50)
    ]
    assert len(fragments) <= 3
    assert sum(isinstance(event, Malformed) for event in events) > 40


@pytest.mark.parametrize(
    "change",
    [
        {"num": -1},
        {"num": 5},
        {"total": 0},
        {"total": -3.5},
        {"total": 1e300},
        {"total": "5"},
        {"total": None},
        {"data": None},
        {"num": 0.5},
    ],
)
def test_a_fragment_that_makes_no_sense_is_malformed(change):
    fragment = {"op": "fragment", "id": 0, "data": "{}", "num": 0, "total": 5}
    event = Protocol().receive(json.dumps({**fragment, **change}), 0.0)
    assert isinstance(event, Malformed)


def test_wrappings_within_wrappings_are_refused():
    inner = json.dumps({"op": "fragment", "id": 0, "data": "{", "num": 0, "total": 2})
    outer = {"op": "fragment", "id": 1, "data": inner, "num": 0, "total": 1}
    event = Protocol().receive(json.dumps(outer), 0.0)
    assert isinstance(event, Malformed)


@pytest.mark.parametrize("path", files("publish_odom*.json", "cbor_*.bin", "p*scan*"))
def test_no_beginning_of_a_captured_frame_raises_anything_undeclared(path):
    frame = path.read_bytes()
    for size in [*range(0, 200), *range(200, len(frame), 997)]:
        try_all(frame[:size])


def try_all(frame):
    """Receive and decode in every way; only a ProtocolError may come out."""
    event = Protocol().receive(frame, 0.0)
    if isinstance(event, Publish):
        for view in (None, *VIEWS):
            attempt(event, view)
    return event


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner)
    ),
    max_leaves=12,
)
OPS = ["publish", "service_response", "call_service", "fragment", "png", "status", "x"]
FIELDS = ["topic", "msg", "id", "service", "values", "result", "data", "num", "total"]
operations = st.fixed_dictionaries(
    {"op": st.sampled_from(OPS)},
    optional={name: json_values for name in FIELDS},
)


@given(st.binary(max_size=200))
@settings(max_examples=300, deadline=None)
def test_any_bytes_give_an_event_or_malformed(frame):
    try_all(frame)


@given(st.binary(max_size=200))
@settings(max_examples=300, deadline=None)
def test_any_bytes_after_a_good_head_give_a_value_or_a_protocol_error(tail):
    try_all(b'{"op":"publish","topic":"/a","msg":' + tail)
    try_all(b"\xa3bopgpublishetopicb/acmsg" + tail)


@given(operations)
@settings(max_examples=300, deadline=None)
def test_any_operation_gives_an_event_or_malformed(operation):
    import cbor2

    try_all(json.dumps(operation).encode())
    try_all(cbor2.dumps(operation))


@given(st.data())
@settings(max_examples=200, deadline=None)
def test_a_captured_message_with_one_byte_changed_never_surprises(data):
    path = data.draw(st.sampled_from([p.values[0] for p in files("cbor_[bo]*.bin")]))
    frame = bytearray(path.read_bytes())
    frame[data.draw(st.integers(0, len(frame) - 1))] = data.draw(st.integers(0, 255))
    try_all(bytes(frame))


@pytest.mark.parametrize(
    "frame",
    [
        b"",
        b"{",
        b"[1,2]",
        b"null",
        b'"text"',
        b"{}",
        b'{"op":5}',
        b'{"op":"publish"}',
        b'{"op":"publish","topic":5,"msg":{}}',
        b"{{{{" * 400,
        b"[" * 100_000,
        b'{"op":' + b"[" * 100_000,
        b'{"op":"status","msg":' + b"[" * 5000 + b"]" * 5000 + b"}",
        b'{"op":"service_response","values":' + b"9" * 5000 + b"}",
        b'{"op":"png","data":"AAAA"}',
        b'{"op":"png","data":"!"}',
        b"\xff\xfe\x00",
        b"\xa1bop\x05",
        b"\xbf",
        b"\xa1" * 5000,
        b"\xa1bop\xd8\x1c\xa1bop\xd8\x1d\x00",
        b'{"op":"publish","topic":"/a","msg":{}}{"op":"x"}'[:20],
    ],
)
def test_garbage_is_malformed_and_says_why(frame):
    event = Protocol().receive(frame, 0.0)
    assert isinstance(event, Malformed)
    assert event.reason
    assert event.size == len(frame)


def test_a_png_that_claims_to_be_huge_is_refused_before_it_is_unpacked():
    import base64

    head = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + (2**31 - 1).to_bytes(4, "big") * 2
    data = base64.b64encode(head + bytes(40)).decode()
    event = Protocol().receive(json.dumps({"op": "png", "data": data}), 0.0)
    assert isinstance(event, Malformed)
    assert "too large" in event.reason


def test_an_unknown_operation_is_told_and_harmless():
    assert Protocol().receive(b'{"op":"dance"}', 0.0) == Unknown("dance")


def test_text_and_bytes_mean_the_same():
    text = '{"op":"status","level":"info","msg":"hé"}'
    assert Protocol().receive(text, 0) == Protocol().receive(text.encode(), 0)


def test_a_frame_whose_topic_changes_after_its_head_is_not_believed():
    frame = b'{"op":"publish","topic":"/a","msg":{"x":1},"topic":"/b"}'
    event = Protocol().receive(frame, 0.0)
    assert event.topic == "/a"
    with pytest.raises(ProtocolError, match=r"begins as a message on .* is "):
        event.decode()


def test_fields_in_any_order_are_understood():
    frame = b'{"msg":{"data":"x"},"topic":"\\u002fa","op":"publish"}'
    event = Protocol().receive(frame, 0.0)
    assert event.topic == "/a"
    assert event.decode() == {"data": "x"}


def test_a_message_is_decoded_once_for_each_type():
    event = read(CAPTURED / "ros1/publish_odom.ujson.json")
    assert event.decode() is event.decode()
    first = event.decode(messages.OdometryMsg)
    assert event.decode(messages.OdometryMsg) is first


def test_a_plain_message_that_is_nested_too_deeply_is_refused():
    deep = b'{"a":' * 40 + b"1" + b"}" * 40
    event = Protocol().receive(b'{"op":"publish","topic":"/a","msg":' + deep + b"}", 0)
    with pytest.raises(ProtocolError, match="nested"):
        event.decode()


@pytest.mark.parametrize("token", ["NaN", "Infinity", "-Infinity"])
def test_bare_tokens_that_are_no_json_are_understood(token):
    frame = '{"op":"publish","topic":"/b","msg":{"percentage":%s,"voltage":1.5}}'
    event = Protocol().receive(frame % token, 0.0)
    battery = event.decode(messages.BatteryStateMsg)
    assert not math.isfinite(battery.percentage)
    assert battery.voltage == 1.5


def test_null_is_nan_where_a_number_is_wanted():
    frame = b'{"op":"publish","topic":"/b","msg":{"percentage":null,"voltage":null}}'
    battery = Protocol().receive(frame, 0.0).decode(messages.BatteryStateMsg)
    assert math.isnan(battery.percentage)
    assert math.isnan(battery.voltage)


def test_a_users_own_type_with_plain_lists_takes_typed_arrays_too():
    class Scan(msgspec.Struct):
        ranges: list[float]

    for name in ("cbor_scan_inf_nan.bin", "publish_scan_inf_nan.ujson.json"):
        scan = read(CAPTURED / "ros1" / name).decode(Scan)
        assert len(scan.ranges) == 720
        assert math.isnan(scan.ranges[0])


def test_a_message_of_another_type_says_what_is_missing():
    event = read(CAPTURED / "ros1/publish_odom.ujson.json")
    with pytest.raises(ProtocolError, match="angle_min"):
        event.decode(messages.LaserScanMsg)
    fits = [
        name
        for name, view in ODOMETRY_VIEWS.items()
        if not isinstance(attempt(event, view), ProtocolError)
    ]
    assert fits == ["nav_msgs/Odometry", "geometry_msgs/PoseWithCovarianceStamped"]


def attempt(event, view):
    try:
        return event.decode(view)
    except ProtocolError as error:
        return error


@pytest.mark.parametrize(
    "head",
    [
        b'{"op":"service_response","values":',
        b'{"op":"call_service","service":"/s","args":',
        b'{"op":"status","msg":',
    ],
)
@pytest.mark.parametrize("depth", [40, 900])
def test_what_is_nested_too_deeply_is_malformed(head, depth):
    event = Protocol().receive(head + b"[" * depth + b"]" * depth + b"}", 0.0)
    assert isinstance(event, Malformed)
    assert "nested" in event.reason or "recursion" in event.reason
