"""Problems of a robot or a layer: stored while they last, and shown on its maps."""

import itertools
import logging
import re
import secrets
import time
from collections.abc import Callable
from functools import partial
from typing import Protocol, TypeVar

from webmap.base.errors import WebMapError
from webmap.base.scope import Removal, keep
from webmap.core.base_page import BasePage
from webmap.core.world_view import WorldView

log = logging.getLogger("webmap.modules")

LONGEST = 1000
"""The greatest length of a shown sentence, in characters."""

AGAIN = 60.0
"""Seconds in which the log gets the same text about one subject once. A problem that
returns within this time after it ended is the same problem."""

MOST_TEXTS = 10
"""The number of different texts about one subject that the log gets in that time."""

_NUMBER = re.compile(
    r"0x[0-9a-f]+|[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|[-+]?\b(?:nan|inf(?:inity)?)\b",
    re.IGNORECASE,
)
_ROW = re.compile(r"#(?:[\s,;:]+#)+")

# A page opened before a restart of WebMap has other numbers.
_numbers = itertools.count(secrets.randbits(31))


def cut(text: str) -> str:
    """Return a text shortened for people; robots may send any text."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def without_numbers(text: str) -> str:
    """Return a sentence with each number or row of numbers replaced by ``#``."""
    return _ROW.sub("#", _NUMBER.sub("#", text))


class Recurring:
    """The history of one problem, until it has been absent for a minute."""

    def __init__(self) -> None:
        self.number = next(_numbers)
        """The number by which pages identify it."""
        self._shape: str | None = None
        self._mended = 0.0
        self._logged: dict[str, float] = {}

    def fails(self, text: str) -> bool:
        """Set the current sentence; return whether more than its numbers changed."""
        shape = without_numbers(text)
        changed = shape != self._shape
        self._shape = shape
        return changed

    def mend(self, now: float) -> None:
        """Set that the problem ended, at ``now`` of any monotonic clock."""
        self._shape, self._mended = None, now

    def is_over(self, now: float) -> bool:
        """Return whether it ended so long ago that the next one is a new problem."""
        return self._shape is None and now - self._mended >= AGAIN

    def should_be_logged(self, now: float) -> bool:
        """Return whether to log the current text, and record it as logged."""
        for shape in [s for s, at in self._logged.items() if now - at >= AGAIN]:
            del self._logged[shape]
        if self._shape is None or self._shape in self._logged:
            return False
        if len(self._logged) >= MOST_TEXTS:
            return False
        self._logged[self._shape] = now
        return True


class Problems:
    """The problems of a robot or a layer, and the maps that show them.

    Args:
        log: The log for each sentence.
        format_text: Returns the shown sentence, for example with a name in front.
        clock: A monotonic clock, in seconds.

    """

    def __init__(
        self,
        log: logging.Logger,
        format_text: Callable[[str], str] = str,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.maps: list[WorldView] = []
        self.current: dict[object, str] = {}
        """The current problems, by subject."""
        self._log = log
        self._format_text = format_text
        self._clock = clock
        self._recurring: dict[object, Recurring] = {}

    def report(self, text: str) -> None:
        """Log a failure and show it on every current map."""
        sentence = self._format_text(cut(text))
        self._log.warning("%s", sentence)
        for map in self.maps:
            map.show_error(sentence)

    def set(self, about: object, text: str) -> None:
        """Show a problem once, until :meth:`clear`; a new text replaces it.

        A text that differs only in its numbers is stored but not shown. The log gets
        the same text once a minute at most, even if the problem ended in between.
        """
        text = cut(text)
        before = self.current.get(about)
        if before == text:
            return
        now = self._clock()
        if before is None:
            self._forget(now)
        self.current[about] = text
        recurring = self._recurring.setdefault(about, Recurring())
        if not recurring.fails(text):
            return
        if recurring.should_be_logged(now):
            self._log.warning("%s", self._format_text(text))
        for page in self._pages():
            page.channel.problem(recurring.number, self._format_text(text))

    def clear(self, about: object) -> None:
        """Remove the problem of ``about``; does nothing if there is none."""
        if self.current.pop(about, None) is None:
            return
        recurring = self._recurring[about]
        recurring.mend(self._clock())
        for page in self._pages():
            page.channel.mended(recurring.number)

    def join(self, map: WorldView) -> None:
        """Show a map the current and future problems."""
        self.maps.append(map)
        if map.page.closed:
            return
        for about, text in self.current.items():
            map.page.channel.problem(
                self._recurring[about].number, self._format_text(text)
            )

    def leave(self, map: WorldView) -> None:
        """Stop showing problems on a map, and remove those that it shows."""
        self.maps.remove(map)
        if map.page.closed or map.page in self._pages():
            return
        for about in self.current:
            map.page.channel.mended(self._recurring[about].number)

    def _pages(self) -> list[BasePage]:
        """Return the open pages of the maps, each of them once."""
        pages = dict.fromkeys(map.page for map in self.maps)
        return [page for page in pages if not page.closed]

    def _forget(self, now: float) -> None:
        """Remove problems that ended so long ago that the next one is a new problem."""
        for about in [a for a, r in self._recurring.items() if r.is_over(now)]:
            del self._recurring[about]


M = TypeVar("M")


class ProblemOwner(Protocol):
    """An object that shows problems: a robot, a map or a layer."""

    def set_problem(self, about: object, text: str) -> None:
        """Show a problem until :meth:`clear_problem`."""

    def clear_problem(self, about: object) -> None:
        """Show the problem of ``about`` no longer; does nothing if there is none."""


class MessageProblems:
    """Shows people the errors in the messages of a topic.

    An error is shown until a valid message arrives or the current scope ends.

    Args:
        owner: Shows the error.
        topic: The topic of the messages.

    """

    def __init__(self, owner: ProblemOwner, topic: str) -> None:
        self._owner = owner
        self._topic = topic
        self._complaint = ""
        self._failure = ""
        keep(Removal(lambda: owner.clear_problem(self)))

    def complain(self, text: str) -> None:
        """Set an error of the message that is drawn at present."""
        self._complaint = text

    def take(self, draw: Callable[[M], object], message: M) -> None:
        """Draw a message; a message for which ``draw`` raises is skipped.

        The earlier drawing stays and ages. An exception that is not a ``WebMapError``
        is a bug in ``draw``; it is logged when it differs from the last one.
        """
        self._complaint = ""
        try:
            draw(message)
        except WebMapError as error:
            self._complaint = str(error)
        except Exception as error:
            self._complaint = f"drawing failed: {type(error).__name__}: {error}"
            if self._complaint != self._failure:
                self._failure = self._complaint
                log.exception("%s: drawing failed", self._topic)
        if self._complaint:
            self._owner.set_problem(self, f"{self._topic}: {self._complaint}")
        else:
            self._owner.clear_problem(self)


def draw_or_report(
    owner: ProblemOwner, topic: str, draw: Callable[[M], None]
) -> Callable[[M], None]:
    """Wrap ``draw`` for a subscription: the owner shows the messages that it refuses.

    Args:
        owner: Shows the errors in messages.
        topic: The topic of the messages.
        draw: Draws a message; it must check the whole message before it changes
            anything.

    """
    return partial(MessageProblems(owner, topic).take, draw)
