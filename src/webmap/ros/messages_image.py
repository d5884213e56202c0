"""Pictures and video of cameras: their typed views, their encodings, their sizes."""

from typing import TYPE_CHECKING, NamedTuple

import msgspec

from webmap.base.errors import ProtocolError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

YUV = {
    "yuv422": (1, 0, 2),
    "uyvy": (1, 0, 2),
    "yuv422_yuy2": (0, 1, 3),
    "yuyv": (0, 1, 3),
}
"""For each encoding, the positions of the first Y, U and V in the bytes of two pixels.

``yuv422`` has the order of UYVY, as defined in ``sensor_msgs/image_encodings.hpp``.
"""

SEMI_PLANAR = {"nv12": (0, 1, 3), "nv21": (0, 3, 1)}
"""The encodings with a plane of all Y, then one of U and V for each 2 x 2 pixels.

The values are those of :data:`YUV`, after Y and the other plane are interleaved. The
height of a message is that of the picture: its data has half as many rows again.
"""


class Mosaic(NamedTuple):
    """The order of the colour filters of a sensor, in squares of 2 x 2 values."""

    red: tuple[int, int]
    """Row and column of red."""

    blue: tuple[int, int]
    """Row and column of blue; the other two are green."""

    octets: int
    """Bytes per value."""


_CORNERS = {
    "rggb": ((0, 0), (1, 1)),
    "bggr": ((1, 1), (0, 0)),
    "gbrg": ((1, 0), (0, 1)),
    "grbg": ((0, 1), (1, 0)),
}

BAYER = {
    f"bayer_{name}{8 * octets}": Mosaic(red, blue, octets)
    for name, (red, blue) in _CORNERS.items()
    for octets in (1, 2)
}
"""The encodings that are mosaics."""


def from_yuv(
    rows: "NDArray[np.uint8]", order: tuple[int, int, int]
) -> "NDArray[np.uint8]":
    """Return a picture in which two pixels share one colour as RGB.

    Args:
        rows: The bytes, of shape (height, 2 * width).
        order: One of :data:`YUV` or :data:`SEMI_PLANAR`.

    Returns:
        Red, green and blue, of shape (height, width, 3), by BT.601 with Y from 16 to
        235, as in cameras and OpenCV.

    Raises:
        ProtocolError: If the width is odd.

    """
    import numpy as np

    height, width = rows.shape[0], rows.shape[1] // 2
    if width % 2:
        raise ProtocolError(
            f"two pixels share their colours, so the width must be even, got {width}"
        )
    pairs = rows.reshape(height, width // 2, 4).astype(np.float32)
    light, u, v = order
    luma = 1.164 * (pairs[..., light::2] - 16)
    blue, red = pairs[..., u, None] - 128, pairs[..., v, None] - 128
    shades = (
        luma + 1.596 * red,
        luma - 0.813 * red - 0.391 * blue,
        luma + 2.018 * blue,
    )
    flat = [shade.reshape(height, width) for shade in shades]
    return np.stack(flat, axis=-1).clip(0, 255).round().astype(np.uint8)


def from_bayer(mosaic: "NDArray[np.uint8]", filters: Mosaic) -> "NDArray[np.uint8]":
    """Return the picture of a mosaic: each square of 2 x 2 values becomes a pixel.

    Args:
        mosaic: Of shape (height, width).
        filters: One of :data:`BAYER`.

    Returns:
        Red, green and blue, of shape (height // 2, width // 2, 3).

    Raises:
        ProtocolError: If the mosaic is smaller than one square.

    """
    import numpy as np

    height, width = (side // 2 * 2 for side in mosaic.shape)
    if height == 0 or width == 0:
        raise ProtocolError(
            f"a mosaic of {mosaic.shape[1]} x {mosaic.shape[0]}, 2 x 2 at least"
        )

    def of(row: int, column: int) -> "NDArray[np.uint8]":
        return mosaic[row:height:2, column:width:2]

    (red, left), (blue, right) = filters.red, filters.blue
    one, other = of(red, 1 - left), of(blue, 1 - right)
    green = ((one.astype(np.uint16) + other) // 2).astype(np.uint8)
    return np.stack([of(red, left), green, of(blue, right)], axis=-1)


MOST_SEGMENTS = 1000
"""Most segments of a JPEG before the segment with its size."""

_NO_FRAME = (0xC4, 0xC8, 0xCC)
"""Markers from 0xC0 to 0xCF that do not begin a frame."""


def size_of(data: bytes) -> tuple[int, int]:
    """Return width and height of a JPEG, PNG or WebP, in pixels, from its head alone.

    A picture of a few kilobytes may have billions of pixels. A program that decodes it,
    also a browser, runs out of memory. This function does not search for a size as a
    browser does, so a picture whose size is not in the expected place is refused.

    Raises:
        ProtocolError: If the size is missing or not in the expected place.

    """
    if data.startswith(b"\xff\xd8"):
        size = _of_jpeg(data)
    elif data[12:16] == b"IHDR":
        size = _number(data[16:20]), _number(data[20:24])
    elif data[8:12] == b"WEBP":
        size = _of_webp(data)
    else:
        size = 0, 0
    if not (size[0] > 0 and size[1] > 0):
        raise ProtocolError("a picture without a size in its header")
    return size


def _of_jpeg(data: bytes) -> tuple[int, int]:
    at = 2
    for _ in range(MOST_SEGMENTS):
        while data[at : at + 2] == b"\xff\xff":  # fill bytes
            at += 1
        if len(data) < at + 9 or data[at] != 0xFF:
            break
        marker = data[at + 1]
        if 0xC0 <= marker <= 0xCF and marker not in _NO_FRAME:
            return _number(data[at + 7 : at + 9]), _number(data[at + 5 : at + 7])
        if marker in (0xD9, 0xDA):  # the end, or pixels without a frame
            break
        at += 2 + _number(data[at + 2 : at + 4])
    return 0, 0


def _of_webp(data: bytes) -> tuple[int, int]:
    kind, body = data[12:16], data[20:30]
    if len(body) < 10:
        return 0, 0
    if kind == b"VP8X":
        return 1 + _little(body[4:7]), 1 + _little(body[7:10])
    if kind == b"VP8L" and body[0] == 0x2F:
        bits = _little(body[1:5])
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    if kind == b"VP8 " and body[3:6] == b"\x9d\x01\x2a":
        return _little(body[6:8]) & 0x3FFF, _little(body[8:10]) & 0x3FFF
    return 0, 0


def _number(data: bytes) -> int:
    return int.from_bytes(data, "big")


def _little(data: bytes) -> int:
    return int.from_bytes(data, "little")


MAX_BYTES = 4 << 20
"""Most bytes of a compressed picture that is shown."""

MAX_PIXELS = 16_000_000
"""Most pixels of a picture that is decoded, here or in a browser."""

_CHANNELS = {
    "rgb8": (0, 1, 2),
    "bgr8": (2, 1, 0),
    "rgba8": (0, 1, 2),
    "bgra8": (2, 1, 0),
    "8UC3": (2, 1, 0),
    "8UC4": (2, 1, 0),
}
"""For each encoding, the positions of red, green and blue in the bytes of a pixel."""

_WIDE = {"rgba8": 4, "bgra8": 4, "8UC4": 4}
_GREY = {"mono8": "u1", "8UC1": "u1", "mono16": "u2", "16UC1": "u2", "32FC1": "f4"}


class CompressedImageMsg(msgspec.Struct):
    """The fields of ``sensor_msgs/CompressedImage`` that are used."""

    data: bytes
    format: str = ""

    @property
    def media_type(self) -> str:
        """The media type of the picture, by its first bytes; ``format`` is ignored.

        Raises:
            ProtocolError: If a browser cannot show the picture, or it has too many
                pixels.

        """
        data = self.data
        if len(data) > MAX_BYTES:
            raise ProtocolError(f"a picture of {len(data)} bytes, {MAX_BYTES} at most")
        media_type = _media_type(data)
        if media_type is None:
            raise ProtocolError(
                f"a picture with the format {self.format!r} that is not JPEG, PNG "
                "or WebP"
            )
        width, height = size_of(data)
        if width * height > MAX_PIXELS:
            raise ProtocolError(
                f"a picture of {width} x {height}, {MAX_PIXELS} pixels at most: "
                "configure the camera for a smaller one"
            )
        return media_type


class ImageMsg(msgspec.Struct):
    """The fields of ``sensor_msgs/Image``."""

    height: int
    width: int
    encoding: str
    step: int
    data: bytes
    is_bigendian: int = 0

    def pixels(self) -> "NDArray[np.uint8]":
        """Return the picture, of shape (height, width, 3) or, if grey, (height, width).

        Values of more than 8 bits are scaled from their least and greatest value. A
        mosaic of a sensor (``bayer_...``) becomes a picture of half its size.

        Raises:
            ProtocolError: If the encoding is unknown or the size does not fit.

        """
        width, height = self.width, self.height
        if not (width > 0 and height > 0 and width * height <= MAX_PIXELS):
            raise ProtocolError(
                f"a picture of {width} x {height}, {MAX_PIXELS} pixels at most"
            )
        if self.encoding in _CHANNELS:
            wide = _WIDE.get(self.encoding, 3)
            rows = self._rows("u1", wide)
            return rows.reshape(height, width, wide)[..., _CHANNELS[self.encoding]]
        if self.encoding in _GREY:
            grey = self._rows(_GREY[self.encoding], 1)
            return grey if grey.dtype.itemsize == 1 else _stretched(grey)
        if self.encoding in YUV:
            return from_yuv(self._rows("u1", 2), YUV[self.encoding])
        if self.encoding in SEMI_PLANAR:
            return from_yuv(self._interleaved(), SEMI_PLANAR[self.encoding])
        if self.encoding in BAYER:
            mosaic = self._rows(f"u{BAYER[self.encoding].octets}", 1)
            if mosaic.dtype.itemsize > 1:
                mosaic = _stretched(mosaic)
            return from_bayer(mosaic, BAYER[self.encoding])
        known = ", ".join(sorted({*_CHANNELS, *_GREY, *YUV, *SEMI_PLANAR, *BAYER}))
        raise ProtocolError(f"the encoding {self.encoding!r}; known are {known}")

    def _interleaved(self) -> "NDArray[np.uint8]":
        """Return the rows of two planes, as of ``yuyv``."""
        import numpy as np

        height = self.height
        count = height + (height + 1) // 2
        # Some drivers set the step to the size of all data divided by the height.
        packed = len(self.data) == count * self.width
        step = self.width if packed else self.step
        planes = msgspec.structs.replace(self, height=count, step=step)
        rows = planes._rows("u1", 1)
        shared = rows[height:].repeat(2, axis=0)[:height]
        return np.stack([rows[:height], shared], axis=-1).reshape(height, -1)

    def _rows(self, kind: str, channels: int) -> "NDArray[np.uint8]":
        import numpy as np

        item = np.dtype((">" if self.is_bigendian else "<") + kind)
        used = self.width * channels * item.itemsize
        if self.step < used or len(self.data) < self.height * self.step:
            raise ProtocolError(
                f"{len(self.data)} bytes with a step of {self.step} are too few for "
                f"{self.height} rows of {self.width} in {self.encoding}"
            )
        rows = np.frombuffer(self.data, np.uint8, self.height * self.step)
        rows = rows.reshape(self.height, self.step)[:, :used]
        return np.ascontiguousarray(rows).view(item)


class AnyImageMsg(msgspec.Struct):
    """A picture of a topic of unknown type: compressed or not."""

    data: bytes
    format: str = ""
    height: int = 0
    width: int = 0
    encoding: str = ""
    step: int = 0
    is_bigendian: int = 0

    @property
    def packed(self) -> CompressedImageMsg:
        """The same as ``sensor_msgs/CompressedImage``."""
        return CompressedImageMsg(self.data, self.format)

    @property
    def raw(self) -> ImageMsg | None:
        """The same as ``sensor_msgs/Image``; None without an encoding."""
        if not self.encoding:
            return None
        return ImageMsg(
            self.height,
            self.width,
            self.encoding,
            self.step,
            self.data,
            self.is_bigendian,
        )


class CompressedVideoMsg(msgspec.Struct):
    """The fields of ``foxglove_msgs/CompressedVideo`` that are used."""

    data: bytes
    format: str = ""


class FfmpegPacketMsg(msgspec.Struct):
    """The fields of ``ffmpeg_image_transport_msgs/FFMPEGPacket`` that are used."""

    data: bytes
    encoding: str = ""

    @property
    def format(self) -> str:
        """The codec, as in :class:`CompressedVideoMsg`, and what it was made from."""
        return self.encoding


def _media_type(data: bytes) -> str | None:
    if data.startswith(b"\xff\xd8\xff"):
        return "image/jpeg"
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return "image/png"
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return "image/webp"
    return None


def _stretched(values: "NDArray[np.uint8]") -> "NDArray[np.uint8]":
    import numpy as np

    finite = np.where(np.isfinite(values), values, 0).astype(np.float64)
    low, high = float(finite.min()), float(finite.max())
    return ((finite - low) * (255.0 / max(high - low, 1e-9))).astype(np.uint8)
