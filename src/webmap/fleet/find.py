"""Queries several bridges at once for the robots behind them."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from webmap.base.echo import echo
from webmap.base.errors import BridgeClosed, BridgeError
from webmap.discovery import Findings, discover
from webmap.discovery.frame_listening import receive_frames
from webmap.discovery.naming import free_name, unique_names
from webmap.discovery.robots import host_name
from webmap.ros.names import agent_named
from webmap.ros.temporary_bridge import ask_topics

LIST_ROBOTS = (
    "List each robot with --robot NAME:ODOM:CMD_VEL:SCAN, "
    "as in --robot Bob:/odom:/cmd_vel:/scan; "
    "or give webmap discover a list of the topics with --topics"
)


@dataclass(frozen=True, slots=True)
class Found:
    """The robots behind one bridge, or why they are unknown."""

    url: str
    label: str
    """A short name for the bridge, unlike all others."""

    findings: Findings
    trouble: BridgeError | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    """Types by topic, as listed by the bridge or given by the user."""

    @property
    def why(self) -> str:
        """Why no robot was found, and what to do, for people; empty if some were."""
        if self.findings.robots:
            return ""
        if isinstance(self.trouble, BridgeClosed):
            return f"{self.trouble}."
        if self.trouble is not None:
            reason = f"the bridge has no rosapi that lists its topics: {self.trouble}"
        else:
            reason = " ".join(self.findings.notes).rstrip(".")
        return f"{self.url}: {reason}. {LIST_ROBOTS}"


async def find(
    urls: Sequence[str], *, wait: float, topics: Mapping[str, str] | None = None
) -> list[Found]:
    """Return the robots behind each bridge; all their names differ.

    Prints on standard error that it waits for a bridge.

    Args:
        urls: The bridges' addresses.
        wait: How long to wait for an unreachable bridge, in seconds.
        topics: Types by topic, if the bridge does not list them.

    """
    if topics is None:
        asked = await asyncio.gather(*(_ask(url, wait) for url in urls))
    else:
        asked = [(await _behind(url, topics), topics, None) for url in urls]
    names = labels(urls)
    named = unique_names(
        [(name, one) for name, (one, _, _) in zip(names, asked, strict=True)]
    )
    return [
        Found(url, label, findings, trouble, listed)
        for url, label, findings, (_, listed, trouble) in zip(
            urls, names, named, asked, strict=True
        )
    ]


def labels(urls: Sequence[str]) -> list[str]:
    """Return a name for each bridge: its agent, or its host.

    The port is added if others have the same name.
    """
    parts = [urlsplit(url) for url in urls]
    hosts = [
        agent_named(url) or part.hostname or "robot"
        for url, part in zip(urls, parts, strict=True)
    ]
    names = [
        host if hosts.count(host) == 1 or part.port is None else f"{host}:{part.port}"
        for host, part in zip(hosts, parts, strict=True)
    ]
    taken: set[str] = set()
    return [free_name(name, taken) for name in names]


async def _ask(
    url: str, wait: float
) -> tuple[Findings, Mapping[str, str], BridgeError | None]:
    def waiting(why: str) -> None:
        echo(f"Waiting for the rosbridge at {url}: {why}", err=True)

    try:
        topics = await ask_topics(url, wait=wait, waiting=waiting)
    except BridgeError as error:
        return Findings(), {}, error
    return await _behind(url, topics), topics, None


async def _behind(url: str, topics: Mapping[str, str]) -> Findings:
    return discover(topics, host_name(url), await receive_frames(url, topics))
