"""rosbridge's ``png``: text hidden in the pixels of a picture (protocol, 2.2.3)."""

import base64
import binascii
import io

from webmap.errors import ProtocolError
from webmap.ros.limits import MAX_OTHER


def decode(data: str, *, max_bytes: int = MAX_OTHER) -> bytes:
    """Return the text in the pixels of a PNG given in base64.

    Raises:
        ProtocolError: If it is no RGB picture in PNG, or one of more than
            ``max_bytes`` of pixels.

    """
    try:
        packed = base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError) as error:
        raise ProtocolError(f"a PNG that is not base64: {error}") from None
    return _pixels(packed, max_bytes).rstrip(b"\n")


def _pixels(packed: bytes, max_bytes: int) -> bytes:
    from PIL import Image

    # Its size stands in its first 24 bytes: refused before anything is unpacked.
    width = int.from_bytes(packed[16:20], "big")
    height = int.from_bytes(packed[20:24], "big")
    if width * height * 3 > max_bytes:
        raise ProtocolError(
            f"a PNG of {width} x {height}, which is too large: it holds "
            f"{width * height * 3} bytes, and {max_bytes} are the limit; subscribe "
            "with compression='cbor'"
        )
    try:
        with Image.open(io.BytesIO(packed), formats=["PNG"]) as image:
            if image.mode != "RGB" or image.size != (width, height):
                raise ProtocolError(f"expected an RGB picture, got {image.mode}")
            return image.tobytes()
    except ProtocolError:
        raise
    except Exception as error:  # Pillow raises whatever its parsers meet
        raise ProtocolError(f"not a PNG: {error!r}") from None
