"""Reading of plain values into a Struct, with all checks of a configuration.

A configuration is a Struct. The annotation of each field has the check of its value:
``v_max: Annotated[float, checks.from_zero("metres per second")] | None = None``.
:func:`read` makes the Struct from plain values, such as TOML, JSON or the arguments of
a method, and adds every mistake with its path.
"""

import functools
import types
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    TypeAlias,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec

from webmap.base.errors import ConfigError
from webmap.config import checks
from webmap.config.checks import KeyPath, Mistakes, checked, did_you_mean, show

ONE_OR_MORE = "one or more"
"""Annotation of a list: a single value is read as a list of one."""

Reader: TypeAlias = Callable[[Any, KeyPath, Mistakes], Any]


@dataclass(frozen=True, slots=True)
class ReadBy:
    """Annotation of a field: the function that reads its value."""

    read: Reader


class Config(msgspec.Struct, frozen=True, omit_defaults=True):
    """Base class of the tables of a configuration."""

    example: ClassVar[str] = ""
    """An example of the table, for error messages."""

    @classmethod
    def expand(cls, value: Any) -> dict[str, Any] | None:
        """Return the table for its short form; None if the part is absent.

        Raises:
            ConfigError: If it is not a short form, with what was expected.

        """
        such = f" such as {cls.example}" if cls.example else " of keys and values"
        raise ConfigError(f"a table{such}")

    def check(self, path: KeyPath, mistakes: Mistakes) -> None:
        """Add mistakes that concern several fields; each alone is valid."""


S = TypeVar("S", bound=Config)


def read(cls: type[S], value: Any, path: KeyPath, mistakes: Mistakes) -> S | None:
    """Return the Struct for a table of plain values; every mistake is added.

    Args:
        cls: The Struct.
        value: A table of keys and values, or its short form.
        path: The path of the table.
        mistakes: The list for every mistake. If there is one, the result is unusable:
            required fields that are wrong or missing are None.

    Returns:
        The Struct; None if the value is no table, or the part is absent.

    """
    if isinstance(value, Mapping):
        return _read_table(cls, value, path, mistakes)
    try:
        table = cls.expand(value)
    except ConfigError as error:
        mistakes.add(path, f"got {show(value)}, expected {error}")
        return None
    return (
        None if table is None else _read_table(cls, table, path, mistakes, short=True)
    )


def _read_table(
    cls: type[S],
    table: Mapping[str, Any],
    path: KeyPath,
    mistakes: Mistakes,
    *,
    short: bool = False,
) -> S:
    known, before = _fields(cls), mistakes.count
    values: dict[str, Any] = {key: None for key in known if known[key].required}
    for key, got in table.items():
        if key not in known:
            unknown(key, known, (*path, str(key)), mistakes)
            continue
        # A short form has no key of its own in the file.
        value = known[key].read(got, path if short else (*path, key), mistakes)
        if value is not None:
            values[key] = value
    for key, each in known.items():
        if each.required and key not in table:
            mistakes.add(path, f'the key "{key}" is missing')
    made = cls(**values)
    if mistakes.count == before:
        made.check(path, mistakes)
    return made


def read_key(cls: type[Config], key: str, value: Any, what: str) -> Any:
    """Return the value of one key of a table, from the arguments of a method.

    Args:
        cls: The class of the table.
        key: The key.
        value: The plain value, as in a fleet file.
        what: The configured thing, such as ``robot 'Bob'``.

    Raises:
        ConfigError: If a value is wrong; the message lists every mistake.

    """
    mistakes = Mistakes()
    made = _fields(cls)[key].read(value, (key,), mistakes)
    mistakes.refuse(what)
    return made


def unknown(
    key: object, known: Iterable[str], path: KeyPath, mistakes: Mistakes
) -> None:
    """Add a mistake that lists the known keys, with the most similar one as a hint."""
    if mistakes.full:
        mistakes.add(path, str(key))  # only counted: a hint takes long
        return
    listed = ", ".join(known)
    hint = did_you_mean(key, known)
    if key in checks.HEAD and len(path) > 1:
        hint = f"; it belongs to the file: write it above the first [table]{hint}"
    mistakes.add(path, f'there is no key "{key}" here{hint}; there are {listed}')


@dataclass(frozen=True, slots=True)
class _Field:
    read: Reader
    required: bool


@functools.cache
def _fields(cls: type[Config]) -> dict[str, _Field]:
    hints = get_type_hints(cls, include_extras=True)
    return {
        each.name: _Field(_reader_of(hints[each.name]), each.required)
        for each in msgspec.structs.fields(cls)
    }


def _reader_of(hint: Any) -> Reader:
    """Return the reader for the value of a field with this annotation."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        for each in inner[1:]:
            if isinstance(each, ReadBy):
                return each.read
            if callable(each):
                return functools.partial(checked, each)
        return _list_reader(get_args(inner[0])[0], single=True)
    if origin in (Union, types.UnionType):
        inner_read = _reader_of(
            next(each for each in inner if each is not types.NoneType)
        )
        return lambda value, path, mistakes: (
            None if value is None else inner_read(value, path, mistakes)
        )
    if origin is list:
        return _list_reader(inner[0], single=False)
    if origin is Literal:
        return functools.partial(checked, checks.one_of(*inner))
    if isinstance(hint, type) and issubclass(hint, Config):
        return functools.partial(read, hint)
    if hint is Any:
        return lambda value, path, mistakes: value
    return functools.partial(checked, {bool: checks.yes_or_no, str: checks.text}[hint])


def _list_reader(hint: Any, *, single: bool) -> Reader:
    inner_read, example = _reader_of(hint), getattr(hint, "example", "")

    def read_all(value: Any, path: KeyPath, mistakes: Mistakes) -> list[Any]:
        if isinstance(value, list | tuple):
            taken = (inner_read(v, (*path, i), mistakes) for i, v in enumerate(value))
            return [each for each in taken if each is not None]
        if single:
            each = inner_read(value, path, mistakes)
            return [] if each is None else [each]
        name = ".".join(part for part in path if isinstance(part, str))
        brackets = " in double brackets" if isinstance(value, Mapping) else ""
        expected = f"a table [[{name}]]{brackets} for each"
        if example:
            expected = f"an array such as [{example.partition(' or ')[0]}]"
        elif get_origin(hint) is Annotated and get_args(hint)[0] is str:
            expected = 'an array of texts, such as ["one", "two"]'
        mistakes.add(path, f"got {show(value)}, expected {expected}")
        return []

    return read_all
