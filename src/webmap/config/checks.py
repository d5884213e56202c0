"""Checks of single values, with what was got, what was expected, and where."""

import difflib
import math
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import date
from numbers import Integral, Real
from typing import Any, TypeAlias

from webmap.base.errors import ConfigError
from webmap.base.text import one_line
from webmap.ros.names import normalise_topic, split_type

KeyPath: TypeAlias = tuple[str | int, ...]
"""Keys and indices that lead to a value."""

Check: TypeAlias = Callable[[Any], Any]
"""Returns the value in its canonical form, or raises ConfigError with what was
expected."""

MOST_MISTAKES = 100
"""How many mistakes are reported in full; the rest are only counted."""

LARGEST = 1e6
"""The greatest speed, length or time of a robot, such as a command timeout."""

LONGEST_TIME = 366 * 86400.0
"""The greatest time until a check before driving is due again, in seconds."""

LONGEST_NAME = 100
"""The greatest length of a name, for lists, in characters."""

HEAD = ("title", "floor")
"""Keys of a fleet file that are texts of the file itself, not of a table."""

_SHOWN = 60

_KINDS: tuple[tuple[type, str], ...] = (
    (bool, "the boolean"),
    (Integral, "the whole number"),
    (Real, "the number"),
    (str, "the text"),
    (list, "the array"),
    (tuple, "the array"),
    (dict, "the table"),
)


@dataclass(slots=True)
class Mistakes:
    """The mistakes found, each with its path."""

    found: list[tuple[KeyPath, str]] = field(default_factory=list)
    more: int = 0
    """The number of further mistakes; only counted, since many texts take long to write
    and read."""
    wrong: set[KeyPath] = field(default_factory=set)
    """The path of each mistake, reported or counted, up to three keys:
    ``("robots", 3, "twist")``."""

    def add(self, path: KeyPath, message: str) -> None:
        """Add a mistake; beyond the greatest number it is only counted."""
        self.wrong.add(path[:3])
        if self.full:
            self.more += 1
        else:
            self.found.append((path, message))

    @contextmanager
    def at(self, path: KeyPath) -> Iterator[None]:
        """Add the error of a block under a path; the block ends there."""
        try:
            yield
        except (ConfigError, OSError) as error:
            self.add(path, str(error))

    def take(self, path: KeyPath, others: "Mistakes") -> None:
        """Add the mistakes of a part whose path is ``path``."""
        for inner, message in others.found:
            self.add((*path, *inner), message)
        self.more += others.more
        self.wrong |= {(*path, *inner)[:3] for inner in others.wrong}

    @property
    def count(self) -> int:
        """The number of mistakes, including those that are only counted."""
        return len(self.found) + self.more

    @property
    def full(self) -> bool:
        """Whether further mistakes are only counted."""
        return len(self.found) >= MOST_MISTAKES

    def refuse(self, what: str) -> None:
        """Raise all mistakes at once, if there are any.

        Args:
            what: The configured thing, such as ``robot 'Bob'``.

        Raises:
            WrongConfig: If there are mistakes.

        """
        if self.count:
            raise WrongConfig(what, self)


class WrongConfig(ConfigError):
    """A configuration with mistakes: a line for each.

    Args:
        what: The configured thing.
        mistakes: All mistakes.

    """

    def __init__(self, what: str, mistakes: Mistakes) -> None:
        self.mistakes = mistakes
        lines = [
            one_line(": ".join(filter(None, (what, key_path_text(path), message))))
            for path, message in mistakes.found
        ]
        if mistakes.more:
            lines.append(f"{what}: and {mistakes.more} more mistakes")
        super().__init__("\n".join(lines))


def key_path_text(path: KeyPath) -> str:
    """Return the path of a value as in TOML: ``robots[0].twist.v_max``."""
    message = ""
    for part in path:
        dot = "." if message else ""
        message += f"[{part}]" if isinstance(part, int) else f"{dot}{part}"
    return message


def show(value: object) -> str:
    """Return a value and its type, for people."""
    if isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, int) and abs(value) >= 10**_SHOWN:
        text = "of very many digits"
    else:
        text = f'"{value}"' if isinstance(value, str) else str(value)
    kind = next(
        (message for cls, message in _KINDS if isinstance(value, cls)), "the value"
    )
    return f"{kind} {one_line(text, _SHOWN)}"


def did_you_mean(got: object, known: Iterable[str]) -> str:
    """Return a hint at the most similar known name; empty if none is similar."""
    found = difflib.get_close_matches(str(got), list(known), n=1)
    return f'; did you mean "{found[0]}"?' if found else ""


def text(value: Any) -> str:
    """Check a text that is not empty."""
    if not isinstance(value, str) or not value.strip():
        raise ConfigError("a text that is not empty")
    return value


def any_text(value: Any) -> str:
    """Check a text, which may be empty."""
    if not isinstance(value, str):
        raise ConfigError("a text")
    return value


def expecting(expected: str, check: Check) -> Check:
    """Return a check whose error has this text about the expected value."""

    def worded(value: Any) -> Any:
        try:
            return check(value)
        except ConfigError:
            raise ConfigError(expected) from None

    return worded


bridge = expecting("the name or the address of a bridge", text)
"""Checks the name or the URL of a bridge."""


def is_name(text: str) -> bool:
    """Return whether a text fits in a list of robots: one line, not too long."""
    return text.strip() != "" and text.isprintable() and len(text) <= LONGEST_NAME


def same_name(name: str) -> str:
    """Return the form that is equal for names that look the same to people."""
    return unicodedata.normalize("NFKC", name).casefold().strip()


def name(value: Any) -> str:
    """Check a name: a text of one line that is not too long."""
    plain = text(value)
    if not is_name(plain):
        raise ConfigError(f"a text of one line with at most {LONGEST_NAME} characters")
    return plain


topic = expecting('the name of a topic, such as "/odom"', normalise_topic)
"""Checks the name of a topic, and returns it in canonical form."""


def frame(value: Any) -> str:
    """Check the name of a frame; the leading slash of ROS 1 is removed."""
    return text(value).removeprefix("/")


def message_type(*allowed: str) -> Check:
    """Return the check of a type: one of these, in the form of either ROS version."""

    def check(value: Any) -> str:
        try:
            if isinstance(value, str) and (str(split_type(value)) in allowed):
                return value
        except ConfigError:
            pass
        raise ConfigError(f"one of the types {', '.join(allowed)}")

    return check


def above_zero(unit: str) -> Check:
    """Return a check for a finite number above zero."""
    expected = f"a number of {unit} above 0"
    return _number(expected, lambda value: value > 0, names_limit=True)


def from_zero(unit: str) -> Check:
    """Return a check for a finite number of 0 or more."""
    expected = f"a number of {unit} from 0 on"
    return _number(expected, lambda value: value >= 0, names_limit=True)


def finite(expected: str) -> Check:
    """Return a check for any finite number within the limits."""
    return _number(expected, lambda value: True)


def between(low: float, high: float, unit: str) -> Check:
    """Return a check for a finite number within both limits, which are included."""
    expected = f"a number of {unit} from {low:g} to {high:g}"
    return _number(expected, lambda value: low <= value <= high)


def _number(
    expected: str, fits: Callable[[float], bool], *, names_limit: bool = False
) -> Check:
    """Return a check for a number that is at most :data:`LARGEST`.

    Args:
        expected: The expected number, for the error.
        fits: Returns whether a finite number is one of those.
        names_limit: Whether the error for a larger number also has the limit.

    """

    def check(value: Any) -> float:
        real = _is_real(value)
        if real and abs(value) <= LARGEST and fits(value):
            return float(value)
        too_large = names_limit and real and LARGEST < value < math.inf
        most = f", at most {LARGEST:g}" if too_large else ""
        raise ConfigError(f"{expected}{most}")

    return check


def numbers(count: int, number: Check) -> Check:
    """Return a check for a sequence of so many numbers, each with its own check."""

    def check(value: Any) -> tuple[float, ...]:
        given = tuple(map(number, items(value)))
        if len(given) != count:
            raise ConfigError(f"{count} numbers")
        return given

    return check


def items(value: Any) -> Iterable[Any]:
    """Return the items of a list, a tuple or a numpy array; other values have none."""
    many = isinstance(value, Iterable) and not isinstance(value, str | Mapping)
    return value if many else ()


def _is_real(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def whole(low: int, high: int) -> Check:
    """Return a check for an integer within both limits; a boolean is none."""

    def check(value: Any) -> int:
        number = isinstance(value, Integral) and not isinstance(value, bool)
        if not number or not low <= int(value) <= high:
            raise ConfigError(f"a whole number from {low} to {high}")
        return int(value)

    return check


milliseconds = expecting("a whole number of milliseconds, 0 or more", whole(0, 2**63))
"""Checks a whole number of milliseconds."""


_UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}


def duration(value: Any) -> float:
    """Check a time: seconds, or a text such as ``12h``, ``30min`` or ``90s``."""
    seconds = value
    if isinstance(value, str):
        found = re.fullmatch(r"(\d{1,9}(?:\.\d{1,9})?) ?(s|min|h)", value)
        seconds = float(found[1]) * _UNITS[found[2]] if found else None
    if not _is_real(seconds) or not 1 <= seconds <= LONGEST_TIME:
        raise ConfigError('a time from 1 s to 366 days, such as "12h" or "30min"')
    return float(seconds)


def yes_or_no(value: Any) -> bool:
    """Check a boolean: ``true`` or ``false``, and no number."""
    if not isinstance(value, bool):
        raise ConfigError("true or false")
    return value


def one_of(*texts: str) -> Check:
    """Return a check for one of these texts."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in texts:
            listed = " or ".join(f'"{each}"' for each in texts)
            raise ConfigError(f"{listed}{did_you_mean(value, texts)}")
        return value

    return check


def array(value: Any) -> list[Any]:
    """Check an array of positional arguments; a tuple becomes a list."""
    if not isinstance(value, list | tuple):
        raise ConfigError("an array of arguments")
    return list(value)


def table(value: Any) -> dict[str, Any]:
    """Check a table of arguments by name, and copy it."""
    if not isinstance(value, Mapping):
        raise ConfigError("a table of arguments by name")
    return dict(value)


def checked(check: Check, value: Any, path: KeyPath, mistakes: Mistakes) -> Any:
    """Return the checked value; None, and a mistake, if it is wrong."""
    try:
        return check(value)
    except ConfigError as error:
        hint = "" if mistakes.full else _otherwise(check, value)
        mistakes.add(path, f"got {show(value)}, expected {error}{hint}")
        return None


def _otherwise(check: Check, value: Any) -> str:
    """Return a hint if quotes, or missing quotes, are the only mistake."""
    try:
        if isinstance(value, str):
            plain = value.strip().lower()
            named = {"true": True, "yes": True, "false": False, "no": False}
            check(named[plain] if plain in named else _number_of(plain))
            bare = str(named[plain]).lower() if plain in named else value.strip()
            return f"; write {bare} without quotes"
        if isinstance(value, int | float | date) and not isinstance(value, bool):
            check(str(value))
            return f'; write it in quotes: "{value}"'
    except (ConfigError, ValueError):
        pass
    return ""


def _number_of(text: str) -> int | float:
    if len(text) > _SHOWN:
        raise ValueError
    return int(text) if text.lstrip("+-").isdigit() else float(text)
