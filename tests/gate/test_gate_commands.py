"""The strict parser of the commands of a page."""

import contextlib
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.gate.commands import (
    Cancel,
    Drive,
    Goal,
    Locate,
    MoveFor,
    Refusal,
    Release,
    SetVelocity,
    Stop,
    Take,
    check,
    parse,
)

DRIVE = {
    "op": "drive",
    "robot": "r1",
    "epoch": 3,
    "seq": 17,
    "tick": 812,
    "x": 0.5,
    "y": 0.0,
    "turn": -1.0,
}
GOAL = {
    "op": "goal",
    "robot": "r1",
    "epoch": 3,
    "seq": 18,
    "tick": 813,
    "x": 1.0,
    "y": 2.0,
    "yaw": 0.5,
}


def text(fields, **changes):
    return json.dumps({**fields, **changes}).encode()


def without(fields, name):
    return {key: value for key, value in fields.items() if key != name}


@pytest.mark.parametrize(
    ("fields", "command"),
    [
        ({"op": "take", "robot": "r1"}, Take("r1")),
        ({"op": "release", "robot": "r1"}, Release("r1")),
        ({"op": "cancel", "robot": "r1"}, Cancel("r1")),
        ({"op": "stop", "robot": "r1"}, Stop("r1")),
        ({"op": "stop", "robot": "*"}, Stop(None)),
        (DRIVE, Drive("r1", 3, 17, 812, 0.5, 0.0, -1.0)),
        (GOAL, Goal("r1", 3, 18, 813, 1.0, 2.0, 0.5)),
    ],
)
def test_valid_commands_are_parsed(fields, command):
    assert parse(text(fields)) == command


def test_zero_and_negative_zero_inputs_are_neutral():
    assert parse(text(DRIVE, x=-0.0, turn=0)).neutral


@pytest.mark.parametrize("axis", ["x", "y", "turn"])
def test_an_input_below_one_thousandth_is_neutral(axis):
    released = {"x": 0, "y": 0, "turn": 0}
    for least in (5e-324, -5e-324, 0.0009, -0.0009):
        assert parse(text(DRIVE, **{**released, axis: least})).neutral
    for moves in (0.001, -0.001, 1.0):
        assert not parse(text(DRIVE, **{**released, axis: moves})).neutral


def test_inputs_beyond_full_scale_are_clamped_and_flagged():
    drive = parse(text(DRIVE, x=10, y=-1e300, turn=1.0))
    assert (drive.x, drive.y, drive.turn) == (1.0, -1.0, 1.0)
    assert drive.clamped
    assert not parse(text(DRIVE)).clamped


def test_the_heading_of_a_goal_is_normalised():
    assert parse(text(GOAL, yaw=7)).yaw == pytest.approx(7 - 2 * 3.14159265, abs=1e-6)


RAW = json.dumps(DRIVE)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"{}",
        b"[]",
        b"null",
        b"0.5",
        b'"drive"',
        b"{{{",
        b"[" * 1000,
        b'{"a":' * 170,
        b"\xff\xfe",
        b"\xed\xa0\x80",  # a lone surrogate, encoded
        b"\xef\xbb\xbf{}",  # a byte order mark
        RAW.encode() + b"{}",
        RAW.encode() + b" " * 1024,
        RAW.encode("utf-16"),
        RAW.replace("0.5", "NaN").encode(),
        RAW.replace("0.5", "Infinity").encode(),
        RAW.replace("0.5", "-Infinity").encode(),
        RAW.replace("0.5", "1e999").encode(),
        RAW.replace("0.5", "1" * 500).encode(),
        RAW.replace("0.5", "1" * 5000).encode(),
        RAW.replace('"x"', '"x": 0, "x"').encode(),
        RAW.replace('"x"', '"op": "stop", "x"').encode(),
        text(DRIVE, x="0.5"),
        text(DRIVE, x=True),
        text(DRIVE, x=None),
        text(DRIVE, x=[0.5]),
        text(DRIVE, x={}),
        text(DRIVE, extra=1),
        text(DRIVE, __proto__={}),
        text(DRIVE, seq=-1),
        text(DRIVE, seq=1.0),
        text(DRIVE, seq=True),
        text(DRIVE, seq="17"),
        text(DRIVE, seq=2**53),
        text(DRIVE, tick=None),
        text(DRIVE, epoch=3.5),
        text(DRIVE, robot=""),
        text(DRIVE, robot=7),
        text(DRIVE, robot=None),
        text(DRIVE, robot="r" * 65),
        text(DRIVE, robot="r\n1"),
        text(DRIVE, robot="\ud800"),
        text(DRIVE, op="Drive"),
        text(DRIVE, op=None),
        text(DRIVE, op=["drive"]),
        text(GOAL, x=1e7),
        text(GOAL, y=-1e300),
        text({"op": "stop", "robot": "*", "now": True}),
        text({"op": "\ud800", "robot": "r1"}),
        *(text(without(DRIVE, name)) for name in DRIVE),
        *(text(without(GOAL, name)) for name in GOAL),
    ],
)
def test_any_other_data_is_refused_with_a_short_printable_reason(data):
    with pytest.raises(Refusal) as refused:
        parse(data)
    assert refused.value.garbage
    # The reason goes to a log and to the page: it is printable and short.
    assert refused.value.why.isprintable()
    assert len(refused.value.why) < 200


@given(st.binary(max_size=1100))
def test_any_bytes_are_parsed_or_refused(data):
    with contextlib.suppress(Refusal):
        parse(data)


json_values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text(max_size=5), inner, max_size=3)
    ),
    max_leaves=8,
)
fields = st.sampled_from([*DRIVE, "yaw", "extra"])


@given(st.dictionaries(fields, json_values, max_size=4), st.sets(fields, max_size=1))
def test_a_drive_command_with_random_fields_is_refused_or_in_range(changes, missing):
    command = {**DRIVE, **changes}
    for name in missing:
        command.pop(name, None)
    try:
        understood = parse(json.dumps(command).encode())
    except Refusal:
        return
    if isinstance(understood, Drive):
        assert all(-1 <= v <= 1 for v in (understood.x, understood.y, understood.turn))
        assert set(command) == set(DRIVE)


@pytest.mark.parametrize(
    "command",
    [
        Take("r1"),
        Release("r1"),
        SetVelocity("r1", 3, 812, (9.0, 0.0, -1.0, 0.0, 0.0, 0.0)),
        Goal("r1", 3, 0, 812, 1.0, -2.0, 9.0),
        Locate("r1", 3, 0, 812, 1.0, -2.0, 9.0),
        MoveFor("r1", "west/c1", 812, 1.0, -2.0, 9.0),
    ],
)
def test_a_command_of_a_program_that_a_page_could_send_passes(command):
    check(command)


@pytest.mark.parametrize(
    "command",
    [
        Take(""),
        Take("r" * 65),
        Release("r" * 2000),
        Take("r\n1"),
        SetVelocity("r" * 65, 3, 812, (0.0,) * 6),
        SetVelocity("r1", -1, 812, (0.0,) * 6),
        SetVelocity("r1", 3, 2**60, (0.0,) * 6),
        Goal("r1", 3, 0, 812, 1e7, 0.0, 0.0),
        Goal("r1", 3, 0, 812, math.nan, 0.0, 0.0),
        Locate("r1", 3, -1, 812, 0.0, 0.0, 0.0),
        Locate("r1", 3, 0, 812, 0.0, 0.0, math.inf),
        MoveFor("r1", "west/c1", 812, 1e7, 0.0, 0.0),
    ],
)
def test_a_command_of_a_program_that_a_page_could_not_send_is_refused(command):
    with pytest.raises(Refusal):
        check(command)
