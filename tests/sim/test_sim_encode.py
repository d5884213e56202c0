"""Frames of real servers, decoded, and encoded again to the same bytes."""

import base64
import io
import json
import math

import cbor2
import numpy as np
import pytest
from PIL import Image

from equipment.captured_frames import CAPTURED, frame_file
from webmap.ros.rosbridge.server.dialect import POLITE, REAL, USUAL, Dialect
from webmap.ros.rosbridge.server.encode import Encoder, Publication, serialize
from webmap.ros.rosbridge.server.schema import Schema

TYPES = {
    "odom": "nav_msgs/Odometry",
    "scan_inf_nan": "sensor_msgs/LaserScan",
    "map": "nav_msgs/OccupancyGrid",
    "tf": "tf2_msgs/TFMessage",
    "tf_static": "tf2_msgs/TFMessage",
    "amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
}
DTYPES = {72: "<i1", 85: "<f4"}


def encoder(dialect, quirks=None):
    return Encoder(Schema(Dialect(dialect)), quirks or REAL[USUAL[dialect]])


def arrays(value):
    """A decoded message with its typed arrays as the graph holds them."""
    if isinstance(value, cbor2.CBORTag):
        return np.frombuffer(value.value, DTYPES[value.tag])
    if isinstance(value, dict):
        return {name: arrays(item) for name, item in value.items()}
    if isinstance(value, list):
        return [arrays(item) for item in value]
    return value


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
@pytest.mark.parametrize("name", ["odom", "map", "tf", "tf_static", "amcl_pose"])
def test_json_frames_match_those_of_the_real_server(dialect, name):
    text = frame_file(dialect, f"publish_{name}.json").read_text()
    operation = json.loads(text)
    made = encoder(dialect)
    message = made.schema.conform(TYPES[name], operation["msg"])
    publication = Publication(operation["topic"], TYPES[name], message, 0.0)
    assert publication.form("none", made) == text


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
@pytest.mark.parametrize("name", ["scan_inf_nan", "map", "tf"])
def test_cbor_frames_match_those_of_the_real_server(dialect, name):
    frame = frame_file(dialect, f"cbor_{name}.bin").read_bytes()
    operation = cbor2.loads(frame)
    publication = Publication(
        operation["topic"], TYPES[name], arrays(operation["msg"]), 0.0
    )
    assert publication.form("cbor", encoder(dialect)) == frame


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_scan_in_json_has_null_for_nan_and_infinity(dialect):
    operation = cbor2.loads(frame_file(dialect, "cbor_scan_inf_nan.bin").read_bytes())
    message = arrays(operation["msg"])
    text = Publication("/scan", TYPES["scan_inf_nan"], message, 0.0).form(
        "none", encoder(dialect)
    )
    ranges = json.loads(text)["msg"]["ranges"]
    for value, written in zip(message["ranges"], ranges, strict=True):
        assert (written is None) == (not math.isfinite(value))


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_raw_serialisation_has_the_length_and_numbers_of_the_real_server(dialect):
    raw = frame_file(dialect, "cborraw_odom.bin").read_bytes()
    real = cbor2.loads(raw)["msg"]["bytes"]
    schema = Schema(Dialect(dialect))
    text = frame_file(dialect, "publish_odom.json").read_text()
    message = schema.conform(TYPES["odom"], json.loads(text)["msg"])
    made = serialize(schema.fields(TYPES["odom"]), message, ros2=dialect == "ros2")
    assert len(made) == len(real)
    # Both begin with the names of the frames and end with the same covariance.
    assert made[-8 * 36 :] == real[-8 * 36 :]
    assert b"robot_0/odom" in made


def test_a_real_server_writes_bare_nan_in_a_covariance_and_a_polite_one_null():
    path = CAPTURED / "ros2" / "publish_odom_nan_covariance.ujson.json"
    captured = path.read_text()
    real = encoder("ros2")
    message = real.schema.conform(TYPES["odom"], json.loads(captured)["msg"])
    publication = Publication("/robot_0/odom", TYPES["odom"], message, 0.0)
    assert publication.form("none", real) == captured
    again = Publication("/robot_0/odom", TYPES["odom"], message, 0.0)
    polite = again.form("none", encoder("ros2", POLITE))
    assert "NaN" not in polite
    assert json.loads(polite)["msg"]["pose"]["covariance"][1] is None


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_only_a_polite_server_encodes_odometry_in_cbor(dialect):
    schema = Schema(Dialect(dialect))
    message = schema.conform(TYPES["odom"], {})
    real = Publication("/odom", TYPES["odom"], message, 0.0)
    assert real.form("cbor", Encoder(schema, REAL[USUAL[dialect]])) is None
    polite = Publication("/odom", TYPES["odom"], message, 0.0)
    frame = polite.form("cbor", Encoder(schema, POLITE))
    assert cbor2.loads(frame)["msg"]["pose"]["covariance"] == [0.0] * 36


def test_a_png_frame_contains_the_message_text_in_its_pixels():
    text = frame_file("ros1", "publish_odom.json").read_text()
    operation = json.loads(text)
    made = encoder("ros1")
    message = made.schema.conform(TYPES["odom"], operation["msg"])
    publication = Publication(operation["topic"], TYPES["odom"], message, 0.0)
    frame = json.loads(publication.form("png", made))
    assert frame["op"] == "png"
    assert pixels(frame["data"]) == text
    captured = json.loads(frame_file("ros1", "png_odom.json").read_text())
    assert pixels(captured["data"]).startswith('{"op":"publish"')


def pixels(data):
    image = Image.open(io.BytesIO(base64.b64decode(data)))
    return image.convert("RGB").tobytes().decode().rstrip("\n")


def test_ros2_never_sends_png():
    made = encoder("ros2")
    publication = Publication("/x", "std_msgs/String", {"data": "x"}, 0.0)
    assert publication.form("png", made) is None


def test_fragments_match_those_of_the_real_server():
    lines = frame_file("ros1", "fragments_odom.jsonl").read_text().splitlines()
    fragments = [json.loads(line) for line in lines[:3]]
    whole = "".join(fragment["data"] for fragment in fragments)
    assert encoder("ros1").fragments(whole, 300) == lines[:3]


def test_fragments_of_a_polite_server_have_an_integer_total():
    frames = encoder("ros1", POLITE).fragments("x" * 700, 300, "call:7")
    decoded = [json.loads(frame) for frame in frames]
    assert [f["total"] for f in decoded] == [3, 3, 3]
    assert [f["num"] for f in decoded] == [0, 1, 2]
    assert {f["id"] for f in decoded} == {"call:7"}


def test_each_encoding_of_a_publication_is_made_once():
    made = encoder("ros1")
    publication = Publication("/x", "std_msgs/String", {"data": "x"}, 0.0)
    assert publication.form("none", made) is publication.form("none", made)
