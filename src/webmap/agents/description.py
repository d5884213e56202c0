"""The description of an agent and of its robots, which displays receive."""

from typing import Any

import msgspec

PROTOCOL = 3
"""The version of what agents and displays exchange."""


class Beacon(msgspec.Struct, frozen=True):
    """The sign that an agent is there."""

    protocol: int
    session: str
    about: str
    """Changes whenever the description of the robots changes."""


class AgentRobot(msgspec.Struct, frozen=True):
    """A robot of an agent."""

    id: str
    config: dict[str, Any]


class About(msgspec.Struct, frozen=True):
    """The description of the robots of an agent."""

    bridges: list[str]
    """The names of the agent's bridge in the configurations."""
    robots: list[AgentRobot]
    grids: list[tuple[str, dict[str, Any]]]
    """The topics of maps under the robots, with their options."""
    alignment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The pose of the maps of all robots on the common one: metres and degrees."""
    open_at: list[str] | None = None
    """Where other computers may reach the agent's rosbridge; None if it is unknown."""


def read_beacon(piece: bytes) -> Beacon | None:
    """Return the beacon in a message; None if it is none."""
    try:
        return msgspec.json.decode(piece, type=Beacon)
    except msgspec.DecodeError:
        return None
