"""Sign-in by one token per start: the decisions, without I/O.

The token is in the URL that WebMap prints. A browser exchanges it once for a cookie,
and from then on the cookie alone is sent. The cookie holds a random session and its
signature by a key derived from the token, so that whoever reads it has not the token,
and a server that starts again with the same token still knows its viewers.
"""

import hashlib
import hmac
import math
import re
import secrets
from collections import OrderedDict, deque

from webmap.errors import ConfigError

_SESSION = re.compile(r"([A-Za-z0-9_-]{22})\.([0-9a-f]{64})")
# 32 bytes are 43 characters in base64 and 64 in hexadecimal.
_TOKEN = re.compile(r"[A-Za-z0-9_-]{43,256}")


def new_token() -> str:
    """Return a new token of 256 random bits, safe in a URL."""
    return secrets.token_urlsafe(32)


class Token:
    """The secret of one server.

    Args:
        secret: At least 43 characters of base64url, as :func:`new_token` makes them.

    Raises:
        ConfigError: If the secret is too short, or not safe in a URL.

    """

    __slots__ = ("_digest", "_key")

    def __init__(self, secret: str) -> None:
        if not _TOKEN.fullmatch(secret):
            # What was got is a secret, so that it is not repeated here.
            raise ConfigError(
                "the token must be 43 to 256 letters, digits, '-' or '_' (256 random "
                f"bits), got {len(secret)} characters; make one with: "
                'python -c "import secrets; print(secrets.token_urlsafe(32))"'
            )
        self._digest = hashlib.sha256(secret.encode()).digest()
        self._key = hmac.digest(secret.encode(), b"webmap session v1", "sha256")

    def matches(self, offered: str) -> bool:
        """Tell in constant time whether ``offered`` is the token."""
        digest = hashlib.sha256(offered.encode(errors="replace")).digest()
        return hmac.compare_digest(digest, self._digest)

    def issue(self) -> str:
        """Return a new cookie value for a browser that gave the token."""
        session = secrets.token_urlsafe(16)
        return f"{session}.{self._sign(session)}"

    def session(self, cookie: str) -> str | None:
        """Return the session that a cookie value proves, None if it proves none."""
        match = _SESSION.fullmatch(cookie)
        if match is None or not hmac.compare_digest(self._sign(match[1]), match[2]):
            return None
        return match[1]

    def _sign(self, session: str) -> str:
        return hmac.digest(self._key, session.encode(), "sha256").hex()


class Attempts:
    """How often each address gave a wrong token in the last minute.

    Args:
        limit: How many failures an address has before it must wait.
        window: How long a failure counts, in seconds.
        addresses: How many addresses are remembered; the oldest is forgotten first.

    """

    def __init__(
        self, limit: int = 10, window: float = 60.0, addresses: int = 1024
    ) -> None:
        self._limit = limit
        self._window = window
        self._addresses = addresses
        self._failures: OrderedDict[str, deque[float]] = OrderedDict()

    def wait(self, address: str, now: float) -> int:
        """Return for how many whole seconds the address must wait; 0 is not at all."""
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
        """Note that the address gave a wrong token."""
        self._failures.setdefault(address, deque(maxlen=self._limit)).append(now)
        self._failures.move_to_end(address)
        if len(self._failures) > self._addresses:
            self._failures.popitem(last=False)
