"""What fails of something that maps show: kept while it does, and said on them all."""

import logging
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from webmap.core.recurring import Recurring

if TYPE_CHECKING:
    from webmap.core.page import Page


class Told(Protocol):
    """Who shows people what fails: a map."""

    @property
    def page(self) -> "Page":
        """Where it shows what stands, until that is taken back."""

    def show_error(self, text: str) -> None:
        """Show what the log has already."""


T = TypeVar("T", bound=Told)

LONGEST = 1000
"""Characters of a sentence that is shown."""


def cut(text: str) -> str:
    """Return a text that people may read; robots may put anything into one."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


class Problems(Generic[T]):
    """The sentences of one thing that maps share, and the maps that show them.

    Args:
        log: Where each sentence goes besides.
        worded: What makes a sentence out of what is said, such as by a name in front.
        clock: Seconds that only go forward.

    """

    def __init__(
        self,
        log: logging.Logger,
        worded: Callable[[str], str] = str,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.maps: list[T] = []
        self.standing: dict[object, str] = {}
        """What fails for now, by what it is about."""
        self._log = log
        self._worded = worded
        self._clock = clock
        self._recurring: dict[object, Recurring] = {}

    def report(self, text: str) -> None:
        """Log a failure and show it on every map there is now."""
        sentence = self._worded(cut(text))
        self._log.warning("%s", sentence)
        for map in self.maps:
            map.show_error(sentence)

    def set(self, about: object, text: str) -> None:
        """Tell what fails until :meth:`clear`, once; a new text takes its place.

        A text that differs in its numbers alone is kept and not told. The same words
        go to the log once a minute at most, whether it was good in between or not.
        """
        text = cut(text)
        before = self.standing.get(about)
        if before == text:
            return
        now = self._clock()
        if before is None:
            self._forget(now)
        self.standing[about] = text
        recurring = self._recurring.setdefault(about, Recurring())
        if not recurring.fails(text):
            return
        if recurring.is_worth_a_line(now):
            self._log.warning("%s", self._worded(text))
        for page in self._pages():
            page.channel.problem(recurring.number, self._worded(text))

    def clear(self, about: object) -> None:
        """Take back what was said of ``about``; does nothing if nothing was."""
        if self.standing.pop(about, None) is None:
            return
        recurring = self._recurring[about]
        recurring.mend(self._clock())
        for page in self._pages():
            page.channel.mended(recurring.number)

    def join(self, map: T) -> None:
        """Show a map what fails now, and from now on."""
        self.maps.append(map)
        if map.page.closed:
            return
        for about, text in self.standing.items():
            map.page.channel.problem(self._recurring[about].number, self._worded(text))

    def leave(self, map: T) -> None:
        """Show a map nothing more, and take back what it shows."""
        self.maps.remove(map)
        if map.page.closed or map.page in self._pages():
            return
        for about in self.standing:
            map.page.channel.mended(self._recurring[about].number)

    def _pages(self) -> "list[Page]":
        """Return the pages that the maps are on, each of them once."""
        pages = dict.fromkeys(map.page for map in self.maps)
        return [page for page in pages if not page.closed]

    def _forget(self, now: float) -> None:
        """Forget what was mended so long ago that its next time is another."""
        for about in [a for a, r in self._recurring.items() if r.is_over(now)]:
            del self._recurring[about]
