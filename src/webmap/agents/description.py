"""The description of an agent and of its robots, which displays receive."""

from typing import Any

import msgspec

from webmap.base.errors import ConfigError
from webmap.config.robot import RobotConfig

PROTOCOL = 3
"""The version of what agents and displays exchange."""

MOST_OF_ABOUT = 2 << 20
"""The longest description, in bytes."""

MOST_OF_ROBOT = 64 << 10
"""The longest description of one robot, in bytes."""

MOST_ROBOTS = 200
"""The greatest number of robots of one agent that a display shows."""

MOST_GRIDS = 20
"""The greatest number of maps under the robots of one agent."""

DEEPEST = 32
"""How deep lists and tables of one robot are nested at most."""

MOST_OF_BEACON = 256
"""The longest sign of an agent, in bytes."""


class Beacon(msgspec.Struct, frozen=True):
    """The sign that an agent is there."""

    protocol: int
    session: str
    about: str
    """Changes whenever the description of the robots changes."""


class About(msgspec.Struct, frozen=True):
    """The description of the robots of an agent."""

    bridges: list[str]
    """The names of the agent's bridge in the configurations."""
    robots: list[msgspec.Raw]
    """The configuration of each robot; its identifier follows from its name."""
    grids: list[tuple[str, dict[str, Any]]]
    """The topics of maps under the robots, with their options."""
    alignment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The pose of the maps of all robots on the common one: metres and degrees."""
    open_at: list[str] | None = None
    """Where other computers may reach the agent's rosbridge; None if it is unknown."""


def read_beacon(piece: bytes) -> Beacon | None:
    """Return the beacon in a message; None if it is none."""
    if len(piece) > MOST_OF_BEACON:
        return None
    try:
        return msgspec.json.decode(piece, type=Beacon)
    except ValueError:
        return None


def read_about(answer: bytes) -> tuple[About, dict[str, RobotConfig], list[str]]:
    """Return what an agent describes, its robots by name, and why others are left out.

    Raises:
        ConfigError: If the answer is no description.

    """
    try:
        about = msgspec.json.decode(answer, type=About)
    except (ValueError, RecursionError) as error:
        raise ConfigError(str(error)) from error
    robots: dict[str, RobotConfig] = {}
    mistakes = []
    for number, raw in enumerate(about.robots[:MOST_ROBOTS], 1):
        try:
            config = _read_robot(bytes(raw))
            if config.name in robots:
                raise ConfigError(f"a second robot has the name {config.name!r}")
            robots[config.name] = config
        except (ConfigError, ValueError, RecursionError) as error:
            mistakes.append(f"robot {number} is not shown: {error}")
    if len(about.robots) > MOST_ROBOTS:
        count = f"got {len(about.robots)} robots, expected {MOST_ROBOTS} at most"
        mistakes.append(f"only the first robots are shown: {count}")
    return about, robots, mistakes


def _read_robot(text: bytes) -> RobotConfig:
    if len(text) > MOST_OF_ROBOT:
        raise ConfigError(f"got {len(text)} bytes, expected {MOST_OF_ROBOT} at most")
    robot = msgspec.json.decode(text, type=dict[str, Any])
    if _depth(robot) > DEEPEST:
        raise ConfigError(f"got values nested deeper than {DEEPEST} levels")
    return RobotConfig.from_dict(robot)


def _depth(value: Any) -> int:
    if not isinstance(value, dict | list):
        return 0
    inside = value.values() if isinstance(value, dict) else value
    return 1 + max(map(_depth, inside), default=0)
