"""What people may do: the roles, from the least to the greatest."""

from typing import Literal, get_args

Role = Literal["viewer", "operator", "admin"]

ROLES: tuple[Role, ...] = get_args(Role)


def covers(role: Role, least: Role) -> bool:
    """Return whether a role may do what needs at least another one."""
    return ROLES.index(role) >= ROLES.index(least)


def who_may(least: Role) -> str:
    """Return the sentence for a person whose role is not enough."""
    return f"Only {'an admin' if least == 'admin' else 'an operator'} may do this."
