"""How much one page may ask of the server: decisions without I/O."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Bounds:
    """What one socket may send."""

    max_bytes: int
    """The largest message, in bytes of UTF-8."""

    rate: float
    """Messages a second, over any long time."""

    burst: float
    """Messages at once. A link that stalled delivers what it held back in one go."""


SCENE = Bounds(max_bytes=16 * 1024, rate=120.0, burst=240.0)
# 20 commands a second for the 6 s after which a silent link is given up.
DRIVE = Bounds(max_bytes=1024, rate=60.0, burst=120.0)


class Allowance:
    """What one socket has left of its bounds: a bucket that fills at a rate."""

    __slots__ = ("_bounds", "_left", "_then")

    def __init__(self, bounds: Bounds, now: float) -> None:
        self._bounds = bounds
        self._left = bounds.burst
        self._then = now

    def spend(self, text: str, now: float) -> str | None:
        """Count one message; return why the socket must end, None if it need not.

        Args:
            text: The message.
            now: Seconds, monotonic.

        """
        bounds = self._bounds
        size = len(text) if text.isascii() else len(text.encode(errors="replace"))
        if size > bounds.max_bytes:
            return f"a message of {size} bytes, at most {bounds.max_bytes} are taken"
        filled = self._left + (now - self._then) * bounds.rate
        self._left, self._then = min(bounds.burst, filled) - 1.0, now
        if self._left < 0.0:
            return f"more than {bounds.rate:.0f} messages a second"
        return None
