"""Arrays of messages with strings, such as transforms, read in one step.

The lengths of the strings decide where the fields of all items are. They are nearly
always those of an earlier message with as many bytes, so its plan is tried first. Each
length is compared while the items are built; after a wrong guess a new plan is made.
"""

import struct
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeAlias

MOST_PLANS = 16
"""Most plans that are kept for one array."""

MOST_ITEMS = 128
"""Most items of an array whose plan is kept."""

_MOST_TEXTS = 1024
_LONGEST = 128
_MOST_BYTES = MOST_ITEMS * _LONGEST


class Misguess(ValueError):
    """The strings have other lengths than in the plan."""


class Piece(NamedTuple):
    """A part of each item: fields of fixed size, padding, or a string."""

    codes: str = ""
    """The fields in the codes of :mod:`struct`."""

    size: int = 0
    unit: int = 0
    """If not 0, padding up to a multiple of this."""

    is_text: bool = False


Plan: TypeAlias = tuple[Callable[[bytes | memoryview, int], tuple[Any, ...]], int]
"""Unpacks the values of all items, where a string has its length before it; and how
many bytes the items have."""


class Rows:
    """One array of a type, with the plans of earlier messages.

    Args:
        pieces: The parts of each item.
        order: The byte order, as in :mod:`struct`.
        start: Where the message begins, for padding.

    """

    def __init__(self, pieces: Sequence[Piece], order: str, start: int) -> None:
        self.plans: dict[Any, Plan] = {}
        self._pieces = pieces
        self._order = order
        self._start = start
        self._length = struct.Struct(f"{order}I").unpack_from

    def plan(self, data: bytes | memoryview, at: int, count: int, key: Any) -> Plan:
        """Return the plan of an array, and keep it if the message has so many bytes.

        Args:
            data: The message.
            at: Where the array begins.
            count: The number of its items.
            key: What the plans of two messages have in common.

        """
        codes, start = [self._order], at
        for _ in range(count):
            for codes_of, size, unit, is_text in self._pieces:
                if is_text:
                    size = 4 + self._length(data, at)[0]
                    if size > len(data):
                        raise IndexError
                    codes.append(f"{size}s")
                elif unit:
                    size = -(at - self._start) % unit
                    codes.append(f"{size}x")
                else:
                    codes.append(codes_of)
                at += size
        plan = struct.Struct("".join(codes)).unpack_from, at - start
        if count <= MOST_ITEMS and at <= len(data):
            if len(self.plans) >= MOST_PLANS:
                self.plans.clear()
            self.plans[key] = plan
        return plan


class Texts(dict[bytes, str]):
    """Strings by their bytes, which are the same in most messages.

    Args:
        big: Whether the most significant byte of a length is the first.
        ends: Whether a string may end with a zero, as in CDR.

    """

    def __init__(self, *, big: bool, ends: bool) -> None:
        super().__init__()
        self._big = big
        self._ends = ends
        self._columns: dict[tuple[bytes, ...], tuple[str, ...]] = {}

    def column(self, data: tuple[bytes, ...]) -> tuple[str, ...]:
        """Return the strings of all items; often they are those of a message before."""
        found = self._columns.get(data)
        if found is None:
            found = tuple(map(self.__getitem__, data))
            if len(data) <= MOST_ITEMS and sum(map(len, data)) <= _MOST_BYTES:
                if len(self._columns) >= MOST_PLANS:
                    self._columns.clear()
                self._columns[data] = found
        return found

    def __missing__(self, data: bytes) -> str:
        length = int.from_bytes(data[:4], "big" if self._big else "little")
        if length != len(data) - 4:
            raise Misguess
        text = text_of(data[4:], ends=self._ends)
        if len(data) <= _LONGEST:
            if len(self) >= _MOST_TEXTS:
                self.clear()
            self[data] = text
        return text


def text_of(data: bytes | memoryview, *, ends: bool) -> str:
    """Return the text of a string; bytes that are not UTF-8 become U+FFFD."""
    if ends and data and not data[-1]:
        data = data[:-1]
    return str(data, "utf-8", "replace")
