"""What a replay publishes about itself: its position, and the marks on its time line.

Both topics carry a ``std_msgs/String`` with JSON. Only the replay publishes them: they
are neither recorded nor played from a recording.
"""

from typing import Literal

import msgspec

STATUS = "/webmap/recording"
"""Topic with the newest :class:`Status`, at least twice a second."""

MARKS = "/webmap/recording/marks"
"""Topic with the newest :class:`Marks`, whenever they changed."""

TYPE = "std_msgs/String"
"""The type of both topics."""


class Status(msgspec.Struct, frozen=True):
    """Where the recording is, and how it is played."""

    name: str
    at: float
    """The position, in seconds since the begin of the recording."""
    seconds: float
    """The length of the recording."""
    rate: float
    """Seconds of the recording that are played per second."""
    playing: bool
    ended: bool
    """Whether it was played to the end: playing starts again from the beginning."""
    jumps: int
    """How often the position has jumped, by a command or at a new round."""
    problem: str = ""
    """Why the rest of the recording is not played."""


class Mark(msgspec.Struct, frozen=True):
    """An event in a recording."""

    at: float
    """The time, in seconds since the begin of the recording."""
    kind: Literal["stop", "goal", "result", "alarm"]
    text: str


class Marks(msgspec.Struct, frozen=True):
    """The events that were found up to now."""

    marks: list[Mark]
    """In the order of their times."""
    left_out: int = 0
    """The number of further events, which are not listed."""
    read: float = 1.0
    """The part of the recording that was read, from 0 to 1."""


class Text(msgspec.Struct):
    """The message that carries them."""

    data: str


def text_of(value: Status | Marks) -> str:
    """Return the JSON of a status or marks."""
    return msgspec.json.encode(value).decode()
