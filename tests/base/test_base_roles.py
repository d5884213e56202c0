"""The order of the roles."""

import pytest

from webmap.base.errors import ConfigError
from webmap.base.roles import (
    ALL_ROBOTS,
    ROLES,
    checked_patterns,
    covers,
    includes,
    who_may,
)


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("least", ROLES)
def test_a_role_covers_itself_and_those_before_it(role, least):
    assert covers(role, least) == (ROLES.index(role) >= ROLES.index(least))


def test_the_sentence_names_who_may():
    assert who_may("operator") == "Only an operator may do this."
    assert who_may("admin") == "Only an admin may do this."


@pytest.mark.parametrize(
    ("patterns", "included"),
    [
        (["*"], ["bay2/bob", "bay1/eve", "bob (bay2)", "Bay2/x"]),
        (["bay2/*"], ["bay2/bob"]),
        (["bay2/*", "bay1/eve"], ["bay2/bob", "bay1/eve"]),
        (["* (bay2)"], ["bob (bay2)"]),
        (["bay[12]/*"], ["bay2/bob", "bay1/eve"]),
        (["bay2"], []),
        (["tag:bay 2"], ["bay2/bob", "bob (bay2)"]),
        (["tag:bay ?"], ["bay2/bob", "bob (bay2)", "bay1/eve"]),
        (["tag:*"], ["bay2/bob", "bob (bay2)", "bay1/eve"]),
        (["tag:bay2/*"], []),
    ],
)
def test_patterns_include_robots_by_name_and_by_tag(patterns, included):
    robots = {
        "bay2/bob": ["bay 2"],
        "bay1/eve": ["bay 1", "lift"],
        "bob (bay2)": ["lift", "bay 2"],
        "Bay2/x": [],
    }
    found = [name for name, tags in robots.items() if includes(patterns, name, tags)]
    assert sorted(found) == sorted(included)


def test_no_patterns_are_all_robots_and_each_pattern_counts_once():
    assert checked_patterns([]) == ALL_ROBOTS
    assert checked_patterns(["a", "b", "a"]) == ("a", "b")


@pytest.mark.parametrize("pattern", ["", "tag:", "two\nlines", "x" * 101])
def test_a_pattern_that_is_not_valid_is_refused(pattern):
    with pytest.raises(ConfigError, match="'tag:bay 2' for their tags"):
        checked_patterns(["bob", pattern])


def test_more_patterns_than_a_person_can_read_are_refused():
    with pytest.raises(ConfigError, match="got 51 patterns, expected 50"):
        checked_patterns(map(str, range(51)))
