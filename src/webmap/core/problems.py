"""What fails of something that maps show: kept while it does, and said on them all."""

import logging
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar


class Told(Protocol):
    """Who shows people what fails: a map."""

    def show_error(self, text: str) -> None:
        """Show what the log has already."""


T = TypeVar("T", bound=Told)


class Problems(Generic[T]):
    """The sentences of one thing that maps share, and the maps that show them.

    Args:
        log: Where each sentence goes besides.
        worded: What makes a sentence out of what is said, such as by a name in front.

    """

    def __init__(self, log: logging.Logger, worded: Callable[[str], str] = str) -> None:
        self.maps: list[T] = []
        self.standing: dict[object, str] = {}
        """What fails for now, by what it is about."""
        self._log = log
        self._worded = worded

    def report(self, text: str) -> None:
        """Log a failure and show it on every map there is now."""
        sentence = self._worded(text)
        self._log.warning("%s", sentence)
        for map in self.maps:
            map.show_error(sentence)

    def set(self, about: object, text: str) -> None:
        """Report what fails until :meth:`clear`, once; a new text takes its place."""
        if self.standing.get(about) != text:
            self.standing[about] = text
            self.report(text)

    def clear(self, about: object) -> None:
        """Note that what was said of ``about`` is true no more."""
        self.standing.pop(about, None)

    def join(self, map: T) -> None:
        """Show a map what fails now, and from now on."""
        self.maps.append(map)
        for text in self.standing.values():
            map.show_error(self._worded(text))

    def leave(self, map: T) -> None:
        """Show a map nothing more."""
        self.maps.remove(map)
