"""Putting fragments together again (rosbridge protocol, 2.2.2).

Python's bridges give every message the same ``id`` and let the fragments of several
topics interleave under it, with a ``total`` that is the length less one, divided by
the size of a fragment, plus one: 5.1446 for five fragments. So a message is known by
``id`` and ``total`` together; where two of one length interleave neither is believed.
"""

import math

import msgspec

from webmap.errors import ProtocolError


class Fragment(msgspec.Struct, frozen=True):
    """One piece of a longer text."""

    id: str | int | float | None
    data: str
    num: int
    total: float

    @property
    def count(self) -> int:
        """How many pieces there are."""
        return math.floor(self.total)


class _Assembly:
    """The pieces of one message, as far as they came."""

    def __init__(self, count: int, began: float) -> None:
        self.count = count
        self.began = began
        self.pieces: dict[int, bytes] = {}
        self.size = 0
        self.received = 0
        self.messages = 1

    def add(self, fragment: Fragment) -> None:
        try:
            data = fragment.data.encode()
        except UnicodeEncodeError as error:
            raise ProtocolError(f"fragments that are no text: {error}") from None
        self.received += 1
        self.size += len(data)
        if fragment.num in self.pieces:
            # Another message of just this length: its pieces cannot be told apart.
            if fragment.num == 0:
                self.messages += 1
            self.messages = max(self.messages, 2)
        self.pieces[fragment.num] = data

    @property
    def is_complete(self) -> bool:
        return self.received >= self.count * self.messages

    @property
    def is_ambiguous(self) -> bool:
        return self.messages > 1

    def text(self) -> bytes:
        return b"".join(self.pieces[num] for num in range(self.count))


class Fragments:
    """The messages of one link that came in part.

    Args:
        max_count: Most fragments of a message.
        max_bytes: Most bytes that wait for their rest, in all.
        max_age: Longest time from the first fragment to the last, in seconds.

    """

    MAX_OPEN = 16
    """Most messages that wait for their rest at a time."""

    def __init__(
        self, *, max_count: int = 64, max_bytes: int = 64 << 20, max_age: float = 60.0
    ) -> None:
        self.max_count = max_count
        self.max_bytes = max_bytes
        self.max_age = max_age
        self._open: dict[tuple[object, float], _Assembly] = {}

    def __len__(self) -> int:
        return len(self._open)

    def add(self, fragment: Fragment, now: float) -> bytes | None:
        """Take one fragment; return the whole text if this was its last.

        Raises:
            ProtocolError: If it makes no sense, a bound is met, or two messages
                were mixed; what belongs to it is forgotten.

        """
        self._expire(now)
        self._check(fragment)
        key = (fragment.id, fragment.total)
        assembly = self._open.get(key)
        if assembly is None:
            assembly = self._open[key] = _Assembly(fragment.count, now)
            self._bound_open()
        assembly.add(fragment)
        self._bound_bytes(key)
        if not assembly.is_complete:
            return None
        del self._open[key]
        if assembly.is_ambiguous:
            raise ProtocolError(
                f"{assembly.messages} messages of {assembly.count} fragments each "
                f"interleave under id {fragment.id!r}: they cannot be told apart"
            )
        return assembly.text()

    def _check(self, fragment: Fragment) -> None:
        if not math.isfinite(fragment.total) or fragment.count < 1:
            raise ProtocolError(f"a fragment of {fragment.total!r} fragments")
        if fragment.count > self.max_count:
            raise ProtocolError(
                f"a message in {fragment.count} fragments, at most "
                f"{self.max_count} are taken"
            )
        if not 0 <= fragment.num < fragment.count:
            raise ProtocolError(f"fragment {fragment.num} of {fragment.count}")

    def _expire(self, now: float) -> None:
        late = [k for k, a in self._open.items() if now - a.began > self.max_age]
        for key in late:
            del self._open[key]

    def _bound_open(self) -> None:
        while len(self._open) > self.MAX_OPEN:
            del self._open[next(iter(self._open))]

    def _bound_bytes(self, key: tuple[object, float]) -> None:
        if sum(assembly.size for assembly in self._open.values()) > self.max_bytes:
            del self._open[key]
            raise ProtocolError(
                f"fragments of more than {self.max_bytes} bytes wait for their rest"
            )
