"""Single checks, and the reading of tables, which the gate uses too."""

import datetime
import math
from typing import Annotated, Any, ClassVar, Literal

import pytest

from webmap.base.errors import ConfigError
from webmap.config import checks
from webmap.config.checks import MOST_MISTAKES, Mistakes, checked
from webmap.config.motion import MotionConfig, ScanAssistConfig, StopHook, TwistConfig
from webmap.config.reading import ONE_OR_MORE, Config, ReadBy, read, read_key


def result_of(check, value):
    """Return the checked value, or the text of its mistake."""
    mistakes = Mistakes()
    found = checked(check, value, ("key",), mistakes)
    return mistakes.found[0][1] if mistakes.found else found


@pytest.mark.parametrize(
    ("check", "value", "expected"),
    [
        (checks.text, " ", 'got the text " ", expected a text that is not empty'),
        (
            checks.text,
            5,
            '5, expected a text that is not empty; write it in quotes: "5"',
        ),
        (checks.text, datetime.date(2026, 1, 2), 'write it in quotes: "2026-01-02"'),
        (checks.any_text, "", ""),
        (checks.any_text, True, "got the boolean true, expected a text"),
        (
            checks.name,
            "a\nb",
            "expected a text of one line with at most 100 characters",
        ),
        (checks.name, "Bob", "Bob"),
        (checks.frame, "/odom", "odom"),
        (checks.message_type("a/B"), "a/msg/B", "a/msg/B"),
        (checks.message_type("a/B"), "a/msg/C", "expected one of the types a/B"),
        (checks.message_type("a/B"), "no type", "expected one of the types a/B"),
        (checks.message_type("a/B"), 3, "expected one of the types a/B"),
        (checks.above_zero("metres"), 0, "expected a number of metres above 0"),
        (checks.above_zero("metres"), 1e7, "metres above 0, at most 1e+06"),
        (checks.above_zero("metres"), 10**70, "the whole number of very many digits"),
        (checks.above_zero("metres"), "1.5", "above 0; write 1.5 without quotes"),
        (checks.above_zero("metres"), "x", "got the text"),
        (checks.above_zero("metres"), "1" * 99, "metres above 0"),
        (checks.from_zero("metres"), -1, "expected a number of metres from 0 on"),
        (checks.from_zero("metres"), 2, 2.0),
        (checks.finite("a number"), math.nan, "got the number nan, expected a number"),
        (checks.between(0, 1, "bars"), 2, "expected a number of bars from 0 to 1"),
        (checks.numbers(2, checks.finite("a number")), (1, 2), (1.0, 2.0)),
        (checks.numbers(2, checks.finite("a number")), (1,), "expected 2 numbers"),
        (checks.numbers(2, checks.finite("a number")), "12", "expected 2 numbers"),
        (checks.whole(1, 9), 3, 3),
        (checks.whole(1, 9), 3.5, "expected a whole number from 1 to 9"),
        (checks.whole(1, 9), True, "expected a whole number from 1 to 9"),
        (checks.whole(1, 9), 10, "expected a whole number from 1 to 9"),
        (checks.duration, "12h", 43200.0),
        (checks.duration, 90, 90.0),
        (checks.duration, "soon", "expected a time from 1 s to 366 days"),
        (checks.duration, 0, "expected a time from 1 s to 366 days"),
        (checks.yes_or_no, True, True),
        (checks.yes_or_no, "yes", "expected true or false; write true without quotes"),
        (checks.one_of("stop", "creep"), "stop", "stop"),
        (checks.one_of("stop", "creep"), "stops", '"creep"; did you mean "stop"?'),
        (checks.one_of("stop", "creep"), object, "got the value <class 'object'>"),
        (checks.array, (1, 2), [1, 2]),
        (checks.array, "12", "expected an array of arguments"),
        (checks.table, {"a": 1}, {"a": 1}),
        (checks.table, [1], "got the array [1], expected a table of arguments by name"),
    ],
)
def test_a_check_returns_the_value_or_what_was_expected(check, value, expected):
    found = result_of(check, value)
    if isinstance(expected, str) and expected != found:
        assert expected in found
    else:
        assert found == expected


def test_names_that_look_the_same_have_one_form():
    assert checks.same_name(" \uff22OB") == checks.same_name("Bob")  # a full-width B


def test_beyond_a_hundred_mistakes_the_others_are_only_counted():
    mistakes, inner = Mistakes(), Mistakes()
    for number in range(MOST_MISTAKES + 2):
        checked(checks.text, number, ("robots", number, "name"), inner)
    mistakes.take(("fleet",), inner)
    assert (len(mistakes.found), mistakes.more) == (MOST_MISTAKES, 2)
    with pytest.raises(ConfigError, match="Bob: and 2 more mistakes"):
        mistakes.refuse("Bob")
    assert ("fleet", "robots", 101) in mistakes.wrong


def test_the_error_of_a_block_becomes_a_mistake_with_its_path():
    mistakes = Mistakes()
    with mistakes.at(("floor",)):
        raise OSError("no such file")
    with mistakes.at(("title",)):
        pass
    assert mistakes.found == [(("floor",), "no such file")]


def _read_even(value, path, mistakes):
    if value % 2:
        mistakes.add(path, "expected an even number")
    return value


class Inner(Config, kw_only=True, frozen=True):
    example: ClassVar[str] = '{ name = "x" } or "x"'

    name: Annotated[str, checks.text]

    def check(self, path, mistakes):
        if self.name == "odd":
            mistakes.add(path, "this is odd")


class Table(Config, kw_only=True, frozen=True):
    need: str
    flag: bool = False
    kind: Literal["a", "b"] = "a"
    anything: Any = None
    maybe: Annotated[float, checks.finite("a number")] | None = None
    even: Annotated[int, ReadBy(_read_even)] = 0
    one: Annotated[list[Annotated[str, checks.text]], ONE_OR_MORE] = []
    inner: Inner | None = None
    inners: list[Inner] = []
    texts: list[Annotated[str, checks.text]] = []
    tables: list["Plain"] = []


class Plain(Config, frozen=True):
    x: bool = False


def mistakes_in(value, cls=Table):
    mistakes = Mistakes()
    read(cls, value, (), mistakes)
    return [(checks.key_path_text(path), text) for path, text in mistakes.found]


def test_a_table_is_read_with_its_lists_and_tables():
    given = {
        "need": "x",
        "flag": True,
        "kind": "b",
        "anything": object,
        "maybe": None,
        "even": 2,
        "one": "one",
        "inner": {"name": "x"},
        "inners": [{"name": "y"}],
        "texts": ["a", "b"],
        "tables": [{"x": True}],
    }
    made = read(Table, given, (), Mistakes())
    assert (made.one, made.inner, made.texts) == (["one"], Inner(name="x"), ["a", "b"])
    assert (made.inners, made.even, made.maybe) == ([Inner(name="y")], 2, None)


@pytest.mark.parametrize(
    ("given", "key", "text"),
    [
        ({}, "", 'the key "need" is missing'),
        ({"need": "x", "flg": 1}, "flg", 'no key "flg" here; did you mean "flag"?'),
        ({"need": "x", "inner": {"name": "odd"}}, "inner", "this is odd"),
        ({"need": "x", "inner": 3}, "inner", 'expected a table such as { name = "x" }'),
        ({"need": "x", "inner": {"title": 3}}, "inner.title", "belongs to the file"),
        ({"need": "x", "inners": 3}, "inners", 'an array such as [{ name = "x" }]'),
        ({"need": "x", "texts": "a"}, "texts", "expected an array of texts, such as"),
        ({"need": "x", "tables": {}}, "tables", "[[tables]] in double brackets for"),
        ({"need": "x", "tables": 3}, "tables", "expected a table [[tables]] for each"),
        ({"need": "x", "tables": [3]}, "tables[0]", "a table of keys and values"),
        ({"need": "x", "one": [3, "a"]}, "one[0]", "expected a text"),
        ({"need": "x", "one": 3}, "one", "expected a text"),
        ({"need": "x", "even": 3}, "even", "expected an even number"),
    ],
)
def test_a_mistake_in_a_table_has_its_path(given, key, text):
    found = mistakes_in(given)
    assert key in [path for path, _ in found]
    assert any(text in message for _, message in found)


def test_the_keys_that_are_known_are_not_listed_again_for_mistakes_that_are_counted():
    given = {"need": "x", **{f"k{number}": 0 for number in range(MOST_MISTAKES + 1)}}
    mistakes = Mistakes()
    read(Table, given, (), mistakes)
    checked(checks.text, 5, ("z",), mistakes)
    assert (len(mistakes.found), mistakes.more) == (MOST_MISTAKES, 2)


def test_one_key_is_read_alone():
    assert read_key(Table, "maybe", 3, "Bob") == 3.0
    with pytest.raises(ConfigError, match="Bob: maybe: got the text"):
        read_key(Table, "maybe", "x", "Bob")


def scan_assist(footprint):
    return {"scan_assist": {"topic": "/s", "footprint": footprint}}


def twist(**more):
    return mistakes_in({"twist": {"topic": "/cmd_vel", **more}}, MotionConfig)


def test_a_limit_that_no_robot_notices_is_refused():
    (found,) = twist(a_max=1e-4)
    assert "expected a number of metres per second squared from 0.001 on" in found[1]
    assert twist(a_max=1e-3) == []


def test_a_stop_hook_has_one_name_and_the_type_of_its_kind():
    lock = StopHook(topic="/lock")
    assert (lock.name, lock.type) == ("/lock", "std_msgs/Bool")
    assert (StopHook(service="/off").name, StopHook(service="/off").type) == (
        "/off",
        "std_srvs/Trigger",
    )
    assert "one of them" in twist(stop_hooks=[{}])[0][1]
    assert "std_msgs/Bool" in twist(stop_hooks=[{"topic": "a", "type": "a/B"}])[0][1]
    assert "std_srvs/Tri" in twist(stop_hooks=[{"service": "a", "type": "a/B"}])[0][1]
    assert "is the velocity topic" in twist(stop_hooks=[{"topic": "cmd_vel"}])[0][1]


def test_a_topic_alone_is_short_for_its_table():
    motion = read(MotionConfig, {"twist": "/cmd_vel"}, (), Mistakes())
    assert motion.twist == TwistConfig(topic="/cmd_vel")


@pytest.mark.parametrize(
    ("given", "key"),
    [
        ({"move": {"frame": "map"}}, "move"),
        ({"move": {"topic": "a", "bridge": "x"}, "initial_pose": "b"}, "initial_pose"),
        (scan_assist([[0, 0]]), "scan_assist.footprint"),
        (scan_assist([[0, 0], [1, 0], [2, 0]]), "scan_assist.footprint"),
    ],
)
def test_parts_that_fit_neither_the_robot_nor_each_other_are_refused(given, key):
    assert [path for path, _ in mistakes_in(given, MotionConfig)] == [key]


def test_a_radius_has_corners_and_the_scanner_a_pose():
    given = {"topic": "/s", "footprint": 0.3, "x": 0.1, "angle": 90}
    disc = read(ScanAssistConfig, given, (), Mistakes())
    assert len(disc.corners) == 12
    assert disc.sensor == pytest.approx((0.1, 0.0, math.pi / 2))
    square = [(1, 1), (-1, 1), (-1, -1)]
    assert ScanAssistConfig(topic="/s", footprint=square).corners == tuple(square)
