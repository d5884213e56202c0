"""Whether a value is of the kind that an annotation names, in words for people."""

import math
import sys
import types
from collections.abc import Callable, Iterable, Mapping
from numbers import Integral, Real
from types import SimpleNamespace
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

Way: TypeAlias = tuple[str | int, ...]
"""Keys and indices on the way to a value."""

Misfit: TypeAlias = tuple[Way, Any, str]
"""The way to a value that does not fit, the value, and what was expected."""

_PLAIN = (str, bytes, int, float, list, tuple, dict, type(None))
"""What files are made of; anything else its taker knows better than we do."""

_NAMES = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text",
    bytes: "bytes",
    type(None): "None",
}


def resolved(annotation: Any, owner: Callable[..., Any]) -> Any:
    """Return an annotation that may be a text as what it means.

    A name that only a type checker knows stands for a class of its own: no plain value
    is one.
    """
    if not isinstance(annotation, str):
        return annotation
    module = sys.modules.get(getattr(owner, "__module__", ""))
    names = dict(vars(module)) if module is not None else {}
    holder = SimpleNamespace(__annotations__={"it": annotation})
    for _ in range(20):
        try:
            return get_type_hints(holder, names, names, include_extras=True)["it"]
        except NameError as error:
            name = str(error.name)
            names[name] = type(name, (), {})
        except Exception:  # what somebody else wrote there may be no type at all
            return Any
    return Any


def misfit(annotation: Any, value: Any) -> Misfit | None:
    """Return what of a value is not of the kind that an annotation names, if any.

    Args:
        annotation: A type, as a signature has it once its texts are resolved.
        value: Anything. An object of a class of its own passes for another class.

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
    except TypeError:  # a protocol that cannot be asked
        return True
    if getattr(annotation, "_is_protocol", False):
        return True
    if issubclass(annotation, Mapping):  # a table with types for its keys, too
        return isinstance(value, Mapping)
    if annotation is str or annotation is bytes:
        return False
    return not isinstance(value, _PLAIN)


def _unusable(value: Any) -> bool:
    """Tell whether it is a whole number of hundreds of digits, which is no float.

    NaN and infinity are floats; what they would mean, their taker says better.
    """
    try:
        math.isnan(value)
    except OverflowError:
        return True
    return False


def _of_several(kinds: tuple[Any, ...], value: Any) -> Misfit | None:
    found = [misfit(kind, value) for kind in kinds]
    if None in found:
        return None
    told = [kind for kind in kinds if kind not in (None, type(None))]
    if len(told) == 1:
        return misfit(told[0], value)
    return (), value, " or ".join(_named(kind) for kind in told)


def _of_many(
    annotation: Any, origin: Any, inner: tuple[Any, ...], value: Any
) -> Misfit | None:
    wrong: Misfit = ((), value, _named(annotation))
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
            return None  # going through it might use it up
        return _first((at, misfit(inner[0], each)) for at, each in enumerate(value))
    if issubclass(origin, Callable):  # type: ignore[arg-type]
        return None if callable(value) else wrong
    return None if _is_one(origin, value) else wrong


def _first(found: Iterable[tuple[Any, Misfit | None]]) -> Misfit | None:
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
        told = [kind for kind in inner if kind is not type(None)]
        return " or ".join(_named(kind) for kind in told)
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
