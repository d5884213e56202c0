import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.errors import WireError
from webmap.scene.wire.messages import (
    LONGEST,
    ElementEvent,
    PageHello,
    ViewReport,
    read_message,
)
from webmap.scene.wire.session import SceneSession

HELLO = {
    "op": "hello",
    "page": "abcdefgh-1",
    "url": "/lab?x=1",
    "width": 800,
    "height": 600,
    "dpr": 2,
    "theme": "dark",
    "containers": {"map": [700, 500]},
}


def text(message, **changes):
    return json.dumps({**message, **changes})


def test_a_hello_message_identifies_the_page():
    hello = read_message(text(HELLO))
    assert isinstance(hello, PageHello)
    assert hello.containers == {"map": (700, 500)}
    assert (hello.page, hello.url, hello.theme) == ("abcdefgh-1", "/lab?x=1", "dark")


def test_an_event_message_contains_the_position_and_the_modifier_keys():
    event = read_message(
        '{"op":"event","mount":1,"element":2,"event":"click","x":3.5,"shift":true}'
    )
    assert isinstance(event, ElementEvent)
    assert (event.x, event.shift, event.world_x) == (3.5, True, None)


@pytest.mark.parametrize(
    "garbage",
    [
        "",
        "null",
        "[]",
        "{}",
        '{"op":"shutdown"}',
        '{"op":"seen","frame":-1}',
        '{"op":"seen","frame":1.5}',
        '{"op":"seen","frame":1,"more":2}',
        '{"op":"event","mount":1,"element":2,"event":"explode"}',
        '{"op":"module","instance":1,"data":"text"}',
        '{"op":"view","map_element":1}',
        text(HELLO, page="../../etc"),
        text(HELLO, theme="pink"),
        text(HELLO, width=None),
        '{"op":"hello","width":1e999}',
        "[" * 5000,
        '{"op":"trouble","text":"' + "x" * LONGEST + '"}',
        b"\xff\xfe",
        b'{"op":"trouble","text":"\xff"}',
    ],
)
def test_an_invalid_message_raises_a_wire_error(garbage):
    with pytest.raises(WireError):
        read_message(garbage)


@given(st.binary() | st.text())
def test_any_bytes_give_a_message_or_a_wire_error(data):
    session = SceneSession()
    try:
        session.receive(data)
    except WireError:
        return


keys = st.sampled_from(
    ["op", "mount", "element", "event", "frame", "map_element", "a", "instance", "data"]
)
values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from(["event", "view", "seen", "click", "module", "ready", "resync"]),
    lambda inner: st.lists(inner) | st.dictionaries(keys, inner),
    max_leaves=5,
)


@given(st.dictionaries(keys, values))
def test_any_json_gives_a_message_or_a_wire_error(message):
    try:
        read_message(json.dumps(message))
    except WireError:
        return


def test_a_view_report_contains_the_matrix_and_the_position():
    numbers = {name: index for index, name in enumerate("abcdef")}
    place = {"width": 700, "height": 500, "left": 10, "top": 20}
    report = read_message(text({"op": "view", "map_element": 3, **numbers, **place}))
    assert isinstance(report, ViewReport)
    assert (report.a, report.f, report.left, report.follow) == (0, 5, 10, 0)


@pytest.mark.parametrize("depth", [40, 900, 5000])
def test_a_module_message_nested_too_deeply_is_refused(depth):
    data = '{"a":' + "[" * depth + "]" * depth + "}"
    text = '{"op":"module","instance":1,"data":' + data + "}"
    with pytest.raises(WireError, match=r"nested deeper than 32|recursion"):
        read_message(text)
