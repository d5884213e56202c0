"""The text of a function that reads messages of one type.

Fields of fixed size that follow each other are read in one step of :mod:`struct`; those
that nobody wants are padding there. Views are built directly.
"""

import struct
from collections.abc import Container, Sequence
from itertools import groupby
from typing import Any

import msgspec

from webmap.ros.arrays import Numbers
from webmap.ros.definitions import FLOATS, INTEGERS, OCTETS, Field
from webmap.ros.limits import MAX_VALUES
from webmap.ros.serialized import layout
from webmap.ros.serialized.layout import ANYWHERE, Place
from webmap.ros.serialized.rows import Piece, Rows
from webmap.ros.serialized.schemas import (
    CODES,
    SIZES,
    Encoding,
    Schema,
    least_size,
    parts_of,
)
from webmap.ros.serialized.views import (
    Skipped,
    check_view,
    flattened,
    is_flat,
    is_row,
    item_of,
    view_fields,
    wanted_of,
    without_none,
)

COPIED = 1 << 16
"""Bytes of a message up to which it is read as ``bytes``, which is faster."""


class Program:
    """The text of a function ``read``, and the objects that it uses by their names.

    Args:
        schema: The type.
        wanted: The view to build, or None for a dict.
        encoding: The serialization.
        big: Whether the most significant byte of a number is the first.
        usual: Whether the function leaves to ``other`` what is not usual: a message
            longer than :data:`COPIED`, another beginning than that of little-endian
            CDR, and text that is not UTF-8 or has no zero at its end.

    Raises:
        ProtocolError: If the schema has not the fields of the view.

    """

    def __init__(
        self,
        schema: Schema,
        wanted: type[msgspec.Struct] | None,
        encoding: Encoding,
        *,
        big: bool = False,
        usual: bool = False,
    ) -> None:
        self.names: dict[str, Any] = {}
        self._known: dict[int, str] = {}
        self._encoding = encoding
        self._cdr = encoding == "cdr"
        self._order = ">" if big else "<"
        self._usual = usual
        self._lines: list[str] = []
        self._indent = 2
        self._count = 0
        self._base = ""
        self._offset = 4 if self._cdr else 0
        self._place = Place(8, 0)
        self._format: list[str] = []
        self._found: list[str] = []
        self._pieces: list[Piece] | None = None
        self._columns = self._flat = False
        whole = Field("", schema.type, schema.fields)
        if is_row(whole, wanted or Any, encoding):
            result = self._rows(whole, None, wanted or Any)
        else:
            result = self._value(whole, wanted or Any)
        self._flush()
        self.text = "\n".join(self._function(result))

    def _function(self, result: str) -> list[str]:
        """Return the lines of the whole function."""
        if self._usual:
            mark = r" or d[:2] != b'\0\1'" if self._cdr else ""
            head = [
                f"  if n > {COPIED}{mark}: return other(d)",
                "  if type(d) is not bytes: d = bytes(d)",
            ]
            tail = ["  except UnicodeDecodeError: return other(d)"]
        else:
            head = [f"  d = memoryview(d) if n > {COPIED} else bytes(d)"]
            tail = []
        counts = any("left" in line for line in self._lines)
        return [
            "def read(d):",
            "  n = len(d)",
            *head,
            *[f"  left = {MAX_VALUES}"] * counts,
            "  try:",
            *self._lines,
            f"    r = {result}",
            *tail,
            "  except (StructError, IndexError, ValueError) as e:",
            "    raise unfit(e) from None",
            f"  p = {self._at}",
            "  if p > n: raise short()",
            # Vendors of DDS fill the last four bytes up.
            f"  if n - p > {3 if self._cdr else 0}: raise long(n - p)",
            "  return r",
        ]

    def _line(self, text: str) -> None:
        self._lines.append("  " * self._indent + text)

    def _new(self) -> str:
        self._count += 1
        return f"v{self._count}"

    def _named(self, value: Any) -> str:
        """Return the name of an object."""
        name = self._known.setdefault(id(value), f"g{len(self._known)}")
        self.names[name] = value  # so its id stays its own
        return name

    @property
    def _at(self) -> str:
        """The expression of the position; the fields to be read in one step begin."""
        if not self._base or not self._offset:
            return self._base or str(self._offset)
        return f"{self._base} + {self._offset}"

    def _move(self, position: str) -> str:
        """Continue at a new position; return its name."""
        self._base, self._offset = f"p{self._count}", 0
        self._count += 1
        self._line(f"{self._base} = {position}")
        return self._base

    def _take(self, code: str, size: int, *, wanted: bool = True) -> str:
        """Read a value with the next step; return its name."""
        self._place = self._place.after(size)
        self._format.append(code if wanted else f"{size}x")
        return self._next_value() if wanted else ""

    def _next_value(self) -> str:
        """Return the name of the next value of a step, or its column in an array."""
        column = f"u[{len(self._found)}::w]"
        self._found.append(column if self._columns else self._new())
        return self._found[-1]

    def _made(self, template: str, values: Sequence[str]) -> str:
        """Return the expression of something made of values, or of a column of it."""
        if not self._columns:
            return template.format(*values)
        names = [self._new() for _ in values]
        each = template.format(*names)
        return f"({each} for {', '.join(names)}, in zip({', '.join(values)}))"

    def _flush(self) -> None:
        """Write the step that reads the fields of fixed size."""
        if not self._format:
            return
        step = struct.Struct(self._order + _shortened(self._format))
        if self._pieces is not None:
            self._pieces.append(Piece(_shortened(self._format), step.size))
        elif self._found:
            names = "".join(f"{name}, " for name in self._found)
            unpack = self._named(step.unpack_from)
            self._line(f"{names}= {unpack}(d, {self._at})")
        self._offset += step.size
        if self._pieces is None:
            self._found = []
        self._format = []

    def _align(self, size: int, condition: str = "") -> None:
        """Move to the next multiple of ``size``; only CDR has padding.

        Args:
            size: Bytes of the next number.
            condition: When there is padding: ``if v1``; always if empty.

        """
        if not self._cdr or size == 1:
            return
        place = self._place.aligned(size)
        padding = -self._place.rest % size if self._place.unit >= size else None
        if padding == 0:
            return
        if padding and not condition:
            self._take("", padding, wanted=False)
            return
        self._flush()
        self._place = place
        if self._pieces is not None:
            self._pieces.append(Piece(unit=size))
            return
        at = self._at
        # A place is counted from the end of the head of 4 bytes.
        up = f"({at} + {size - 1} & -{size})" if size < 8 else f"({at} + 3 & -8) + 4"
        self._move(f"{up} {condition} else {at}" if condition else up)

    def _message(self, type: str, fields: Sequence[Field], hint: Any) -> str:
        """Read the fields of a message; return the expression of its value."""
        view = view_fields(hint)
        if view is not None:
            check_view(type, fields, hint, view)
        values = {}
        for field, name, inner in wanted_of(fields, hint):
            value = self._value(field, inner)
            if inner is not Skipped:
                values[name] = value
        if not fields and self._cdr:
            self._take("", 1, wanted=False)
        if hint is Skipped:
            return ""
        if view is not None:
            return self._call(hint, values)
        parts = ", ".join(f"{name!r}: {{}}" for name in values)
        made = self._made(f"{{{{{parts}}}}}", [*values.values()])
        return self._as(made, hint, hint == dict[str, Any])

    def _call(self, view: type[msgspec.Struct], values: dict[str, str]) -> str:
        """Return the expression of a new struct; positional arguments are faster."""
        first = []
        defaults = {each.name: each.default for each in msgspec.structs.fields(view)}
        if self._flat:  # the columns of all values in the view
            for name, default in defaults.items():
                if name in values:
                    first.append(values[name])
                    continue
                same = map(self._named, flattened(default))
                first += [f"repeat({each})" for each in same]
            return ", ".join(first)
        for name in view.__match_args__:
            if not values:
                break
            if name in values:
                first.append(values.pop(name))
            elif defaults[name] in (0, ""):
                constant = repr(defaults[name])
                first.append(f"repeat({constant})" if self._columns else constant)
            else:
                break
        made = self._named(view)
        if self._columns and not values:
            return f"map({made}, {', '.join(first)})"
        arguments = ["{}"] * len(first) + [f"{name}={{}}" for name in values]
        template = f"{made}({', '.join(arguments)})"
        return self._made(template, [*first, *values.values()])

    def _as(self, value: str, hint: Any, fits: bool) -> str:
        """Return the expression of a plain value as a value of a type."""
        if fits or hint is Any:
            return value
        return self._made(f"convert({{}}, {self._named(hint)})", [value])

    def _value(self, field: Field, hint: Any) -> str:
        """Read a field; return the expression of its value."""
        hint = without_none(hint)
        if field.is_array and field.type in CODES:
            return self._numbers(field, hint)
        if field.is_array:
            return self._array(field, hint)
        parts = parts_of(field, self._encoding)
        if parts is not None:
            return self._message(field.type, parts, hint)
        if field.type == "string":
            return self._string(hint)
        size = SIZES[field.type]
        self._align(size)
        value = self._take(CODES[field.type], size, wanted=hint is not Skipped)
        if hint is float and field.type in INTEGERS:
            return self._made("float({})", [value])
        kinds: dict[Any, Container[str]] = {
            **{float: FLOATS, int: INTEGERS},
            **{bool: ("bool",), Skipped: SIZES},
        }
        return self._as(value, hint, field.type in kinds.get(hint, ()))

    def _length(self) -> str:
        """Read the length of a string or an array; return its name."""
        self._align(4)
        length = self._take("I", 4)
        self._flush()
        return length

    def _string(self, hint: Any) -> str:
        if self._pieces is not None:
            self._align(4)
            self._flush()
            self._pieces.append(Piece(is_text=True))
            self._place = ANYWHERE
            value = self._next_value()
            column = f"texts.column({value})"
            return self._as(
                column if self._columns else f"texts[{value}]", hint, hint is str
            )
        length = self._length()
        self._place = ANYWHERE
        if hint is Skipped:
            self._move(f"{self._at} + {length}")
            return ""
        value, start = self._new(), self._at
        if self._offset and self._base:
            start = self._move(start)
        end = self._move(f"{start} + {length}")
        if not self._usual:
            self._line(f"{value} = text(d[{start}:{end}])")
        elif self._cdr:
            self._line(f"if d[{end} - 1]: return other(d)")
            self._line(f"{value} = d[{start}:{end} - 1].decode()")
        else:
            self._line(f"{value} = d[{start}:{end}].decode()")
        return self._as(value, hint, hint is str)

    def _numbers(self, field: Field, hint: Any) -> str:
        """Read an array of numbers."""
        size, code = SIZES[field.type], CODES[field.type]
        if field.size is not None:
            self._align(size)
            count = field.size * size
            data = self._take(f"{count}s", count, wanted=hint is not Skipped)
        else:
            length = self._length()
            self._align(size, f"if {length}")
            data, start = self._new(), self._at
            end = self._move(f"{start} + {length} * {size}")
            self._place = layout.after_numbers(field.type)
            if hint is not Skipped:
                self._line(f"if {end} > n: raise short()")
                self._line(f"{data} = d[{start}:{end}]")
        if hint is Skipped:
            return ""
        if isinstance(hint, type) and issubclass(hint, Numbers):
            return self._made(f"packed({self._named(hint)}, {code!r}, {{}})", [data])
        if field.type in OCTETS:
            return self._as(self._made("bytes({})", [data]), hint, hint is bytes)
        item = item_of(hint)
        if field.type == "bool":
            values = self._made("[*map(bool, {})]", [data])
            return self._as(values, hint, item in (Any, bool))
        values = self._made(f"numbers({code!r}, {{}})", [data])
        kinds: dict[Any, Any] = {float: FLOATS, int: INTEGERS}
        if field.type in kinds.get(item, ()):
            return self._made("{}.tolist()", [values])
        return self._as(values, hint, False)

    def _array(self, field: Field, hint: Any) -> str:
        """Read an array of messages or of strings."""
        count = self._length() if field.size is None else str(field.size)
        item = Skipped if hint is Skipped else item_of(hint)
        one, parts = layout.one_of(field), parts_of(field, self._encoding)
        record = layout.record_size(parts, self._encoding) if parts else None
        if record is not None:
            found = self._records(one, count, record, item or Any)
        elif self._indent == 2 and is_row(one, item, self._encoding):
            found = self._rows(one, count, item or Any)
        else:
            found = self._loop(one, count, item or Any)
        return found if hint is Skipped else self._as(found, hint, item is not None)

    def _records(
        self, one: Field, count: str, record: tuple[int, int], hint: Any
    ) -> str:
        """Read messages of one fixed size in one step."""
        size, unit = record
        self._align(unit, f"if {count}")
        self._flush()
        start = self._at
        end = self._move(f"{start} + {count} * {size}")
        after = Place(min(unit, 4), 0)
        if hint is Skipped:
            self._place = after
            return ""
        self._check_count(one, count, f"{end} > n")
        self._place = Place(unit, 0)
        value = self._value(one, hint)
        step = struct.Struct(self._order + _shortened(self._format))
        names, self._format, self._found = self._found, [], []
        self._place = after
        each = f"{self._named(step.iter_unpack)}(d[{start}:{end}])"
        return self._list(value, names, each)

    def _rows(self, one: Field, count: str | None, hint: Any) -> str:
        """Read messages of fields of fixed size and strings in one step.

        Args:
            one: One of them.
            count: Their number; None for the message itself, which is in no list.
            hint: The type of one.

        """
        self._flush()
        if count is not None:
            least = least_size((one,), self._encoding)
            self._check_count(one, count, f"{count} * {least} > n - ({self._at})")
        pieces: list[Piece] = []
        self._pieces, self._place, offset = pieces, ANYWHERE, self._offset
        self._columns = count is not None and hint is not Any  # slower for a dict
        self._flat = self._columns and is_flat(hint)
        value = self._value(one, hint)
        self._flush()
        columns, self._columns, self._pieces = self._columns, False, None
        names, self._found = f"{', '.join(self._found)},", []
        width = names.count(",")
        self._place, self._offset = ANYWHERE, offset
        rows = Rows(pieces, self._order, 4 if self._cdr else 0)
        at, found, key, unpacked = self._at, self._new(), "n", names
        if count is not None:
            at, unpacked = self._move(at), "u"
            key = f"({count}, n - {at}, {at} & 7)"
            each = f"for {names} in zip(*[iter(u)] * w)"
            if self._flat:
                value = f"zip({value})"
            value = f"[*{value}]" if columns else f"[{value} {each}]"
            self._line(f"w = {width}")
        plan = f"{self._named(rows.plan)}(d, {at}, {count or 1}, {key})"
        self._line(f"f, e = {self._named(rows.plans.get)}({key}) or {plan}")
        self._line(f"{unpacked} = f(d, {at})")
        self._line(f"try: {found} = {value}")
        again = f"f, e = {plan}; {unpacked} = f(d, {at}); {found} = {value}"
        self._line(f"except Misguess: {again}")
        self._flat = False
        self._move(f"{at} + e")
        return found

    def _list(self, value: str, names: Sequence[str], each: str) -> str:
        found = self._new()
        values = "".join(f"{name}, " for name in names)
        self._line(f"{found} = [{value} for ({values}) in {each}]")
        return found

    def _check_count(self, one: Field, count: str, too_many: str) -> None:
        """Write the checks of the number of items, before any of them is built."""
        self._line(f"if {too_many}: raise short()")
        self._line(f"left -= {count} * {layout.values_of(one, self._encoding)}")
        self._line("if left < 0: raise many()")

    def _loop(self, one: Field, count: str, hint: Any) -> str:
        """Read an array item by item."""
        self._flush()
        least = least_size((one,), self._encoding)
        self._check_count(one, count, f"{count} * {least} > n - ({self._at})")
        place = self._place.either(layout.place_after(one, ANYWHERE))
        self._place = place
        found = self._new()
        if hint is not Skipped:
            self._line(f"{found} = []")
        start = self._move(self._at)
        self._line(f"for _ in range({count}):")
        self._indent += 1
        value = self._value(one, hint)
        self._flush()
        if hint is not Skipped:
            self._line(f"{found}.append({value})")
        self._line(f"{start} = {self._at}")
        self._indent -= 1
        self._base, self._offset, self._place = start, 0, place
        return found


def _shortened(codes: Sequence[str]) -> str:
    """Return codes of :mod:`struct` with a number for each repetition."""
    counts = ((code, len([*same])) for code, same in groupby(codes))
    return "".join(
        f"{count}{code}" if len(code) == 1 and count > 1 else code * count
        for code, count in counts
    )
