"""What a session remembers of its page: mounts, maps, and what is to be sent next."""

import math
import struct
from collections import deque
from collections.abc import Iterable
from typing import ClassVar

from webmap.scene.element import Element
from webmap.scene.fragment import Fragment
from webmap.scene.wire.encode import EVENT_NUMBER, encode_snapshot, string, varint
from webmap.scene.wire.messages import ViewReport
from webmap.scene.wire.opcodes import PREVENT, STOP, VIEW_OPERATIONS, Op

_ORDER = struct.Struct("<d").pack


class Mount:
    """A fragment at one place of one page."""

    def __init__(
        self, number: int, fragment: Fragment, within: int, under: int, order: float
    ) -> None:
        self.number = number
        self.fragment = fragment
        self.within = within
        self.under = under
        self.order = order
        self.classes: dict[str, None] = {}
        self.listening: dict[tuple[int, str], int] = {}

    def record(self) -> bytes:
        """Return what puts the fragment there, as it is now."""
        out = bytearray([Op.MOUNT])
        out += varint(self.number) + varint(self.fragment.id)
        out += varint(self.within) + varint(self.under) + _ORDER(self.order)
        out.append(Op.SNAPSHOT)
        return bytes(out) + varint(self.number) + encode_snapshot(self.fragment)

    def choices(self) -> bytes:
        """Return what only this page has: classes and listeners."""
        return b"".join(
            [self.class_record(name, True) for name in self.classes]
            + [self.listen_record(*key) for key in self.listening]
        )

    def class_record(self, name: str, on: bool) -> bytes:
        """Return what gives or takes a class of the fragment's root."""
        head = bytes((Op.MOUNT_CLASS, *varint(self.number), on))
        return head + string(name)

    def listen_record(self, element: int, event: str) -> bytes:
        """Return what makes the page listen, or not listen any more."""
        flags = self.listening.get((element, event))
        op = Op.UNLISTEN if flags is None else Op.LISTEN
        out = bytearray([op]) + varint(self.number) + varint(element)
        out.append(EVENT_NUMBER[event])
        if flags is not None:
            out.append(flags)
        return bytes(out)

    def hears(self, element: int, event: str) -> bool:
        """Whether anybody here listens to that event of that element now."""
        if (element, event) in self.listening:
            return True
        node = self.fragment.find(element)
        return isinstance(node, Element) and bool(node.handlers(event))


def flags(*, prevent: bool, stop: bool) -> int:
    """Return the flags of an event that is listened to."""
    return PREVENT * prevent | STOP * stop


_MATRIX = struct.Struct("<6d").pack
_COUNTS = {
    "translate": (2,),
    "scale": (1, 3),
    "rotate": (1, 3),
    "set": (6,),
    "fit": (4,),
    "follow": (1,),
}


class MapView:
    """One map: its last report, and the operations that are not in it yet."""

    UNREPORTED_KEPT = 1000

    def __init__(self, mount: int, svg: int) -> None:
        self.mount = mount
        self.svg = svg
        self.report: ViewReport | None = None
        self._number = 0
        self._unreported: deque[tuple[int, bytes]] = deque(maxlen=self.UNREPORTED_KEPT)

    def state(self, session: int) -> bytes:
        """Return how the map was last seen, for a page that does not know."""
        report = self.report
        out = bytearray([Op.VIEW_STATE]) + varint(self.svg) + varint(session)
        if report is None:
            out += b"\0\0"
        else:
            out += varint(report.applied) + b"\1"
            out += _MATRIX(report.a, report.b, report.c, report.d, report.e, report.f)
            out += varint(report.follow)
        return bytes(out)

    def operate(self, operation: str, args: tuple[float, ...]) -> bytes:
        """Return the record of an operation, and keep it until it is reported.

        Raises:
            ValueError: If there is no such operation, or its numbers are wrong.

        """
        if len(args) not in _COUNTS.get(operation, ()):
            raise ValueError(f"a view knows {_COUNTS}, got {operation}{args}")
        if not all(map(math.isfinite, args)):
            raise ValueError(f"{operation} takes finite numbers, got {args}")
        self._number += 1
        out = bytearray([Op.VIEW]) + varint(self.svg) + varint(self._number)
        out += bytes((VIEW_OPERATIONS.index(operation), len(args)))
        record = bytes(out) + struct.pack(f"<{len(args)}d", *args)
        self._unreported.append((self._number, record))
        return record

    def take(self, report: ViewReport) -> None:
        """Remember how the page shows the map."""
        self.report = report
        while self._unreported and self._unreported[0][0] <= report.applied:
            self._unreported.popleft()

    @property
    def unreported(self) -> bytes:
        """The records of the operations that no report has in it."""
        return b"".join(record for _, record in self._unreported)


class PendingRecords:
    """The records of a page's next frame that no fragment remembers, by kind.

    All but messages can be made again from what a session keeps. When they grow too
    long, they are forgotten, and :attr:`send_all` is set.
    """

    MESSAGES_KEPT: ClassVar = 1000
    BYTES_KEPT: ClassVar = 256 * 1024
    NOTICES_KEPT: ClassVar = 5
    PROBLEMS_KEPT: ClassVar = 100

    def __init__(self) -> None:
        self.send_all = False
        """Whether the page must get everything, whatever it got before."""
        self.gone = bytearray()
        self.new: list[int] = []
        """The numbers of mounts that the page has not yet."""
        self.records = bytearray()
        self.messages: list[bytes] = []
        self.standing: dict[int, bytes] = {}
        """The record of each problem that is not mended, the newest of too many."""
        self.problems: dict[int, bytes] = {}
        """The record of each problem that changed."""
        self._notices: dict[bytes, None] = {}

    def record(self, record: bytes | bytearray) -> None:
        """Add a record that can be made again."""
        self.records += record
        if len(self.records) > self.BYTES_KEPT:
            # All of it can be made again from what is kept, and that is less.
            self.records.clear()
            self.send_all = True

    def message(self, record: bytes) -> None:
        """Add a message, which is sent once; of too many, the newest are kept."""
        if len(self.messages) >= self.MESSAGES_KEPT:
            # A page that looks away this long wants the newest.
            del self.messages[0]
        self.messages.append(record)

    def notice(self, text: str) -> None:
        """Add a notice; the newest are sent again to a page that was loaded again."""
        record = bytes((Op.ERROR,)) + string(text)
        self._notices.pop(record, None)
        self._notices[record] = None
        if len(self._notices) > self.NOTICES_KEPT:
            del self._notices[next(iter(self._notices))]
        self.message(record)

    def problem(self, number: int, text: str) -> None:
        """Add a problem, or with no text its end; the newest text counts."""
        record = bytes((Op.PROBLEM, *varint(number))) + string(text)
        self.standing.pop(number, None)
        if text:
            self.standing[number] = record
        if len(self.standing) > self.PROBLEMS_KEPT:
            del self.standing[next(iter(self.standing))]
        self.problems[number] = record
        if len(self.problems) > self.MESSAGES_KEPT:
            # All of it can be made again from what is kept, and that is less.
            self.problems.clear()
            self.send_all = True

    def notices_again(self) -> Iterable[bytes]:
        """Return the newest notices that are not in the next frame anyway."""
        return [record for record in self._notices if record not in self.messages]

    def sent(self) -> None:
        """Note that the frame with all of it was made."""
        self.send_all = False
        self.gone, self.records = bytearray(), bytearray()
        self.new, self.messages, self.problems = [], [], {}
