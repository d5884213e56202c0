"""What a page is to be told next, and what of that is left out if it grows too long."""

from collections.abc import Iterable
from typing import ClassVar

from webmap.wire.encode import string
from webmap.wire.opcodes import Op


class Unsaid:
    """The records of a page's coming frame that no fragment remembers, by kind.

    All but messages can be made again from what a session keeps; when there is too
    much of that, it is forgotten, and :attr:`tell_all` says that all must be told.
    """

    MESSAGES_KEPT: ClassVar = 1000
    BYTES_KEPT: ClassVar = 256 * 1024
    NOTICES_KEPT: ClassVar = 5

    def __init__(self) -> None:
        self.tell_all = False
        """Whether the page must be told everything, whatever it was told before."""
        self.gone = bytearray()
        self.new: list[int] = []
        """The numbers of mounts that the page has not yet."""
        self.records = bytearray()
        self.messages: list[bytes] = []
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

    def notices_again(self) -> Iterable[bytes]:
        """Return the newest notices that are not about to be said anyway."""
        return [record for record in self._notices if record not in self.messages]

    def said(self) -> None:
        """Note that the frame with all of it was made."""
        self.tell_all = False
        self.gone, self.records = bytearray(), bytearray()
        self.new, self.messages = [], []
