"""Sign-in by one token per start: the decisions, without I/O.

The token is in the URL that WebMap prints. The server answers it with a one-time code,
and the browser exchanges the code for two secrets of a new session. The browser sends
the cookie with each request; it allows reading only. The pages keep the key themselves
and open their sockets with it: a browser sends a cookie to every port of a host, but
only pages of the exact origin can read the key. Both secrets are the session with a
signature, made with a secret that is derived from the token. So neither reveals the
token, neither reveals the other, and a server that starts again with the same token
still knows its viewers.
"""

import hashlib
import hmac
import math
import re
import secrets
from collections import OrderedDict, deque

from webmap.base.errors import ConfigError

_SESSION = re.compile(r"([A-Za-z0-9_-]{22})\.([0-9a-f]{64})")
# 32 bytes are 43 characters in base64 and 64 in hexadecimal.
_TOKEN = re.compile(r"[A-Za-z0-9_-]{43,256}")

CODE_LIFE_S = 120.0
"""Validity of a one-time code in seconds; it includes the start of a browser."""


def new_token() -> str:
    """Return a new token of 256 random bits, safe in a URL."""
    return secrets.token_urlsafe(32)


class Token:
    """The secret of one server.

    Args:
        secret: At least 43 characters of base64url, as from :func:`new_token`.

    Raises:
        ConfigError: If the secret is too short, or not safe in a URL.

    """

    __slots__ = ("_cookie_secret", "_digest", "_frame_secret", "_key_secret")

    def __init__(self, secret: str) -> None:
        if not _TOKEN.fullmatch(secret):
            # The value is a secret, so it is not repeated here.
            raise ConfigError(
                "the token must be 43 to 256 letters, digits, '-' or '_' (256 random "
                f"bits), got {len(secret)} characters; make one with: "
                'python -c "import secrets; print(secrets.token_urlsafe(32))"'
            )
        self._digest = hashlib.sha256(secret.encode()).digest()
        self._cookie_secret = _derive(secret, b"webmap session v1")
        self._key_secret = _derive(secret, b"webmap page key v1")
        self._frame_secret = _derive(secret, b"webmap frame key v1")

    def matches(self, offered: str) -> bool:
        """Return in constant time whether ``offered`` is the token."""
        digest = hashlib.sha256(offered.encode(errors="replace")).digest()
        return hmac.compare_digest(digest, self._digest)

    def issue(self, session: str | None = None) -> str:
        """Return the cookie value of a session, of a new one if none is given."""
        return _signed(self._cookie_secret, session or secrets.token_urlsafe(16))

    def session(self, cookie: str) -> str | None:
        """Return the session of a valid cookie value, or None."""
        return _proved(self._cookie_secret, cookie)

    def key(self, session: str, *, framed: bool = False) -> str:
        """Return the key with which the pages of a session open their sockets.

        Args:
            session: The session.
            framed: Whether the key is for a frame, in which nobody drives.

        """
        return _signed(self._frame_secret if framed else self._key_secret, session)

    def session_of_key(self, key: str, *, framed: bool = False) -> str | None:
        """Return the session of a valid page key, or None; see :meth:`key`."""
        return _proved(self._frame_secret if framed else self._key_secret, key)


def _derive(secret: str, label: bytes) -> bytes:
    return hmac.digest(secret.encode(), label, "sha256")


def _signed(secret: bytes, session: str) -> str:
    return f"{session}.{hmac.digest(secret, session.encode(), 'sha256').hex()}"


def _proved(secret: bytes, text: str) -> str | None:
    match = _SESSION.fullmatch(text)
    if match is None or not hmac.compare_digest(_signed(secret, match[1]), text):
        return None
    return match[1]


class Codes:
    """One-time codes: each signs in one browser, once, soon after it was made.

    Args:
        life: How long a code is valid, in seconds.
        limit: How many codes are kept; the oldest is removed first.

    """

    def __init__(self, life: float = CODE_LIFE_S, limit: int = 64) -> None:
        self._life = life
        self._limit = limit
        self._codes: OrderedDict[str, tuple[float, str]] = OrderedDict()

    def issue(self, now: float, session: str | None = None) -> str:
        """Return a new code, valid from ``now``, in seconds of any clock.

        Args:
            now: Seconds of any clock.
            session: The session that the code signs in; a new one if not given.

        """
        code = secrets.token_urlsafe(16)
        self._codes[code] = now + self._life, session or secrets.token_urlsafe(16)
        if len(self._codes) > self._limit:
            self._codes.popitem(last=False)
        return code

    def use(self, code: str, now: float) -> str | None:
        """Use up a code, and return its session.

        Returns:
            None if it was used before, is too old, or unknown.

        """
        end, session = self._codes.pop(code, (now, ""))
        return session if now < end else None


class Attempts:
    """Counts each address's wrong tokens of the last minute.

    The right token never has to wait: many people may share one address, such as that
    of a reverse proxy or of the machine itself.

    Args:
        limit: How many failures an address has before its wrong tokens must wait.
        window: How long a failure counts, in seconds.
        addresses: How many addresses are kept; the oldest is removed first.

    """

    def __init__(
        self, limit: int = 10, window: float = 60.0, addresses: int = 1024
    ) -> None:
        self._limit = limit
        self._window = window
        self._addresses = addresses
        self._failures: OrderedDict[str, deque[float]] = OrderedDict()

    def wait(self, address: str, now: float) -> int:
        """Return how many whole seconds the address must wait; 0 for no wait."""
        failures = self._failures.get(address)
        if failures is None:
            return 0
        while failures and now - failures[0] >= self._window:
            failures.popleft()
        if not failures:
            del self._failures[address]
        if len(failures) < self._limit:
            return 0
        return math.ceil(failures[0] + self._window - now)

    def failed(self, address: str, now: float) -> None:
        """Count a wrong token of an address."""
        self._failures.setdefault(address, deque(maxlen=self._limit)).append(now)
        self._failures.move_to_end(address)
        if len(self._failures) > self._addresses:
            self._failures.popitem(last=False)
