import pytest

from webmap.base.errors import ConfigError
from webmap.ros.definitions import MAX_DEPTH, MAX_LINES, UnknownType
from webmap.ros.serialized.schemas import MAX_FIELDS, MAX_TEXT, read_schema

LINE = "=" * 80


def chain(count):
    """Return a text with types that are nested so deep."""
    parts = [f"{LINE}\nMSG: a/T{n}\na/T{n + 1} next" for n in range(1, count)]
    return "\n".join(["a/T1 next", *parts, f"{LINE}\nMSG: a/T{count}\nint8 end"])


def test_a_schema_has_the_types_of_its_text():
    text = f"Other[] others\n{LINE}\nMSG: a/msg/Other\nstring<=5 name\nint8[2] pair"
    schema = read_schema("a/msg/B", "ros2msg", text)
    (others,) = schema.fields
    assert (schema.type, schema.ros2) == ("a/B", True)
    assert others.is_array
    assert [each.name for each in others.fields] == ["name", "pair"]
    assert read_schema("a/msg/B", "ros2msg", text) is schema


def test_an_included_definition_needs_no_text():
    schema = read_schema("std_msgs/msg/Header", "ros2msg")
    assert [each.name for each in schema.fields] == ["stamp", "frame_id"]
    schema = read_schema("std_msgs/Header", "ros1msg")
    assert [each.name for each in schema.fields] == ["seq", "stamp", "frame_id"]


def test_a_text_must_have_all_its_types():
    with pytest.raises(UnknownType, match="geometry_msgs/Pose are not known"):
        read_schema("a/B", "ros2msg", "geometry_msgs/Pose pose")
    with pytest.raises(UnknownType, match="std_msgs/Header"):
        read_schema("a/B", "ros1msg", "Header header")


def fan(depth):
    """Return a text with few types and ten to the power of ``depth`` fields."""
    many = "\n".join(f"a/T{{n}} f{each}" for each in range(10))
    parts = [f"{LINE}\nMSG: a/T{n}\n{many.format(n=n + 1)}" for n in range(1, depth)]
    return "\n".join([many.format(n=1), *parts, f"{LINE}\nMSG: a/T{depth}\nint8 x"])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a/B inner", "nested too deep"),
        ("C c\n====\nMSG: a/C\na/B b", "nested too deep"),
        (chain(MAX_DEPTH + 1), "nested too deep"),
        (fan(MAX_DEPTH - 2), f"more than {MAX_FIELDS} fields"),
        ("\n".join(f"int8 f{n}" for n in range(MAX_FIELDS + 1)), "more than"),
        ("\n".join(f"int8 A{n} = 1\nint8 a{n}" for n in range(MAX_LINES)), "more than"),
        ("float64[99999999] x", "longer than any message"),
        (f"float64[{'9' * 5000}] x", "is no field"),
        ("C[99999] c\n====\nMSG: a/C\nstring[99999] x", "longer than any message"),
        ("wstring x", "wstring"),
        ("C c\n====\nMSG: a/C\n wstring[] x", "wstring"),
        ("float64", "is no field"),
        ("int8 x!", "value"),
        ("int8 __class__", "is no field"),
        ("x" * (MAX_TEXT + 1), f"the limit is {MAX_TEXT}"),
        ("int8 x\n====\nMSG: a-b\nint8 y", "not the name of a type"),
        ("int8 x\n====\nSRV: a/C\nint8 y", "a/C"),
        ("int8 x\n====\nACTION: a/C\nint8 y\n---\n", "a/C"),
        ("int8 x\nint8 x", "two fields 'x'"),
    ],
)
def test_an_invalid_text_is_refused_with_its_reason(text, words):
    with pytest.raises(ConfigError, match=words) as caught:
        read_schema("a/B", "ros2msg", text)
    assert len(str(caught.value)) < 6000


def test_unknown_languages_and_names_are_refused():
    with pytest.raises(ConfigError, match="protobuf"):
        read_schema("a/B", "protobuf", "")
    with pytest.raises(ConfigError, match="not the name of a type"):
        read_schema("B", "ros2msg", "")


def test_constants_of_wide_strings_are_no_fields():
    read_schema("a/B", "ros2msg", 'wstring NAME = "x"\nint8 y')
