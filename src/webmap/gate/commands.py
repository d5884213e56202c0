"""The commands that a page sends on ``/drive``, and their strict parser. No I/O.

A command is one JSON object in one text frame of at most 1024 bytes, with exactly
these fields::

    {"op": "take", "robot": "r1"}
    {"op": "release", "robot": "r1"}
    {"op": "renew", "robot": "r1", "epoch": 3}
    {"op": "drive", "robot": "r1", "epoch": 3, "seq": 17, "tick": 812,
     "x": 1.0, "y": 0.0, "turn": 0.0}
    {"op": "goal", "robot": "r1", "epoch": 3, "seq": 18, "tick": 813,
     "x": 1.0, "y": 2.0, "yaw": 0.5}
    {"op": "locate", "robot": "r1", "epoch": 3, "seq": 19, "tick": 814,
     "x": 1.0, "y": 2.0, "yaw": 0.5}
    {"op": "cancel", "robot": "r1"}
    {"op": "stop", "robot": "r1"}        or "*" for all
    {"op": "reset", "robot": "r1", "stop": "5f0c"}
    {"op": "ask", "robot": "r1"}
    {"op": "grant", "robot": "r1"}
    {"op": "deny", "robot": "r1"}
    {"op": "stop-test", "robot": "r1"}
    {"op": "check", "robot": "r1"}

``drive`` is a state, not an event: a page that holds a lease sends it at 20 Hz, also
when no input is pressed, and stops sending it when anything is uncertain. ``x`` is
forward, ``y`` left and ``turn`` counter-clockwise, as parts of the speed in force, each
in ``[-1, 1]``; larger values are clamped, and if all are below 0.001 the inputs are
released. ``epoch`` is the lease's, ``tick`` the newest tick that the page received, and
``seq`` grows with every ``drive``, ``goal`` and ``locate`` of the connection. ``goal``
is the pose to drive to and ``locate`` the pose where the robot is, in metres and
radians in the robot's goal frame. ``reset`` ends the STOP with the identity ``stop``,
as the gate reported it; if a newer STOP is active, the reset is refused. It moves
nothing and gives no lease. ``ask`` requests control from the holder, who answers with
``grant`` or ``deny``; no answer for 10 s grants it. ``release`` also withdraws the
request. ``stop-test`` creeps, stops sending and measures whether the base stops by
itself; it needs the lease, released inputs, and a page that goes on sending ``drive``.
``check`` ends a check before driving; it counts only shortly after the reset of a STOP
that was confirmed.

A page whose operator drives by a camera adds ``"video"`` to each ``drive``: the age of
the newest picture on the page, in milliseconds.

Any other frame is refused whole. But a frame that begins with ``{"op":"stop"`` stops
robots first, whatever follows: the robot that it names, if that can be read for
certain, otherwise all. :mod:`webmap.gate.display.pages` has the gate's answers.
"""

import json
import math
import re
import reprlib
from collections.abc import Callable
from typing import Any, NoReturn, TypeVar

import msgspec

from webmap.base.errors import MotionError


class Refusal(MotionError):
    """A command that is refused whole: it does not restart a dead-man timeout either.

    Args:
        why: One sentence for the person who gave the command.
        garbage: Whether the command is invalid, rather than valid at the wrong time
            or from the wrong page. A page that sends much garbage is closed.

    """

    def __init__(self, why: str, *, garbage: bool = False) -> None:
        super().__init__(why)
        self.why = why
        self.garbage = garbage


MAX_BYTES = 1024
"""The longest command, in bytes of UTF-8."""

MAX_INTEGER = 2**53 - 1
"""The largest whole number that JavaScript keeps exactly."""

MAX_COORDINATE = 1e6
"""The farthest goal, in metres from the frame's origin along one axis."""

MAX_ID = 64
"""The longest identity of a press of STOP, in characters."""

MAX_NAME = 64
"""The longest name of a robot, in characters."""


RELEASED = 1e-3
"""The part of full speed below which an axis counts as released.

A millimetre per second of each metre per second is slower than any base moves, and less
than any input that is held.
"""


Velocity = tuple[float, float, float, float, float, float]
"""Forward, left, counter-clockwise, upward, about the forward and about the left axis:
metres and radians per second in the robot's own frame."""


class Take(msgspec.Struct, frozen=True, tag_field="op", tag="take"):
    """The page takes the lease of a robot."""

    robot: str


class Release(msgspec.Struct, frozen=True, tag_field="op", tag="release"):
    """The page releases the lease, or withdraws its request for control."""

    robot: str


class Renew(msgspec.Struct, frozen=True, tag_field="op", tag="renew"):
    """The page keeps its lease, though it sends nothing else now."""

    robot: str
    epoch: int


class Drive(msgspec.Struct, frozen=True, tag_field="op", tag="drive"):
    """The present state of the page's inputs."""

    robot: str
    epoch: int
    seq: int
    tick: int
    x: float
    y: float
    turn: float
    clamped: bool = False
    """Whether an axis was outside ``[-1, 1]``."""
    video: float | None = None
    """Age in seconds of the camera picture that the operator drives by, if any."""

    @property
    def neutral(self) -> bool:
        """Whether every input is released."""
        return all(abs(axis) < RELEASED for axis in (self.x, self.y, self.turn))


class SetVelocity(msgspec.Struct, frozen=True, tag_field="op", tag="drive"):
    """A velocity of a program, which ends with the dead-man timeout."""

    robot: str
    epoch: int
    tick: int
    velocity: Velocity


class Goal(msgspec.Struct, frozen=True, tag_field="op", tag="goal"):
    """The page sends the robot to a pose: metres and radians in its goal frame."""

    robot: str
    epoch: int
    seq: int
    tick: int
    x: float
    y: float
    yaw: float


class MoveFor(msgspec.Struct, frozen=True, tag_field="op", tag="move"):
    """A program sends the robot to a pose in the name of a page of its display."""

    robot: str
    page: str
    """The connection of the page, whose viewer wants this."""
    tick: int
    x: float
    y: float
    yaw: float


class Locate(msgspec.Struct, frozen=True, tag_field="op", tag="locate"):
    """The page states where the robot is: metres and radians in its goal frame."""

    robot: str
    epoch: int
    seq: int
    tick: int
    x: float
    y: float
    yaw: float


class Cancel(msgspec.Struct, frozen=True, tag_field="op", tag="cancel"):
    """The page cancels the robot's goals."""

    robot: str


class Stop(msgspec.Struct, frozen=True, tag_field="op", tag="stop"):
    """The page sends STOP to a robot, or to every robot (``None``)."""

    robot: str | None


class Reset(msgspec.Struct, frozen=True, tag_field="op", tag="reset"):
    """The page ends the STOP with this identity."""

    robot: str
    stop: str


class Ask(msgspec.Struct, frozen=True, tag_field="op", tag="ask"):
    """The page requests control from the holder."""

    robot: str


class Grant(msgspec.Struct, frozen=True, tag_field="op", tag="grant"):
    """The holder gives the lease to the page that requests control."""

    robot: str


class Deny(msgspec.Struct, frozen=True, tag_field="op", tag="deny"):
    """The holder keeps the lease."""

    robot: str


class StopTest(msgspec.Struct, frozen=True, tag_field="op", tag="stop-test"):
    """The page starts a stop test: does the base stop by itself?"""

    robot: str


class Check(msgspec.Struct, frozen=True, tag_field="op", tag="check"):
    """The person at the page has finished the check before driving."""

    robot: str


PageCommand = (
    Take
    | Release
    | Renew
    | Drive
    | Goal
    | Locate
    | Cancel
    | Stop
    | Reset
    | Ask
    | Grant
    | Deny
    | StopTest
    | Check
)

ControlCommand = Take | Release | SetVelocity | Goal | MoveFor | Locate
"""What a program sends to get control of a robot, to use it and to release it."""

ProgramCommand = ControlCommand | Cancel | Stop | Reset

Command = PageCommand | ProgramCommand


P = TypeVar("P", Goal, Locate)


def parse(data: bytes) -> PageCommand:
    """Return the command in ``data``.

    Raises:
        Refusal: If ``data`` is not a command; no bytes raise any other error.

    """
    fields = _object(data)
    op = fields.pop("op", None)
    read = _READERS.get(op) if isinstance(op, str) else None
    if read is None:
        _refuse(f"'op' is {_short(op)}, expected one of {', '.join(_READERS)}")
    reader = _Fields(fields)
    command = read(reader)
    if fields:
        _refuse(f"{_short(next(iter(fields)))} is not a field of {op!r}")
    return command


def check(command: ControlCommand) -> None:
    """Check a command of a program on another computer like that of a page.

    Raises:
        Refusal: If a value is not what a page could send.

    """
    if isinstance(command, SetVelocity):  # the gate checks the velocity itself
        fields = _Fields(msgspec.structs.asdict(command))
        fields.robot()
        fields.whole("epoch")
        fields.whole("tick")
        return
    if isinstance(command, MoveFor):
        robot, _, tick, x, y, yaw = msgspec.structs.astuple(command)
        command = Goal(robot, 0, 0, tick, x, y, yaw)
    parse(msgspec.json.encode(command))


def op_of(command: Command) -> str:
    """Return the name of a command on the wire, which refusals repeat."""
    return str(command.__struct_config__.tag)


def _object(data: bytes) -> dict[str, Any]:
    if len(data) > MAX_BYTES:
        _refuse(f"a command has at most {MAX_BYTES} bytes")
    try:
        value = json.loads(
            data.decode(), object_pairs_hook=_pairs, parse_constant=_no_constant
        )
    except Refusal:
        raise
    except (ValueError, RecursionError):
        _refuse(f"not JSON: {_short(data)}")
    if not isinstance(value, dict):
        _refuse(f"a command is a JSON object, got {_short(value)}")
    return value


def _pairs(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    fields = dict(pairs)
    if len(fields) != len(pairs):
        _refuse("a field is given twice")
    return fields


def _no_constant(name: str) -> NoReturn:
    _refuse(f"got {name}, expected a finite number")


class _Fields:
    """Takes the fields of a command out one by one and checks the type of each."""

    def __init__(self, fields: dict[str, Any]) -> None:
        self._fields = fields

    def _take(self, name: str) -> Any:
        try:
            return self._fields.pop(name)
        except KeyError:
            _refuse(f"{name!r} is missing")

    def has(self, name: str) -> bool:
        return name in self._fields

    def robot(self) -> str:
        value = self._take("robot")
        if not (isinstance(value, str) and value and len(value) <= MAX_NAME):
            _refuse(f"'robot' is {_short(value)}, expected a robot's name")
        if not value.isprintable():
            _refuse(f"'robot' is {_short(value)}, which is not plain text")
        return value

    def identity(self, name: str) -> str:
        value = self._take(name)
        if not (isinstance(value, str) and 0 < len(value) <= MAX_ID):
            _refuse(f"{name!r} is {_short(value)}, expected the identity of a STOP")
        return value

    def whole(self, name: str) -> int:
        value = self._take(name)
        # A bool is an int in Python, but not in JSON.
        if type(value) is not int or not 0 <= value <= MAX_INTEGER:
            _refuse(f"{name!r} is {_short(value)}, expected a whole number from 0 on")
        return value

    def number(self, name: str) -> float:
        value = self._take(name)
        if type(value) not in (int, float):
            _refuse(f"{name!r} is {_short(value)}, expected a number")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            _refuse(f"{name!r} is too large for a number")
        return number

    def coordinate(self, name: str) -> float:
        value = self.number(name)
        if abs(value) > MAX_COORDINATE:
            _refuse(f"{name!r} is {value:g} m, expected within ±{MAX_COORDINATE:.0f} m")
        return value


def _drive(fields: _Fields) -> Drive:
    robot = fields.robot()
    epoch, seq, tick = (fields.whole(name) for name in ("epoch", "seq", "tick"))
    asked = [fields.number(name) for name in ("x", "y", "turn")]
    x, y, turn = (min(1.0, max(-1.0, axis)) for axis in asked)
    clamped = asked != [x, y, turn]
    video = fields.whole("video") / 1000 if fields.has("video") else None
    return Drive(robot, epoch, seq, tick, x, y, turn, clamped, video)


def _pose(kind: type[P], fields: _Fields) -> P:
    robot = fields.robot()
    epoch, seq, tick = (fields.whole(name) for name in ("epoch", "seq", "tick"))
    x, y = fields.coordinate("x"), fields.coordinate("y")
    return kind(
        robot, epoch, seq, tick, x, y, math.remainder(fields.number("yaw"), math.tau)
    )


def _one_or_all(fields: _Fields) -> str | None:
    robot = fields.robot()
    return None if robot == "*" else robot


_READERS: dict[str, Callable[[_Fields], PageCommand]] = {
    "take": lambda fields: Take(fields.robot()),
    "release": lambda fields: Release(fields.robot()),
    "renew": lambda fields: Renew(fields.robot(), fields.whole("epoch")),
    "drive": _drive,
    "goal": lambda fields: _pose(Goal, fields),
    "locate": lambda fields: _pose(Locate, fields),
    "cancel": lambda fields: Cancel(fields.robot()),
    "ask": lambda fields: Ask(fields.robot()),
    "grant": lambda fields: Grant(fields.robot()),
    "deny": lambda fields: Deny(fields.robot()),
    "stop-test": lambda fields: StopTest(fields.robot()),
    "check": lambda fields: Check(fields.robot()),
    "stop": lambda fields: Stop(_one_or_all(fields)),
    "reset": lambda fields: Reset(fields.robot(), fields.identity("stop")),
}


def _short(value: object) -> str:
    """Return ``value`` for a log: ASCII, at most 60 characters."""
    text = reprlib.repr(value).encode("ascii", "backslashreplace").decode()
    return text if len(text) <= 60 else text[:57] + "..."


def _refuse(why: str) -> NoReturn:
    raise Refusal(why, garbage=True)


_SPACE = rb"[ \t\n\r]*"
_STOP = rb"%b\{%b\"op\"%b:%b\"stop\"" % (_SPACE, _SPACE, _SPACE, _SPACE)
_BEGINS = re.compile(_STOP)
_NAMES_NEXT = re.compile(
    _STOP
    + rb"%b,%b\"robot\"%b:%b(\"(?:[^\"\\]|\\.)*\")" % (_SPACE, _SPACE, _SPACE, _SPACE)
)
_NAME_KEY = re.compile(rb"\"robot\"" + _SPACE + rb":")


def begins_like_stop(data: bytes) -> bool:
    """Return whether a frame begins with ``{"op":"stop"``, spaces allowed."""
    return _BEGINS.match(data) is not None


def stop_in(data: bytes) -> Stop | None:
    """Return the STOP that a frame is, valid or not; ``None`` if it is none."""
    if not (b"stop" in data or b"\\" in data):  # most frames; JSON escapes begin so
        return None
    try:
        command = parse(data)
    except Refusal:
        return Stop(robot_in(data)) if begins_like_stop(data) else None
    return command if isinstance(command, Stop) else None


def robot_in(data: bytes) -> str | None:
    """Return the one robot that a frame names, if that can be read for certain.

    Args:
        data: A frame: a command, or one that begins like a STOP.

    Returns:
        The name, which may be unknown; ``None`` if the frame names no robot or several,
        or the name cannot be read.

    """
    try:
        fields = json.loads(data.decode(), object_pairs_hook=list)
        names = [value for name, value in fields if name == "robot"]
    except (ValueError, TypeError, RecursionError):  # not JSON, or not an object
        names = _named_next(data)
    name = names[0] if len(names) == 1 else None
    return name if isinstance(name, str) else None


def _named_next(data: bytes) -> list[str]:
    """Return the robot named right after the beginning of a frame that is not JSON."""
    found = _NAMES_NEXT.match(data)
    if found is None or len(_NAME_KEY.findall(data)) > 1:
        return []
    try:
        return [json.loads(found[1].decode())]
    except ValueError:
        return []
