"""Zenoh's router in this process: its configuration, from a file of users.

A router without users serves this computer alone. With users it is closed: an agent may
send as itself only, and a display may reach only the agents that its user may drive.
"""

import os
import socket
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from webmap.agents.address import (
    EVERY,
    beacon,
    checked_name,
    gate_in,
    locator,
)
from webmap.agents.gate_messages import MOST_SAMPLE
from webmap.agents.peer import MOST_BYTES
from webmap.base.errors import ConfigError
from webmap.base.tls import TlsFiles
from webmap.base.zenoh_sessions import zenoh_config

if TYPE_CHECKING:
    import zenoh

MOST_SESSIONS = 10_000
"""Sessions of a router; each agent and each display has three."""

LOOPBACK = ("127.0.0.1", "[::1]", "localhost")


class UserEntry(msgspec.Struct, forbid_unknown_fields=True):
    """One user: an agent, or a display with the agents that it reaches."""

    password: str
    agent: str = ""
    """The agent that this user is; "" for a display."""
    drives: list[str] = []
    """The agents that displays of this user reach; ``*`` for all."""


class Users(msgspec.Struct, forbid_unknown_fields=True):
    """The file of users: a table ``[users.NAME]`` for each."""

    users: dict[str, UserEntry]


def read_users(file: Path) -> dict[str, UserEntry]:
    """Return the users of a file.

    Raises:
        ConfigError: If the file has a mistake.
        OSError: If it cannot be read.

    """
    try:
        users = msgspec.toml.decode(file.read_bytes(), type=Users).users
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{file}: {error}") from None
    for name, user in users.items():
        checked_name(name, "user")
        for agent in (user.agent, *user.drives):
            if agent not in ("", "*"):
                checked_name(agent)
        if not user.password or ":" in name or "\n" in user.password:
            raise ConfigError(f"{file}: the user {name} has no password of one line")
        if bool(user.agent) == bool(user.drives):
            raise ConfigError(
                f'{file}: the user {name} needs either "agent", the agent that it is, '
                'or "drives", the agents that it reaches'
            )
    return users


def is_loopback_locator(place: str) -> bool:
    """Return whether only this computer reaches a locator."""
    host = place.partition("/")[2].rpartition(":")[0]
    return host in LOOPBACK


def free_port(place: str) -> str:
    """Return a locator with a free port in place of port 0."""
    transport, _, rest = place.partition("/")
    host, _, port = rest.rpartition(":")
    if port != "0":
        return place
    family = socket.AF_INET6 if host.startswith("[") else socket.AF_INET
    with socket.socket(family) as probe:
        probe.bind((host.strip("[]"), 0))
        return f"{transport}/{host}:{probe.getsockname()[1]}"


def router_settings(
    listen: str,
    users: Mapping[str, UserEntry] | None,
    *,
    files: TlsFiles | None = None,
    insecure_lan: bool = False,
) -> dict[str, Any]:
    """Return the configuration of a router.

    Args:
        listen: The locator to listen on.
        users: The users; None lets everybody in.
        files: The certificate of the router, for TLS.
        insecure_lan: Whether other computers may connect without TLS or users.

    Raises:
        ConfigError: If other computers could connect without TLS or users, or the
            files for TLS are missing.

    """
    place = free_port(locator(listen))
    tls = place.startswith("tls/")
    if tls and files is None:
        raise ConfigError(f"{place}: TLS needs --tls, or --tls-cert and --tls-key")
    if files is not None and not tls:
        raise ConfigError(f"{place} is without TLS: expected tls/HOST:PORT")
    if not is_loopback_locator(place) and not (tls and users) and not insecure_lan:
        raise ConfigError(
            f"{place} can be reached from other computers: use tls/ and --users, or "
            "--insecure-lan if you trust this network"
        )
    transport: dict[str, Any] = {
        "shared_memory": {"enabled": False},
        "unicast": {"max_sessions": MOST_SESSIONS},
        "link": {"rx": {"max_message_size": MOST_BYTES}},
    }
    if files is not None:
        transport["link"]["tls"] = {
            "listen_certificate": str(files.certificate),
            "listen_private_key": str(files.key),
        }
    settings: dict[str, Any] = {
        "mode": "router",
        "listen": {"endpoints": [place]},
        "transport": transport,
        "low_pass_filter": [
            {
                "flows": ["ingress"],
                "messages": ["put"],
                "key_exprs": [f"{gate_in(EVERY, EVERY, EVERY)}/*"],
                "size_limit": MOST_SAMPLE,
            }
        ],
    }
    if users is not None:
        transport["auth"] = {"usrpwd": {"dictionary_file": _dictionary(users)}}
        settings["access_control"] = access_rules(users)
    return settings


def open_router(
    listen: str, users: Mapping[str, UserEntry] | None, **options: Any
) -> "tuple[zenoh.Session, str]":
    """Run a router in this process, until its session is closed.

    Another program may take the free port that port 0 became, so the router then tries
    two others.

    Args:
        listen: The locator to listen on.
        users: The users; None lets everybody in.
        **options: The other arguments of :func:`router_settings`.

    Returns:
        The session, and the locator with its port.

    Raises:
        ConfigError: As :func:`router_settings`, or if Zenoh is not installed, or the
            router cannot listen.

    """
    attempts = 3 if locator(listen).endswith(":0") else 1
    while True:
        settings = router_settings(listen, users, **options)
        attempts -= 1
        try:
            return _open_session(settings), settings["listen"]["endpoints"][0]
        except ConfigError:
            if not attempts:
                raise


def _open_session(settings: dict[str, Any]) -> "zenoh.Session":
    passwords = settings["transport"].get("auth", {}).get("usrpwd")
    try:
        config = zenoh_config(**settings)
        import zenoh

        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            (place,) = settings["listen"]["endpoints"]
            text = str(error).partition(" at /")[0]
            raise ConfigError(f"the router cannot listen on {place}: {text}") from None
    finally:
        if passwords is not None:  # Zenoh has read them
            Path(passwords["dictionary_file"]).unlink()


def _dictionary(users: Mapping[str, UserEntry]) -> str:
    """Write the passwords for Zenoh into a file that only this user reads."""
    number, name = tempfile.mkstemp(prefix="webmap-router-")
    with os.fdopen(number, "w") as file:
        for user, entry in users.items():
            file.write(f"{user}:{entry.password}\n")
    return name


def access_rules(users: Mapping[str, UserEntry]) -> dict[str, Any]:
    """Return Zenoh's ``access_control``; what no rule allows is denied."""
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    for user, entry in users.items():
        sends, gets = _keys_of_agent(entry.agent), _keys_for_agent(entry.agent)
        names, asks = gets, list[str]()
        answers = [f"webmap/{entry.agent}/about/**"]
        if not entry.agent:
            agents = ["*"] if "*" in entry.drives else entry.drives
            sends = [key for each in agents for key in _keys_of_display(each, user)]
            gets = [key for each in agents for key in _keys_for_display(each, user)]
            asks, answers = [f"webmap/{each}/about/**" for each in agents], []
            names = [*gets, beacon(EVERY)]  # it finds only those that it reaches
        rows = [
            ("sends", "put", "ingress", sends),
            ("gets", "put", "egress", gets),
            ("subscribes", "declare_subscriber", "ingress", names),
            ("told", "declare_subscriber", "egress", sends),
            ("asks", "query", "ingress", asks),
            ("answered", "reply", "egress", asks),
            ("finds", "declare_queryable", "egress", asks),
            ("offers", "declare_queryable", "ingress", answers),
            ("asked", "query", "egress", answers),
            ("replies", "reply", "ingress", answers),
        ]
        found = [
            {
                "id": f"{user}-{what}",
                "messages": [message],
                "flows": [flow],
                "permission": "allow",
                "key_exprs": keys,
            }
            for what, message, flow, keys in rows
            if keys
        ]
        rules += found
        policies.append({"rules": [rule["id"] for rule in found], "subjects": [user]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": user, "usernames": [user]} for user in users],
        "policies": policies,
    }


def _keys_of_agent(agent: str) -> list[str]:
    root = f"webmap/{agent}"
    return [
        f"{root}/here",
        f"{root}/gate/out/*",
        f"{root}/data/out/**",
        f"{root}/topics/**",
        f"{root}/pictures/out/**",
        f"{root}/pictures/of/*",
    ]


def _keys_for_agent(agent: str) -> list[str]:
    root = f"webmap/{agent}"
    ins = [f"{root}/{kind}/in/**" for kind in ("gate", "data", "pictures")]
    return [f"{root}/here", *ins]


def _keys_of_display(agent: str, user: str) -> list[str]:
    root = f"webmap/{agent}"
    return [
        f"{root}/gate/in/{user}/*/*",
        f"{root}/data/in/{user}/*/*",
        f"{root}/pictures/in/{user}/*",
    ]


def _keys_for_display(agent: str, user: str) -> list[str]:
    root = f"webmap/{agent}"
    return [
        f"{root}/here",
        f"{root}/gate/out/*",
        f"{root}/data/out/{user}/*/*",
        f"{root}/topics/**",
        f"{root}/pictures/out/{user}/*",
        f"{root}/pictures/of/*",
    ]
