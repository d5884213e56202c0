"""What people may do: the roles, from the least to the greatest, and with which robots.

The robots are patterns: ``bay2/*`` for names of robots, ``tag:bay 2`` for their tags.
"""

from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import Literal, get_args

from webmap.base.errors import ConfigError

Role = Literal["viewer", "operator", "admin"]

ROLES: tuple[Role, ...] = get_args(Role)


def covers(role: Role, least: Role) -> bool:
    """Return whether a role may do what needs at least another one."""
    return ROLES.index(role) >= ROLES.index(least)


def who_may(least: Role) -> str:
    """Return the sentence for a person whose role is not enough."""
    return f"Only {'an admin' if least == 'admin' else 'an operator'} may do this."


ALL_ROBOTS = ("*",)
"""The patterns of a person who may drive every robot."""

TAG = "tag:"
"""What a pattern for the tags of robots begins with."""

MOST_PATTERNS, LONGEST_PATTERN = 50, 100

NOT_YOURS = "You may look at this robot and press STOP. Its own operators can drive it."
"""The refusal for an operator of other robots."""


def checked_patterns(patterns: Iterable[str]) -> tuple[str, ...]:
    """Return the patterns of the robots of a person; all robots if there are none.

    Raises:
        ConfigError: If a pattern is not valid.

    """
    checked = tuple(dict.fromkeys(patterns)) or ALL_ROBOTS
    if len(checked) > MOST_PATTERNS:
        raise ConfigError(f"got {len(checked)} patterns, expected {MOST_PATTERNS}")
    for pattern in checked:
        plain = pattern.removeprefix(TAG)
        if not (plain and pattern.isprintable() and len(pattern) <= LONGEST_PATTERN):
            raise ConfigError(
                "a pattern of robots is 'bay2/*' for their names or 'tag:bay 2' for "
                f"their tags, with {LONGEST_PATTERN} characters at most: got "
                f"{pattern[:LONGEST_PATTERN]!r}"
            )
    return checked


def includes(patterns: Iterable[str], name: str, tags: Iterable[str]) -> bool:
    """Return whether the patterns of a person include a robot."""
    return any(
        any(fnmatchcase(tag, pattern.removeprefix(TAG)) for tag in tags)
        if pattern.startswith(TAG)
        else fnmatchcase(name, pattern)
        for pattern in patterns
    )
