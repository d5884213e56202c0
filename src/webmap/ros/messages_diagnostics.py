"""Typed views of what the parts of a robot say of their health."""

import binascii
from typing import ClassVar

import msgspec

from webmap.errors import ProtocolError
from webmap.ros.messages import Stamped

OK, WARN, ERROR, STALE = range(4)
LEVELS = ("ok", "warn", "error", "stale")
"""The names of the levels, by their numbers."""


class KeyValueMsg(msgspec.Struct, frozen=True, gc=False):
    """``diagnostic_msgs/KeyValue``."""

    key: str
    value: str


class DiagnosticStatusMsg(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """``diagnostic_msgs/DiagnosticStatus``."""

    name: str
    level_value: int | str = msgspec.field(name="level")
    """The level as it came; :attr:`level` is what to count with."""

    message: str = ""
    hardware_id: str = ""
    values: list[KeyValueMsg] = msgspec.field(default_factory=list)

    @property
    def level(self) -> int:
        """0 ok, 1 warning, 2 error, 3 stale.

        It is a ``byte``, which some bridges of ROS 2 write as text: the character
        itself, or base64.

        Raises:
            ProtocolError: If it is none of them.

        """
        said = self.level_value
        level = said if isinstance(said, int) else _byte(said)
        if not 0 <= level < len(LEVELS):
            raise ProtocolError(f"{self.name!r}: a level is 0 to 3, got {said!r}")
        return level


class DiagnosticArrayMsg(Stamped, frozen=True, kw_only=True):
    """``diagnostic_msgs/DiagnosticArray``."""

    separable: ClassVar = True
    status: list[DiagnosticStatusMsg]


def _byte(text: str) -> int:
    """Return the byte that a text stands for, or -1."""
    if len(text) == 1:
        return ord(text)
    try:
        data = binascii.a2b_base64(text, strict_mode=True)
    except (binascii.Error, ValueError):
        return -1
    return data[0] if len(data) == 1 else -1
