"""Tells the address of a Foxglove bridge from that of a rosbridge; both are ``ws://``."""

import asyncio
from collections.abc import Iterable
from urllib.parse import urlsplit, urlunsplit

from websockets.exceptions import WebSocketException

from webmap.ros.foxglove.protocol import SUBPROTOCOLS
from webmap.ros.sockets.connection import close_soon, connect_to

PATIENCE = 1.0
"""Longest wait for the answer of a bridge, in seconds."""


async def recognised(urls: Iterable[str]) -> list[str]:
    """Return the addresses; that of a Foxglove bridge begins with ``foxglove``.

    Only a Foxglove bridge answers with one of its subprotocols. An address where
    nothing answers is not changed.
    """
    return list(await asyncio.gather(*map(_recognised, urls)))


async def _recognised(url: str) -> str:
    if not url.startswith(("ws://", "wss://")):
        return url
    try:
        async with asyncio.timeout(PATIENCE):
            await close_soon(await connect_to(url, SUBPROTOCOLS))
    except (OSError, ValueError, WebSocketException):  # TimeoutError, too
        return url
    parts = urlsplit(url)
    place = parts.netloc
    if parts.port is None:  # the ports of the schemes differ
        place += ":443" if parts.scheme == "wss" else ":80"
    scheme = parts.scheme.replace("ws", "foxglove")
    return urlunsplit(parts._replace(scheme=scheme, netloc=place))
