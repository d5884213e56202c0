"""How agents make themselves known: signs, and descriptions of their robots.

An agent repeats its sign, a :class:`Beacon`, at the router, and answers with
:class:`About` whoever asks for its description. Commands that ask once and end find
agents by :func:`agents_behind`, which waits for the network.
"""

import time
from collections.abc import Callable
from typing import Any

import msgspec

from webmap.agents import address
from webmap.agents.peer import peer_of
from webmap.base.errors import BridgeClosed, ConfigError, WireError
from webmap.base.nesting import is_too_deep
from webmap.config.robot import RobotConfig
from webmap.ros.names import is_agent_url, normalise_url

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

LISTEN = 1.5
"""Seconds in which every agent that is there gives a sign."""

CHECK = 0.05
"""Seconds between two checks."""


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
    if is_too_deep(robot, DEEPEST):
        raise ConfigError(f"got values nested deeper than {DEEPEST} levels")
    return RobotConfig.from_dict(robot)


def agents_behind(
    url: str, *, wait: float, waiting: Callable[[str], object] = lambda _why: None
) -> list[str]:
    """Return the addresses of the agents that an address names.

    Args:
        url: The address of a router, which names all its agents, of an agent, or of a
            rosbridge; the latter two name themselves.
        wait: How long to wait for the router and a first agent, in seconds.
        waiting: Called once with the reason when waiting begins.

    Raises:
        BridgeClosed: If the router cannot be reached, or no agent is there.

    """
    url = normalise_url(url)
    if not is_agent_url(url) or address.agent_in(url) is not None:
        return [url]
    peer = peer_of(url)
    names: set[str] = set()
    number = peer.listen(
        address.beacon(address.EVERY), lambda key, _: names.add(key.split("/")[1])
    )
    began, listened, reported = time.monotonic(), 0.0, False
    try:
        while listened < LISTEN or not names:
            waited = time.monotonic() - began
            nobody = f"no agent is at {url} yet{peer.user.may_not}"
            why = peer.trouble or (None if names else nobody)
            if why is not None and waited > max(wait, LISTEN):
                break
            if why is not None and waited > LISTEN and not reported:
                reported = True
                waiting(why)
            time.sleep(CHECK)
            listened = 0.0 if peer.trouble else listened + CHECK
        trouble = peer.trouble
    finally:
        peer.unlisten(number)
    if trouble is not None:
        raise BridgeClosed(trouble, trouble)
    if not names:
        why = f"no agent is at {url}{peer.user.may_not}"
        raise BridgeClosed(
            f"{why}; start one beside the robot: webmap agent ws://localhost:9090 "
            f"--router {url} --name NAME",
            why,
        )
    return [f"{url}/{name}" for name in sorted(names)]


def one_agent(
    url: str, *, wait: float, waiting: Callable[[str], object] = lambda _why: None
) -> str:
    """Return the address of a rosbridge or of an agent; of a router, its only agent.

    Args:
        url: The address.
        wait: As for :func:`agents_behind`.
        waiting: As for :func:`agents_behind`.

    Raises:
        BridgeClosed: If the router cannot be reached, or no agent is there.
        ConfigError: If several are there.

    """
    found = agents_behind(url, wait=wait, waiting=waiting)
    if len(found) > 1:
        raise ConfigError(
            f"got the router {url} with {len(found)} agents, expected the address of "
            f"one of them: {', '.join(found)}"
        )
    return found[0]


def about_agent(url: str) -> About | None:
    """Return the description of an agent; None if it gives none."""
    key = address.about(address.agent_in(url) or "")
    try:
        answer = peer_of(url).ask(key, most=MOST_OF_ABOUT)
        return None if answer is None else msgspec.json.decode(answer, type=About)
    except (ValueError, RecursionError, WireError):
        return None
