"""What was wrong with transforms of late, and whom it concerns."""

from dataclasses import dataclass

from webmap.tf import Buffer

STANDS = 10.0
"""Seconds for which a fault is said, after it was seen last."""

MOST = 50
"""Frames of whose faults note is kept."""


@dataclass(slots=True)
class _Fault:
    frames: tuple[str, str]
    words: str
    seen: float


class FrameFaults:
    """Keeps the faults of transforms until they have not been seen for a while.

    Args:
        buffer: The frames; who hangs from whom says whom a fault concerns.

    """

    def __init__(self, buffer: Buffer) -> None:
        self._buffer = buffer
        self._faults: dict[str, _Fault] = {}

    @property
    def any(self) -> bool:
        """Whether there is one."""
        return bool(self._faults)

    def note(self, parent: str, child: str, words: str, now: float) -> bool:
        """Note that a transform had a fault.

        Args:
            parent: The frame that its numbers are in.
            child: The frame whose place it tells.
            words: What was wrong, in a sentence.
            now: The time, in seconds of any clock that only goes forward.

        Returns:
            Whether it is news; a fault of every message is said once.

        """
        known = self._faults.get(child)
        if known is not None:
            known.seen = now
            return False
        if len(self._faults) >= MOST:
            return False
        self._faults[child] = _Fault((parent, child), words, now)
        return True

    def of(self, base: str, now: float) -> str | None:
        """Return what is wrong with the frames that a robot is placed by, if anything.

        Args:
            base: The robot's own frame. Concerned are the frames that it hangs from
                and those with the same prefix.
            now: As in :meth:`note`.

        """
        if not self._faults:
            return None
        for child in [c for c, f in self._faults.items() if now > f.seen + STANDS]:
            del self._faults[child]
        space = base.rpartition("/")[0]
        chain = set(self._buffer.chain(base))
        said = [
            fault.words
            for fault in self._faults.values()
            if chain.intersection(fault.frames)
            or (space and any(name.startswith(f"{space}/") for name in fault.frames))
        ]
        return said[0] if said else None
