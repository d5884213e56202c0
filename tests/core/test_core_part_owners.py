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
    ("name", "owner"),
    [
        ("a/base: Motors", "own"),
        ("/a/base: Motors", "own"),
        ("/a/Power/Battery", "own"),
        ("a: Motors", "own"),
        ("/a", "own"),
        ("b/base: Motors", "another"),
        ("a/b/base: Motors", "another"),
        ("a1/base: Motors", "unknown"),
        ("base: Motors", "unknown"),
        ("/Group/a/base: Motors", "unknown"),
        ("base: port a/b", "unknown"),
        ("a base: Motors", "unknown"),
        ("", "unknown"),
    ],
)
def test_a_part_is_the_innermost_robots_whose_namespace_it_begins_with(name, owner):
    assert owners("a", "b", "a/b").owner(name, "a") == owner


def test_what_no_namespace_is_in_front_of_is_not_the_robots_that_has_none():
    found = owners("", "a")
    assert found.owner("base: Motors", "") == "unknown"
    assert found.owner("a/base: Motors", "") == "another"


def test_robots_of_the_same_namespace_are_one():
    """Each page may make a robot of its own for the same one."""
    assert owners("a", "a").owner("base: Motors", "a") == "own"


def test_who_leaves_counts_no_more_also_with_its_scope():
    found, scope = owners("a"), Scope("robot")
    with scope.active():
        found.join("b")
    assert found.owner("base: Motors", "a") == "unknown"
    scope.close()
    assert found.owner("base: Motors", "a") == "own"
