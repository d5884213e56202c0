"""The operations in what a client sends, which need not be one a frame."""

import json
from typing import Any

_MOST_KEPT = 64 * 1024
_MOST_FAILURES = 50


class IncomingText:
    """Finds whole JSON objects; half of one waits for the rest, garbage is dropped.

    As rosbridge: two objects in a frame are both run, and an object may come in
    pieces. What cannot become one is let go of, and never costs more than a bounded
    number of attempts.
    """

    def __init__(self) -> None:
        self._kept = ""
        # The real parser takes NaN, Infinity and 1e999: json does too.
        self._decoder = json.JSONDecoder()

    @property
    def waits(self) -> bool:
        """Whether the beginning of an object is kept for its rest."""
        return bool(self._kept)

    def feed(self, data: str | bytes) -> list[dict[str, Any]]:
        """Return the operations that are complete now, in order."""
        text = data.decode("utf-8", "replace") if isinstance(data, bytes) else data
        found, rest = self._scan(self._kept + text)
        if not found and self._kept:
            # The new frame may be whole and only the kept half be garbage.
            found, rest_alone = self._scan(text)
            rest = rest_alone if found else rest
        self._kept = rest if len(rest) <= _MOST_KEPT else ""
        return found

    def _scan(self, text: str) -> tuple[list[dict[str, Any]], str]:
        found: list[dict[str, Any]] = []
        rest_from: int | None = None
        start = text.find("{")
        failures = 0
        while start >= 0 and failures < _MOST_FAILURES:
            try:
                value, end = self._decoder.raw_decode(text, start)
            except (ValueError, RecursionError):
                failures += 1
                rest_from = start if rest_from is None else rest_from
                start = text.find("{", start + 1)
                continue
            if "op" in value or rest_from is None:
                found.append(value)
                rest_from = None
            start = text.find("{", end)
        return found, "" if rest_from is None else text[rest_from:]
