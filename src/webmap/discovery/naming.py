"""Unique names for robots behind several bridges."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from webmap.config.checks import same_name
from webmap.discovery.found import Findings


def unique_names(
    found: Sequence[tuple[str, Findings]],
) -> list[Findings]:
    """Return the findings, with a bridge's name added to names that are not unique.

    Args:
        found: The name and the findings of each bridge.

    """
    often = Counter(
        same_name(robot.name) for _, findings in found for robot in findings.robots
    )
    taken: set[str] = set()
    result = []
    for bridge, findings in found:
        robots = []
        for robot in findings.robots:
            name = robot.name
            if often[same_name(name)] > 1:
                name = f"{name} ({bridge})"
            robots.append(replace(robot, name=free_name(name, taken)))
        result.append(replace(findings, robots=tuple(robots)))
    return result


def free_name(wanted: str, taken: set[str]) -> str:
    """Return a name that is not taken, and add it to the taken ones.

    Args:
        wanted: The name; a number is appended if it is taken.
        taken: The taken names, as :func:`same_name` returns them.

    """
    name, number = wanted, 1
    while same_name(name) in taken:
        number += 1
        name = f"{wanted} {number}"
    taken.add(same_name(name))
    return name
