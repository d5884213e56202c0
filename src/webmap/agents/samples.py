"""Numbered samples: what is lost, doubled or out of order is noticed.

A sample carries one message of the gate. It begins with the random number of its
sender's session and with its own number, which grows by one. Copies of it come over
several connections, each of which delivers in order; the first copy counts.
"""

import secrets
import struct
from collections import deque

from webmap.base.errors import WireError

_head = struct.Struct("<QQ")

HEAD_BYTES = _head.size

MAX_BYTES = 1 << 20
"""The longest sample, in bytes."""

SESSIONS = 64
"""Ended sessions that are remembered; a slow connection may bring more of them."""


def head_of(sample: bytes) -> tuple[int, int]:
    """Return the session and the number of a sample."""
    session, number = _head.unpack_from(sample)
    return session, number


class Numbering:
    """Numbers the samples of one sender."""

    def __init__(self, session: int | None = None) -> None:
        self.session = secrets.randbits(64) if session is None else session
        """The identity of the sender until it restarts."""
        self.sent = 0
        """The number of the newest sample; 0 before the first."""

    def next(self, body: bytes) -> bytes:
        """Return the next sample, with this body."""
        self.sent += 1
        return _head.pack(self.session, self.sent) + body


class Order:
    """Accepts the samples of one sender, each once and in their order."""

    def __init__(self) -> None:
        self.session: int | None = None
        """The session of the sender; None before the first sample."""
        self.newest = 0
        """The number of the newest accepted sample."""
        self.lost = 0
        """How many samples never came."""
        self._ended: deque[int] = deque(maxlen=SESSIONS)

    def take(self, sample: bytes) -> tuple[bytes | None, bool]:
        """Return the body of a sample, and whether its sender has restarted.

        The body is None if the sample came twice, after a newer one, or after the
        session that followed its own.

        Raises:
            WireError: If the bytes are no sample.

        """
        if not HEAD_BYTES <= len(sample) <= MAX_BYTES:
            raise WireError(
                f"got a sample of {len(sample)} bytes, "
                f"expected {HEAD_BYTES} to {MAX_BYTES}"
            )
        session, number = head_of(sample)
        restarted = session != self.session and session not in self._ended
        if restarted:
            if self.session is not None:
                self._ended.append(self.session)
            self.session, self.newest = session, number - 1
        if session != self.session or number <= self.newest:
            return None, False
        self.lost += number - self.newest - 1
        self.newest = number
        return sample[HEAD_BYTES:], restarted
