"""How often one listener hears of a topic."""

from typing import Generic, TypeVar

T = TypeVar("T")


class Throttle(Generic[T]):
    """Let one thing through in each period, and always the newest in the end.

    Args:
        period: Least time between two, in seconds; 0 lets everything through.

    """

    __slots__ = ("_due", "_held", "period")

    def __init__(self, period: float) -> None:
        self.period = period
        self._due = -float("inf")
        self._held: T | None = None

    def offer(self, thing: T, now: float) -> T | None:
        """Return ``thing`` if its time has come; else hold it, instead of an older."""
        if now < self._due:
            self._held = thing
            return None
        return self._let_through(thing, now)

    @property
    def due(self) -> float | None:
        """When what is held may pass, or None if nothing is held."""
        return None if self._held is None else self._due

    def take(self, now: float) -> T | None:
        """Return what was held if its time has come."""
        held = self._held
        if held is None or now < self._due:
            return None
        return self._let_through(held, now)

    def drop(self) -> None:
        """Forget what is held: the link on which it came is gone."""
        self._held = None

    def _let_through(self, thing: T, now: float) -> T:
        # Half a period of slack: a topic of just this rate jitters, and one that
        # comes a millisecond early must not make every second one wait.
        self._due = max(self._due + self.period, now + self.period / 2)
        self._held = None
        return thing
