"""Decorator for methods whose arguments set one part of a robot's configuration."""

import functools
import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

from webmap.core.module_arguments import WrongArguments, check_arguments

if TYPE_CHECKING:
    from webmap.core.driven import Driven

P = ParamSpec("P")
D = TypeVar("D", bound="Driven")
Method = Callable[Concatenate[D, P], None]


def sets_part(key: str) -> Callable[[Method[D, P]], Method[D, P]]:
    """Make a method set one part of the configuration (decorator).

    The method has a signature and a docstring but no code. Its arguments are passed to
    ``configure`` under the names of its parameters. Unknown arguments and a bridge that
    is not a ``Bridge`` are refused here; ``configure`` checks the rest.

    Args:
        key: The name of the part.

    """

    def decorate(method: Method[D, P]) -> Method[D, P]:
        signature = inspect.signature(method)

        @functools.wraps(method)
        def setter(owner: D, /, *args: P.args, **kwargs: P.kwargs) -> None:
            _check(owner, method, args, kwargs)
            given = signature.bind(owner, *args, **kwargs)
            given.apply_defaults()
            _, *values = given.arguments.items()
            part = dict(values)
            bridge = part.pop("bridge", None)
            owner.configure(key, part, bridge)

        return setter

    return decorate


def _check(
    owner: "Driven",
    method: Callable[..., object],
    args: tuple[Any, ...],
    kwargs: dict[str, Any],
) -> None:
    try:
        check_arguments(method, args, kwargs)
    except WrongArguments as error:
        wrong = [each for each in error.wrong if each.name in ("", "bridge")]
        if wrong:
            called = f"robot {owner.name!r}: {method.__name__}"
            raise WrongArguments(called, wrong) from None
