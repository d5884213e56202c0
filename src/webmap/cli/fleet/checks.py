"""Checks of one value each: what was got, what was expected, and where."""

import difflib
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import date
from typing import Any, TypeAlias

from webmap.cli.fleet.lines import Path
from webmap.discovery.naming import LONGEST, is_name
from webmap.errors import ConfigError
from webmap.outside_text import one_line
from webmap.ros.names import normalise_topic, split_type

Check: TypeAlias = Callable[[Any], Any]
"""Takes a value and returns what it means, or raises ConfigError."""

_KINDS: tuple[tuple[type, str], ...] = (
    (bool, "the boolean"),
    (int, "the whole number"),
    (float, "the number"),
    (str, "the text"),
    (list, "the array"),
    (dict, "the table"),
)
_LONGEST = 60

HEAD = ("title", "floor")
"""Keys that are texts, of the file itself and of no table in it."""

MOST_MISTAKES = 100
"""Mistakes of a file that are named."""

LARGEST = 1e6
"""No speed, time or length in a file is larger."""


@dataclass(slots=True)
class Mistakes:
    """What is wrong in a file, with the way to it."""

    found: list[tuple[Path, str]] = field(default_factory=list)
    more: int = 0
    """How many there are besides; nobody reads thousands, and they take long."""

    def add(self, path: Path, words: str) -> None:
        """Note one mistake."""
        if self.full:
            self.more += 1
        else:
            self.found.append((path, words))

    @property
    def full(self) -> bool:
        """Whether no more mistakes are worded."""
        return len(self.found) >= MOST_MISTAKES


def show(value: object) -> str:
    """Return a value and its kind, as a person would say it."""
    if isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, int) and abs(value) >= 10**_LONGEST:
        text = "of very many digits"
    else:
        text = f'"{value}"' if isinstance(value, str) else str(value)
    kind = next((words for cls, words in _KINDS if isinstance(value, cls)), "the value")
    return f"{kind} {one_line(text, _LONGEST)}"


def text(value: Any) -> str:
    """Take a text that is not empty."""
    if not isinstance(value, str) or not value.strip():
        raise ConfigError("a text that is not empty")
    return value


def name(value: Any) -> str:
    """Take what people call something: a text of one line that is not too long."""
    plain = text(value)
    if not is_name(plain):
        raise ConfigError(f"a text of one line with {LONGEST} characters at the most")
    return plain


def topic(value: Any) -> str:
    """Take the name of a topic."""
    try:
        return normalise_topic(value)
    except ConfigError:
        raise ConfigError('the name of a topic, such as "/odom"') from None


def message_type(*allowed: str) -> Check:
    """Return what takes one of these types, in either dialect."""

    def check(value: Any) -> str:
        try:
            if isinstance(value, str) and (str(split_type(value)) in allowed):
                return value
        except ConfigError:
            pass
        raise ConfigError(f"one of the types {', '.join(allowed)}")

    return check


def above_zero(unit: str) -> Check:
    """Return what takes a finite number above zero."""

    def check(value: Any) -> float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not 0 < value < math.inf or value > LARGEST:
            raise ConfigError(f"a number of {unit} above 0")
        return float(value)

    return check


def finite(expected: str) -> Check:
    """Return what takes any finite number of a size that makes sense."""

    def check(value: Any) -> float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not math.isfinite(value) or abs(value) > LARGEST:
            raise ConfigError(expected)
        return float(value)

    return check


def covariance(value: Any) -> list[float]:
    """Take the variances of x, y and yaw."""
    numbers: list[Any] = [None]
    if isinstance(value, list) and len(value) == 3:
        numbers = value
    for number in numbers:
        plain = isinstance(number, int | float) and not isinstance(number, bool)
        if not plain or not 0 <= number <= LARGEST:
            raise ConfigError(
                "three numbers from 0 on: the variances of x and y in m², of yaw in "
                "rad², such as [0.25, 0.25, 0.068]"
            )
    return [float(number) for number in numbers]


def milliseconds(value: Any) -> int:
    """Take a whole number of milliseconds."""
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ConfigError("a whole number of milliseconds, 0 or more")
    return value


def yes_or_no(value: Any) -> bool:
    """Take a boolean."""
    if not isinstance(value, bool):
        raise ConfigError("true or false")
    return value


def one_of(*words: str) -> Check:
    """Return what takes one of these words."""

    def check(value: Any) -> str:
        if value not in words or not isinstance(value, str):
            listed = " or ".join(f'"{word}"' for word in words)
            raise ConfigError(f"{listed}{near(value, words)}")
        return value

    return check


def near(got: object, known: Iterable[str]) -> str:
    """Return a hint at what was meant, empty if nothing is like it."""
    found = difflib.get_close_matches(str(got), list(known), n=1)
    return f'; did you mean "{found[0]}"?' if found else ""


def one(check: Check, value: Any, path: Path, mistakes: Mistakes) -> Any:
    """Return what a value means; None, and a mistake, if it is wrong."""
    try:
        return check(value)
    except ConfigError as error:
        hint = "" if mistakes.full else _otherwise(check, value)
        mistakes.add(path, f"got {show(value)}, expected {error}{hint}")
        return None


def _otherwise(check: Check, value: Any) -> str:
    """Return a hint if quotes, or their absence, are all that is wrong."""
    try:
        if isinstance(value, str):
            plain = value.strip().lower()
            named = {"true": True, "yes": True, "false": False, "no": False}
            check(named[plain] if plain in named else _number_of(plain))
            word = str(named[plain]).lower() if plain in named else value.strip()
            return f"; write {word} without quotes"
        if isinstance(value, int | float | date) and not isinstance(value, bool):
            check(str(value))
            return f'; a text stands in quotes: "{value}"'
    except (ConfigError, ValueError):
        pass
    return ""


def _number_of(text: str) -> int | float:
    if len(text) > _LONGEST:
        raise ValueError
    return int(text) if text.lstrip("+-").isdigit() else float(text)


def table(
    value: Any,
    checks: Mapping[str, Check],
    path: Path,
    mistakes: Mistakes,
    *,
    needed: Iterable[str] = (),
) -> dict[str, Any]:
    """Return what the keys of a table mean; each wrong one is a mistake."""
    if not isinstance(value, dict):
        mistakes.add(path, f"got {show(value)}, expected a table of keys and values")
        return {}
    meant = {}
    for key, got in value.items():
        if key in checks:
            meant[key] = one(checks[key], got, (*path, key), mistakes)
        else:
            unknown(key, checks, (*path, key), mistakes)
    for key in needed:
        if key not in value:
            mistakes.add(path, f'the key "{key}" is missing')
    return meant


def unknown(key: str, known: Iterable[str], path: Path, mistakes: Mistakes) -> None:
    """Note a key that means nothing."""
    if mistakes.full:
        mistakes.add(path, key)  # counted alone: a hint takes long
        return
    listed = ", ".join(known)
    hint = near(key, known)
    if key in HEAD and len(path) > 1:
        hint = f"; it is the file's own, and stands before the first [table]{hint}"
    mistakes.add(path, f'there is no key "{key}" here{hint}; there are {listed}')
