"""What a session remembers of one map on its page."""

import math
import struct
from collections import deque

from webmap.wire.encode import varint
from webmap.wire.messages import ViewReport
from webmap.wire.opcodes import VIEW_OPERATIONS, Op

_MATRIX = struct.Struct("<6d").pack
_COUNTS = {
    "translate": (2,),
    "scale": (1, 3),
    "rotate": (1, 3),
    "set": (6,),
    "fit": (4,),
    "follow": (1,),
}


class Canvas:
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
