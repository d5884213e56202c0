"""What a page is to be told next, and what of that is left out if it grows too long."""

from collections.abc import Iterable
from typing import ClassVar

from webmap.wire.encode import string, varint
from webmap.wire.opcodes import Op


class Unsaid:
    """The records of a page's coming frame that no fragment remembers, by kind.

    All but messages can be made again from what a session keeps; when there is too
    much of that, it is forgotten, and :attr:`tell_all` says that all must be told.
    """

    MESSAGES_KEPT: ClassVar = 1000
    BYTES_KEPT: ClassVar = 256 * 1024
    NOTICES_KEPT: ClassVar = 5
    PROBLEMS_KEPT: ClassVar = 100

    def __init__(self) -> None:
        self.tell_all = False
        """Whether the page must be told everything, whatever it was told before."""
        self.gone = bytearray()
        self.new: list[int] = []
        """The numbers of mounts that the page has not yet."""
        self.records = bytearray()
        self.messages: list[bytes] = []
        self.standing: dict[int, bytes] = {}
        """What says each problem that is not mended, the newest of too many."""
        self.problems: dict[int, bytes] = {}
        """What says, of problems that changed, how each is now."""
        self._notices: dict[bytes, None] = {}

    def record(self, record: bytes | bytearray) -> None:
        """Say something that can be made again."""
        self.records += record
        if len(self.records) > self.BYTES_KEPT:
            # All of it can be made again from what is kept, and that is less.
            self.records.clear()
            self.tell_all = True

    def message(self, record: bytes) -> None:
        """Say something that is said once; of too many, the newest are."""
        if len(self.messages) >= self.MESSAGES_KEPT:
            # A page that looks away this long wants the newest.
            del self.messages[0]
        self.messages.append(record)

    def notice(self, text: str) -> None:
        """Say a notice, and the newest again to a page that was loaded again."""
        record = bytes((Op.ERROR,)) + string(text)
        self._notices.pop(record, None)
        self._notices[record] = None
        if len(self._notices) > self.NOTICES_KEPT:
            del self._notices[next(iter(self._notices))]
        self.message(record)

    def problem(self, number: int, text: str) -> None:
        """Say a problem until it is mended, which no text says; the newest counts."""
        record = bytes((Op.PROBLEM, *varint(number))) + string(text)
        self.standing.pop(number, None)
        if text:
            self.standing[number] = record
        if len(self.standing) > self.PROBLEMS_KEPT:
            del self.standing[next(iter(self.standing))]
        self.problems[number] = record
        if len(self.problems) > self.MESSAGES_KEPT:
            # All of it can be made again from what stands, and that is less.
            self.problems.clear()
            self.tell_all = True

    def notices_again(self) -> Iterable[bytes]:
        """Return the newest notices that are not about to be said anyway."""
        return [record for record in self._notices if record not in self.messages]

    def said(self) -> None:
        """Note that the frame with all of it was made."""
        self.tell_all = False
        self.gone, self.records = bytearray(), bytearray()
        self.new, self.messages, self.problems = [], [], {}
