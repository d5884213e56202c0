"""Messages as lines of a recording, without values that differ from run to run."""

import json
import re
from collections.abc import Iterable, Mapping
from typing import Any

LONGEST = 88
"""Characters of a line that holds a whole value."""

ANY = "*"
"""Replaces a value that differs from run to run."""

CHANGING = {
    "acks",
    "ack",
    "age",
    "pid",
    "reaction",
    "seq",
    "tick",
}
"""Fields of numbers that depend on time."""

_GENERATED = re.compile(r"\bWebMap-[0-9a-f]{8}-(\d+)\b")


class Names:
    """Tokens for random and counted values: ids, epochs, ports.

    Values that only grow are numbered by size, others in the order in which they are
    noted. So it does not matter which thread notes its message first.
    """

    def __init__(self) -> None:
        self._seen: dict[str, dict[Any, str]] = {}
        self._growing: dict[str, set[int]] = {}
        self._texts: dict[str, str] = {}

    def call(self, text: str, token: str) -> None:
        """Replace a text by a token wherever it occurs."""
        self._texts[text] = token

    def grow(self, kind: str, number: int) -> None:
        """Note one of the numbers of a kind that only grow."""
        self._growing.setdefault(kind, set()).add(number)

    def meet(self, kind: str, value: str) -> None:
        """Note a random value of a kind."""
        seen = self._seen.setdefault(kind, {})
        self.call(value, seen.setdefault(value, f"<{kind} {len(seen) + 1}>"))

    def number(self, kind: str, number: int) -> str:
        """Return the token of a number that was noted."""
        place = sorted(self._growing.get(kind, ())).index(number) + 1
        return f"<{kind} {place}>"

    def text(self, text: str) -> str:
        """Return a text with tokens in it."""
        for known in sorted(self._texts, key=len, reverse=True):
            if known in text:
                text = re.sub(
                    rf"(?<!\w){re.escape(known)}(?!\w)", self._texts[known], text
                )
        return _GENERATED.sub(self._generated, text)

    def _generated(self, found: re.Match[str]) -> str:
        number = int(found[1])
        if number in self._growing.get("goal", ()):
            return self.number("goal", number)
        return "<call>"

    def plain(self, value: Any, key: str = "") -> Any:
        """Return a value of a message with tokens in it."""
        if key in CHANGING and value is not None:
            return ANY
        if isinstance(value, Mapping):
            return {
                self.text(str(name)): self.plain(each, name)
                for name, each in value.items()
            }
        if isinstance(value, list | tuple):
            return [self.plain(each) for each in value]
        if isinstance(value, bytes):
            return self.text(value.decode("utf-8", "backslashreplace"))
        if key in ("epoch", "request") and value in self._growing.get(key, ()):
            return self.number(key, value)
        return self.text(value) if isinstance(value, str) else value


def goal_number(id: str) -> int | None:
    """Return the number of an identifier that the gate made."""
    found = _GENERATED.fullmatch(id)
    return int(found[1]) if found else None


def lines(head: str, fields: Mapping[str, Any]) -> str:
    """Return a message as one line, or as several if it is long."""
    short = " ".join([head, *(f"{key}={_json(each)}" for key, each in fields.items())])
    if len(short) <= LONGEST:
        return short
    return "\n".join([head, *_tree(fields, "  ")])


def tree(fields: Mapping[str, Any]) -> str:
    """Return fields as lines in the order of their names, one for each short one."""
    return "\n".join(_tree(fields, ""))


def _tree(fields: Mapping[str, Any], indent: str) -> list[str]:
    found = []
    for key, value in sorted(fields.items()):
        whole = f"{indent}{key} = {_json(value)}"
        if len(whole) <= LONGEST or not value or not isinstance(value, dict | list):
            found.append(whole)
        elif isinstance(value, dict):
            found += [f"{indent}{key}:", *_tree(value, f"{indent}  ")]
        else:
            found.append(f"{indent}{key}:")
            found += [f"{indent}  {_json(each)}" for each in value]
    return found


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, sort_keys=True)


def thinned(texts: Iterable[tuple[str, str]]) -> list[str]:
    """Return texts without repetitions.

    Args:
        texts: Each text, and which repetition stays: ``"once"`` for the first,
            ``"last"`` for the last, or ``""`` for each that differs from the text
            before it.

    """
    found: list[str] = []
    known: set[str] = set()
    for text, stays in texts:
        if (stays == "once" and text in known) or (found and found[-1] == text):
            continue
        if stays == "last" and text in known:
            found.remove(text)
        known.add(text)
        found.append(text)
    return found


def is_zero(value: Any) -> bool:
    """Return whether all numbers in a message are 0, and there are some."""
    numbers = list(_numbers(value))
    return bool(numbers) and not any(numbers)


def _numbers(value: Any) -> Iterable[float]:
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list):
        for each in value:
            yield from _numbers(each)
    elif isinstance(value, float | int):
        yield value
