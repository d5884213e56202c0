"""Commands to a replay, the position that they lead to, and the status; asks no clock.

The topics of status and marks carry a ``std_msgs/String`` with JSON. Only the replay
publishes them: they are neither recorded nor played from a recording.
"""

import math
from typing import Literal, NamedTuple

import msgspec

from webmap.bags.times import SECOND, Pace
from webmap.base.errors import ConfigError

SLOWEST, FASTEST = 0.001, 1000.0
"""The least and the greatest rate."""

PLAIN = ("again", "play", "pause")
"""The commands without a value; ``again`` plays from where the playing began."""

LIMITS = {"seek": (0.0, 1e9), "rate": (SLOWEST, FASTEST)}
"""The commands with a value, and its limits: a position in seconds, or a rate."""


class PlaybackCommand(NamedTuple):
    """What an operator wants of a replay."""

    name: str
    value: float = 0.0

    @property
    def line(self) -> str:
        """The command as a line of text without its end."""
        return self.name if self.name in PLAIN else f"{self.name} {self.value!r}"


def command_of(name: object, value: object = None) -> PlaybackCommand:
    """Return a command.

    Args:
        name: ``again``, ``play``, ``pause``, ``seek`` or ``rate``.
        value: A position in seconds or a rate, for the last two.

    Raises:
        ConfigError: If there is no such command, or the value is not valid.

    """
    if name in PLAIN and value is None:
        return PlaybackCommand(str(name))
    if not isinstance(name, str) or name not in LIMITS:
        raise ConfigError(
            f"a command to a recording is again, play, pause, seek SECONDS or rate "
            f"FACTOR, got {str(name)[:40]!r}"
        )
    least, most = LIMITS[name]
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not least <= value <= most:  # type: ignore[operator]
        raise ConfigError(
            f"{name} needs a number from {least:g} to {most:g}, got {str(value)[:40]!r}"
        )
    return PlaybackCommand(name, float(value))  # type: ignore[arg-type]


def read_command(line: str) -> PlaybackCommand:
    """Return the command of a line.

    Raises:
        ConfigError: As in :func:`command_of`.

    """
    name, _, value = line.strip().partition(" ")
    if not value:
        return command_of(name)
    try:
        return command_of(name, float(value))
    except ValueError:
        return command_of(name, math.nan)


class Playback:
    """The position in a recording, and whether it moves.

    Between two commands is a *turn*: the player shows the state at the position, calls
    :meth:`begin`, and plays from there or waits. All times are nanoseconds since 1970.

    Args:
        begin: The begin of the recording.
        end: The end of the recording.
        start: The position where the playing begins, in seconds.
        rate: Seconds of the recording that are played per second.
        loop: Whether to play again after the end.
        now: The time now.

    """

    def __init__(
        self, begin: int, end: int, *, start: float, rate: float, loop: bool, now: int
    ) -> None:
        self._begin, self._end = begin, end
        self._first = begin + round(start * SECOND)
        self._loop = loop
        self._pace = Pace(self._first, now, rate)
        self._held: int | None = self._first  # the position, while it does not move
        self.rate = rate
        self.playing = True
        self.ended = False
        self.jumps = 0
        """How often the position has jumped."""
        self.turn = 0
        """The number of the turn."""

    def at(self, now: int) -> int:
        """Return the position, as a time of the recording."""
        at = self._pace.at(now) if self._held is None else self._held
        return min(max(at, self._begin), self._end)

    def seconds_at(self, now: int) -> float:
        """Return the position in seconds since the begin of the recording."""
        return (self.at(now) - self._begin) / SECOND

    def pace(self, now: int) -> Pace:
        """Return when messages are due, and the stamps that they get."""
        if self._held is None:
            return self._pace
        return Pace(self._held, now, self.rate, self._pace.earliest)

    def begin(self, now: int) -> None:
        """Begin the turn: the state at the position is known."""
        # Nothing was published before the first turn, so all its stamps may be old.
        earliest = now if self.turn else 0
        self._pace = Pace(self.at(now), now, self.rate, earliest)
        if self.playing:
            self._held = None

    def finish(self, at: int) -> None:
        """End the recording, or begin the next round: all messages were played.

        Args:
            at: The position of the last message, as a time of the recording.

        """
        self.playing = self._loop
        self.ended = not self._loop
        if self._loop:
            self._jump(self._first)
        else:
            self._hold(at)

    def obey(self, command: PlaybackCommand, now: int) -> None:
        """Pause, go on, seek or change the rate, at ``now`` in nanoseconds."""
        name, value = command
        if name == "rate":
            self.rate = value
            if self._held is None:
                self._pace = Pace(self.at(now), now, value, now)
        elif name == "seek":
            self._jump(self._begin + round(value * SECOND))
        elif name == "pause" and self.playing:
            self.playing = False
            self._hold(self.at(now))
        elif name == "again" or (name == "play" and self.ended):
            self.playing = True
            self._jump(self._first)
        elif name == "play" and not self.playing:
            self.playing = True
            self._hold(self.at(now))

    def _jump(self, to: int) -> None:
        self.ended = False
        self.jumps += 1
        self.turn += 1
        self._held = min(max(to, self._begin), self._end)

    def _hold(self, at: int) -> None:
        self.turn += 1
        self._held = at


STATUS = "/webmap/recording"
"""Topic with the newest :class:`PlaybackStatus`, at least twice a second."""

MARKS = "/webmap/recording/marks"
"""Topic with the newest :class:`Marks`, whenever they changed."""

EVENTS = "/webmap/events"
"""Topic of the events in a recording of the last minutes: JSON with ``kind``, which is
that of a mark or ``"note"``, and ``text``."""

TYPE = "std_msgs/String"
"""The type of these topics."""


class PlaybackStatus(msgspec.Struct, frozen=True):
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
    """An event in a recording, marked on the time line of the player."""

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


class StringMessage(msgspec.Struct):
    """A ``std_msgs/String`` with a status or marks."""

    data: str


def text_of(value: PlaybackStatus | Marks) -> str:
    """Return the JSON of a status or marks."""
    return msgspec.json.encode(value).decode()
