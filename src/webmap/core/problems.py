"""What is wrong with a robot or a layer: kept meanwhile, and shown on its maps."""

import itertools
import logging
import re
import secrets
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Protocol, TypeVar

from webmap.base.errors import WebMapError
from webmap.base.scope import Removal, keep

if TYPE_CHECKING:
    from webmap.core.map import Map
    from webmap.core.page import Page

log = logging.getLogger("webmap.modules")

LONGEST = 1000
"""Characters of a sentence that is shown."""

AGAIN = 60.0
"""Seconds in which the same words about one thing go to the log once, and for which
it is the same trouble when it fails anew after it was mended."""

WORDINGS = 10
"""How many different words about one thing the log takes in that time."""

_NUMBER = re.compile(
    r"0x[0-9a-f]+|[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|[-+]?\b(?:nan|inf(?:inity)?)\b",
    re.IGNORECASE,
)
_ROW = re.compile(r"#(?:[\s,;:]+#)+")

# A page that was open before WebMap was started anew knows other numbers.
_numbers = itertools.count(secrets.randbits(31))


def cut(text: str) -> str:
    """Return a text that people may read; robots may put anything into one."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def wording(text: str) -> str:
    """Return a sentence without its numbers, of which a row is as good as one."""
    return _ROW.sub("#", _NUMBER.sub("#", text))


class Recurring:
    """What is remembered of one thing that fails, until it was good for a minute."""

    def __init__(self) -> None:
        self.number = next(_numbers)
        """What pages know it by."""
        self._wording: str | None = None
        self._mended = 0.0
        self._logged: dict[str, float] = {}

    def fails(self, text: str) -> bool:
        """Take the sentence of now; return whether it is new, numbers aside."""
        words = wording(text)
        news = words != self._wording
        self._wording = words
        return news

    def mend(self, now: float) -> None:
        """Note that it is good again, at ``now`` of any clock that goes forward."""
        self._wording, self._mended = None, now

    def is_over(self, now: float) -> bool:
        """Return whether it has been good for so long that the next time is another."""
        return self._wording is None and now - self._mended >= AGAIN

    def is_worth_a_line(self, now: float) -> bool:
        """Return whether the log is to have the words of now, and note that it has."""
        for words in [w for w, at in self._logged.items() if now - at >= AGAIN]:
            del self._logged[words]
        if self._wording is None or self._wording in self._logged:
            return False
        if len(self._logged) >= WORDINGS:
            return False
        self._logged[self._wording] = now
        return True


class Problems:
    """The sentences of one thing that maps share, and the maps that show them.

    Args:
        log: Where each sentence goes besides.
        worded: Makes the sentence that is shown, for example with a name in front.
        clock: Seconds that only go forward.

    """

    def __init__(
        self,
        log: logging.Logger,
        worded: Callable[[str], str] = str,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.maps: list[Map] = []
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
        """Show what fails until :meth:`clear`, once; a new text takes its place.

        A text that differs in its numbers alone is kept and not shown. The same words
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
        """Take back the problem of ``about``; does nothing if there is none."""
        if self.standing.pop(about, None) is None:
            return
        recurring = self._recurring[about]
        recurring.mend(self._clock())
        for page in self._pages():
            page.channel.mended(recurring.number)

    def join(self, map: "Map") -> None:
        """Show a map what fails now, and from now on."""
        self.maps.append(map)
        if map.page.closed:
            return
        for about, text in self.standing.items():
            map.page.channel.problem(self._recurring[about].number, self._worded(text))

    def leave(self, map: "Map") -> None:
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


M = TypeVar("M")


class Owner(Protocol):
    """Who shows people what goes on failing: a robot, a map or a layer."""

    def set_problem(self, about: object, text: str) -> None:
        """Note what fails until :meth:`clear_problem`."""

    def clear_problem(self, about: object) -> None:
        """Note that the problem of ``about`` is over."""


class Refusing:
    """Shows people what is wrong with the messages of a topic.

    The sentence about a message stands until one comes that is right, or until the
    current scope ends.

    Args:
        owner: Shows the sentence.
        topic: Where the messages come from.

    """

    def __init__(self, owner: Owner, topic: str) -> None:
        self._owner = owner
        self._topic = topic
        self._complaint = ""
        self._failure = ""
        keep(Removal(lambda: owner.clear_problem(self)))

    def complain(self, words: str) -> None:
        """Note what is wrong with the message that is drawn at present."""
        self._complaint = words

    def take(self, draw: Callable[[M], object], message: M) -> None:
        """Have a message drawn; one for which ``draw`` raises is left out.

        What was drawn before then stays and ages. An error that is not one of WebMap's
        is a mistake in ``draw``, and is logged when it differs from the last one.
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


def refusing(
    owner: Owner, topic: str, draw: Callable[[M], None]
) -> Callable[[M], None]:
    """Return ``draw`` for a subscription: what it refuses, the owner shows.

    Args:
        owner: Shows what is wrong with messages.
        topic: Where the messages come from.
        draw: Takes a message, and changes nothing before it has looked at all of it.

    """
    return partial(Refusing(owner, topic).take, draw)
