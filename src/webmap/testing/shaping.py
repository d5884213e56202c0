"""When the bytes of a bad link arrive: decided without I/O."""

import random
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Shape:
    """How one direction of a link treats its bytes."""

    latency: float = 0.0
    """Seconds that every byte is late."""

    jitter: float = 0.0
    """Seconds that may be added to the latency, at random, keeping the order."""

    bandwidth: float | None = None
    """Bytes a second; None for no limit."""

    slice_size: int | None = None
    """Bytes of a piece, into which what is written is cut; None to leave it whole."""

    slice_gap: float = 0.0
    """Seconds between two pieces of what was written at once."""

    def __post_init__(self) -> None:
        for name in ("latency", "jitter", "slice_gap"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must be 0 or more, got {getattr(self, name)}")
        for name in ("bandwidth", "slice_size"):
            if getattr(self, name) is not None and getattr(self, name) <= 0:
                raise ValueError(f"{name} must be above 0, got {getattr(self, name)}")


class Shaper:
    """Says when each byte of one direction is due; never out of order.

    Args:
        shape: How the link is from now on; may be changed at any time.
        seed: Of the jitter.

    """

    def __init__(self, shape: Shape | None = None, seed: int = 1) -> None:
        self.shape = shape or Shape()
        self._random = random.Random(seed)  # noqa: S311 - a fault, not a secret
        self._due = float("-inf")
        self._free_at = float("-inf")

    def take(self, data: bytes, now: float) -> list[tuple[float, bytes]]:
        """Return the pieces of what came in at ``now``, each with when it is due."""
        pieces = []
        for number, piece in enumerate(self._cut(data)):
            begun = now + number * self.shape.slice_gap
            pieces.append((self._when(len(piece), begun), piece))
        return pieces

    def _cut(self, data: bytes) -> list[bytes]:
        size = self.shape.slice_size or max(len(data), 1)
        return [data[at : at + size] for at in range(0, len(data), size)]

    def _when(self, size: int, now: float) -> float:
        shape = self.shape
        if shape.bandwidth is not None:
            now = self._free_at = max(self._free_at, now) + size / shape.bandwidth
        due = now + shape.latency + shape.jitter * self._random.random()
        self._due = max(self._due, due)
        return self._due
