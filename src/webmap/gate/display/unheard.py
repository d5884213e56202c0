"""STOPs that were said and that no gate may have heard. No I/O.

A gate may end in the moment in which somebody says STOP, or not run at all. So a STOP
is kept until a gate that was told of it has gone on for a while, and every new gate is
told of it again. A robot that is told to stop twice stands no less.
"""

from collections.abc import Iterator

HEEDED = 2.0
"""Seconds for which a gate must have gone on since it was told."""


class Unheard:
    """The STOPs that are kept, each with who said it."""

    def __init__(self) -> None:
        self._said: dict[tuple[str | None, str | None], float] = {}

    def __iter__(self) -> Iterator[tuple[str | None, str | None]]:
        """Go through them: by whose connection, or ``None``, and for which robot."""
        return iter(list(self._said))

    def say(self, by: str | None, robot: str | None, now: float) -> None:
        """Keep one; a gate that runs is told of it now.

        Args:
            by: The connection that said it; ``None`` for a program.
            robot: Which robot; ``None`` for all.
            now: The time.

        """
        self._said[by, robot] = now

    def told(self, now: float) -> None:
        """Note that a gate has only now been told of all."""
        self._said = dict.fromkeys(self._said, now)

    def lives(self, now: float) -> None:
        """Note that the gate that was told goes on."""
        if self._said:
            self._said = {
                who: at for who, at in self._said.items() if now - at < HEEDED
            }
