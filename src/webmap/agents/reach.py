"""Why a router cannot be reached, in words: Zenoh reports only that it cannot."""

import re
import socket
import ssl

_OF_AUTHORITY = re.compile(
    rb"\x06\x03\x55\x1d\x13(\x01\x01\xff)?\x04.\x30.\x01\x01\xff", re.DOTALL
)
"""The part of a certificate with ``basicConstraints`` and ``CA:TRUE``."""

PATIENCE = 2.0
"""Seconds for an answer."""


def why_not_reached(locator: str, user: str, ca: str) -> str:
    """Return why a connection to a router fails. Waits for the network.

    Args:
        locator: The router's locator.
        user: The name of the user; "" without one.
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
    except OSError as error:
        return str(error)
    with link:
        if transport == "tls":
            why = _why_no_tls(link, host, ca)
            if why:
                return why
    if user:
        return (
            f"it does not let the user {user} in: the name or the password is wrong, "
            "it has no users, or it is not a Zenoh router"
        )
    return (
        "it lets nobody in without a user: set WEBMAP_ROUTER_USER and "
        "WEBMAP_ROUTER_PASSWORD, or it is not a Zenoh router"
    )


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
