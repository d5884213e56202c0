"""The socket that a server listens on, bound before anything else starts.

Bound first, so that a port in use is one sentence and not half a server.
"""

import os
import socket

from webmap.errors import ConfigError
from webmap.not_listening import why_not_listening
from webmap.server.origins import WILDCARD, is_loopback

_BACKLOG = 256
# A peer that acknowledges nothing for so long is gone, in milliseconds. Without it a
# stalled viewer's socket lingers for a quarter of an hour.
_USER_TIMEOUT_MS = 10_000


def check_exposure(host: str, *, insecure_lan: bool) -> None:
    """Refuse to be reached from other machines unless that was asked for.

    Raises:
        ConfigError: If ``host`` is not this machine alone and nobody said so.

    """
    if not is_loopback(host) and not insecure_lan:
        raise ConfigError(
            f"host {host!r} can be reached from other machines, and without TLS "
            "everybody on the way can read the token and drive the robots: keep "
            "127.0.0.1 and put a proxy with TLS or an SSH tunnel in front, or say "
            "insecure_lan=True (--insecure-lan) if you trust this network"
        )


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens.

    Args:
        host: A name or an address of this machine.
        port: From 0 to 65535; 0 lets the kernel choose.

    Raises:
        ConfigError: If that is not possible, with what would be.

    """
    if not 0 <= port <= 65535:
        raise ConfigError(f"a port is a number from 0 to 65535, got {port}")
    try:
        found = socket.getaddrinfo(
            host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )
    except (OSError, UnicodeError) as error:
        raise ConfigError(f"there is no host {host!r} to listen on") from error
    family, _, _, _, address = found[0]
    listener = socket.socket(family, socket.SOCK_STREAM)
    try:
        if os.name == "posix":
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if hasattr(socket, "TCP_USER_TIMEOUT"):
            listener.setsockopt(
                socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _USER_TIMEOUT_MS
            )
        listener.bind(address)
        listener.listen(_BACKLOG)
    except OSError as error:
        listener.close()
        raise ConfigError(why_not_listening(host, port, error)) from error
    return listener


def url_of(listener: socket.socket, host: str) -> str:
    """Return the URL at which a browser on this machine finds a listening socket."""
    name = "127.0.0.1" if host in WILDCARD else host
    bracketed = f"[{name}]" if ":" in name else name
    return f"http://{bracketed}:{listener.getsockname()[1]}/"
