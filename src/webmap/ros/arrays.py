"""Arrays of numbers in messages, kept as bytes until somebody asks for numpy.

JSON brings lists with ``null`` for what is not a number, a binary encoding brings typed
arrays. Both become one compact value that costs 4 bytes or 1 byte a number and needs no
numpy to be made, moved between processes or thrown away.
"""

from array import array
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, cast

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

T = TypeVar("T", bound="Numbers")

_NAN = float("nan")

NOT_COPIED = 1 << 20
"""Bytes from which numbers stay in the bytes that they came in."""


class Numbers:
    """Numbers of one width; :class:`Floats` and :class:`Int8s` say which."""

    typecode: ClassVar[str]
    __slots__ = ("values",)

    def __init__(self, values: "array[Any]") -> None:
        self.values = values
        """The numbers, in the machine's byte order; not to be changed."""

    @classmethod
    def from_wire(cls: type[T], value: object) -> T:
        """Return what a decoder found in the place of the array.

        Raises:
            ValueError: If it is no array, or a number in it does not fit.

        """
        try:
            return cls(cls._numbers(value))
        except (TypeError, OverflowError, ValueError) as error:
            raise ValueError(
                f"expected an array of numbers, got {type(value).__name__}: {error}"
            ) from None

    @classmethod
    def _numbers(cls, value: object) -> "array[Any]":
        if isinstance(value, array):
            same = value.typecode == cls.typecode
            return value if same else array(cls.typecode, value)
        if isinstance(value, bytes):
            if len(value) > NOT_COPIED:
                return cast(
                    "array[Any]", memoryview(value).cast(cast(Any, cls.typecode))
                )
            numbers: array[Any] = array(cls.typecode)
            numbers.frombytes(value)
            return numbers
        if value is None:
            return array(cls.typecode)
        if not isinstance(value, list):
            raise TypeError("it is neither a list nor a typed array")
        return cls._from_list(value)

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
    """Numbers of ``float32[]``; what was ``null`` is NaN."""

    typecode = "f"
    __slots__ = ()

    @classmethod
    def _from_list(cls, value: list[Any]) -> "array[Any]":
        try:
            return array("f", value)
        except TypeError:  # a null: bridges write it for NaN and both infinities
            return array("f", [_NAN if item is None else item for item in value])

    def array(self) -> "NDArray[np.float32]":
        """Return the numbers as a read-only array of shape (N,), not copied."""
        import numpy as np

        return np.frombuffer(memoryview(self.values).toreadonly(), np.float32)


class Int8s(Numbers):
    """Numbers of ``int8[]``."""

    typecode = "b"
    __slots__ = ()

    def array(self) -> "NDArray[np.int8]":
        """Return the numbers as a read-only array of shape (N,), not copied."""
        import numpy as np

        return np.frombuffer(memoryview(self.values).toreadonly(), np.int8)


def dec_hook(wanted: type, value: object) -> object:
    """Decode the fields that msgspec does not know; see its ``dec_hook``."""
    if isinstance(wanted, type) and issubclass(wanted, Numbers):
        return wanted.from_wire(value)
    raise NotImplementedError(f"a message cannot hold a {wanted!r}")
