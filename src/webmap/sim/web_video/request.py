"""Requests to the cameras over HTTP. No I/O."""

import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal
from urllib.parse import parse_qsl, urlsplit

from PIL import Image

from webmap.ros.rosbridge.server.dialect import resolve

MOST_SIDE = 4096
"""Most pixels along a side of a picture that is made or read."""

_TOO_LARGE = (Image.DecompressionBombError, Image.DecompressionBombWarning)


EXAMPLE = "/stream?topic=/robot_0/camera/image_raw&type=mjpeg"

_PATHS: dict[str, Literal["list", "stream", "snapshot"]] = {
    "/": "list",
    "/stream": "stream",
    "/snapshot": "snapshot",
}
_TYPES = ("mjpeg", "ros_compressed")
_MOST_PARAMETERS = 32
_SHOWN = 80


class NoPicture(Exception):
    """The message of a topic is not a readable JPEG."""


@dataclass(frozen=True, slots=True)
class Form:
    """The format of a picture; None keeps the camera's value."""

    quality: int | None = None
    """1 to 100."""

    width: int | None = None
    """In pixels; the height does not change with it."""

    height: int | None = None
    """In pixels."""

    inverted: bool = False
    """Whether the picture is rotated by half a turn."""

    @property
    def is_plain(self) -> bool:
        """Whether pictures are sent unchanged."""
        return self == Form()

    def apply(self, jpeg: bytes) -> bytes:
        """Return a picture in this format.

        Raises:
            NoPicture: If it is not a readable JPEG.

        """
        try:
            with Image.open(io.BytesIO(jpeg), formats=("JPEG",)) as opened:
                if max(opened.size) > MOST_SIDE:
                    raise NoPicture(f"a picture of {opened.width} x {opened.height}")
                shown: Image.Image = opened.convert("RGB")
        except (OSError, ValueError, SyntaxError, *_TOO_LARGE) as error:
            raise NoPicture(str(error)) from error
        size = (self.width or shown.width, self.height or shown.height)
        if size != shown.size:
            shown = shown.resize(size)
        if self.inverted:
            shown = shown.transpose(Image.Transpose.ROTATE_180)
        file = io.BytesIO()
        # 95 is the default of web_video_server.
        shown.save(file, "JPEG", quality=self.quality or 95)
        return file.getvalue()


class Refusal(Exception):
    """A refused request, with the status and the text of the answer."""

    def __init__(self, status: int, text: str) -> None:
        super().__init__(text)
        self.status = status


@dataclass(frozen=True, slots=True)
class Request:
    """The requested picture or stream."""

    what: Literal["list", "stream", "snapshot"]
    topic: str = ""
    """Topic of ``sensor_msgs/Image``, as in web_video_server."""
    form: Form = field(default_factory=Form)


def read_request(head: bytes) -> Request:
    """Return the request in the head of an HTTP message.

    The parameters are those of web_video_server: ``topic``, ``type``, ``quality``,
    ``width``, ``height`` and ``invert``. Others are ignored, as in web_video_server.

    Args:
        head: All bytes up to the blank line.

    Raises:
        Refusal: If the request is invalid.

    """
    line = head.decode("latin-1").partition("\n")[0].rstrip("\r")
    parts = line.split(" ")
    if len(parts) != 3 or not parts[2].startswith("HTTP/1."):
        raise Refusal(
            400,
            f"{_plain(line)} is not a request of HTTP/1.0 or 1.1, "
            "such as GET / HTTP/1.1",
        )
    method, target, _ = parts
    if method != "GET":
        raise Refusal(405, f"use GET for pictures, got {_plain(method)}")
    try:
        address = urlsplit(target)
        parameters = dict(
            reversed(  # of two equal keys, the first is used
                parse_qsl(
                    address.query,
                    keep_blank_values=True,
                    max_num_fields=_MOST_PARAMETERS,
                )
            )
        )
    except ValueError:
        raise Refusal(
            400,
            f"{_plain(target)} is not an address with parameters, such as {EXAMPLE}",
        ) from None
    what = _PATHS.get(address.path)
    if what is None:
        raise Refusal(
            404,
            f"there is nothing at {_plain(address.path)}; there are / with a list of "
            "the cameras, /stream?topic=... and /snapshot?topic=...",
        )
    if what == "list":
        return Request(what)
    if not parameters.get("topic", "").strip("/"):
        raise Refusal(400, f"the topic of the camera is missing, as in {EXAMPLE}")
    kind = parameters.get("type", "mjpeg")
    if what == "stream" and kind not in _TYPES:
        raise Refusal(
            400, f"type must be {' or '.join(_TYPES)} here, got {_plain(kind)}"
        )
    # ros_compressed streams the messages of the camera's topic unchanged.
    as_it_is = what == "stream" and kind == "ros_compressed"
    return Request(
        what, resolve(parameters["topic"]), Form() if as_it_is else _form(parameters)
    )


def _form(parameters: Mapping[str, str]) -> Form:
    return Form(
        quality=_number(parameters, "quality", 100),
        width=_number(parameters, "width", MOST_SIDE),
        height=_number(parameters, "height", MOST_SIDE),
        inverted="invert" in parameters,
    )


def _number(parameters: Mapping[str, str], name: str, most: int) -> int | None:
    text = parameters.get(name)
    if text is None or text == "-1":  # web_video_server uses -1 for "unchanged"
        return None
    if text.isascii() and text.isdigit() and len(text) < 6 and 1 <= int(text) <= most:
        return int(text)
    raise Refusal(
        400, f"{name} must be a whole number from 1 to {most}, got {_plain(text)}"
    )


def _plain(text: str) -> str:
    cut = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
    return repr("".join(c if c.isprintable() else "?" for c in cut))
