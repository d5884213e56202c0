"""Which pages are open: one socket of a kind for each, and not too many."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Generic, Protocol, TypeVar


class Seated(Protocol):
    """Something that can be told to go."""

    def end(self, code: int, reason: str) -> None:
        """Go, for the given reason."""


T = TypeVar("T", bound=Seated)
Key = tuple[str, str]
"""A viewer and one of its pages."""

REPLACED = 4001
"""The close code of a socket whose page has opened another."""


class Seats(Generic[T]):
    """The sockets of one kind that are open now."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._taken: dict[Key, T] = {}

    def __len__(self) -> int:
        return len(self._taken)

    def take(self, key: Key, newcomer: T) -> bool:
        """Seat a socket; False if every seat is taken by other pages.

        A page that opens again takes its own seat over: its old socket may be one
        that the network has lost and nobody has missed yet.
        """
        before = self._taken.get(key)
        if before is None and len(self._taken) >= self._limit:
            return False
        self._taken[key] = newcomer
        if before is not None:
            before.end(REPLACED, "this page has been opened again")
        return True

    def leave(self, key: Key, leaver: T) -> None:
        """Free a seat, unless somebody else has taken it over."""
        if self._taken.get(key) is leaver:
            del self._taken[key]

    @asynccontextmanager
    async def taken(self, key: Key, newcomer: T) -> AsyncIterator[bool]:
        """Hold a seat within an ``async with`` block; gives False if there is none."""
        seated = self.take(key, newcomer)
        try:
            yield seated
        finally:
            self.leave(key, newcomer)
