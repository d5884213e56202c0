"""Reading a fleet file."""

import tomllib
from pathlib import Path

from webmap.cli.fleet.checks import Mistakes
from webmap.cli.fleet.depth import DEEPEST, too_deep
from webmap.cli.fleet.fleet_table import read_table
from webmap.cli.fleet.lines import Lines, way_in_words
from webmap.cli.fleet.lines import Path as Way
from webmap.cli.fleet.schema import Fleet
from webmap.cli.fleet.syntax import not_toml
from webmap.errors import ConfigError
from webmap.outside_text import one_line
from webmap.plain_files import read_file

LARGEST = 1 << 19
"""Bytes that a file may have."""

EXPECTED = "expected TOML with a table [bridges] and a table [[robots]] for each robot"


class FleetText:
    """A file that was read, and where in it something stands.

    Args:
        name: The file's name, for people.
        text: What is in it.

    Raises:
        ConfigError: If it is not TOML; line and column are named.

    """

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        if not text.strip():
            raise ConfigError(f"{name}: the file is empty; {EXPECTED}")
        line = too_deep(text)
        if line is not None:
            raise ConfigError(
                f"{name}:{line}: keys and values are nested {DEEPEST} deep at the "
                f"most; {EXPECTED}"
            )
        try:
            self.data = tomllib.loads(text)
        except ValueError as error:  # also whole numbers of thousands of digits
            raise ConfigError(not_toml(name, text, error)) from None
        except RecursionError:
            raise ConfigError(
                f"{name}: values are nested too deep; {EXPECTED}"
            ) from None
        self._lines = Lines(text)

    def complaint(self, way: Way, words: str) -> str:
        """Return a mistake with file, line and key."""
        said = f"{way_in_words(way)}: {words}"
        # What a file holds must not steer the terminal that shows it.
        return f"{self.name}:{self._lines.of(way)}: {one_line(said)}"

    def refuse(self, mistakes: Mistakes) -> None:
        """Raise all mistakes at once, if there are any.

        Raises:
            ConfigError: If there are.

        """
        if mistakes.found:
            lines = [self.complaint(way, words) for way, words in mistakes.found]
            if mistakes.more:
                lines.append(f"{self.name}: and {mistakes.more} mistakes more")
            raise ConfigError("\n".join(lines))


def read_text(file: Path) -> FleetText:
    """Read a file.

    Raises:
        ConfigError: If it is no file, too large, not UTF-8, or not TOML.
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


def read_fleet(file: Path) -> tuple[Fleet, FleetText]:
    """Return what a file says, and where it says it.

    Raises:
        ConfigError: If anything in it is wrong; every mistake is named with its line.
        OSError: If it cannot be read.

    """
    text = read_text(file)
    mistakes = Mistakes()
    fleet = read_table(text.data, mistakes)
    text.refuse(mistakes)
    return fleet, text
