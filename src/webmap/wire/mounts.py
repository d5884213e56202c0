"""What a session remembers of the fragments on its page."""

import struct

from webmap.scene.element import Element
from webmap.scene.fragment import Fragment
from webmap.wire.encode import EVENT_NUMBER, encode_snapshot, string, varint
from webmap.wire.opcodes import PREVENT, STOP, Op

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
