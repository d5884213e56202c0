"""Whether what a robot is told is of the kinds that the method's signature names.

A number in quotes or an address where the bridge should be is refused in the call
that says it, in the words in which a module's arguments are.
"""

import functools
from collections.abc import Callable, Collection
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar

from webmap.core.module_arguments import WrongArguments, check_arguments


class Named(Protocol):
    """Whose method is called: a robot."""

    name: str


P = ParamSpec("P")
R = TypeVar("R")
N = TypeVar("N", bound=Named)
Method = Callable[Concatenate[N, P], R]


def checks_kinds(
    *, but: Collection[str] = ()
) -> Callable[[Method[N, P, R]], Method[N, P, R]]:
    """Have a method refuse arguments that are not of the kinds it names; a decorator.

    Args:
        but: Parameters whose values the method looks at itself, in better words.

    """

    def decorate(method: Method[N, P, R]) -> Method[N, P, R]:
        @functools.wraps(method)
        def checked(owner: N, /, *args: P.args, **kwargs: P.kwargs) -> R:
            _check(owner, method, args, kwargs, but)
            return method(owner, *args, **kwargs)

        return checked

    return decorate


def _check(
    owner: Named,
    method: Callable[..., object],
    args: tuple[Any, ...],
    kwargs: dict[str, Any],
    but: Collection[str],
) -> None:
    try:
        check_arguments(method, args, kwargs)
    except WrongArguments as error:
        wrong = [each for each in error.wrong if each.name not in but]
        if wrong:
            called = f"robot {owner.name!r}: {method.__name__}"
            raise WrongArguments(called, wrong) from None
