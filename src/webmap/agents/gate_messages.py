"""What agents and displays send each other about gates, as numbered samples. No I/O.

A sample carries one message. It begins with the random number of its sender's session
and with its own number, which grows by one: what is lost, doubled or out of order is
noticed. Copies of it come over several connections, each of which delivers in order;
the first copy counts.
"""

import secrets
import struct
from collections import deque
from typing import Annotated

import msgspec

from webmap.base.errors import WireError
from webmap.base.roles import Role
from webmap.gate.protocol import FromGate, FromPage, FromProgram, RobotReport

_head = struct.Struct("<QQ")

HEAD_BYTES = _head.size

MAX_BYTES = 1 << 20
"""The longest sample, in bytes."""

SESSIONS = 64
"""Ended sessions that are remembered; a slow connection may bring more of them."""

MOST_SAMPLE = 64 << 10
"""The longest sample of a display, in bytes: the state of :data:`MOST_PAGES` pages."""

MOST_NAME = 64
"""The longest name of a page, in characters."""

MOST_PAGES = 200
"""The greatest number of pages of one display, with its program."""


def head_of(sample: bytes) -> tuple[int, int]:
    """Return the session and the number of a sample."""
    session, number = _head.unpack_from(sample)
    return session, number


class Numbering:
    """Numbers the samples of one sender, from 1 in each session."""

    def __init__(self, session: int | None = None) -> None:
        self.session = secrets.randbits(64) if session is None else session
        """The identity of the sender until it restarts."""
        self.sent = 0
        """The number of the newest sample; 0 before the first."""

    def next(self, body: bytes) -> bytes:
        """Return the sample that carries ``body``: 16 bytes more."""
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


class PageState(msgspec.Struct, frozen=True, array_like=True):
    """All that a display states of one of its pages, or of its program."""

    id: Annotated[str, msgspec.Meta(max_length=32)]
    """Its connection without the name of the display."""
    name: Annotated[str, msgspec.Meta(max_length=MOST_NAME)]
    role: Role
    speeds: tuple[float, float] | None = None
    """The speed limits of its ``Teleop``, in m/s and rad/s."""
    greeted: bool = True
    """Whether the display has received its :class:`Hello`."""
    person: Annotated[str, msgspec.Meta(max_length=16)] = ""
    """The parts of its identity; empty for a program."""
    page: Annotated[str, msgspec.Meta(max_length=16)] = ""


class SampleAck(msgspec.Struct, frozen=True, tag="answer", omit_defaults=True):
    """A display has received this sample of the agent; sent 1 to 20 times a second."""

    session: int
    number: int
    pages: tuple[PageState, ...] | None = None
    """The program and all pages with all their state, after each change and once a
    second: no lost sample leaves a lasting error."""
    reports: bool = False
    """Whether the display needs all reports, because it has lost a sample."""


class AllReports(msgspec.Struct, frozen=True, tag="reports"):
    """The newest report of each robot, in one sample: some of many would be lost."""

    reports: tuple[RobotReport, ...]
    robots: tuple[str, ...]
    """All robots: a gate that has just started has reported none of them yet."""


class StopAck(msgspec.Struct, frozen=True, tag="took"):
    """The agent has received this STOP of a display."""

    display: str
    session: int
    number: int


ToDisplays = FromGate | AllReports | StopAck
"""What an agent sends to all displays."""

FromDisplay = FromPage | FromProgram | SampleAck
"""What a display may send. Everything else is refused whole."""
