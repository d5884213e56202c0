"""Arrays of numbers in messages, kept as bytes until numpy is needed.

JSON gives lists with ``null`` for NaN and infinities; a binary encoding gives typed
arrays. Both become one compact value of 4 bytes or 1 byte a number. Creating, moving
between processes and dropping such a value needs no numpy.
"""

import struct
from array import array
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, cast

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

T = TypeVar("T", bound="Numbers")

_NAN = float("nan")

NOT_COPIED = 1 << 20
"""Size in bytes above which an array uses the received bytes without a copy."""

MOST_PACKED = 1 << 16
"""Longest list that is packed: packing copies all its references."""


class Numbers:
    """Numbers of one width; base class of :class:`Floats` and :class:`Int8s`."""

    typecode: ClassVar[str]
    __slots__ = ("values",)

    def __init__(self, values: "array[Any]") -> None:
        self.values = values
        """The numbers, in the byte order of the machine. Read-only."""

    @classmethod
    def from_wire(cls: type[T], value: object) -> T:
        """Return the decoded value of an array field.

        Raises:
            ValueError: If the value is not an array, or a number does not fit.

        """
        try:
            return cls(cls._numbers(value))
        except (TypeError, OverflowError, ValueError, struct.error) as error:
            raise ValueError(
                f"expected an array of numbers, got {type(value).__name__}: {error}"
            ) from None

    @classmethod
    def _numbers(cls, value: object) -> "array[Any]":
        if isinstance(value, array):
            same = value.typecode == cls.typecode
            return value if same else array(cls.typecode, value)
        if isinstance(value, memoryview):
            return cls._from_view(value)
        if isinstance(value, bytes):
            if len(value) > NOT_COPIED:
                return cls._from_view(memoryview(value).cast(cast(Any, cls.typecode)))
            numbers: array[Any] = array(cls.typecode)
            numbers.frombytes(value)
            return numbers
        if value is None:
            return array(cls.typecode)
        if not isinstance(value, list):
            raise TypeError("it is neither a list nor a typed array")
        return cls._from_list(value)

    @classmethod
    def _from_view(cls, value: memoryview) -> "array[Any]":
        """Return numbers of the same width, without a copy if there are many."""
        if value.format != cls.typecode:
            return array(cls.typecode, value)
        if value.nbytes > NOT_COPIED:
            return cast("array[Any]", value)
        numbers: array[Any] = array(cls.typecode)
        numbers.frombytes(value.cast("B"))  # much faster than number by number
        return numbers

    @classmethod
    def _from_list(cls, value: list[Any]) -> "array[Any]":
        return array(cls.typecode, value)

    def __len__(self) -> int:
        return len(self.values)

    def __bytes__(self) -> bytes:
        return self.values.tobytes()

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and bytes(self) == bytes(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {len(self)}>"


class Floats(Numbers):
    """Numbers of ``float32[]``; ``null`` becomes NaN."""

    typecode = "f"
    __slots__ = ()

    @classmethod
    def _from_list(cls, value: list[Any]) -> "array[Any]":
        try:
            return _packed(value)
        except (TypeError, struct.error):  # bridges write null for NaN and infinities
            return _packed([_NAN if item is None else item for item in value])

    def array(self) -> "NDArray[np.float32]":
        """Return the numbers as a read-only array of shape (N,), not copied."""
        import numpy as np

        return np.frombuffer(memoryview(self.values).toreadonly(), np.float32)


def _packed(value: list[float]) -> "array[Any]":
    """Return the same as ``array("f", value)``, which takes twice as long."""
    if len(value) > MOST_PACKED:
        return array("f", value)
    return array("f", struct.pack(f"{len(value)}f", *value))


class Int8s(Numbers):
    """Numbers of ``int8[]``."""

    typecode = "b"
    __slots__ = ()

    def array(self) -> "NDArray[np.int8]":
        """Return the numbers as a read-only array of shape (N,), not copied."""
        import numpy as np

        return np.frombuffer(memoryview(self.values).toreadonly(), np.int8)


def dec_hook(expected: type, value: object) -> object:
    """Decode the fields of types unknown to msgspec; its ``dec_hook``."""
    if isinstance(expected, type) and issubclass(expected, Numbers):
        return expected.from_wire(value)
    raise NotImplementedError(f"a message cannot hold a {expected!r}")
