"""The text of a fleet file: TOML, the line of each value, and passwords in it.

Python's TOML reader returns values without their lines. :class:`Lines` parses a text
that was already read, so it can trust its form: it recognises headers, keys, strings,
arrays and inline tables, and skips other values. Text that would take the reader very
long is found before that, in one pass.
"""

import os
import re
import shlex
import tomllib
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlsplit

from webmap.base.errors import ConfigError
from webmap.base.plain_files import read_file
from webmap.base.text import one_line
from webmap.config.checks import KeyPath, Mistakes, key_path_text

LARGEST = 1 << 19
"""The greatest size of a file, in bytes."""

EXPECTED = "expected TOML with a table [bridges] and a table [[robots]] for each robot"

DEEPEST = 20
"""The greatest number of parts of a key, and of nested brackets."""

_STRING = (  # up to two quotes before the three that end a text belong to it
    r'"""(?:\\.|[^\\])*?""""{0,2}'
    r"|'''.*?''''{0,2}"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
)
_TOKEN = re.compile(
    rf"(?P<part>{_STRING}|[A-Za-z0-9_-]+)|(?P<dot>[ \t]*\.[ \t]*)"
    r"|(?P<opens>[\[{])|(?P<closes>[\]}])|(?P<sign>[=,\n])|(?P<quote>[\"'])"
    r"|#[^\n]*|[^\w\"'.\[\]{}#=,\n]+",
    re.DOTALL,
)

_WHERE = re.compile(
    r"(?P<message>.*) \(at (?:line (?P<line>\d+), column \d+|end of .*)\)"
)
_TABLE = re.compile(r"Cannot declare \((?P<keys>.*?),?\) twice")
_NUMBER = re.compile(r"\d[\d_]{999,}")
_LONGEST = 60

SEVERAL = ("robots", "map", "image", "modules", "labels", "buttons")
"""Tables that may occur more than once."""

MESSAGES = {
    "Invalid value": "expected a value: a text with quotes, true and false without",
    "Illegal character '\\n'": "expected the quote that ends a text on the same line",
    "Invalid statement": 'expected a table such as [bridges], or key = "value"',
    "Expected '=' after a key in a key/value pair": "expected a key, an equals sign "
    "and a value",
    "Cannot overwrite a value": "this key is already defined",
    "Expected newline or end of document after a statement": "expected the end of the "
    "line after a value",
}
"""The errors of the TOML reader, reworded for authors of files."""


class FleetText:
    """The text of a file, with the lines of its values.

    Args:
        name: The file's name, for error messages.
        text: The content of the file.

    Raises:
        ConfigError: If it is not TOML; the message has line and column.

    """

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        if not text.strip():
            raise ConfigError(f"{name}: the file is empty; {EXPECTED}")
        line = too_deep(text)
        if line is not None:
            raise ConfigError(
                f"{name}:{line}: keys and values are nested at most {DEEPEST} "
                f"deep; {EXPECTED}"
            )
        try:
            self.data = tomllib.loads(text)
        except ValueError as error:  # also integers of thousands of digits
            raise ConfigError(not_toml(name, text, error)) from None
        except RecursionError:
            raise ConfigError(
                f"{name}: values are nested too deep; {EXPECTED}"
            ) from None
        self._lines = Lines(text)

    def complaint(self, path: KeyPath, message: str) -> str:
        """Return a mistake with file, line and key."""
        mistake = f"{key_path_text(path) or 'the file'}: {message}"
        # The content of a file must not control the terminal that shows it.
        return f"{self.name}:{self._lines.of(path)}: {one_line(mistake)}"

    def refuse(self, mistakes: Mistakes) -> None:
        """Raise all mistakes at once, if there are any.

        Raises:
            ConfigError: If there are mistakes.

        """
        if mistakes.found:
            lines = [self.complaint(path, message) for path, message in mistakes.found]
            if mistakes.more:
                lines.append(f"{self.name}: and {mistakes.more} more mistakes")
            raise ConfigError("\n".join(lines))


def read_text(file: Path) -> FleetText:
    """Read a file.

    Raises:
        ConfigError: If it is not a file, too large, not UTF-8, or not TOML.
        OSError: If it cannot be read.

    """
    try:
        data = read_file(file, LARGEST)
    except ConfigError as error:
        raise ConfigError(f"{error}; {EXPECTED}") from None
    if data.startswith((b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")):
        raise ConfigError(
            f"{file}: the file begins with a byte order mark; save it as UTF-8 without"
        )
    try:
        return FleetText(str(file), data.decode())
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise ConfigError(f"{file}:{line}: this is not UTF-8; {EXPECTED}") from None


class Lines:
    """The line of each key and each element of an array.

    Args:
        text: A valid TOML text.

    """

    def __init__(self, text: str) -> None:
        self._found: dict[KeyPath, int] = {}
        self._tables: dict[KeyPath, int] = {}
        """The index of the newest table of each array of tables."""
        self._line = 1
        self._read(text)

    def of(self, path: KeyPath) -> int:
        """Return the line of a path, or of its nearest parent; 1 for the file."""
        while path and path not in self._found:
            path = path[:-1]
        return self._found.get(path, 1)

    def _read(self, text: str) -> None:
        table: KeyPath = ()
        # Each array and inline table that is open: its path, and in an array the index.
        open_values: list[tuple[KeyPath, int | None]] = []
        value: KeyPath | None = None  # the path of the value here; None among keys
        keys: list[str] = []
        brackets = 0  # of a header that is open
        for token in _TOKEN.finditer(text):
            if value is not None and token.lastgroup in ("part", "opens"):
                self._found.setdefault(value, self._line)
            match token.lastgroup, token[0]:
                case "part", _ if value is None:
                    keys.append(_unquoted(token[0]))
                case "sign", "=":
                    value = open_values[-1][0] if open_values else table
                    for key in keys:
                        value = (*value, key)
                        self._found.setdefault(value, self._line)
                    keys = []
                case "opens", "[" if value is None:
                    brackets += 1
                case "closes", "]" if brackets:
                    table, keys = self._header(keys, array=brackets == 2), []
                    brackets = 0
                case "opens", "[" if value is not None:
                    open_values.append((value, 0))
                    value = (*value, 0)
                case "opens", "{":
                    open_values.append((value or (), None))
                    value = None
                case "closes", _ if open_values:
                    value, _ = open_values.pop()
                case "sign", ",":
                    path, index = open_values.pop()
                    index = None if index is None else index + 1
                    value = None if index is None else (*path, index)
                    open_values.append((path, index))
                case "sign", "\n" if not open_values:
                    value = None
            self._line += token[0].count("\n")

    def _header(self, keys: list[str], *, array: bool) -> KeyPath:
        path: KeyPath = ()
        for place, key in enumerate(keys):
            path = (*path, key)
            if array and place == len(keys) - 1:
                self._tables[path] = self._tables.get(path, -1) + 1
            self._found.setdefault(path, self._line)
            if path in self._tables:
                path = (*path, self._tables[path])
        self._found[path] = self._line
        return path


def _unquoted(key: str) -> str:
    if key.startswith('"') and "\\" in key:
        return str(tomllib.loads(f"key = {key}")["key"])
    return key[1:-1] if key[0] in "\"'" else key


def too_deep(text: str) -> int | None:
    """Return the line where a text is nested deeper than :data:`DEEPEST`, or None."""
    brackets = parts = 0
    for token in _TOKEN.finditer(text):
        kind = token.lastgroup
        if kind == "quote":  # a text without an end; the reader reports it
            return None
        if kind == "dot":
            parts += 1
        elif kind != "part":
            parts = 0
        if kind == "opens":
            brackets += 1
        elif kind == "closes":
            brackets -= 1
        if brackets > DEEPEST or parts >= DEEPEST:
            return text.count("\n", 0, token.start()) + 1
    return None


def not_toml(name: str, text: str, error: ValueError) -> str:
    """Return the error of a text that is not TOML, with its line and the text there.

    Args:
        name: The file's name, for error messages.
        text: The content of the file.
        error: The error of the TOML reader.

    """
    lines = text.splitlines() or [""]
    found = _WHERE.fullmatch(str(error))
    if found is None:
        number = _NUMBER.search(text)
        if number is None:
            return f"{name}: this is not TOML: {error}"
        line = text.count("\n", 0, number.start()) + 1
        return f"{name}:{line}: this is not TOML: a whole number of far too many digits"
    message = found["message"]
    # The reader gives no line for the end of the file.
    line = int(found["line"] or len(lines))
    table = _TABLE.fullmatch(message)
    if table is not None:
        keys = ".".join(key.strip().strip("'\"") for key in table["keys"].split(","))
        message = f"the table [{keys}] is already defined"
        if keys.rpartition(".")[2] in SEVERAL:
            message += f"; for several, write [[{keys}]] in double brackets"
    here = one_line(lines[min(line, len(lines)) - 1].strip(), _LONGEST)
    got = f"got {here}, " if here else ""
    return f"{name}:{line}: this is not TOML: {got}{MESSAGES.get(message, message)}"


_SECRET = re.compile(
    r"(?i)(?:^|[_-])(?:password|passwd|pwd|pass|secret|token|api[_-]?key|auth|credentials)$"
)


def readable_secret(file: Path, data: Any) -> str | None:
    """Return a warning if a file contains a password and others may read it.

    Args:
        file: The file.
        data: Its content, as plain values.

    Raises:
        OSError: If the file no longer exists.

    """
    mode = file.stat().st_mode & 0o777
    if os.name != "posix" or not mode & 0o077 or not _holds_secret(data):
        return None
    return (
        f"{file} contains a password, and other users of this computer may read it "
        f"(its mode is {mode:04o}): run chmod 600 {shlex.quote(str(file))}"
    )


def _holds_secret(data: Any) -> bool:
    """Return whether a text in the data is a password, or a URL with one."""
    left = [data]
    while left:
        value = left.pop()
        if isinstance(value, list):
            left += value
        elif isinstance(value, dict):
            if any(_is_secret(key, each) for key, each in value.items()):
                return True
            left += value.values()
        elif isinstance(value, str) and "://" in value and _in_address(value):
            return True
    return False


def _in_address(text: str) -> bool:
    try:
        parts = urlsplit(text)
        pairs = parse_qsl(parts.query)
    except ValueError:
        return False
    return "@" in parts.netloc or any(_is_secret(*pair) for pair in pairs)


def _is_secret(key: str, value: Any) -> bool:
    return isinstance(value, str) and value != "" and bool(_SECRET.search(key))
