"""Check of a module's arguments against its annotations.

Modules added from a file and from a program get the same wrong arguments: a number in
quotes, a topic in place of the bridge, a misspelt key. They are found here, before the
module is created, so modules need no type checks of their own, and the path of each
wrong argument is known to the reader of a file.
"""

import inspect
import math
import sys
import types
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from typing import (
    Annotated,
    Any,
    Literal,
    TypeAlias,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

from webmap.base.errors import ConfigError
from webmap.config import checks
from webmap.config.checks import KeyPath, did_you_mean

Mismatch: TypeAlias = tuple[KeyPath, Any, str]
"""The path of a value of the wrong type, the value, and the expected type."""

_PLAIN = (str, bytes, int, float, list, tuple, dict, type(None))
"""Types that files consist of; only values of these types are checked."""

MEANINGS = {("topic", str): checks.topic, ("throttle", int): checks.milliseconds}
"""The checks of parameters that mean the same in every module, by name and type.

A bad topic would otherwise be found only on subscription, which may be when the first
page opens.
"""

_NAMES = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text",
    bytes: "bytes",
    type(None): "None",
}


def resolved(annotation: Any, owner: Callable[..., Any]) -> Any:
    """Return the type of an annotation that may be a string.

    A name that only a type checker knows becomes a class of its own, which no plain
    value is an instance of.
    """
    if not isinstance(annotation, str):
        return annotation
    module = sys.modules.get(getattr(owner, "__module__", ""))
    names = dict(vars(module)) if module is not None else {}
    holder = type("Holder", (), {"__annotations__": {"it": annotation}})
    for _ in range(20):
        try:
            return get_type_hints(holder, names, names, include_extras=True)["it"]
        except NameError as error:
            name = str(error.name)
            names[name] = type(name, (), {"__module__": "typing"})
        except Exception:  # an annotation may be no type at all
            return Any
    return Any


def misfit(annotation: Any, value: Any) -> Mismatch | None:
    """Return the part of a value that does not match an annotation, or None.

    Args:
        annotation: A type from a signature, with its strings resolved.
        value: Any value. An instance of a custom class passes for another class.

    """
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return misfit(inner[0], value)
    if origin in (Union, types.UnionType):
        return _of_several(inner, value)
    if origin is Literal:
        fits = any(value == one and type(value) is type(one) for one in inner)
        return None if fits else ((), value, _named(annotation))
    if origin is not None:
        return _of_many(annotation, origin, inner, value)
    fits = _is_one(annotation, value)
    return None if fits else ((), value, _named(annotation))


def _is_one(annotation: Any, value: Any) -> bool:
    if annotation is None:
        return value is None
    if not isinstance(annotation, type) or isinstance(annotation, TypeVar):
        return True
    if annotation is bool:
        return isinstance(value, bool)
    if annotation in (int, float):
        kind = Integral if annotation is int else Real
        if not isinstance(value, kind) or isinstance(value, bool):
            return False
        return annotation is int or not _unusable(value)
    try:
        if isinstance(value, annotation):
            return True
    except TypeError:  # a protocol without runtime checks
        return True
    if getattr(annotation, "_is_protocol", False):
        return True
    if issubclass(annotation, Mapping):  # a table whose annotation names key types
        return isinstance(value, Mapping)
    if annotation is str or annotation is bytes:
        return False
    return not isinstance(value, _PLAIN)


def _unusable(value: Any) -> bool:
    """Return whether a value is an integer too large for a float.

    NaN and infinity are floats; the module that takes the value checks them.
    """
    try:
        math.isnan(value)
    except OverflowError:
        return True
    return False


def _of_several(kinds: tuple[Any, ...], value: Any) -> Mismatch | None:
    found = [misfit(kind, value) for kind in kinds]
    if None in found:
        return None
    known = [kind for kind in kinds if kind not in (None, type(None))]
    if len(known) == 1:
        return misfit(known[0], value)
    return (), value, " or ".join(_named(kind) for kind in known)


def _of_many(
    annotation: Any, origin: Any, inner: tuple[Any, ...], value: Any
) -> Mismatch | None:
    wrong: Mismatch = ((), value, _named(annotation))
    if not isinstance(origin, type):
        return None
    if issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            return wrong
        return _first((key, misfit(inner[1], each)) for key, each in value.items())
    if origin is tuple and Ellipsis not in inner:
        if not isinstance(value, list | tuple) or len(value) != len(inner):
            return wrong
        pairs = zip(inner, value, strict=True)
        return _first((at, misfit(kind, each)) for at, (kind, each) in enumerate(pairs))
    if issubclass(origin, Iterable):
        if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
            return wrong
        if not isinstance(value, list | tuple):
            return None  # iterating might consume it
        return _first((at, misfit(inner[0], each)) for at, each in enumerate(value))
    if issubclass(origin, Callable):  # type: ignore[arg-type]
        return None if callable(value) else wrong
    return None if _is_one(origin, value) else wrong


def _first(found: Iterable[tuple[Any, Mismatch | None]]) -> Mismatch | None:
    for key, wrong in found:
        if wrong is not None:
            deeper, value, expected = wrong
            return (key, *deeper), value, expected
    return None


def _named(annotation: Any) -> str:
    origin, inner = get_origin(annotation), get_args(annotation)
    if annotation in _NAMES:
        return _NAMES[annotation]
    if origin is Literal:
        return " or ".join(
            f'"{one}"' if isinstance(one, str) else str(one) for one in inner
        )
    if origin is Annotated:
        return _named(inner[0])
    if origin in (Union, types.UnionType):
        known = [kind for kind in inner if kind is not type(None)]
        return " or ".join(_named(kind) for kind in known)
    if origin is tuple and Ellipsis not in inner:
        return f"{len(inner)} in a list: {', '.join(_named(kind) for kind in inner)}"
    kind = origin or annotation
    if isinstance(kind, type):
        if issubclass(kind, Mapping):
            return "a table"
        if issubclass(kind, Iterable) and origin is not None:
            return f"a list, each {_named(inner[0])}" if inner else "a list"
        if kind is list or kind is tuple:
            return "a list"
        name = kind.__name__
        return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"
    return str(annotation)


_POSITIONAL = (
    inspect.Parameter.POSITIONAL_ONLY,
    inspect.Parameter.POSITIONAL_OR_KEYWORD,
)
_NAMED = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)


@dataclass(frozen=True, slots=True)
class WrongArgument:
    """An argument that a module does not accept."""

    path: KeyPath
    """``("args", 1)`` or ``("options", "throttle")``, followed by the path into a list
    or a table; empty if it is about all arguments."""

    text: str
    """What was expected, or the error."""

    name: str = ""
    """The name of the module's parameter."""

    got: tuple[Any, ...] = ()
    """The value, if ``text`` is what was expected."""


class WrongArguments(ConfigError, TypeError):
    """The arguments of a module are wrong.

    Args:
        module: The module's name.
        wrong: All wrong arguments.

    """

    def __init__(self, module: str, wrong: Sequence[WrongArgument]) -> None:
        self.wrong = tuple(wrong)
        texts = [_as_text(each) for each in self.wrong]
        super().__init__(f"{module}: {'; '.join(texts)}")


def check_arguments(
    factory: Callable[..., Any],
    args: Sequence[Any],
    options: Mapping[str, Any],
    *,
    first: int = 0,
) -> None:
    """Check arguments against the annotations of a module.

    Args:
        factory: The module's class or factory; its first parameter is the owner.
        args: The positional arguments after the owner.
        options: The keyword arguments.
        first: The number of the first of ``args`` in error messages, if it is not the
            caller's first argument.

    Raises:
        WrongArguments: If an argument does not match.

    """
    try:
        signature = inspect.signature(factory)
    except (TypeError, ValueError):
        return  # written in C, checks its arguments itself
    found = list(_wrong(factory, signature, args, options, first))
    if not found:
        try:
            signature.bind(None, *args, **options)
        except TypeError as error:
            found = [WrongArgument((), f"{error}; it takes {_names(signature)}")]
    if found:
        raise WrongArguments(getattr(factory, "__name__", str(factory)), found)


def _wrong(
    factory: Callable[..., Any],
    signature: inspect.Signature,
    args: Sequence[Any],
    options: Mapping[str, Any],
    first: int,
) -> Iterator[WrongArgument]:
    parameters = _after_owner(signature)
    by_place = [each for each in parameters if each.kind in _POSITIONAL]
    by_name = {each.name: each for each in parameters if each.kind in _NAMED}
    rest = {each.kind: each for each in parameters}
    more = rest.get(inspect.Parameter.VAR_POSITIONAL)
    others = rest.get(inspect.Parameter.VAR_KEYWORD)
    for place, value in enumerate(args):
        parameter = by_place[place] if place < len(by_place) else more
        if parameter is not None:
            yield from _one(factory, parameter, value, ("args", first + place))
    placed = {each.name for each in by_place[: len(args)]}
    every = signature.parameters.values()
    # The owner is passed by position; its name is not free for another argument.
    owner = {each.name for each in every if each.kind in _NAMED} - set(by_name)
    for name, value in options.items():
        parameter = by_name.get(name, None if name in owner else others)
        if name in placed and name in by_name:
            text = f'"{name}" has multiple values: one by its place, one by its name'
            yield WrongArgument(("options", name), text)
        elif parameter is None:
            hint = did_you_mean(name, by_name)
            text = f'there is no argument "{name}"{hint}; it takes {_names(signature)}'
            yield WrongArgument(("options", name), text)
        else:
            yield from _one(factory, parameter, value, ("options", name))


def _one(
    factory: Callable[..., Any], parameter: inspect.Parameter, value: Any, path: KeyPath
) -> Iterator[WrongArgument]:
    if value is parameter.default:
        return
    if parameter.annotation is parameter.empty:
        return
    found = misfit(resolved(parameter.annotation, factory), value)
    if found is not None:
        deeper, got, expected = found
        many = parameter.kind is inspect.Parameter.VAR_KEYWORD
        name = str(path[1]) if many else parameter.name
        yield WrongArgument((*path, *deeper), expected, name, (got,))
    elif (parameter.name, type(value)) in MEANINGS:
        try:
            MEANINGS[parameter.name, type(value)](value)
        except ConfigError as error:
            yield WrongArgument(path, str(error), parameter.name, (value,))


def _after_owner(signature: inspect.Signature) -> list[inspect.Parameter]:
    parameters = list(signature.parameters.values())
    takes_owner = bool(parameters) and parameters[0].kind in _POSITIONAL
    return parameters[1:] if takes_owner else parameters


def _names(signature: inspect.Signature) -> str:
    # Without annotation and default, a parameter shows its name and its stars.
    empty = inspect.Parameter.empty
    listed = _after_owner(signature)
    names = [str(each.replace(annotation=empty, default=empty)) for each in listed]
    return f"({', '.join(names)})"


def _as_text(wrong: WrongArgument) -> str:
    if not wrong.got:
        return wrong.text
    inside = "".join(f"[{part!r}]" for part in wrong.path[2:])
    text = repr(wrong.got[0])
    shown = text if len(text) <= 60 else f"{text[:57]}..."
    return f"{wrong.name}{inside}: expected {wrong.text}, got {shown}"
