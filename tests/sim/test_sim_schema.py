import base64

import numpy as np
import pytest

from webmap.ros.definitions import UnknownType
from webmap.ros.rosbridge.server.dialect import Dialect, canonical, resolve
from webmap.ros.rosbridge.server.rosapi import definition_text, type_definitions
from webmap.ros.rosbridge.server.schema import MessageMismatch, Schema

TWIST = "geometry_msgs/Twist"
ZERO = {"x": 0.0, "y": 0.0, "z": 0.0}


@pytest.fixture(params=["ros1", "ros2"])
def schema(request):
    return Schema(Dialect(request.param))


def test_missing_fields_are_zero(schema):
    message = schema.conform(TWIST, {"linear": {"x": 1}})
    assert message == {"linear": {"x": 1.0, "y": 0.0, "z": 0.0}, "angular": ZERO}
    assert schema.conform(TWIST, {}) == {"linear": ZERO, "angular": ZERO}


def test_a_list_fills_the_fields_in_order(schema):
    message = schema.conform("geometry_msgs/Vector3", [1, 2, 3])
    assert message == {"x": 1.0, "y": 2.0, "z": 3.0}


@pytest.mark.parametrize(
    "value",
    [
        {"linear": {"q": 1}},
        {"linear": {"x": "fast"}},
        {"linear": {"x": None}},
        {"linear": 5},
        {"linear": {"x": [1]}},
        "forward",
        7,
    ],
)
def test_a_value_that_does_not_fit_the_type_is_refused(schema, value):
    with pytest.raises(MessageMismatch):
        schema.conform(TWIST, value)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ({"linear": {"q": 1}}, f"Message type {TWIST} does not have a field linear.q"),
        (
            {"linear": {"x": "fast"}},
            f"{TWIST} message requires a number for field linear.x, "
            "but got a <class 'str'>",
        ),
        (7, f"{TWIST} message requires a table of fields, but got a <class 'int'>"),
    ],
)
def test_a_mismatch_has_the_error_text_of_rosbridge(schema, value, words):
    with pytest.raises(MessageMismatch) as error:
        schema.conform(TWIST, value)
    assert str(error.value) == words


def test_true_is_accepted_as_a_number_only_in_ros2():
    value = {"linear": {"x": True}}
    assert Schema(Dialect("ros2")).conform(TWIST, value)["linear"]["x"] == 1.0
    with pytest.raises(MessageMismatch):
        Schema(Dialect("ros1")).conform(TWIST, value)


def test_infinity_is_refused_when_numbers_must_be_finite(schema):
    value = {"linear": {"x": float("inf")}}
    assert schema.conform(TWIST, value)["linear"]["x"] == float("inf")
    with pytest.raises(MessageMismatch, match="finite"):
        schema.conform(TWIST, value, finite=True)


def test_a_huge_integer_in_a_float_field_becomes_infinity(schema):
    value = {"linear": {"x": 10**400}}
    assert schema.conform(TWIST, value)["linear"]["x"] == float("inf")


@pytest.mark.parametrize("value", [300, -1, 1.5])
def test_out_of_range_and_fractional_integers_are_refused(schema, value):
    with pytest.raises(MessageMismatch):
        schema.conform("sensor_msgs/BatteryState", {"power_supply_status": value})


def test_number_sequences_are_typed_arrays(schema):
    scan = schema.conform("sensor_msgs/LaserScan", {"ranges": [1, 2.5]})
    assert scan["ranges"].dtype == np.float32
    assert scan["ranges"].tolist() == [1.0, 2.5]
    assert scan["intensities"].tolist() == []


def test_bytes_are_accepted_as_base64_or_as_a_list(schema):
    text = base64.b64encode(b"\x01\x02").decode()
    for data in (text, [1, 2]):
        image = schema.conform("sensor_msgs/CompressedImage", {"data": data})
        assert image["data"] == b"\x01\x02"
    with pytest.raises(MessageMismatch):
        schema.conform("sensor_msgs/CompressedImage", {"data": "%%%"})


def test_a_fixed_array_of_the_wrong_length_is_refused(schema):
    with pytest.raises(MessageMismatch, match="36 values"):
        schema.conform("geometry_msgs/PoseWithCovariance", {"covariance": [0.0]})


def test_times_are_read_with_the_field_names_of_both_dialects(schema):
    whole, rest = schema.dialect.time(0)
    for stamp in ({"secs": 3, "nsecs": 4}, {"sec": 3, "nanosec": 4}):
        header = schema.conform("std_msgs/Header", {"stamp": stamp})
        assert header["stamp"] == {whole: 3, rest: 4}


def test_only_ros1_headers_have_a_sequence_number():
    ros1, ros2 = Dialect("ros1"), Dialect("ros2")
    assert [ros1.header("/a", 1.5, "map")["seq"] for _ in range(2)] == [1, 2]
    assert ros1.header("/b", 1.5, "map")["seq"] == 1
    assert ros2.header("/a", 1.5, "map") == {
        "stamp": {"sec": 1, "nanosec": 500_000_000},
        "frame_id": "map",
    }


@pytest.mark.parametrize(
    ("spelled", "name"),
    [
        ("nav_msgs/Odometry", "nav_msgs/Odometry"),
        ("nav_msgs/msg/Odometry", "nav_msgs/Odometry"),
        ("std_srvs/srv/Trigger", "std_srvs/Trigger"),
        ("rosapi_msgs/srv/Topics", "rosapi/Topics"),
    ],
)
def test_both_spellings_of_a_type_give_the_same_name(spelled, name):
    assert canonical(spelled) == name


def test_names_are_made_absolute():
    assert resolve("rosapi/topics") == "/rosapi/topics"
    assert resolve("/a//b/") == "/a/b"


def test_an_unknown_type_is_named_in_the_error(schema):
    with pytest.raises(UnknownType, match="no_msgs/Such"):
        schema.conform("no_msgs/Such", {})


def test_type_definitions_include_the_nested_types(schema):
    names = [d["type"] for d in type_definitions(schema, "nav_msgs/Odometry")]
    assert names[0] == "nav_msgs/Odometry"
    assert "geometry_msgs/Quaternion" in names
    assert len(names) == len(set(names))


def test_the_definition_text_has_the_format_of_a_message_file(schema):
    text = definition_text(schema, "geometry_msgs/PoseWithCovariance")
    assert "float64[36] covariance" in text
    assert "MSG: geometry_msgs/Point" in text
