"""Fleet files that would take long to read, or that are nested without end."""

import re
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.errors import ConfigError
from webmap.config.checks import MOST_MISTAKES
from webmap.config.toml_text import DEEPEST, LARGEST, FleetText, Lines, too_deep
from webmap.fleet.fleet_file import prepare

HEAD = '[bridges]\nb = "ws://robot:9090"\n'
DEEP = ".".join(["a"] * 8000)
QUOTED = " . ".join(['"a"', "'b'"] * 4000)


@pytest.mark.parametrize(
    "line",
    [
        f"{DEEP} = 1",
        f"{QUOTED} = 1",
        f"[{DEEP}]",
        f"[[{DEEP}]]",
        f"x = {{ {DEEP} = 1 }}",
        f"x = [{{ {DEEP} = 1 }}]",
        "x = " + "[" * 5000,
        "x = " + "{a=" * 5000,
        "x = " + "[" * (DEEPEST + 1) + "]" * (DEEPEST + 1),
    ],
)
def test_too_deeply_nested_toml_is_refused_quickly_with_its_line(tmp_path, line):
    file = tmp_path / "fleet.toml"
    file.write_text(f"{HEAD}\n{line}\n")
    began = time.process_time()
    with pytest.raises(ConfigError) as refused:
        prepare(file)
    assert time.process_time() - began < 0.5
    assert f"fleet.toml:4: keys and values are nested at most {DEEPEST} deep" in str(
        refused.value
    )


@pytest.mark.parametrize(
    "text",
    [
        f'title = "{DEEP}"',
        f"title = '{DEEP}'",
        f'title = """\n{DEEP} = [[[[\n"""',
        f"title = '''\n{'[' * 100}\n'''",
        f"# {DEEP} {'[' * 100}\n",
        "x = 1.5\ny = 2001-01-01T00:00:00.5\n" * 100,
        f"x = [{'[1.5], ' * 1000}]",
        ".".join(["a"] * DEEPEST) + " = 1",
        'title = "it\\"s' + "[" * 100 + '"',
    ],
)
def test_dots_and_brackets_in_strings_and_comments_do_not_count_as_nesting(text):
    assert too_deep(text) is None


@given(st.text(alphabet="\"'\\[]{}.=a#\n \t1"))
def test_the_depth_check_accepts_any_text_without_dots_and_brackets(text):
    assert too_deep(text) is None or text.count(".") + text.count("[") + text.count("{")


def test_a_too_large_fleet_file_is_refused(tmp_path):
    file = tmp_path / "fleet.toml"
    file.write_text("#" * (LARGEST + 1))
    with pytest.raises(ConfigError, match="the file is larger than 512 KiB"):
        prepare(file)


def test_the_first_of_many_mistakes_are_listed_and_the_others_are_counted(tmp_path):
    file = tmp_path / "fleet.toml"
    file.write_text(HEAD + "[[robots]]\n" + "".join(f"k{n} = 1\n" for n in range(5000)))
    with pytest.raises(ConfigError) as refused:
        prepare(file)
    lines = str(refused.value).splitlines()
    assert len(lines) == MOST_MISTAKES + 1
    assert "robots[0].k0: there is no key" in lines[0]
    counted = re.fullmatch(r".*: and (\d+) more mistakes", lines[-1])
    assert 4900 <= int(counted[1]) <= 4903


def test_quoted_keys_are_found_by_their_decoded_name():
    text = '"a b" = 1\n\'c\\d\' = 2\n"\\u0065\\"" = 3\n'
    lines = Lines(text)
    assert [lines.of((key,)) for key in FleetText("x", text).data] == [1, 2, 3]
