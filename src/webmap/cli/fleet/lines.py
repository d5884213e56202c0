"""On which line of a TOML file something stands.

Python's TOML reader gives values without their lines. This scanner goes through a
text that was read already, so it may trust its form: it knows headers, keys, strings,
arrays and inline tables, and skips what else values are made of.
"""

import re
import tomllib
from typing import TypeAlias

Path: TypeAlias = tuple[str | int, ...]
"""Keys and indices on the way to a value."""

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_SPACE = re.compile(r"[ \t]*")
_GAP = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_PLAIN = re.compile(r"[^,\]}#\n]*")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?:"{0,2}(?!"))'
    r"|'''.*?'''(?:'{0,2}(?!'))"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)


class Lines:
    """The line of each key and each element of an array.

    Args:
        text: A text that is TOML.

    """

    def __init__(self, text: str) -> None:
        self._text = text.replace("\r\n", "\n")
        self._at = 0
        self._found: dict[Path, int] = {}
        self._tables: dict[Path, int] = {}
        self._seen_to = (0, 1)
        self._document()

    def of(self, path: Path) -> int:
        """Return the line of a path, or of what is around it; 1 for the file."""
        while path and path not in self._found:
            path = path[:-1]
        return self._found.get(path, 1)

    def _document(self) -> None:
        table: Path = ()
        while self._skip(_GAP) < len(self._text):
            if self._next("[["):
                table = self._header(array=True)
            elif self._next("["):
                table = self._header(array=False)
            else:
                self._pair(table)

    def _header(self, *, array: bool) -> Path:
        keys = self._key()
        self._at += 2 if array else 1
        path: Path = ()
        for place, key in enumerate(keys):
            path = (*path, key)
            if array and place == len(keys) - 1:
                self._tables[path] = self._tables.get(path, -1) + 1
            self._note(path)
            if path in self._tables:
                path = (*path, self._tables[path])
        self._found[path] = self._line()
        return path

    def _pair(self, table: Path) -> None:
        path = table
        start = self._line()
        for key in self._key():
            path = (*path, key)
            self._found.setdefault(path, start)
        self._at += 1  # the equals sign
        self._value(path)

    def _value(self, path: Path) -> None:
        self._skip(_GAP)
        if self._next("["):
            self._array(path)
        elif self._next("{"):
            self._inline(path)
        else:
            string = _STRING.match(self._text, self._at)
            self._at = string.end() if string else self._skip(_PLAIN)

    def _array(self, path: Path) -> None:
        index = 0
        while self._skip(_GAP) < len(self._text) and not self._next("]"):
            self._note((*path, index))
            self._value((*path, index))
            self._skip(_GAP)
            self._next(",")
            index += 1

    def _inline(self, path: Path) -> None:
        while self._skip(_GAP) < len(self._text) and not self._next("}"):
            self._pair(path)
            self._skip(_GAP)
            self._next(",")

    def _key(self) -> list[str]:
        keys = []
        while True:
            self._skip(_SPACE)
            string = _STRING.match(self._text, self._at)
            bare = _BARE.match(self._text, self._at)
            if string is not None:
                keys.append(_unquoted(string[0]))
                self._at = string.end()
            elif bare is not None:
                keys.append(bare[0])
                self._at = bare.end()
            else:
                raise ValueError(f"no key on line {self._line()}")
            self._skip(_SPACE)
            if not self._next("."):
                return keys

    def _skip(self, pattern: re.Pattern[str]) -> int:
        found = pattern.match(self._text, self._at)
        assert found is not None, "every one of these patterns matches nothing too"
        self._at = found.end()
        return self._at

    def _next(self, text: str) -> bool:
        if self._text.startswith(text, self._at):
            self._at += len(text)
            return True
        return False

    def _note(self, path: Path) -> None:
        self._found.setdefault(path, self._line())

    def _line(self) -> int:
        at, line = self._seen_to
        line += self._text.count("\n", at, self._at)
        self._seen_to = (self._at, line)
        return line


def _unquoted(key: str) -> str:
    if "\\" in key:
        return str(tomllib.loads(f"key = {key}")["key"])
    return key[1:-1]  # keys are of one line, with one quote on each side


def way_in_words(way: Path) -> str:
    """Return the way to a value as TOML writes it: ``robots[0].twist.v_max``."""
    words = ""
    for part in way:
        dot = "." if words else ""
        words += f"[{part}]" if isinstance(part, int) else f"{dot}{part}"
    return words or "the file"
