"""The name of a part shows which of several robots it belongs to."""

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
def test_a_part_belongs_to_the_robot_with_the_longest_matching_namespace(name, owner):
    assert owners("a", "b", "a/b").owner(name, "a") == owner


def test_a_part_without_a_namespace_does_not_belong_to_a_robot_without_one():
    found = owners("", "a")
    assert found.owner("base: Motors", "") == "unknown"
    assert found.owner("a/base: Motors", "") == "another"


def test_robots_of_the_same_namespace_count_as_one():
    """Each page may make its own object for the same robot."""
    assert owners("a", "a").owner("base: Motors", "a") == "own"


def test_a_robot_does_not_count_after_its_scope_is_closed():
    found, scope = owners("a"), Scope("robot")
    with scope.active():
        found.join("b")
    assert found.owner("base: Motors", "a") == "unknown"
    scope.close()
    assert found.owner("base: Motors", "a") == "own"
