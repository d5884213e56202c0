"""No bytes break a parser: it returns a value, or raises an error of WebMap."""

import contextlib
import functools
import importlib
import inspect
import pkgutil
import re
import time
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_bytes import CORPUS

import webmap
from equipment.gate_harness import KEY, spec
from webmap.base.errors import WebMapError
from webmap.base.map_file import read_map
from webmap.config.checks import Mistakes
from webmap.config.fleet import read_fleet
from webmap.config.toml_text import read_text
from webmap.features.labels.label_store import LabelStore
from webmap.gate.actions import SendGoal
from webmap.gate.protocol import FromGate
from webmap.ros.decoding import decode_json
from webmap.ros.definitions import shipped
from webmap.ros.serialized.reader import make_reader
from webmap.ros.serialized.schemas import read_schema
from webmap.server.people import UserFile
from webmap.sim.web_video import HttpError

FILE = Path("picture")

PARSERS = {
    "agents.announcements:read_about": (),
    "agents.camera_messages:read_picture": (),
    "agents.camera_messages:read_reply": (),
    "agents.camera_messages:read_request": (),
    "agents.data_messages:lean_scan": (5,),
    "agents.data_messages:read_json": (msgspec.json.decode, "text"),
    "agents.data_messages:read_op": (),
    "agents.data_messages:unpack": (),
    "bags.types:bytes_of_json": ("FIELDS", {"ros2": True}),
    "features.cameras.video_codecs:nal_units": (),
    "features.cameras.video_codecs:read_sps": (),
    "features.tiles.tile_source:media_type": ("tile",),
    "fleet.robot_files:check_agent_picture": (FILE, "image/png"),
    "fleet.robot_files:check_picture": (FILE, "image/svg+xml"),
    "fleet.robot_files:picture_from_agent": ("picture.svg",),
    "gate.commands:parse": (),
    "gate.lanes.foxglove_texts:read_text": (),
    "gate.lanes.navigation:answer_to": ("call",),
    "gate.lanes.navigation:of_action": ("GOAL",),
    "gate.lanes.navigation:of_topics": ("SPEC", "GOAL"),
    "gate.lanes.rosbridge:check_parts": (),
    "gate.lanes.rosbridge:parse": (),
    "gate.lanes.rosbridge:plain": (),
    "gate.lanes.scans:check_parts": (),
    "gate.lanes.scans:parse_scan": (1.0,),
    "gate.lanes.serialization:accepted": (),
    "gate.lanes.serialization:action_feedback": (0,),
    "gate.lanes.serialization:action_result": (),
    "gate.lanes.serialization:actionlib_in": (
        0,
        "actionlib_msgs/GoalStatusArray",
        "ros1",
    ),
    "gate.lanes.serialization:scan_in": (0, "ros1", 1.0),
    "gate.lanes.serialization:trigger_result": ("ros1",),
    "gate.lanes.serialization:velocity_in": (0, "nav_msgs/Odometry", "ros1"),
    "ros.decoding:decode_json": (dict[str, msgspec.Raw],),
    "ros.messages_image:size_of": (),
    "ros.rosbridge.cbor:decode": (),
    "ros.rosbridge.events:check_count": (),
    "ros.sockets.frame_reader:whole_of": (),
    "scene.wire.messages:read_message": (),
    "sim.web_video:read_request": (),
}
"""The parsers, and their arguments besides the bytes."""

STREAMS = {
    "agents.gate_messages:Order": ("take",),
    "features.cameras.video_codecs:H264": ("read",),
    "features.cameras.video_codecs:Vp9": ("read",),
    "gate.pipe:Unpacker": ("feed", FromGate),
    "ros.image_pull:HttpResponseParser": ("feed",),
    "ros.image_pull:Multipart": ("feed", "boundary"),
}
"""Parsers that keep what came before: the method that takes the next bytes, and the
arguments of the parser."""

NONE = {
    "base.plain_files:write_file",
    "ros.offload:aside",
    "server.files:publish_image",
}
"""Functions that take bytes and do not read them."""

ALSO = {
    "bags.types:bytes_of_json": (ValueError, RecursionError),
    "gate.lanes.rosbridge:plain": (ValueError,),
}


OF_BYTES = re.compile(r"(<class ')?(str \| )?bytes\b")
"""Matches the annotation of an argument that has bytes."""


@contextlib.contextmanager
def may_refuse(*kinds, longest=2000):
    """Accept an error of WebMap, or of further kinds, that is not too long."""
    try:
        yield
    except (WebMapError, HttpError, *kinds) as error:
        length = len(str(error))
    else:
        length = 0
    assert length < longest, "the error repeats the bytes"


def modules():
    for found in pkgutil.walk_packages(webmap.__path__, "webmap."):
        if not found.name.endswith("__main__"):
            yield importlib.import_module(found.name)


def of_bytes():
    """Return the public functions with bytes as an argument that refuse some."""
    for module in modules():
        for name, each in vars(module).items():
            if not inspect.isfunction(each) or each.__module__ != module.__name__:
                continue
            taken = inspect.signature(each).parameters.values()
            reads = any(OF_BYTES.match(str(one.annotation)) for one in taken)
            refuses = "Raises:" in (each.__doc__ or "")
            if reads and refuses and not name.startswith("_"):
                yield f"{module.__name__.removeprefix('webmap.')}:{name}"


@functools.cache
def views():
    """Return the types as which messages of robots are read."""
    return {
        each
        for module in modules()
        for name, each in vars(module).items()
        if inspect.isclass(each)
        and issubclass(each, msgspec.Struct)
        and each.__module__ == module.__name__
        and re.search(r"(Msg|Message)$", name)
        and module.__name__.startswith(("webmap.ros", "webmap.features"))
    }


def found(name):
    module, _, attribute = name.partition(":")
    return getattr(importlib.import_module(f"webmap.{module}"), attribute)


@functools.cache
def named(argument):
    """Return an argument that is a value of the gate."""
    goal = SendGoal(KEY, "r1", "g1", 1.0, 2.0, 0.5, "c1", "navigate_to_pose")
    fields = shipped(False).definition("std_msgs/Header").fields
    return {"SPEC": spec(), "GOAL": goal, "FIELDS": fields}.get(argument, argument)


changes = st.lists(
    st.tuples(
        st.sampled_from(["cut", "insert", "replace", "repeat", "join"]),
        st.floats(0, 1),
        st.binary(max_size=8) | st.sampled_from(CORPUS),
    ),
    max_size=4,
)


@st.composite
def nearly_valid(draw):
    """Draw bytes of the corpus, with a few changes."""
    data = draw(st.sampled_from(CORPUS))
    for kind, where, piece in draw(changes):
        at = int(where * len(data))
        if kind == "cut":
            data = data[:at]
        elif kind == "insert":
            data = data[:at] + piece + data[at:]
        elif kind == "replace":
            data = data[:at] + piece + data[at + len(piece) :]
        elif kind == "repeat":
            data = data[:at] + data[at : at + 40] * 20 + data[at:]
        else:
            data += piece
    return data[:20_000]


def parsed(name, data):
    """Let a parser read bytes; return what it raised, if it did."""
    given = PARSERS[name]
    options = next((one for one in given if isinstance(one, dict)), {})
    wanted = functools.partial(found(name), **options)
    rest = [named(one) for one in given if one is not options]
    if name in ("fleet.robot_files:picture_from_agent",):
        rest, data_at = [*rest, data], 1
    elif name.startswith(("fleet.robot_files", "bags.types")) or "read_json" in name:
        rest, data_at = [rest[0], data, *rest[1:]], 1
    else:
        rest, data_at = [data, *rest], 0
    assert rest[data_at] is data
    begun = time.monotonic()
    with may_refuse(*ALSO.get(name, ())):
        wanted(*rest)
    assert time.monotonic() - begun < 5.0


def test_every_function_that_reads_bytes_is_tested_here():
    names = set(of_bytes())
    assert len(names) > 20
    assert names - NONE == PARSERS.keys()
    assert len(views()) > 20


@pytest.mark.parametrize("name", PARSERS)
def test_the_corpus_breaks_no_parser(name):
    for data in CORPUS:
        parsed(name, data)


@pytest.mark.parametrize("name", PARSERS)
@settings(max_examples=25)
@given(data=nearly_valid())
def test_nearly_valid_bytes_break_no_parser(name, data):
    parsed(name, data)


@settings(max_examples=50)
@given(data=nearly_valid())
def test_no_bytes_break_the_reading_of_a_message_as_any_type(data):
    for view in views():
        with may_refuse():
            decode_json(data, view)


SERIALIZED = [
    make_reader(read_schema(name, language), None, encoding)
    for encoding, language in (("cdr", "ros2msg"), ("ros1", "ros1msg"))
    for name in (
        *("nav_msgs/Odometry", "sensor_msgs/LaserScan", "nav_msgs/OccupancyGrid"),
        *("tf2_msgs/TFMessage", "diagnostic_msgs/DiagnosticArray", "std_msgs/Empty"),
        *("sensor_msgs/PointCloud2", "visualization_msgs/MarkerArray", "nav_msgs/Path"),
    )
]
"""Readers of serialized messages."""


@settings(max_examples=50)
@given(data=nearly_valid())
def test_no_bytes_break_the_reading_of_serialized_messages(data):
    for read in SERIALIZED:
        with may_refuse():
            read(data)


@settings(max_examples=50)
@given(data=nearly_valid(), language=st.sampled_from(["ros2msg", "ros1msg", "ros2idl"]))
def test_no_text_breaks_the_reading_of_a_schema(data, language):
    for text in (data.decode(errors="replace"), f"module a {{ {data!r} }};"):
        with may_refuse(longest=25_000):
            read_schema("a/B", language, text)


@pytest.mark.parametrize("name", STREAMS)
@settings(max_examples=40)
@given(pieces=st.lists(nearly_valid(), max_size=4))
def test_no_pieces_break_a_parser_of_streams(name, pieces):
    method, *rest = STREAMS[name]
    parser = found(name)(*rest)
    with may_refuse():
        for piece in pieces:
            getattr(parser, method)(piece)


FILES = {
    "fleet.toml": lambda file: read_fleet(read_text(file).data, Mistakes()),
    "users.toml": lambda file: UserFile(file.parent).read(),
    "map.yaml": read_map,
    "image.pgm": lambda file: read_map(_map_of(file)),
    "labels/of.json": lambda file: LabelStore(file.parents[1], "of").load(),
}
"""The files that WebMap reads, and what reads them."""

TEXTS = [
    b'[bridges]\na = "ws://robot:9090"\n[[robots]]\nname = "Bob"\nbridge = "a"\n',
    b'[users.ana]\nrole = "operator"\npassword = "$argon2id$x"\n',
    b"image: image.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
    b"occupied_thresh: 0.65\nfree_thresh: 0.2\n",
    b'[{"name": "Dock", "x": 1.0, "y": 2.0, "icon": "charger"}]',
    b"P5\n2 2\n255\n\0\1\2\3",
    b"a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n",
    b"a = " + b"[" * 500,
]


def _map_of(image):
    file = image.with_name("of.yaml")
    file.write_bytes(TEXTS[2])
    return file


@pytest.mark.parametrize("name", FILES)
def test_no_file_breaks_its_reader(name, tmp_path):
    file = tmp_path / name
    file.parent.mkdir(exist_ok=True)

    @settings(max_examples=40)
    @given(data=st.sampled_from(TEXTS) | nearly_valid())
    def read(data):
        file.write_bytes(data)
        with may_refuse(longest=20_000):
            FILES[name](file)

    read()
