"""How somebody wants a camera's pictures: their quality, their size, upside down."""

import io
from dataclasses import dataclass

from PIL import Image

MOST_SIDE = 4096
"""Pixels of the longest side that a picture is made or read with."""

_TOO_LARGE = (Image.DecompressionBombError, Image.DecompressionBombWarning)


class NoPicture(Exception):
    """What a topic brought is no JPEG that can be read."""


@dataclass(frozen=True, slots=True)
class Form:
    """The form of a picture; what is None stays as the camera has it."""

    quality: int | None = None
    """1 to 100."""

    width: int | None = None
    """In pixels; the height does not follow by itself."""

    height: int | None = None
    """In pixels."""

    inverted: bool = False
    """Whether it is turned by half a turn."""

    @property
    def is_plain(self) -> bool:
        """Whether pictures go out byte by byte as they came."""
        return self == Form()

    def apply(self, jpeg: bytes) -> bytes:
        """Return a picture in this form.

        Raises:
            NoPicture: If it is none.

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
        # 95 is what web_video_server takes where nobody says.
        shown.save(file, "JPEG", quality=self.quality or 95)
        return file.getvalue()
