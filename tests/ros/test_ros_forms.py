"""Forms for messages: fields, defaults, ranges, and errors that name the field."""

import math

import pytest

from webmap.base.errors import ConfigError
from webmap.ros.definitions import Definitions, UnknownType, shipped
from webmap.ros.message_check import Misfit
from webmap.ros.message_forms import (
    checked,
    entry_of,
    fields_of,
    filled_in,
    initial,
    leaves,
)


def fields(text: str, **others: str):
    texts = {
        "test_msgs/It": text,
        **{k.replace("__", "/"): v for k, v in others.items()},
    }
    return fields_of("test_msgs/msg/It", Definitions(texts, ros2=True))


@pytest.mark.parametrize("ros2", [False, True])
def test_the_default_message_of_every_shipped_definition_is_valid(ros2):
    known = shipped(ros2=ros2)
    assert len(list(known)) > 100
    for type in known:
        form = fields_of(type, known)
        message = initial(form, {})
        assert checked(form, message) == checked(form, checked(form, message))
        entries = {way: entry_of(field, None) for way, field in leaves(form)}
        assert set(entries) == {way for way, _ in leaves(form)}


def test_a_form_has_no_field_for_the_sequence_number_of_a_header():
    assert [way for way, _ in leaves(fields_of("nav_msgs/Path"))] == [
        "header.stamp", "header.frame_id", "poses",
    ]  # fmt: skip


def test_a_type_is_known_in_the_spelling_of_both_dialects():
    assert fields_of("std_msgs/Bool") == fields_of("std_msgs/msg/Bool")


def test_omitted_fields_get_the_default_of_the_definition():
    form = fields("geometry_msgs/Quaternion q\nint8 n -3\nstring s 'none'\nbool b true",
                  geometry_msgs__Quaternion="float64 x 0\nfloat64 w 1")  # fmt: skip
    assert initial(form, {"q": {"x": 0.5}}) == {
        "q": {"x": 0.5, "w": 1.0}, "n": -3, "s": "none", "b": True,
    }  # fmt: skip


def test_form_entries_are_converted_to_the_message():
    form = fields(
        "uint8 n\nfloat32 f\nbool b\nstring s\nfloat64[3] v\nint16[] list\ntime t\n"
        "In inner\nIn[] more",
        test_msgs__In="string[<=2] words\nduration d",
    )
    entries = {
        "n": " 7 ", "f": "1e3", "b": True, "s": "<b>ü</b>", "v": "1, 2,3.5",
        "list": "", "t": "2.25", "inner.words": "a, b", "inner.d": "-0.5",
        "more": '[{"words": ["x"]}]',
    }  # fmt: skip
    assert filled_in(form, entries) == {
        "n": 7, "f": 1000.0, "b": True, "s": "<b>ü</b>", "v": [1.0, 2.0, 3.5],
        "list": [], "t": {"secs": 2, "nsecs": 250_000_000},
        "inner": {"words": ["a", "b"], "d": {"secs": -1, "nsecs": 500_000_000}},
        "more": [{"words": ["x"]}],
    }  # fmt: skip
    later = filled_in(form, {"t": "2.25"}, ros2=True)["t"]
    assert later == {"sec": 2, "nanosec": 250_000_000}


@pytest.mark.parametrize(
    ("definition", "entry", "words"),
    [
        ("uint8 n", "256", 'n: got 256, expected a whole number from 0 to 255'),
        ("int8 n", "-129", "n: got -129, expected a whole number from -128 to 127"),
        ("uint8 n", "1.5", "n: got 1.5, expected a whole number"),
        ("uint8 n", "", 'n: got "", expected a whole number'),
        ("int64 n", "9" * 39, "n: got 9999"),
        ("float64 n", "nan", "n: got nan, expected a number"),
        ("float64 n", "1e999", "n: got inf, expected a number"),
        ("float32 n", "1e39", "n: got 1e+39, expected a number"),
        ("bool n", "yes", 'n: got "yes", expected true or false'),
        ("string<=3 n", "four", 'n: got "four", expected a text of 3 at most'),
        ("float64[3] n", "1, 2", "n: got 2 values, expected 3 values of float64"),
        ("int8[<=2] n", "1, 2, 3", "n: got 3 values, expected at most 2 values"),
        ("uint8[] n", "1, x", 'n[1]: got "x", expected a whole number'),
        ("time n", "-1", "n: got -1, expected seconds from 0"),
        ("duration n", "1e12", "n: got 1000000000000.0, expected a number of seconds"),
        ("std_msgs/Bool[] n", "{", "n: this is not JSON"),
        ("std_msgs/Bool[] n", '[{"data": 1}]', "n[0].data: got 1, expected true"),
        ("std_msgs/Bool[] n", '[{"dat": true}]', "n[0].dat: no such field; there are"),
        ("std_msgs/Bool[] n", "[[]]", "n[0]: got [], expected a table of fields"),
        ("string n", "x" * 10_001, "n: at most 10000 characters"),
    ],
)  # fmt: skip
def test_an_invalid_entry_raises_an_error_that_names_the_field(
    definition, entry, words
):
    form = fields(definition, std_msgs__Bool="bool data")
    with pytest.raises(Misfit) as error:
        filled_in(form, {"n": entry})
    assert words in str(error.value)


@pytest.mark.parametrize("given", [{"n": True}, {"n": None}, {"n": math.nan}, [1], "x"])
def test_plain_data_is_checked_as_strictly_as_form_entries(given):
    with pytest.raises(Misfit):
        checked(fields("int32 n"), given)


def test_constants_are_assigned_to_the_field_whose_values_they_name():
    battery = {field.name: field for field in fields_of("sensor_msgs/BatteryState")}
    assert battery["power_supply_health"].constants["POWER_SUPPLY_HEALTH_DEAD"] == 3
    assert len(battery["power_supply_status"].constants) == 5
    assert battery["present"].constants is None
    (command,) = fields_of("nav2_msgs/srv/ManageLifecycleNodes")
    assert command.constants["SHUTDOWN"] == 4
    level, *_ = fields_of("diagnostic_msgs/DiagnosticStatus")
    assert list(level.constants) == ["OK", "WARN", "ERROR", "STALE"]


def test_comments_and_string_constants_are_parsed_as_in_ros():
    form = fields("# what it is\nstring A=x # y\nstring mode  # of them\nint8 B=0x10")
    (mode,) = form
    assert mode.constants == {"A": "x # y"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("int8", "'int8' is no field"),
        ("test_msgs/It it", "nested too deep"),
        ("int8 x=y", "'y' is not a value of int8"),
        ("\n".join(f"int8 a{i}" for i in range(401)), "more than 400 fields"),
        ("std_msgs/No no", "the fields of std_msgs/No are not known here"),
    ],
)
def test_an_invalid_definition_is_refused(text, words):
    with pytest.raises(ConfigError, match=words):
        fields(text)


def test_a_type_without_a_shipped_definition_raises_unknown_type():
    with pytest.raises(UnknownType, match="my_msgs/Dock are not known"):
        fields_of("my_msgs/srv/Dock")
