"""Encodings of raw pictures that cameras send as their sensors have them."""

from typing import TYPE_CHECKING, NamedTuple

from webmap.errors import ProtocolError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

YUV = {
    "yuv422": (1, 0, 2),
    "uyvy": (1, 0, 2),
    "yuv422_yuy2": (0, 1, 3),
    "yuyv": (0, 1, 3),
}
"""For each encoding, where the first light, U and V are in the bytes of two pixels.

``yuv422`` has them in the order of UYVY, as ``sensor_msgs/image_encodings.hpp`` says.
"""


class Mosaic(NamedTuple):
    """How the filters lie before a sensor, in squares of two by two."""

    red: tuple[int, int]
    """Row and column of red."""

    blue: tuple[int, int]
    """Row and column of blue; green are the other two."""

    octets: int
    """Bytes of a value."""


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
    """Return a picture whose colours are shared by two pixels each.

    Args:
        rows: Its bytes, of shape (height, 2 * width).
        order: One of :data:`YUV`.

    Returns:
        Red, green and blue, of shape (height, width, 3), by BT.601 with light from 16
        to 235, as cameras and OpenCV have it.

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
    """Return the picture of a mosaic: each square of two by two becomes a pixel.

    Args:
        mosaic: Of shape (height, width).
        filters: One of :data:`BAYER`.

    Returns:
        Red, green and blue, of shape (height // 2, width // 2, 3).

    Raises:
        ProtocolError: If it is not as large as one square.

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
