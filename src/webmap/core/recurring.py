"""One thing that fails again and again: what of that is new, and worth a line."""

import itertools
import re
import secrets

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
        """Take what is said of it now; tell whether that is news, numbers aside."""
        words = wording(text)
        news = words != self._wording
        self._wording = words
        return news

    def mend(self, now: float) -> None:
        """Note that it is good again, at ``now`` of any clock that goes forward."""
        self._wording, self._mended = None, now

    def is_over(self, now: float) -> bool:
        """Tell whether it has been good for so long that the next time is another."""
        return self._wording is None and now - self._mended >= AGAIN

    def is_worth_a_line(self, now: float) -> bool:
        """Tell whether the log is to have the words of now, and take it that it has."""
        for words in [w for w, at in self._logged.items() if now - at >= AGAIN]:
            del self._logged[words]
        if self._wording is None or self._wording in self._logged:
            return False
        if len(self._logged) >= WORDINGS:
            return False
        self._logged[self._wording] = now
        return True
