"""The text of a function that reads messages of one type.

Fields of fixed size that follow each other are read in one step of :mod:`struct`; those
that nobody wants are padding there. A view is built directly.
"""

import struct
import types
import typing
from collections.abc import Sequence
from typing import Any, NamedTuple

import msgspec

from webmap.base.errors import ProtocolError
from webmap.ros.arrays import Numbers
from webmap.ros.definitions import FLOATS, INTEGERS, OCTETS, Field
from webmap.ros.limits import MAX_VALUES
from webmap.ros.serialized.schemas import (
    CODES,
    SIZES,
    Encoding,
    Schema,
    least_size,
    parts_of,
)

_COPIED = 1 << 16
"""Bytes of a message up to which it is read as ``bytes``, which is faster."""


class _Skipped:
    """In place of a type: nobody wants the value."""


class _Place(NamedTuple):
    """What is known of a position: it is ``rest`` modulo ``unit``."""

    unit: int
    rest: int

    def after(self, size: int) -> "_Place":
        return _Place(self.unit, (self.rest + size) % self.unit)

    def either(self, other: "_Place") -> "_Place":
        """Return what is known if one of two places is the right one."""
        unit = min(self.unit, other.unit)
        while self.rest % unit != other.rest % unit:
            unit //= 2
        return _Place(unit, self.rest % unit)


_ANYWHERE = _Place(1, 0)


class Program:
    """The text of a function ``read``, and the names in it.

    Args:
        schema: The type.
        wanted: The view to build, or None for a dict.
        encoding: The serialization.
        big: Whether the most significant byte of a number is the first.

    Raises:
        ProtocolError: If the schema has not the fields of the view.

    """

    def __init__(
        self,
        schema: Schema,
        wanted: type[msgspec.Struct] | None,
        encoding: Encoding,
        *,
        big: bool,
    ) -> None:
        self.names: dict[str, Any] = {}
        self._encoding = encoding
        self._cdr = encoding == "cdr"
        self._order = ">" if big else "<"
        self._lines: list[str] = []
        self._indent = 2
        self._count = 0
        self._format: list[str] = []
        self._found: list[str] = []
        self._place = _Place(8, 0)
        result = self._fields(schema.type, schema.fields, wanted or Any)
        self._flush()
        self.text = "\n".join(self._frame(result, big))

    def _frame(self, result: str, big: bool) -> list[str]:
        """Return the lines of the function."""
        head = 4 if self._cdr else 0
        mark = b"\0\0" if big else b"\0\1"
        return [
            "def read(d):",
            "  n = len(d)",
            f"  if n > {_COPIED}: d = memoryview(d)",
            "  elif type(d) is not bytes: d = bytes(d)",
            *([f"  if n < 4 or d[:2] != {mark!r}: return other(d)"] * self._cdr),
            f"  p = {head}; left = {MAX_VALUES}",
            "  try:",
            *self._lines,
            f"    r = {result}",
            "  except (StructError, IndexError, ValueError) as e:",
            "    raise unfit(e) from None",
            "  if p > n: raise short()",
            # Vendors of DDS fill the last four bytes up.
            f"  if n - p > {3 * self._cdr}: raise long(n - p)",
            "  return r",
        ]

    def _line(self, text: str) -> None:
        self._lines.append("  " * self._indent + text)

    def _new(self) -> str:
        self._count += 1
        return f"v{self._count}"

    def _named(self, value: Any) -> str:
        """Return the name of an object in the text."""
        for name, each in self.names.items():
            if each is value:
                return name
        name = f"g{len(self.names)}"
        self.names[name] = value
        return name

    def _take(self, code: str, size: int, *, wanted: bool = True) -> str:
        """Read a value whose size and place are known, with the next step."""
        self._place = self._place.after(size)
        self._format.append(code if wanted else f"{size}x")
        if not wanted:
            return ""
        name = self._new()
        self._found.append(name)
        return name

    def _flush(self) -> None:
        """Write the step that reads the fields of fixed size."""
        if not self._format:
            return
        step = struct.Struct(self._order + "".join(self._format))
        if self._found:
            names = "".join(f"{name}, " for name in self._found)
            self._line(f"{names}= {self._unpack(step)}(d, p)")
        self._line(f"p += {step.size}")
        self._format, self._found = [], []

    def _unpack(self, step: struct.Struct) -> str:
        return self._named(step.unpack_from)

    def _align(self, size: int, condition: str = "") -> None:
        """Move to the next multiple of ``size``; only CDR has padding."""
        if not self._cdr or size == 1:
            return
        if self._place.unit >= size:
            padding = -self._place.rest % size
            if not padding:
                return
            if not condition:
                self._take("", padding, wanted=False)
                return
        self._flush()
        # The offset of a place is counted from the end of the head of 4 bytes.
        up = f"(p + {size - 1} & -{size})" if size < 8 else "(p + 3 & -8) + 4"
        self._line(f"{condition}p = {up}")
        self._place = _Place(size, 0)

    def _fields(self, type: str, fields: Sequence[Field], hint: Any) -> str:
        """Read the fields of a message; return the expression of its value."""
        hint = _without_none(hint)
        view = _view_fields(hint)
        if view is None and hint is not _Skipped:
            plain = self._dict(fields)
            return self._as(plain, hint, hint is Any or hint == dict[str, Any])
        values = {}
        for field in fields:
            known = view.pop(field.name, None) if view else None
            inner = _Skipped if known is None else known.hint
            value = self._value(field, inner)
            if known is not None:
                values[known.name] = value
        if not fields and self._cdr:
            self._take("", 1, wanted=False)
        if hint is _Skipped:
            return ""
        for name, known in (view or {}).items():
            if known.required:
                raise ProtocolError(
                    f"{type} has no field {name!r}, which {hint.__name__} needs"
                )
        return self._call(hint, values)

    def _call(self, view: type[msgspec.Struct], values: dict[str, str]) -> str:
        """Return the expression of a new struct; positional arguments are faster."""
        arguments = []
        for name in view.__match_args__:
            if name not in values:
                break
            arguments.append(values.pop(name))
        arguments += [f"{name}={value}" for name, value in values.items()]
        return f"{self._named(view)}({', '.join(arguments)})"

    def _dict(self, fields: Sequence[Field]) -> str:
        parts = [f"{each.name!r}: {self._value(each, Any)}" for each in fields]
        if not fields and self._cdr:
            self._take("", 1, wanted=False)
        return f"{{{', '.join(parts)}}}"

    def _as(self, value: str, hint: Any, fits: bool) -> str:
        """Return the expression of a plain value as a value of a type."""
        if fits or hint is Any:
            return value
        return f"convert({value}, {self._named(hint)})"

    def _value(self, field: Field, hint: Any) -> str:
        hint = _without_none(hint)
        if field.is_array:
            return self._array(field, hint)
        parts = parts_of(field, self._encoding)
        if parts is not None:
            return self._fields(field.type, parts, hint)
        if field.type == "string":
            return self._string(hint)
        size = SIZES[field.type]
        self._align(size)
        value = self._take(CODES[field.type], size, wanted=hint is not _Skipped)
        return self._scalar(field.type, value, hint)

    def _scalar(self, type: str, value: str, hint: Any) -> str:
        if hint is _Skipped:
            return ""
        if hint is float and type in INTEGERS:
            return f"float({value})"
        fits = (
            (hint is float and type in FLOATS)
            or (hint is int and type in INTEGERS)
            or (hint is bool and type == "bool")
        )
        return self._as(value, hint, fits)

    def _length(self) -> str:
        """Read the length of a string or an array; return its name."""
        self._align(4)
        length = self._take("I", 4)
        self._flush()
        return length

    def _string(self, hint: Any) -> str:
        length = self._length()
        self._place = _ANYWHERE if self._cdr else self._place
        if hint is _Skipped:
            self._line(f"p += {length}")
            return ""
        value = self._new()
        self._line(f"q = p + {length}")
        if self._cdr:
            # Some writers leave out the zero at the end.
            self._line("e = q if d[q - 1] else q - 1")
            self._line(f"{value} = str(d[p:e], 'utf-8', 'replace'); p = q")
        else:
            self._line(f"{value} = str(d[p:q], 'utf-8', 'replace'); p = q")
        return self._as(value, hint, hint is str)

    def _array(self, field: Field, hint: Any) -> str:
        if field.type in CODES:
            return self._numbers(field, hint)
        count = self._length() if field.size is None else str(field.size)
        item, fits = _item_of(hint)
        parts = parts_of(field, self._encoding)
        found = self._records(field, count, parts, item) if parts else None
        if found is None:
            found = self._loop(field, count, item)
        return found if hint is _Skipped else self._as(found, hint, fits)

    def _numbers(self, field: Field, hint: Any) -> str:
        size, code = SIZES[field.type], CODES[field.type]
        if field.size is not None:
            self._align(size)
            count = field.size * size
            data = self._take(f"{count}s", count, wanted=hint is not _Skipped)
        else:
            length = self._length()
            self._align(size, f"if {length}: ")
            unit = min(size, 4)
            self._place = _Place(unit, 0) if self._cdr else self._place
            move = f"p + {length} * {size}"
            if hint is _Skipped:
                self._line(f"p = {move}")
                return ""
            data = self._new()
            self._line(f"q = {move}")
            self._line("if q > n: raise short()")
            self._line(f"{data} = d[p:q]; p = q")
        if hint is _Skipped:
            return ""
        if isinstance(hint, type) and issubclass(hint, Numbers):
            return f"packed({self._named(hint)}, {code!r}, {data})"
        if field.type in OCTETS:
            return self._as(f"bytes({data})", hint, hint is bytes)
        item, fits = _item_of(hint)
        if field.type == "bool":
            return self._as(f"[*map(bool, {data})]", hint, fits and item in (Any, bool))
        values = f"numbers({code!r}, {data})"
        kinds = FLOATS if item is float else INTEGERS if item is int else ()
        if hint is not Any and fits and field.type in kinds:
            return f"{values}.tolist()"
        return self._as(values, hint, hint is Any)

    def _records(
        self, field: Field, count: str, parts: Sequence[Field], hint: Any
    ) -> str | None:
        """Read an array of messages of one fixed size in one step, if they have one."""
        size = _fixed_size(parts, self._encoding)
        if not size:
            return None
        unit = size[1]
        self._align(unit, f"if {count}: ")
        place = _Place(min(unit, 4), 0) if self._cdr else self._place
        self._flush()
        self._line(f"q = p + {count} * {size[0]}")
        if hint is _Skipped:
            self._line("p = q")
            self._place = place
            return ""
        self._check_count(count, "q > n", _values(field, self._encoding))
        self._place = _Place(unit, 0)
        value = self._fields(field.type, parts, hint)
        step = struct.Struct(self._order + "".join(self._format))
        assert step.size == size[0]
        names = "".join(f"{name}, " for name in self._found)
        self._format, self._found = [], []
        self._place = place
        found = self._new()
        each = self._named(step.iter_unpack)
        self._line(f"{found} = [{value} for ({names}) in {each}(d[p:q])]; p = q")
        return found

    def _check_count(self, count: str, too_many: str, values: int) -> None:
        self._line(f"if {too_many}: raise short()")
        self._line(f"left -= {count} * {values}")
        self._line("if left < 0: raise many()")

    def _loop(self, field: Field, count: str, hint: Any) -> str:
        """Read an array one by one."""
        self._flush()
        one = _one(field)
        least = least_size((one,), self._encoding)
        values = _values(field, self._encoding)
        self._check_count(count, f"{count} * {least} > n - p", values)
        after = _place_after(one, _ANYWHERE, self._encoding)
        self._place = self._place.either(after) if self._cdr else self._place
        place = self._place
        found = "" if hint is _Skipped else self._new()
        if found:
            self._line(f"{found} = []")
        self._line(f"for _ in range({count}):")
        self._indent += 1
        value = self._value(one, hint)
        self._flush()
        self._line(f"{found}.append({value})" if found else "pass")
        self._indent -= 1
        self._place = place
        return found


class _ViewField(NamedTuple):
    name: str
    hint: Any
    required: bool


def _view_fields(hint: Any) -> dict[str, _ViewField] | None:
    """Return the fields of a view by their names in messages; None if it is no view."""
    if not (isinstance(hint, type) and issubclass(hint, msgspec.Struct)):
        return None
    hints = typing.get_type_hints(hint, include_extras=True)
    return {
        each.encode_name: _ViewField(each.name, hints[each.name], each.required)
        for each in msgspec.structs.fields(hint)
    }


def _without_none(hint: Any) -> Any:
    """Return the type besides None; a message never has None."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        rest = [each for each in typing.get_args(hint) if each is not type(None)]
        return rest[0] if len(rest) == 1 else hint
    return hint


def _item_of(hint: Any) -> tuple[Any, bool]:
    """Return the type of the items of a list, and whether a list is wanted."""
    if hint is _Skipped:
        return _Skipped, True
    if hint is Any or hint is list:
        return Any, True
    if typing.get_origin(hint) is list:
        return typing.get_args(hint)[0], True
    return Any, False


def _one(field: Field) -> Field:
    """Return one item of an array as a field."""
    return Field(field.name, field.type, field.fields)


def _fixed_size(parts: Sequence[Field], encoding: Encoding) -> tuple[int, int] | None:
    """Return size and alignment of messages that follow each other without padding.

    None if their size varies, or if there is padding, or an array of messages in them.
    """
    sizes = _sizes_of(parts, encoding)
    if not sizes:
        return None
    if encoding == "ros1":
        return sum(size for size, _ in sizes), 1
    unit, at = sizes[0][1], 0
    for size, each in sizes:
        at += -at % each + size
        if each > unit:
            return None
    return (at, unit) if at % unit == 0 else None


def _sizes_of(
    parts: Sequence[Field], encoding: Encoding
) -> list[tuple[int, int]] | None:
    """Return size and alignment of all values in a message; None if they vary."""
    found: list[tuple[int, int]] = []
    for field in parts:
        inner = parts_of(field, encoding)
        varies = field.is_array and (field.size is None or inner is not None)
        if varies or field.type == "string":
            return None
        if inner is not None:
            sizes = _sizes_of(inner, encoding)
            if sizes is None:
                return None
            found += sizes
        else:
            size = SIZES[field.type]
            found.append((size * (1 if field.size is None else field.size), size))
    if not parts and encoding == "cdr":
        found.append((1, 1))
    return found


def _values(field: Field, encoding: Encoding) -> int:
    """Return how many values one item of an array is, without the arrays in it."""
    parts = parts_of(field, encoding) or ()
    inner = (1 if each.is_array else _scalar_values(each, encoding) for each in parts)
    return 1 + sum(inner)


def _scalar_values(field: Field, encoding: Encoding) -> int:
    return 0 if parts_of(field, encoding) is None else _values(field, encoding)


def _place_after(field: Field, place: _Place, encoding: Encoding) -> _Place:
    """Return what is known of the place after a field."""
    parts = parts_of(field, encoding)
    if field.is_array and field.size is None:
        place = _aligned(place, 4).after(4)
        size = SIZES.get(field.type)
        if size is not None:
            return _Place(min(size, 4), 0)
        return place.either(_place_after(_one(field), _ANYWHERE, encoding))
    if (field.is_array and parts is not None) or field.type == "string":
        return _ANYWHERE
    if parts is not None:
        for each in parts:
            place = _place_after(each, place, encoding)
        return place if parts else place.after(1)
    size = SIZES[field.type]
    count = 1 if field.size is None else field.size
    return _aligned(place, size).after(size * count)


def _aligned(place: _Place, size: int) -> _Place:
    if place.unit < size:
        return _Place(size, 0)
    return place.after(-place.rest % size)
