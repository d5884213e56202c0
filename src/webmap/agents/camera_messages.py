"""What displays and agents exchange about cameras. No I/O.

A display requests the pictures of a camera again and again, and each request names the
newest picture that it got. The agent answers each request to its sender, and sends a
picture once to all.
"""

import struct
from collections import deque
from typing import NamedTuple

import msgspec

from webmap.agents.data_messages import read_json
from webmap.base.errors import WireError
from webmap.ros.messages_image import MAX_BYTES

MOST_REQUEST = 4096
"""The longest message of a display about a camera, in bytes."""

_head = struct.Struct("<Qd")

MOST_PICTURE = _head.size + MAX_BYTES
"""The longest message with a picture, in bytes."""


class CameraRequest(msgspec.Struct, frozen=True, tag="look"):
    """A display shows a camera and wants its pictures for the next seconds."""

    number: int
    """Grows with each request of a display."""
    robot: str
    """The id of the robot."""
    camera: str
    """The name of the camera."""
    newest: int = 0
    """The number of the newest picture that came; 0 before the first."""


class CameraRelease(msgspec.Struct, frozen=True, tag="away"):
    """A display does not show a camera any more."""

    robot: str
    camera: str


class CameraReply(msgspec.Struct, frozen=True):
    """The agent's answer to a :class:`CameraRequest`, sent to its display alone."""

    number: int
    """The number of the request."""
    clock: float
    """The agent's clock when the request came, in seconds."""
    trouble: str = ""
    """Why no pictures come from the camera."""


class PictureMessage(NamedTuple):
    """A picture as the camera sent it; it goes to all displays at once."""

    number: int
    clock: float
    """The agent's clock when the picture came from the camera, in seconds."""
    data: bytes


_request = msgspec.json.Decoder(CameraRequest | CameraRelease).decode
_reply = msgspec.json.Decoder(CameraReply).decode


def read_request(piece: bytes) -> CameraRequest | CameraRelease:
    """Return the message of a display about a camera.

    Raises:
        WireError: If the bytes are nothing of the kind.

    """
    if len(piece) > MOST_REQUEST:
        raise WireError(f"got a request of {len(piece)} bytes, {MOST_REQUEST} at most")
    request: CameraRequest | CameraRelease = read_json(_request, piece, "a request")
    return request


def read_reply(piece: bytes) -> CameraReply:
    """Return the answer to a request.

    Raises:
        WireError: If the bytes are none.

    """
    return read_json(_reply, piece, "an answer")


def pack_picture(picture: PictureMessage) -> bytes:
    """Return number and clock in 16 bytes, and then the picture as it came."""
    return _head.pack(picture.number, picture.clock) + picture.data


def read_picture(piece: bytes) -> PictureMessage:
    """Return the picture in a message.

    Raises:
        WireError: If the message is too short for one.

    """
    if len(piece) <= _head.size:
        raise WireError(f"got a picture of {len(piece)} bytes")
    number, clock = _head.unpack_from(piece)
    return PictureMessage(number, clock, piece[_head.size :])


class AgentClock:
    """Computes how old at most a picture is, without a common clock.

    The agent's clock was read between a request and its answer. So the oldest that a
    picture can be follows from the latest request that could have found that clock.
    """

    KEPT = 30
    """Answers from which the age follows; the two clocks drift apart over longer."""

    def __init__(self) -> None:
        self._asked: dict[int, float] = {}
        self._ahead: deque[float] = deque(maxlen=self.KEPT)
        """How much the display's clock is ahead of the agent's at least, in seconds."""

    def asked(self, number: int, now: float) -> None:
        """Note the time of a request."""
        self._asked[number] = now
        if len(self._asked) > self.KEPT:
            del self._asked[next(iter(self._asked))]

    def answered(self, number: int, clock: float, now: float) -> bool:
        """Note the agent's clock in an answer; return whether it was asked here.

        Answers of the same agent about other cameras come too.
        """
        asked = self._asked.pop(number, None)
        if asked is None:
            return False
        if self._ahead and max(self._ahead) > now - clock:
            self._ahead.clear()  # one of the computers slept, or the agent is a new one
        self._ahead.append(asked - clock)
        return True

    def age(self, clock: float, now: float) -> float | None:
        """Return the greatest possible age of what had this time on the agent's clock.

        None before the first answer.
        """
        if not self._ahead:
            return None
        return max(0.0, now - clock - max(self._ahead))
