"""The line of each value in a TOML file."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.config.toml_text import Lines

# Each number is the number of its own line.
EVERYTHING = r'''# a comment with [brackets] = "and" {more}
first = 2
"quoted key" = 3
'literal.key' = 4
dotted . "inner" = 5

[table] # header
a = 8
b = [ # an array over lines
    10, 10,
    11, # a comment, with a comma

    [13, { x = 13, y = { z = 13 } }],
]
text = """
several = "lines" # and no comment
[not.a.header]
""""
after = 19
plain = 'back\slash'
more = "a \" quote # and \\"
next = 22
inline = { x = 23, "y.z" = 23, w.v = 23 }
literal = \'\'\'
[neither]
\'\'\'
last = 27
[table.sub.deep]
a = 29
[[robots]]
a = 31
[robots.twist]
a = 33
[[robots.modules]]
a = 35
[[robots.modules]]
a = 37
[[robots]]
twist.a = 39
  [[robots.modules]]
  a = 41
date = 1979-05-27 07:32:00
end = 43'''.replace("\\'", "'")


def numbers(value, path=()):
    if isinstance(value, dict):
        for key, each in value.items():
            yield from numbers(each, (*path, key))
    elif isinstance(value, list):
        for index, each in enumerate(value):
            yield from numbers(each, (*path, index))
    elif type(value) is int:
        yield path, value


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_the_line_of_every_value_is_found(newline):
    text = EVERYTHING.replace("\n", newline)
    lines = Lines(text)
    found = list(numbers(tomllib.loads(text)))
    assert len(found) == 25
    for path, line in found:
        assert lines.of(path) == line, path


def test_the_lines_of_table_headers_are_found():
    lines = Lines(EVERYTHING)
    assert lines.of(("table",)) == 7
    assert lines.of(("robots", 1)) == 38
    assert lines.of(("robots", 0, "modules", 1)) == 36


def test_a_missing_key_has_the_line_of_its_table():
    lines = Lines(EVERYTHING)
    assert lines.of(("robots", 1, "name")) == 38
    assert lines.of(("nothing",)) == 1


PIECES = st.sampled_from(
    ["a = 1\n", "[t]\n", "[[r]]\n", "\r\n", '"""', "'''", *"ab=1.[]{},\n #\"'\\é"]
)


@given(st.lists(PIECES, max_size=25).map("".join))
def test_any_valid_toml_can_be_scanned_for_lines(text):
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    lines = Lines(text)
    for path, _ in numbers(data):
        assert 1 <= lines.of(path) <= text.count("\n") + 1
