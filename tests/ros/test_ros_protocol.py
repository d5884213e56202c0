import json
import math

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equipment.captured_frames import CAPTURED
from webmap.base.errors import ProtocolError
from webmap.poses.placing import ODOMETRY_VIEWS
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

pytestmark = pytest.mark.slow

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
def test_every_captured_message_decodes_and_its_head_names_the_topic(path):
    frame = path.read_bytes()
    event = Protocol().receive(frame, 0.0)
    if isinstance(event, Status):
        assert path.parent.name == "rs"
        return
    assert isinstance(event, Publish)
    assert topic_in_head(frame) == event.topic
    assert event.topic.startswith("/")
    assert isinstance(event.decode(), dict)


@given(
    name=st.text(st.sampled_from('/\\"ab_é\n\x7f'), min_size=1, max_size=12)
    | st.integers(590, 1210).map("/".ljust),
    escaped=st.booleans(),
    spaced=st.booleans(),
)
def test_a_head_names_the_topic_that_the_whole_frame_has_or_none(name, escaped, spaced):
    operation = {"op": "publish", "topic": name, "msg": {}}
    separators = None if spaced else (",", ":")
    text = json.dumps(operation, separators=separators, ensure_ascii=escaped)
    frame = (text.replace("/", "\\/") if escaped else text).encode()
    assert topic_in_head(frame) in (name, None)
    if name.isidentifier() and name.isascii():
        assert topic_in_head(frame) == name
    event = Protocol().receive(frame, 0.0)
    assert isinstance(event, Publish)
    assert (event.topic, event.decode()) == (name, {})


@pytest.mark.parametrize("path", files("publish_odom_nan*", "cbor_odom_nan*"))
def test_odometry_with_nan_in_its_covariance_decodes(path):
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
def test_captured_scans_keep_nan_and_in_cbor_also_infinity(path):
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
def test_captured_battery_states_decode(path):
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
def test_a_captured_png_which_webmap_never_requests_is_left_out(path):
    assert read(path) == Unknown("png")


@pytest.mark.parametrize("path", files("cborraw_*.bin"))
def test_captured_raw_cbor_keeps_its_bytes_undecoded(path):
    message = read(path).decode()
    assert set(message) == {"secs", "nsecs", "bytes"}
    assert isinstance(message["bytes"], bytes)
    with pytest.raises(ProtocolError):
        read(path).decode(messages.OdometryMsg)


@pytest.mark.parametrize("path", files("service_response_*.json"))
def test_every_captured_service_response_is_recognised(path):
    event = read(path)
    if event == Unknown("png"):  # it was requested so
        assert path.name == "service_response_png.ros2.json"
        return
    assert isinstance(event, ServiceResponse)
    assert isinstance(event.values, dict if event.result else str)


@pytest.mark.parametrize("path", files("call_service_*.json"))
def test_a_captured_service_call_to_the_client_is_recognised(path):
    event = read(path)
    assert isinstance(event, CallService)
    assert event.service == "/client_srv"
    assert event.args == {"data": True}


@pytest.mark.parametrize("path", files("status_*.json", servers=["rs"]))
def test_every_captured_status_is_recognised(path):
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
def test_captured_fragments_of_a_map_are_joined_in_any_order(path, order):
    lines = fragment_lines(path)
    events = whole(lines if order == "as sent" else lines[::-1])
    assert len(events) == 1
    assert events[0].topic == "/map"
    assert events[0].decode(messages.OccupancyGridMsg).cells.shape == (320, 400)


@pytest.mark.parametrize("path", files("fragments_odom*.jsonl"))
def test_captured_fragments_of_odometry_are_joined_to_two_messages(path):
    events = whole(fragment_lines(path))
    assert [event.topic for event in events] == ["/robot_0/odom"] * 2
    assert all(event.decode(messages.OdometryMsg).frame_id for event in events)


@pytest.mark.parametrize("path", files("service_response_fragmented*.jsonl"))
def test_a_captured_service_response_in_fragments_is_joined(path):
    events = whole(fragment_lines(path))
    assert [type(event) for event in events] == [ServiceResponse]


@pytest.mark.parametrize("path", files("png_fragments_map*.jsonl"))
def test_captured_fragments_of_a_png_are_joined_if_the_limit_allows_them(path):
    assert whole(fragment_lines(path), max_count=256) == [Unknown("png")]


def test_more_fragments_than_allowed_are_refused():
    lines = fragment_lines(CAPTURED / "rs/png_fragments_map.ros2.jsonl")
    events = whole(lines)
    assert len(events) == len(lines)
    assert all("at most 64" in event.reason for event in events)


def test_fragments_of_two_topics_may_interleave_under_one_id():
    one = fragment_lines(CAPTURED / "ros1/fragments_map.ujson.jsonl")
    two = fragment_lines(CAPTURED / "ros1/fragments_odom.ujson.jsonl")[:3]
    mixed = [line for pair in zip(one, two, strict=False) for line in pair] + one[3:]
    events = whole(mixed)
    assert [event.topic for event in events] == ["/robot_0/odom", "/map"]


def test_interleaved_messages_with_equal_fragment_counts_are_refused():
    lines = fragment_lines(CAPTURED / "ros1/fragments_odom.ujson.jsonl")
    one, two = lines[:3], lines[3:]
    events = whole([one[0], two[0], one[1], two[1], one[2], two[2], *one])
    assert [type(event) for event in events] == [Malformed, Publish]
    assert "interleave" in events[0].reason


def test_fragments_of_an_incomplete_message_expire():
    lines = fragment_lines(CAPTURED / "ros1/fragments_odom.ujson.jsonl")
    protocol = Protocol()
    assert protocol.receive(lines[0], 0.0) is None
    assert protocol.receive(lines[1], 61.0) is None
    assert protocol.receive(lines[2], 61.1) is None


def test_the_size_of_waiting_fragments_is_limited():
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
def test_a_fragment_with_invalid_fields_is_malformed(change):
    fragment = {"op": "fragment", "id": 0, "data": "{}", "num": 0, "total": 5}
    event = Protocol().receive(json.dumps({**fragment, **change}), 0.0)
    assert isinstance(event, Malformed)


def test_a_fragment_inside_a_fragment_is_refused():
    inner = json.dumps({"op": "fragment", "id": 0, "data": "{", "num": 0, "total": 2})
    outer = {"op": "fragment", "id": 1, "data": inner, "num": 0, "total": 1}
    event = Protocol().receive(json.dumps(outer), 0.0)
    assert isinstance(event, Malformed)


@pytest.mark.parametrize("path", files("publish_odom*.json", "cbor_*.bin", "p*scan*"))
def test_truncated_captured_frames_raise_only_protocol_errors(path):
    frame = path.read_bytes()
    for size in [*range(0, 200), *range(200, len(frame), 997)]:
        try_all(frame[:size])


def try_all(frame):
    """Receive and decode in every way; only a ProtocolError may be raised."""
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
@settings(max_examples=50, deadline=None)
def test_any_bytes_give_a_valid_or_a_malformed_event(frame):
    try_all(frame)


@given(st.binary(max_size=200))
@settings(max_examples=50, deadline=None)
def test_any_bytes_after_a_good_head_give_a_value_or_a_protocol_error(tail):
    try_all(b'{"op":"publish","topic":"/a","msg":' + tail)
    try_all(b"\xa3bopgpublishetopicb/acmsg" + tail)


@pytest.mark.slow
@given(operations)
@settings(max_examples=50, deadline=None)
def test_any_operation_gives_a_valid_or_a_malformed_event(operation):
    import cbor2

    try_all(json.dumps(operation).encode())
    try_all(cbor2.dumps(operation))


@given(st.data())
@settings(max_examples=50, deadline=None)
def test_a_captured_message_with_a_changed_byte_raises_only_protocol_errors(data):
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
        b"\xff\xfe\x00",
        b"\xa1bop\x05",
        b"\xbf",
        b"\xa1" * 5000,
        b"\xa1bop\xd8\x1c\xa1bop\xd8\x1d\x00",
        b'{"op":"publish","topic":"/a","msg":{}}{"op":"x"}'[:20],
    ],
)
def test_garbage_is_malformed_with_a_reason(frame):
    event = Protocol().receive(frame, 0.0)
    assert isinstance(event, Malformed)
    assert event.reason
    assert event.size == len(frame)


def test_an_unknown_operation_is_reported_as_unknown():
    assert Protocol().receive(b'{"op":"dance"}', 0.0) == Unknown("dance")


def test_text_and_binary_frames_give_the_same_event():
    text = '{"op":"status","level":"info","msg":"hé"}'
    assert Protocol().receive(text, 0) == Protocol().receive(text.encode(), 0)


def test_a_frame_with_two_different_topics_is_refused_when_decoded():
    frame = b'{"op":"publish","topic":"/a","msg":{"x":1},"topic":"/b"}'
    event = Protocol().receive(frame, 0.0)
    assert event.topic == "/a"
    with pytest.raises(ProtocolError, match=r"begins as a message on .* is "):
        event.decode()


def test_the_fields_of_a_frame_may_come_in_any_order():
    frame = b'{"msg":{"data":"x"},"topic":"\\u002fa","op":"publish"}'
    event = Protocol().receive(frame, 0.0)
    assert event.topic == "/a"
    assert event.decode() == {"data": "x"}


def test_a_message_is_decoded_once_for_each_type():
    event = read(CAPTURED / "ros1/publish_odom.ujson.json")
    assert event.decode() is event.decode()
    first = event.decode(messages.OdometryMsg)
    assert event.decode(messages.OdometryMsg) is first


def test_a_message_nested_too_deeply_is_refused():
    deep = b'{"a":' * 40 + b"1" + b"}" * 40
    event = Protocol().receive(b'{"op":"publish","topic":"/a","msg":' + deep + b"}", 0)
    with pytest.raises(ProtocolError, match="nested"):
        event.decode()


@pytest.mark.parametrize("token", ["NaN", "Infinity", "-Infinity"])
def test_bare_nan_and_infinity_tokens_are_accepted(token):
    frame = '{"op":"publish","topic":"/b","msg":{"percentage":%s,"voltage":1.5}}'
    event = Protocol().receive(frame % token, 0.0)
    battery = event.decode(messages.BatteryStateMsg)
    assert not math.isfinite(battery.percentage)
    assert battery.voltage == 1.5


def test_null_in_a_number_field_becomes_nan():
    frame = b'{"op":"publish","topic":"/b","msg":{"percentage":null,"voltage":null}}'
    battery = Protocol().receive(frame, 0.0).decode(messages.BatteryStateMsg)
    assert math.isnan(battery.percentage)
    assert math.isnan(battery.voltage)


def test_a_custom_type_with_a_plain_list_accepts_typed_arrays():
    class Scan(msgspec.Struct):
        ranges: list[float]

    for name in ("cbor_scan_inf_nan.bin", "publish_scan_inf_nan.ujson.json"):
        scan = read(CAPTURED / "ros1" / name).decode(Scan)
        assert len(scan.ranges) == 720
        assert math.isnan(scan.ranges[0])


def test_decoding_as_the_wrong_type_names_the_missing_field():
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
def test_an_operation_nested_too_deeply_is_malformed(head, depth):
    event = Protocol().receive(head + b"[" * depth + b"]" * depth + b"}", 0.0)
    assert isinstance(event, Malformed)
    assert "nested" in event.reason or "recursion" in event.reason
