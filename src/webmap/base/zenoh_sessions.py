"""The settings of sessions with a Zenoh router, and why one cannot be opened.

Zenoh reports only that a router cannot be reached: :func:`why_not_reached` finds the
reason.
"""

import json
import re
import socket
import ssl
from typing import TYPE_CHECKING, Any

from webmap.base.errors import ConfigError

if TYPE_CHECKING:
    import zenoh

OPENING = 4.0
"""Seconds for the router to open a session."""

_OF_AUTHORITY = re.compile(
    rb"\x06\x03\x55\x1d\x13(\x01\x01\xff)?\x04.\x30.\x01\x01\xff", re.DOTALL
)
"""The part of a certificate with ``basicConstraints`` and ``CA:TRUE``."""

PATIENCE = 2.0
"""Seconds for an answer."""


def zenoh_config(**settings: Any) -> "zenoh.Config":
    """Return a configuration that finds nobody by itself and shares no memory.

    Raises:
        ConfigError: If Zenoh is not installed.

    """
    try:
        import zenoh
    except ImportError:
        raise ConfigError(
            "Zenoh is needed and not installed: pip install 'webmap[fleet]'"
        ) from None
    closed = {
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
    }
    return zenoh.Config.from_json5(json.dumps({**closed, **settings}))


def client_settings(
    endpoint: str, most: int, user: str = "", password: str = "", ca: str = ""
) -> dict[str, Any]:
    """Return the settings of a session with a router.

    Args:
        endpoint: The router's locator.
        most: Bytes of the largest message that the session receives.
        user: The name of the user.
        password: The password; "" without users.
        ca: The file with the certificate of the router's authority; "" for those that
            the system knows.

    """
    settings: dict[str, Any] = {
        "mode": "client",
        "connect": {
            "endpoints": [endpoint],
            "timeout_ms": 0,
            "exit_on_failure": True,
            "retry": {
                "period_init_ms": 50,
                "period_max_ms": 200,
                "period_increase_factor": 2,
            },
        },
    }
    link: dict[str, Any] = {
        "tx": {"queue": {"size": {"data": 1, "real_time": 1}}},
        "rx": {"max_message_size": most},
    }
    if endpoint.startswith("tls/") and ca:
        link["tls"] = {"root_ca_certificate": ca}
    settings["transport"] = {
        "link": link,
        "unicast": {"open_timeout": int(OPENING * 1000)},
        "shared_memory": {"enabled": False},
    }
    if password:
        settings["transport"]["auth"] = {"usrpwd": {"user": user, "password": password}}
    return settings


def why_not_reached(locator: str, ca: str = "") -> str:
    """Return why nothing is reached at a router's locator; "" if something answers.

    Waits for the network.

    Args:
        locator: The router's locator.
        ca: The file with the certificate of the router's authority; "" for those that
            the system knows.

    """
    transport, _, place = locator.partition("/")
    host, _, port = place.rpartition(":")
    host = host.strip("[]")
    try:
        link = socket.create_connection((host, int(port)), PATIENCE)
    except socket.gaierror as error:
        return f"the host's name is not known ({error.strerror})"
    except ConnectionRefusedError:
        return "the connection was refused, nothing listens there"
    except TimeoutError:
        return f"no answer within {PATIENCE:g} s"
    except (OSError, UnicodeError) as error:
        return str(error)
    with link:
        return _why_no_tls(link, host, ca) if transport == "tls" else ""


def _why_no_tls(link: socket.socket, host: str, ca: str) -> str:
    try:
        context = ssl.create_default_context(cafile=ca or None)
    except OSError as error:
        return f"the file of WEBMAP_ROUTER_CA cannot be used: {error}"
    # Zenoh does not require what Python requires since 3.13.
    context.verify_flags &= ~ssl.VERIFY_X509_STRICT
    try:
        with context.wrap_socket(link, server_hostname=host) as secured:
            certificate = secured.getpeercert(binary_form=True) or b""
    except ssl.SSLCertVerificationError as error:
        return f"its certificate is not valid: {error.verify_message}"
    except OSError as error:
        return f"it does not speak TLS: {error}"
    if _OF_AUTHORITY.search(certificate):  # Python accepts it, Zenoh does not
        return (
            "its certificate is not valid: it is that of an authority (CA:TRUE), as "
            "self-signed ones are by default; give the router one that the authority "
            "signed, or a self-signed one with CA:FALSE"
        )
    return ""
