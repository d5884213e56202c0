"""Pictures of cameras."""

from typing import TYPE_CHECKING

import msgspec

from webmap.errors import ProtocolError
from webmap.ros.image_encodings import BAYER, YUV, from_bayer, from_yuv
from webmap.ros.image_size import size_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MAX_BYTES = 4 << 20
"""The largest compressed picture that is shown."""

MAX_PIXELS = 16_000_000
"""The most pixels of a picture that is decoded, here or in a browser."""

_CHANNELS = {
    "rgb8": (0, 1, 2),
    "bgr8": (2, 1, 0),
    "rgba8": (0, 1, 2),
    "bgra8": (2, 1, 0),
    "8UC3": (2, 1, 0),
}
"""For each encoding, which of a pixel's bytes are red, green and blue."""

_WIDE = {"rgba8": 4, "bgra8": 4}
_GREY = {"mono8": "u1", "8UC1": "u1", "mono16": "u2", "16UC1": "u2", "32FC1": "f4"}


class CompressedImageMsg(msgspec.Struct):
    """The fields of ``sensor_msgs/CompressedImage`` that are shown."""

    data: bytes
    format: str = ""

    @property
    def media_type(self) -> str:
        """What the picture is, by its first bytes, whatever ``format`` says.

        Raises:
            ProtocolError: If it is nothing that a browser shows, or has more pixels
                than a browser should have to decode.

        """
        data = self.data
        if len(data) > MAX_BYTES:
            raise ProtocolError(f"a picture of {len(data)} bytes, {MAX_BYTES} at most")
        media_type = _media_type(data)
        if media_type is None:
            raise ProtocolError(
                f"a picture with the format {self.format!r} that is no JPEG, PNG or "
                "WebP"
            )
        width, height = size_of(data)
        if width * height > MAX_PIXELS:
            raise ProtocolError(
                f"a picture of {width} x {height}, {MAX_PIXELS} pixels at most: let "
                "the camera send a smaller one"
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

        What has more than 8 bits is stretched from its least to its greatest value. A
        mosaic of a sensor (``bayer_...``) becomes a picture of half its size.

        Raises:
            ProtocolError: If the encoding is not known or the size does not fit.

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
        if self.encoding in BAYER:
            mosaic = self._rows(f"u{BAYER[self.encoding].octets}", 1)
            if mosaic.dtype.itemsize > 1:
                mosaic = _stretched(mosaic)
            return from_bayer(mosaic, BAYER[self.encoding])
        known = ", ".join(sorted({*_CHANNELS, *_GREY, *YUV, *BAYER}))
        raise ProtocolError(f"the encoding {self.encoding!r}; known are {known}")

    def _rows(self, kind: str, channels: int) -> "NDArray[np.uint8]":
        import numpy as np

        item = np.dtype((">" if self.is_bigendian else "<") + kind)
        used = self.width * channels * item.itemsize
        if self.step < used or len(self.data) < self.height * self.step:
            raise ProtocolError(
                f"{len(self.data)} bytes in rows of {self.step} are too few for "
                f"{self.width} x {self.height} of {self.encoding}"
            )
        rows = np.frombuffer(self.data, np.uint8, self.height * self.step)
        rows = rows.reshape(self.height, self.step)[:, :used]
        return np.ascontiguousarray(rows).view(item)


class AnyImageMsg(msgspec.Struct):
    """A picture of a topic whose type nobody knows: either of both."""

    data: bytes
    format: str = ""
    height: int = 0
    width: int = 0
    encoding: str = ""
    step: int = 0
    is_bigendian: int = 0

    @property
    def packed(self) -> CompressedImageMsg:
        """It as ``sensor_msgs/CompressedImage``."""
        return CompressedImageMsg(self.data, self.format)

    @property
    def raw(self) -> ImageMsg | None:
        """It as ``sensor_msgs/Image``; None if it has no encoding, which that has."""
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
