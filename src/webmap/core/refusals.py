"""What a robot sends and nobody can draw: said to people once, and left out."""

import logging
from collections.abc import Callable
from typing import Protocol, TypeVar

from webmap.errors import WebMapError
from webmap.scope import Removal, keep

log = logging.getLogger("webmap.modules")

M = TypeVar("M")


class Owner(Protocol):
    """Who shows people what goes on failing: a robot, a map or a layer."""

    def set_problem(self, about: object, text: str) -> None:
        """Note what fails until :meth:`clear_problem`."""

    def clear_problem(self, about: object) -> None:
        """Note that what was said of ``about`` is true no more."""


def refusing(
    owner: Owner, topic: str, draw: Callable[[M], None]
) -> Callable[[M], None]:
    """Return ``draw`` for a subscription: what it refuses, the owner tells.

    A message that ``draw`` raises an error of WebMap's for is left out, so that what
    was drawn before stays and ages. The sentence stands until a message is taken, or
    until the current scope ends.

    Args:
        owner: Who tells.
        topic: Where the messages come from.
        draw: Takes a message, and changes nothing before it has looked at all of it.

    """
    about = object()
    keep(Removal(lambda: owner.clear_problem(about)))

    def take(message: M) -> None:
        try:
            draw(message)
        except WebMapError as error:
            owner.set_problem(about, f"{topic}: {error}")
        else:
            owner.clear_problem(about)

    return take
