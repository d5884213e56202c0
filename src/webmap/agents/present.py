"""The agents at a router, for commands that ask once and end. Waits for the network."""

import time
from collections.abc import Callable

import msgspec

from webmap.agents import address
from webmap.agents.description import MOST_OF_ABOUT, About
from webmap.agents.peer import peer_of
from webmap.base.errors import BridgeClosed, ConfigError, WireError
from webmap.ros.names import is_agent_url, normalise_url

LISTEN = 1.5
"""Seconds in which every agent that is there gives a sign."""

LOOK = 0.05
"""Seconds between two looks."""


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
        address.here(address.EVERY), lambda key, _: names.add(key.split("/")[1])
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
            time.sleep(LOOK)
            listened = 0.0 if peer.trouble else listened + LOOK
        trouble = peer.trouble
    finally:
        peer.unlisten(number)
    if trouble is not None:
        raise _closed(trouble, trouble)
    if not names:
        why = f"no agent is at {url}{peer.user.may_not}"
        raise _closed(
            why,
            f"{why}; start one beside the robot: webmap agent ws://localhost:9090 "
            f"--router {url} --name NAME",
        )
    return [f"{url}/{name}" for name in sorted(names)]


def _closed(why: str, text: str) -> BridgeClosed:
    closed = BridgeClosed(text)
    closed.why = why
    return closed


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
