"""Requests that come through a reverse proxy: where from, under which address, and who.

A proxy states this in headers, which anybody else can send too. So they count only if
the connection itself comes from an address that the configuration names.
"""

import hashlib
import ipaddress
import json
import logging
import re
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias, cast, get_args

from starlette.types import Scope

from webmap.base.errors import ConfigError
from webmap.base.roles import ALL_ROBOTS, Role, checked_patterns
from webmap.core.operators import MOST_NAME, RESERVED, Viewer, likeness, plain_name
from webmap.server.origins import checked_origin, ip_of, same_origin

log = logging.getLogger("webmap.server")

Network: TypeAlias = ipaddress.IPv4Network | ipaddress.IPv6Network

TRUSTED = "webmap.trusted_proxy"
"""The key of a scope: whether the connection comes from a proxy that is trusted."""

LIFE_S = 180.0
"""Seconds that a sign-in at a proxy lasts after a request. A page sends one a minute,
so that the proxy, and what it asks, decide again."""

MOST_SEEN = 1000
"""People whose sign-in is remembered; who was seen longest ago must load again."""

_PREFIXES = b"x-forwarded-prefix", b"x-forwarded-context", b"x-proxycontextpath"
_PUBLIC = re.compile(r"(https?://[^/?#@\s]+)((?:/[^/?#\s]+)*)/?", re.IGNORECASE)
_BASE = re.compile(r"(?:/(?!\.\.?(?:/|$))[\w.~!$&'()*+,;=:@-]+)*", re.ASCII)
_HEADER = re.compile(r"[A-Za-z0-9-]{1,64}")


@dataclass(frozen=True, slots=True)
class Proxies:
    """The address at which browsers see WebMap, and the proxies that are trusted."""

    origin: str = ""
    """Scheme, host and port that browsers see, as checked; empty if not stated."""

    base: str = ""
    """The path under which browsers see WebMap there, without a slash at its end."""

    trusted: tuple[Network, ...] = ()
    """The addresses whose forwarded headers count."""

    @classmethod
    def of(cls, public_url: str = "", trusted: Iterable[str] = ()) -> "Proxies":
        """Return the proxies of a configuration.

        Args:
            public_url: The address that browsers see, such as
                ``https://example.com/robots``.
            trusted: Addresses or networks of proxies.

        Raises:
            ConfigError: If one is not valid.

        """
        match = _PUBLIC.fullmatch(public_url)
        if public_url and (match is None or not _BASE.fullmatch(match[2])):
            raise ConfigError(
                "the public URL is the address that browsers see, as "
                f"'https://example.com/robots': got {public_url!r}"
            )
        networks = []
        for each in trusted:
            try:
                networks.append(ipaddress.ip_network(each))
            except ValueError:
                raise ConfigError(
                    "a trusted proxy is an address or a network, as '127.0.0.1' or "
                    f"'10.0.0.0/24': got {each!r}"
                ) from None
        origin = checked_origin(match[1]) if match else ""
        return cls(origin, match[2] if match else "", tuple(networks))

    @property
    def names(self) -> list[str]:
        """The name of the host that browsers see, without its port, if it is stated."""
        host = self.origin.partition("://")[2]
        return [re.sub(r":\d+$", "", host)] if host else []

    def trusts(self, address: str) -> bool:
        """Return whether headers of a connection from an address count."""
        ip = ip_of(address)
        return ip is not None and any(ip in network for network in self.trusted)

    def seen(self, scope: Scope) -> Scope:
        """Return the scope of a request as the browser sees it."""
        trusted = self.trusts((scope.get("client") or ("",))[0])
        scope = {**scope, TRUSTED: trusted}
        base = self._forwarded(scope) if trusted else ""
        host = _only(scope["headers"], b"host")
        secure = self.origin.startswith("https:")
        if same_origin(self.origin, secure=secure, host=host):
            base = self.base
            _set_scheme(scope, secure=secure)
        if base:
            path = scope["path"]
            if path != base and not path.startswith(f"{base}/"):
                scope["path"] = base + path  # the proxy has removed it
            scope["root_path"] = base
        return scope

    def _forwarded(self, scope: Scope) -> str:
        """Apply the headers of a trusted proxy; return the base path that it states."""
        headers: list[tuple[bytes, bytes]] = scope["headers"]
        proto, host = (_only(headers, b"x-forwarded-" + k) for k in (b"proto", b"host"))
        if proto in ("http", "https"):
            _set_scheme(scope, secure=proto == "https")
        if host:
            others = [(key, value) for key, value in headers if key != b"host"]
            scope["headers"] = [*others, (b"host", host.encode("latin-1"))]
        lists = [v.decode("latin-1") for k, v in headers if k == b"x-forwarded-for"]
        hops = [hop.strip() for hop in ",".join(lists).split(",")]
        # The client states the first ones, and each proxy adds one at the end.
        client = next((hop for hop in reversed(hops) if not self.trusts(hop)), "")
        ip = ip_of(client)
        if ip is not None:
            scope["client"] = (str(ip), 0)
        base = next(filter(None, (_only(headers, name) for name in _PREFIXES)), "")
        return base.rstrip("/") if _BASE.fullmatch(base.rstrip("/")) else ""


def _set_scheme(scope: Scope, *, secure: bool) -> None:
    plain = "ws" if scope["type"] == "websocket" else "http"
    scope["scheme"] = plain + "s" * secure


def _only(headers: Iterable[tuple[bytes, bytes]], name: bytes) -> str:
    """Return the value of a header; empty if there are several."""
    values = [value.decode("latin-1").strip() for key, value in headers if key == name]
    return values[0] if len(values) == 1 and "," not in values[0] else ""


@dataclass(frozen=True, slots=True)
class Grant:
    """What the people of a group may do."""

    group: str
    """``*`` is everybody who has signed in."""
    role: Role
    robots: tuple[str, ...] = ALL_ROBOTS

    @classmethod
    def read(cls, text: str) -> "Grant":
        """Return what ``GROUP=ROLE`` or ``GROUP=ROLE:PATTERN,...`` states.

        Raises:
            ConfigError: If it has another form.

        """
        group, _, right = text.rpartition("=")
        role, colon, robots = right.partition(":")
        if not group or role not in get_args(Role):
            raise ConfigError(
                "a role of a group is 'GROUP=viewer', 'GROUP=admin' or, for some "
                f"robots, 'GROUP=operator:bay2/*,tag:lift': got {text!r}"
            )
        patterns = robots.split(",") if colon else ALL_ROBOTS
        return cls(group, cast(Role, role), checked_patterns(patterns))


@dataclass(slots=True)
class ProxyUsers:
    """People who have signed in at a proxy, by the headers that it sends.

    An ``authenticate`` function of the server, and the memory of who was seen last.
    """

    user_header: str
    grants: tuple[Grant, ...]
    """The first one of a person's groups counts."""
    groups_header: str = ""
    sign_out_url: str = ""
    """Where a person signs out; empty if the page has no such button."""
    now: Callable[[], float] = time.monotonic
    _seen: OrderedDict[str, tuple[str, float]] = field(default_factory=OrderedDict)
    """By person, the id of the newest viewer, and when there was a request."""

    def __post_init__(self) -> None:
        """Check the configuration.

        Raises:
            ConfigError: If a header or the address is not valid, or there is no role.

        """
        for header in filter(None, (self.user_header, self.groups_header)):
            if not _HEADER.fullmatch(header):
                raise ConfigError(
                    f"a header has letters, digits and '-', got {header!r}"
                )
        if not self.grants:
            raise ConfigError(
                "nobody could sign in: state who may do what, as "
                "--proxy-role '*=viewer'"
            )
        if self.sign_out_url and not re.match(r"https?://|/", self.sign_out_url):
            raise ConfigError(
                "the address to sign out begins with https:// or /, got "
                f"{self.sign_out_url!r}"
            )

    def __call__(self, scope: Mapping[str, Any]) -> Viewer | None:
        """Return who makes a request; None if the proxy does not state it clearly."""
        found = _Stated(scope["headers"])
        why = found.trouble(self.user_header, self.groups_header)
        if why is None and found.sent and not scope.get(TRUSTED):
            why = "the connection does not come from a trusted proxy"
        if why is None and found.sent:
            name = found.value(self.user_header)
            shown = plain_name(name, MOST_NAME)
            if not likeness(shown) or likeness(shown) in RESERVED or len(name) > 256:
                why = "other people could not tell whose name it is"
        if why is not None:
            peer = (scope.get("client") or ("an unknown address",))[0]
            log.warning("refused a sign-in header from %s: %s", peer, why)
        if why is not None or not found.sent:
            return None
        groups = {each.strip() for each in found.value(self.groups_header).split(",")}
        right = next((g for g in self.grants if g.group in {"*", *groups}), None)
        person = _hash(name)
        self._seen.pop(person, None)
        if right is None:
            return None
        # Another right is another viewer: the sockets of the earlier one end.
        id = f"{person}.{_hash(json.dumps((right.role, right.robots)))}"
        self._seen[person] = id, self.now()
        if len(self._seen) > MOST_SEEN:
            self._seen.popitem(last=False)
        signs_out = bool(self.sign_out_url)
        return Viewer(id, shown, right.role, signs_out, right.robots)

    def lasts(self, id: str) -> bool:
        """Return whether a viewer was seen lately, with the same rights."""
        newest, at = self._seen.get(id.partition(".")[0], ("", 0.0))
        return newest == id and self.now() - at < LIFE_S


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


class _Stated:
    """The headers of a request, by names in which "_" counts as "-"."""

    def __init__(self, headers: Iterable[tuple[bytes, bytes]]) -> None:
        self._headers = [(k.decode("latin-1").lower(), v) for k, v in headers]
        self.sent = False
        """Whether there is a header with the name of a person."""

    def trouble(self, user: str, groups: str) -> str | None:
        """Return why the headers do not count; None if they are clear, or not there."""
        for header in filter(None, (user.lower(), groups.lower())):
            like = [
                name for name, _ in self._headers if name.replace("_", "-") == header
            ]
            if len(like) > 1 or like not in ([], [header]):
                return f"got {header} more than once, or in another spelling"
            self.sent |= bool(like) and header == user.lower()
        return None

    def value(self, header: str) -> str:
        """Return the value of a header; empty if there is none."""
        values = [value for name, value in self._headers if name == header.lower()]
        return values[0].decode("utf-8", "replace").strip() if values else ""
