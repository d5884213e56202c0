"""Which of several robots a part belongs to, by its name."""

import pytest

from webmap.base.scope import Scope
from webmap.features.layers.diagnostics import PartOwners


def owners(*namespaces: str) -> PartOwners:
    found = PartOwners()
    for namespace in namespaces:
        found.join(namespace)
    return found


@pytest.mark.parametrize(
    ("name", "whose"),
    [
        ("a/base: Motors", "own"),
        ("/a/base: Motors", "own"),
        ("/a/Power/Battery", "own"),
        ("a: Motors", "own"),
        ("/a", "own"),
        ("b/base: Motors", "another"),
        ("a/b/base: Motors", "another"),
        ("a1/base: Motors", "nobody"),
        ("base: Motors", "nobody"),
        ("/Group/a/base: Motors", "nobody"),
        ("base: port a/b", "nobody"),
        ("a base: Motors", "nobody"),
        ("", "nobody"),
    ],
)
def test_a_part_is_the_innermost_robots_whose_namespace_it_begins_with(name, whose):
    assert owners("a", "b", "a/b").whose(name, "a") == whose


def test_what_no_namespace_is_in_front_of_is_not_the_robots_that_has_none():
    found = owners("", "a")
    assert found.whose("base: Motors", "") == "nobody"
    assert found.whose("a/base: Motors", "") == "another"


def test_robots_of_the_same_namespace_are_one():
    """Each page may make a robot of its own for the same one."""
    assert owners("a", "a").whose("base: Motors", "a") == "own"


def test_who_leaves_counts_no_more_also_with_its_scope():
    found, scope = owners("a"), Scope("robot")
    with scope.active():
        found.join("b")
    assert found.whose("base: Motors", "a") == "nobody"
    scope.close()
    assert found.whose("base: Motors", "a") == "own"
