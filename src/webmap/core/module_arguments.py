"""Whether a module takes the arguments that it is given, by its own annotations.

Who adds a module from a file or from a program makes the same mistakes: a number in
quotes, a topic where the bridge should be, a key with a typing error. They are found
here, before the module is made, so that no module needs checks of kinds, and the way
to each wrong argument is known to who reads a file.
"""

import difflib
import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from webmap.core.annotations import Way, misfit, resolved
from webmap.errors import ConfigError
from webmap.ros.names import normalise_topic

_POSITIONAL = (
    inspect.Parameter.POSITIONAL_ONLY,
    inspect.Parameter.POSITIONAL_OR_KEYWORD,
)
_NAMED = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)


@dataclass(frozen=True, slots=True)
class WrongArgument:
    """An argument that a module does not take."""

    way: Way
    """``("args", 1)`` or ``("options", "throttle")``, and on into a list or a table;
    empty if it is about all of them."""

    words: str
    """What was expected, or what is wrong."""

    name: str = ""
    """What the module calls it."""

    got: tuple[Any, ...] = ()
    """The value, if ``words`` say what was expected in its place."""


class WrongArguments(ConfigError, TypeError):
    """A module does not take its arguments.

    Args:
        module: The module's name.
        wrong: All that is wrong.

    """

    def __init__(self, module: str, wrong: Sequence[WrongArgument]) -> None:
        self.wrong = tuple(wrong)
        said = [_in_words(each) for each in self.wrong]
        super().__init__(f"{module}: {'; '.join(said)}")


def check_arguments(
    factory: Callable[..., Any],
    args: Sequence[Any],
    options: Mapping[str, Any],
    *,
    first: int = 0,
) -> None:
    """Let arguments pass that are of the kinds that a module's annotations name.

    Args:
        factory: What makes the module; its first parameter is the owner.
        args: What it gets after its owner.
        options: Its arguments by name.
        first: The number of the first of ``args`` for people, where they were passed
            on after others.

    Raises:
        WrongArguments: If one is not.

    """
    try:
        signature = inspect.signature(factory)
    except (TypeError, ValueError):
        return  # written in C; it says itself what it takes
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
    # The owner comes by its place, and by its name nobody else can.
    owner = {each.name for each in every if each.kind in _NAMED} - set(by_name)
    for name, value in options.items():
        parameter = by_name.get(name, None if name in owner else others)
        if name in placed and name in by_name:
            words = f'"{name}" has multiple values: one by its place, one by its name'
            yield WrongArgument(("options", name), words)
        elif parameter is None:
            near = difflib.get_close_matches(name, by_name, n=1)
            hint = f'; did you mean "{near[0]}"?' if near else ""
            words = f'there is no argument "{name}"{hint}; it takes {_names(signature)}'
            yield WrongArgument(("options", name), words)
        else:
            yield from _one(factory, parameter, value, ("options", name))


def _one(
    factory: Callable[..., Any], parameter: inspect.Parameter, value: Any, way: Way
) -> Iterator[WrongArgument]:
    if value is parameter.default:
        return
    if parameter.annotation is parameter.empty:
        return
    found = misfit(resolved(parameter.annotation, factory), value)
    if found is not None:
        deeper, got, expected = found
        many = parameter.kind is inspect.Parameter.VAR_KEYWORD
        name = str(way[1]) if many else parameter.name
        yield WrongArgument((*way, *deeper), expected, name, (got,))
    elif parameter.name == "topic" and isinstance(value, str):
        # The name means the same in every module, and a bad one would be found only
        # when the topic is subscribed to, which may be when the first page is opened.
        try:
            normalise_topic(value)
        except ConfigError:
            expected = 'the name of a topic, such as "/odom"'
            yield WrongArgument(way, expected, "topic", (value,))
    elif parameter.name == "throttle" and isinstance(value, int) and value < 0:
        yield WrongArgument(way, "milliseconds, 0 or more", "throttle", (value,))


def _after_owner(signature: inspect.Signature) -> list[inspect.Parameter]:
    parameters = list(signature.parameters.values())
    takes_owner = bool(parameters) and parameters[0].kind in _POSITIONAL
    return parameters[1:] if takes_owner else parameters


def _names(signature: inspect.Signature) -> str:
    # Without its annotation and default, a parameter shows its name and its stars.
    empty = inspect.Parameter.empty
    listed = _after_owner(signature)
    names = [str(each.replace(annotation=empty, default=empty)) for each in listed]
    return f"({', '.join(names)})"


def _in_words(wrong: WrongArgument) -> str:
    if not wrong.got:
        return wrong.words
    inside = "".join(f"[{part!r}]" for part in wrong.way[2:])
    text = repr(wrong.got[0])
    shown = text if len(text) <= 60 else f"{text[:57]}..."
    return f"{wrong.name}{inside}: expected {wrong.words}, got {shown}"
