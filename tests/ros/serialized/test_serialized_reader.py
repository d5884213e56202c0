import contextlib
import json
from array import array

import cbor2
import msgspec
import numpy as np
import pytest

from equipment.captured_frames import CAPTURED, frame_file
from webmap.base.errors import ProtocolError
from webmap.features.layers.marker_drawing import MarkerArrayMsg
from webmap.features.layers.point_cloud import PointCloud2Msg
from webmap.features.layers.pose_array import ParticleCloudMsg, PoseArrayMsg
from webmap.ros import messages
from webmap.ros.arrays import Floats, Int8s
from webmap.ros.decoding import convert
from webmap.ros.definitions import shipped
from webmap.ros.limits import MAX_VALUES, TooLarge
from webmap.ros.message_forms import initial
from webmap.ros.messages_image import CompressedImageMsg, ImageMsg
from webmap.ros.serialized.reader import make_reader
from webmap.ros.serialized.schemas import read_schema
from webmap.ros.serialized.writer import make_writer
from webmap.ros.tf.buffer import names_of

VIEWS = {
    "geometry_msgs/Pose": messages.PoseMsg,
    "geometry_msgs/Pose2D": messages.Pose2DMsg,
    "geometry_msgs/PoseArray": PoseArrayMsg,
    "geometry_msgs/PoseStamped": messages.PoseStampedMsg,
    "geometry_msgs/PoseWithCovarianceStamped": messages.PoseWithCovarianceStampedMsg,
    "geometry_msgs/TransformStamped": messages.TransformStampedMsg,
    "geometry_msgs/Twist": messages.TwistMsg,
    "nav_msgs/OccupancyGrid": messages.OccupancyGridMsg,
    "nav_msgs/Odometry": messages.OdometryMsg,
    "nav_msgs/Path": messages.PathMsg,
    "nav2_msgs/ParticleCloud": ParticleCloudMsg,
    "sensor_msgs/BatteryState": messages.BatteryStateMsg,
    "sensor_msgs/CompressedImage": CompressedImageMsg,
    "sensor_msgs/Image": ImageMsg,
    "sensor_msgs/LaserScan": messages.LaserScanMsg,
    "sensor_msgs/PointCloud2": PointCloud2Msg,
    "tf2_msgs/TFMessage": messages.TFMessage,
    "visualization_msgs/MarkerArray": MarkerArrayMsg,
}
LOGS = {"cdr": "rcl_interfaces/Log", "ros1": "rosgraph_msgs/Log"}
LANGUAGES = {"cdr": "ros2msg", "ros1": "ros1msg"}
ENCODINGS = pytest.mark.parametrize("encoding", LANGUAGES)


def tools(encoding, name, view=None, text=None):
    schema = read_schema(name, LANGUAGES[encoding], text)
    return make_reader(schema, view, encoding), make_writer(schema, encoding)


def numbered(fields, start=1):
    """Return a message in which each number differs, with two items in each array."""
    message = {}
    for field in fields:
        start += 1
        items = []
        for _ in range((field.size or 2) if field.is_array else 1):
            start += 1
            if field.fields is not None:
                items.append(numbered(field.fields, start * 2 % 90))
            elif field.type in ("time", "duration"):
                items.append({"secs": start, "nsecs": start + 1})
            elif field.type == "string":
                items.append(f"{field.name} {start}")
            else:
                items.append(bool(start % 2) if field.type == "bool" else start % 100)
        message[field.name] = items if field.is_array else items[0]
    return message


def message_of(encoding, name):
    return numbered(shipped(encoding == "cdr").definition(name).fields)


@ENCODINGS
@pytest.mark.parametrize("name", [*VIEWS, "log"])
def test_a_view_is_the_same_as_that_of_the_plain_message(encoding, name):
    view = messages.LogMsg if name == "log" else VIEWS[name]
    name = LOGS[encoding] if name == "log" else name
    written = tools(encoding, name)[1](message_of(encoding, name))
    plain = tools(encoding, name)[0](written)
    for _ in range(2):  # the second time the lengths of the strings are known
        read = tools(encoding, name, view)[0](written)
        if view is messages.TFMessage:
            assert read.transforms == convert(plain, view).rows
        else:
            assert read == convert(plain, view)


@ENCODINGS
def test_the_values_of_a_transform_have_the_order_of_the_view(encoding):
    text = (
        "a/Moved[] transforms\n===\nMSG: a/Moved\n"
        "geometry_msgs/Transform transform\nstring child_frame_id\nint32 more\n"
        "===\nMSG: geometry_msgs/Transform\n"
        "geometry_msgs/Quaternion rotation\ngeometry_msgs/Vector3 translation\n"
        "===\nMSG: geometry_msgs/Quaternion\nfloat64 w\nfloat64 z\nfloat64 y\n"
        "float32 x\n"
        "===\nMSG: geometry_msgs/Vector3\nint8 y\nfloat64 x\n"
    ).replace("===", "=" * 80)
    read, write = tools(encoding, "a/Moves", messages.TFMessage, text)
    message = {
        "child_frame_id": "base",
        "transform": {
            "translation": {"x": 1.0, "y": 2},
            "rotation": {"x": 4.0, "y": 5.0, "z": 6.0, "w": 7.0},
        },
    }
    row = (0, 0, 0, 0, "", "base", 1.0, 2.0, 0.0, 4.0, 5.0, 6.0, 7.0)
    for count in (0, 1, 3):
        data = write({"transforms": [{**message, "more": 9}] * count})
        assert read(data).rows == [row] * count
        assert repr(read(data).rows) == repr([row] * count)  # 2.0, not 2
    assert convert({"transforms": [message]}, messages.TFMessage).rows == [row]


@pytest.mark.parametrize("dialect", ["ros1", "ros2", "rs"])
@pytest.mark.parametrize(
    ("frame", "name"),
    [
        ("odom", "nav_msgs/Odometry"),
        ("scan_inf_nan", "sensor_msgs/LaserScan"),
        ("map", "nav_msgs/OccupancyGrid"),
    ],
)
def test_captured_messages_are_read(dialect, frame, name):
    path = CAPTURED / dialect / f"cborraw_{frame}.bin"
    data = cbor2.loads(path.read_bytes())["msg"]["bytes"]
    encoding = "ros1" if dialect == "ros1" else "cdr"
    read, write = tools(encoding, name)
    message = read(data)
    assert str(read(write(message))) == str(message)
    view = tools(encoding, name, VIEWS[name])[0](data)
    assert view.stamp > 1.7e9
    if name == "nav_msgs/Odometry":
        assert view.frame_id == "robot_0/odom"
        assert view.child_frame_id == "robot_0/base_link"
        assert view.place.usable
        assert len(message["pose"]["covariance"]) == 36
    elif name == "sensor_msgs/LaserScan":
        assert view.ranges.shape == (720,)
        assert np.isinf(view.ranges).any()
        assert np.isnan(view.ranges).any()
    else:
        assert view.cells.shape == (320, 400)
        assert set(np.unique(view.cells)) <= {-1, 0, 100}


def test_a_map_in_bytes_is_the_map_in_json():
    data = cbor2.loads(frame_file("ros1", "cborraw_map.bin").read_bytes())
    text = json.loads(frame_file("ros1", "publish_map.json").read_text())["msg"]
    message = tools("ros1", "nav_msgs/OccupancyGrid")[0](data["msg"]["bytes"])
    assert message["data"].tolist() == text["data"]
    assert message["info"]["origin"] == text["info"]["origin"]


def test_a_captured_channel_has_the_schema_of_its_messages():
    folder = CAPTURED / "foxglove"
    (channel,) = json.loads((folder / "advertise.json").read_text())["channels"]
    schema = read_schema(
        channel["schemaName"], channel["schemaEncoding"], channel["schema"]
    )
    read = make_reader(schema, messages.OdometryMsg, channel["encoding"])
    frame = memoryview((folder / "message_data.bin").read_bytes())
    message = read(frame[13:])  # after operation, subscription and time
    assert message.frame_id == "robot_0/odom"
    assert message.place.planar.x == pytest.approx(0.882, abs=1e-3)


@ENCODINGS
def test_a_plain_message_has_the_values_of_other_links(encoding):
    text = "uint8[] a\nfloat32[] b\nbool[] c\nchar[2] d\nstring[] e\nint64 f\ntime g\n"
    text = text.replace("time", "builtin_interfaces/Time")
    read, write = tools(encoding, "a/B", text=text)
    names = ("sec", "nanosec") if encoding == "cdr" else ("secs", "nsecs")
    message = {
        **{"a": b"\1\2", "b": array("f", [1.5, 2]), "c": [True, False], "d": b"ab"},
        **{"e": ["x", "", "tür"], "f": -5, "g": dict(zip(names, (7, 8), strict=True))},
    }
    found = read(write(message))
    assert found == message
    assert type(found["c"][0]) is bool
    assert found["b"].typecode == "f"


def test_fields_without_a_place_in_the_schema_need_a_default():
    with pytest.raises(ProtocolError, match=r"std_msgs/Bool has no field 'percentage'"):
        tools("cdr", "std_msgs/Bool", messages.BatteryStateMsg)
    read, write = tools(
        "cdr", "geometry_msgs/Point", messages.PointMsg, "float64 x\nfloat64 y"
    )
    assert read(write({"x": 1.0, "y": 2.0})) == messages.PointMsg(1.0, 2.0, 0.0)


class Odd(msgspec.Struct):
    """A view whose types differ from those of the message."""

    a: float
    c: list[float]
    d: dict[str, int]
    f: list[int] | None
    b: str | None = "absent"
    e: bool = False
    renamed: int = msgspec.field(name="g", default=1)


@ENCODINGS
def test_a_view_may_have_other_types_than_the_message(encoding):
    text = (
        "int8 a\nint16[] c\nP d\nuint16[2] f\nbool e\nint32 g\n====\nMSG: a/P\nint8 x"
    )
    read, write = tools(encoding, "a/B", Odd, text)
    message = {"a": 1, "c": [2, 3], "d": {"x": 4}, "f": [5, 6], "e": True, "g": 7}
    assert read(write(message)) == Odd(1.0, [2, 3], {"x": 4}, [5, 6], "absent", True, 7)


@ENCODINGS
def test_a_value_that_does_not_fit_the_view_is_refused(encoding):
    class View(msgspec.Struct):
        a: int
        b: Floats

    text = "string a\nfloat32[] b"
    read, write = tools(encoding, "a/B", View, text)
    with pytest.raises(ProtocolError, match="int"):
        read(write({"a": "x"}))
    read, write = tools(encoding, "a/B", View, "int8 a\nstring[] b")
    with pytest.raises(ProtocolError, match="array"):
        read(write({"b": ["x"]}))


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("0007", "00 07 .XCDR2."),
        ("0006", "XCDR2"),
        ("0009", "XCDR2"),
        ("0003", "PL_CDR"),
        ("0100", "unknown"),
        ("0042", "unknown"),
    ],
)
def test_other_encapsulations_are_refused_by_name(head, words):
    read, write = tools("cdr", "std_msgs/String")
    data = write({"data": "x"})
    with pytest.raises(ProtocolError, match=f"std_msgs/String that begins.*{words}"):
        read(bytes.fromhex(head) + data[2:])


@pytest.mark.parametrize("size", range(4))
def test_a_message_without_a_head_is_refused(size):
    read, _ = tools("cdr", "std_msgs/Empty")
    with pytest.raises(ProtocolError, match="std_msgs/Empty"):
        read(b"\0\1\0\0"[:size])


def test_big_endian_messages_of_all_sizes_are_read():
    text = "float64 a\nstring b\nuint16[] c\nP[] d\n====\nMSG: a/P\nuint8 x\nfloat64 y"
    schema = read_schema("a/B", "ros2msg", text)
    read = make_reader(schema, None, "cdr")
    data = bytes.fromhex(
        "00000000 3ff8000000000000 00000003 6869 00 00 00000002 0102 0304 00000001"
        "05 000000 4000000000000000"
    )
    assert read(data) == {
        **{"a": 1.5, "b": "hi", "c": array("H", [0x102, 0x304])},
        "d": [{"x": 5, "y": 2.0}],
    }
    with pytest.raises(ProtocolError, match="ends before its last field"):
        read(data[:-1])


@pytest.mark.parametrize(
    ("octets", "text"),
    [
        ("00000000", ""),
        ("01000000 00", ""),
        ("03000000 616200", "ab"),
        ("02000000 6162", "ab"),  # some writers forget the zero
        ("02000000 ff00", "\N{REPLACEMENT CHARACTER}"),
        ("04000000 61006200", "a\0b"),
    ],
)
def test_strings_of_cdr_may_lack_their_zero(octets, text):
    read, _ = tools("cdr", "std_msgs/String")
    assert read(bytes.fromhex(f"00010000 {octets}")) == {"data": text}
    several = tools("cdr", "a/B", text="string[] a")[0]
    assert several(bytes.fromhex(f"00010000 01000000 {octets}")) == {"a": [text]}


@ENCODINGS
def test_messages_whose_strings_change_their_lengths_are_read(encoding):
    read, write = tools(encoding, "tf2_msgs/TFMessage", messages.TFMessage)
    plain, _ = tools(encoding, "tf2_msgs/TFMessage")
    for number in range(60):
        names = ["x" * (number * each % 7) for each in range(number % 9)]
        names = [*names, "y" * (20 - sum(map(len, names)) % 20)]
        transforms = [
            {"header": {"frame_id": name[::2]}, "child_frame_id": name}
            for name in names
        ]
        data = write({"transforms": transforms})
        for _ in range(2):
            found = read(data).rows
            assert [*map(names_of, found)] == [(n[::2], n) for n in names]
            assert convert(plain(data), messages.TFMessage).rows == found


@ENCODINGS
def test_a_message_with_a_wrong_length_changes_nothing_for_the_next_one(encoding):
    read, write = tools(encoding, "tf2_msgs/TFMessage")
    good = write(message_of(encoding, "tf2_msgs/TFMessage"))
    message = tools(encoding, "tf2_msgs/TFMessage")[0](good)
    last = good.rfind(b"child_frame_id")
    wrong = bytearray(good)
    wrong[last - 4 : last] = (len(good) - last).to_bytes(4, "little")
    with pytest.raises(ProtocolError):
        read(bytes(wrong))
    assert read(good) == message


@ENCODINGS
def test_strings_of_many_messages_are_read(encoding):
    read, write = tools(encoding, "geometry_msgs/PoseStamped", messages.PoseStampedMsg)
    for number in range(3000):
        name = f"frame {number}" * (1 + 40 * (number % 100 == 0))
        assert read(write({"header": {"frame_id": name}})).frame_id == name


@ENCODINGS
def test_an_array_of_many_messages_is_read(encoding):
    read, write = tools(encoding, "tf2_msgs/TFMessage", messages.TFMessage)
    names = ["x" * (each % 9) for each in range(300)]
    data = write({"transforms": [{"child_frame_id": name} for name in names]})
    assert [names_of(row)[1] for row in read(data).rows] == names
    for at in range(8, 200, 4):
        lying = data[:at] + b"\xff\xff\xff\x7f" + data[at + 4 :]
        with contextlib.suppress(ProtocolError):
            read(lying)


def test_big_endian_arrays_are_numbers_of_this_machine():
    head = bytes.fromhex("00000000 00000002")
    schema = read_schema("a/B", "ros2msg", "float32[] a\nint8[] b")
    read = make_reader(schema, Numbers, "cdr")
    message = read(head + bytes.fromhex("3fc00000 c0000000 00000001 ff"))
    assert message.a.array().tolist() == [1.5, -2.0]
    assert message.b.array().tolist() == [-1]


class Numbers(msgspec.Struct):
    a: Floats
    b: Int8s


@ENCODINGS
def test_numbers_too_large_for_the_view_are_refused(encoding):
    read, write = tools(encoding, "a/B", Numbers, "float64[] a\nint16[] b")
    assert read(write({"a": [1.5], "b": [-3]})).a == Floats(array("f", [1.5]))
    with pytest.raises(ProtocolError, match="a/B that cannot be read"):
        read(write({"b": [300]}))


@ENCODINGS
def test_messages_without_fields_are_read_in_arrays_and_messages(encoding):
    text = "N[2] a\nN[] b\nP[] c\nint16[] d\nstring[] e\n"
    text += "====\nMSG: a/N\n====\nMSG: a/P\nN n\nuint16 x\nuint16[2] y"
    read, write = tools(encoding, "a/B", None, text)
    message = {
        **{"a": [{}, {}], "b": [{}], "d": array("h", [1]), "e": ["x"]},
        "c": [{"n": {}, "x": each, "y": array("H", [1, 2])} for each in range(3)],
    }
    assert read(write(message)) == message


def test_long_arrays_share_the_memory_of_the_message():
    read, write = tools("cdr", "nav_msgs/OccupancyGrid", messages.OccupancyGridMsg)
    side = 2000
    info = {"width": side, "height": side}
    data = write({"info": info, "data": array("b", bytes(side * side))})
    message = read(data)
    assert message.cells.shape == (side, side)
    assert np.shares_memory(message.cells, np.frombuffer(data, np.int8))
    read, write = tools("cdr", "sensor_msgs/PointCloud2", PointCloud2Msg)
    cloud = bytearray(b"head!" + write({"data": bytes(1 << 21)}))
    message = read(memoryview(cloud)[5:])
    assert np.shares_memory(message.data.array(), np.frombuffer(cloud, np.uint8))
    small = write({"data": bytes(9)})
    assert not np.shares_memory(
        read(small).data.array(), np.frombuffer(small, np.uint8)
    )


@ENCODINGS
@pytest.mark.parametrize("view", [None, messages.TFMessage])
def test_items_are_counted_before_any_of_them_is_built(encoding, view):
    read, write = tools(encoding, "tf2_msgs/TFMessage", view)
    data = write({"transforms": [{}] * (MAX_VALUES // 6 + 1)})
    with pytest.raises(TooLarge, match=f"the limit is {MAX_VALUES}"):
        read(data)
    count = 4 if encoding == "cdr" else 0
    lying = data[:count] + b"\xff\xff\xff\xff" + data[count + 4 :]
    with pytest.raises(ProtocolError, match="ends before its last field"):
        read(lying)


def test_items_without_bytes_are_counted_too():
    text = "Outer[] a\n====\nMSG: a/Outer\nstd_msgs/Empty[1000] b\n"
    text += "====\nMSG: std_msgs/Empty\n"
    read, write = tools("ros1", "a/B", text=text)
    assert len(read(write({"a": [{}] * 2}))["a"][1]["b"]) == 1000
    read = tools("ros1", "a/B", text=text.replace("1000", ""))[0]
    nested = b"\2\0\0\0" + (MAX_VALUES // 2).to_bytes(4, "little") * 2
    with pytest.raises(TooLarge):
        read(nested)
    with pytest.raises(ProtocolError):
        read(b"\xff\xff\xff\xff")


@pytest.mark.slow
def test_a_complete_default_message_of_each_type_is_read():
    for ros2 in (True, False):
        encoding = "cdr" if ros2 else "ros1"
        for name in shipped(ros2):
            fields = shipped(ros2).definition(name).fields
            read, write = tools(encoding, name)
            if "time" in str(fields) or "duration" in str(fields):
                assert read(write({})) is not None
            else:
                assert str(read(write({}))) == str(read(write(initial(fields, {}))))
