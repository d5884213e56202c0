"""The options of a layer: declared once, as annotated attributes of its class.

The declaration gives the signature, with which arguments are checked and named in error
messages. Values are checked by the annotations.
"""

import inspect
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import UnionType
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    TypeAlias,
    Union,
    get_args,
    get_origin,
)

from webmap.base.errors import ConfigError
from webmap.core.module_arguments import resolved
from webmap.ros.bridge import Bridge


@dataclass(frozen=True, slots=True)
class Limit:
    """The values that an option may have: ``Annotated[float, Limit(words, fits)]``."""

    words: str
    """The values in words, as in "must be WORDS"."""

    fits: Callable[[Any], bool]


BY_PLACE = inspect.Parameter.POSITIONAL_OR_KEYWORD
BY_NAME = inspect.Parameter.KEYWORD_ONLY

Metres: TypeAlias = Annotated[
    float, Limit("metres above 0", lambda value: math.isfinite(value) and value > 0)
]
Count: TypeAlias = Annotated[int, Limit("at least 1", lambda value: value >= 1)]
Seconds: TypeAlias = Annotated[float, Limit("at least 0 s", lambda value: value >= 0)]
Frame: TypeAlias = Literal["map", "robot"]


class LayerOptions:
    """Takes arguments after an owner, and stores each as an attribute.

    Every annotated attribute of the class that has a value is an option, and its value
    is the default. Options are keyword arguments; those above ``_: KW_ONLY`` may also
    be given by position, after the bridge and the topic.
    """

    owner: ClassVar[str] = "owner"
    """The name of the first argument."""

    __signature__: ClassVar[inspect.Signature]

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.__signature__ = _signature(cls)

    def _take_arguments(self, *args: Any, **options: Any) -> None:
        """Store the arguments after the owner as attributes.

        Raises:
            ConfigError: If a value is outside of its limits.

        """
        given = self.__signature__.bind(*args, **options)
        given.apply_defaults()
        del given.arguments[self.owner]
        for name, value in given.arguments.items():
            annotation = self.__signature__.parameters[name].annotation
            for limit in _limits(annotation, value):
                if not limit.fits(value):
                    raise ConfigError(f"{name} must be {limit.words}, got {value}")
            setattr(self, name, value)


def _signature(cls: type[LayerOptions]) -> inspect.Signature:
    empty = inspect.Parameter.empty
    topic = getattr(cls, "topic", empty)
    found = [
        inspect.Parameter(cls.owner, BY_PLACE),
        inspect.Parameter("bridge", BY_PLACE, annotation=Bridge),
        inspect.Parameter("topic", BY_PLACE, annotation=str, default=topic),
        *sorted(_options(cls), key=lambda option: option.kind),
    ]
    return inspect.Signature(found)


def _limits(annotation: Any, value: Any) -> Iterator[Limit]:
    """Yield the limits of an annotation for a value."""
    origin = get_origin(annotation)
    if origin is Annotated:
        found = annotation.__metadata__
        yield from (each for each in found if isinstance(each, Limit))
    elif origin in (Union, UnionType) and value is not None:
        for inner in get_args(annotation):
            yield from _limits(inner, value)


def _options(cls: type) -> Iterator[inspect.Parameter]:
    """Yield the options of a class, its own before those of its base classes."""
    seen = {"topic"}
    for each in cls.__mro__:
        own = inspect.get_annotations(each)
        # Strings, if the file begins with ``from __future__ import annotations``.
        own = {name: resolved(text, each) for name, text in own.items()}
        by_place = list(own).index("_") if "_" in own else 0
        for place, (name, annotation) in enumerate(own.items()):
            origin: Any = get_origin(annotation) or annotation
            known = name in seen or name.startswith("_") or origin is ClassVar
            if known or not hasattr(cls, name):
                continue
            seen.add(name)
            option = inspect.Parameter(name, BY_NAME, default=getattr(cls, name))
            option = option.replace(annotation=annotation)
            yield option.replace(kind=BY_PLACE) if place < by_place else option
