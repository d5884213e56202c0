"""The state of a page in a session: mounts, maps, and the records to send next."""

import math
import struct
from collections import deque
from collections.abc import Iterable
from typing import ClassVar

from webmap.scene.element import Element
from webmap.scene.node import Fragment, frame_request
from webmap.scene.wire.encode import EVENT_NUMBER, encode_snapshot
from webmap.scene.wire.messages import ViewReport
from webmap.scene.wire.opcodes import PREVENT, STOP, VIEW_OPERATIONS, Op, string, varint

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
        """Return the records that mount the current fragment."""
        out = bytearray([Op.MOUNT])
        out += varint(self.number) + varint(self.fragment.id)
        out += varint(self.within) + varint(self.under) + _ORDER(self.order)
        out.append(Op.SNAPSHOT)
        return bytes(out) + varint(self.number) + encode_snapshot(self.fragment)

    def choices(self) -> bytes:
        """Return the records that only this page has: classes and listeners."""
        return b"".join(
            [self.class_record(name, True) for name in self.classes]
            + [self.listen_record(*key) for key in self.listening]
        )

    def class_record(self, name: str, on: bool) -> bytes:
        """Return the record that adds or removes a class of the fragment's root."""
        head = bytes((Op.MOUNT_CLASS, *varint(self.number), on))
        return head + string(name)

    def listen_record(self, element: int, event: str) -> bytes:
        """Return the record that makes the page listen, or stop listening."""
        flags = self.listening.get((element, event))
        op = Op.UNLISTEN if flags is None else Op.LISTEN
        out = bytearray([op]) + varint(self.number) + varint(element)
        out.append(EVENT_NUMBER[event])
        if flags is not None:
            out.append(flags)
        return bytes(out)

    def has_listener(self, element: int, event: str) -> bool:
        """Return whether an event of an element has a listener here now."""
        if (element, event) in self.listening:
            return True
        node = self.fragment.find(element)
        return isinstance(node, Element) and bool(node.handlers(event))


def flags(*, prevent: bool, stop: bool) -> int:
    """Return the flags of an event with a listener."""
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
    """One map: its last report, and the operations after that report."""

    UNREPORTED_KEPT = 1000

    def __init__(self, mount: int, svg: int) -> None:
        self.mount = mount
        self.svg = svg
        self.report: ViewReport | None = None
        self._number = 0
        self._unreported: deque[tuple[int, bytes]] = deque(maxlen=self.UNREPORTED_KEPT)

    def state(self, session: int) -> bytes:
        """Return the last reported view of the map, for a new page."""
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
            ValueError: If the operation is unknown, or its numbers are wrong.

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
        """Store the page's report of the map's view."""
        self.report = report
        while self._unreported and self._unreported[0][0] <= report.applied:
            self._unreported.popleft()

    @property
    def pixel(self) -> float:
        """Metres across a pixel of the page's screen; 0 if it is not known."""
        report = self.report
        if report is None:
            return 0.0
        area = abs(report.a * report.d - report.b * report.c) * report.dpr**2
        return 1 / math.sqrt(area) if area > 0.0 else 0.0

    @property
    def unreported(self) -> bytes:
        """The records of the operations that no report contains yet."""
        return b"".join(record for _, record in self._unreported)


class PendingRecords:
    """The records of a page's next frame that no fragment stores, by kind.

    All but messages can be made again from the session. When they grow too long, they
    are discarded, and :attr:`send_all` is set.
    """

    MESSAGES_KEPT: ClassVar = 1000
    MESSAGE_BYTES_KEPT: ClassVar = 1024 * 1024
    BYTES_KEPT: ClassVar = 256 * 1024
    NOTICES_KEPT: ClassVar = 5
    PROBLEMS_KEPT: ClassVar = 100

    def __init__(self) -> None:
        self.send_all = False
        """Whether the page must get the whole state, whatever it got before."""
        self.gone = bytearray()
        self.new: list[int] = []
        """The numbers of mounts that the page does not have yet."""
        self.records = bytearray()
        self.messages: deque[bytes] = deque()
        self._message_bytes = 0
        self.current_problems: dict[int, bytes] = {}
        """The record of each current problem; of too many, the newest."""
        self.problems: dict[int, bytes] = {}
        """The record of each problem that changed."""
        self._notices: dict[bytes, None] = {}

    def unmounted(self, number: int) -> None:
        """Add the end of a mount that the page has."""
        frame_request.make()
        self.gone += bytes((Op.UNMOUNT, *varint(number)))
        if len(self.gone) > self.BYTES_KEPT:
            self.gone.clear()
            self.send_all = True

    def record(self, record: bytes | bytearray) -> None:
        """Add a record that can be made again."""
        frame_request.make()
        self.records += record
        if len(self.records) > self.BYTES_KEPT:
            # All of it can be made again from the stored state, which is shorter.
            self.records.clear()
            self.send_all = True

    def message(self, record: bytes) -> None:
        """Add a message, which is sent once; of too many, the newest are kept."""
        frame_request.make()
        self.messages.append(record)
        self._message_bytes += len(record)
        # A page that is inactive for this long needs the newest.
        while len(self.messages) > self.MESSAGES_KEPT or (
            self._message_bytes > self.MESSAGE_BYTES_KEPT and len(self.messages) > 1
        ):
            self._message_bytes -= len(self.messages.popleft())

    def notice(self, text: str) -> None:
        """Add a notice; the newest ones are sent again after a reload of the page."""
        record = bytes((Op.ERROR,)) + string(text)
        self._notices.pop(record, None)
        self._notices[record] = None
        if len(self._notices) > self.NOTICES_KEPT:
            del self._notices[next(iter(self._notices))]
        self.message(record)

    def problem(self, number: int, text: str) -> None:
        """Add a problem, or end it if the text is empty; the newest text counts."""
        frame_request.make()
        record = bytes((Op.PROBLEM, *varint(number))) + string(text)
        self.current_problems.pop(number, None)
        if text:
            self.current_problems[number] = record
        if len(self.current_problems) > self.PROBLEMS_KEPT:
            del self.current_problems[next(iter(self.current_problems))]
        self.problems[number] = record
        if len(self.problems) > self.MESSAGES_KEPT:
            # All of it can be made again from the stored state, which is shorter.
            self.problems.clear()
            self.send_all = True

    def notices_again(self) -> Iterable[bytes]:
        """Return the newest notices that are not already in the next frame."""
        return [record for record in self._notices if record not in self.messages]

    def sent(self) -> None:
        """Discard the records, as the frame with all of them was made."""
        self.send_all = False
        self.gone, self.records = bytearray(), bytearray()
        self.new, self.problems = [], {}
        self.messages, self._message_bytes = deque(), 0
