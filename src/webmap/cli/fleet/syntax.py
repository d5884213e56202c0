"""What is said of a text that is not TOML: where, what stands there, what to do."""

import re

from webmap.outside_text import one_line

_WHERE = re.compile(
    r"(?P<words>.*) \(at (?:line (?P<line>\d+), column \d+|end of .*)\)"
)
_TABLE = re.compile(r"Cannot declare \((?P<keys>.*?),?\) twice")
_NUMBER = re.compile(r"\d[\d_]{999,}")
_LONGEST = 60

SEVERAL = ("robots", "map", "image", "modules", "labels", "buttons")
"""Tables of which there may be more than one."""

WORDS = {
    "Invalid value": "no value that TOML knows: a text stands in quotes, true and "
    "false without",
    "Illegal character '\\n'": "expected the quote that ends a text on the same line",
    "Invalid statement": 'expected a table such as [bridges], or key = "value"',
    "Expected '=' after a key in a key/value pair": "expected a key, an equals sign "
    "and a value",
    "Cannot overwrite a value": "this key stands there already",
    "Expected newline or end of document after a statement": "expected the end of the "
    "line after a value",
}
"""What the reader of TOML says, in the words of somebody who writes a file."""


def not_toml(name: str, text: str, error: ValueError) -> str:
    """Return what is wrong with a text, with its line and what stands there.

    Args:
        name: The file's name, for people.
        text: What is in it.
        error: What the reader of TOML says.

    """
    lines = text.splitlines() or [""]
    found = _WHERE.fullmatch(str(error))
    if found is None:
        number = _NUMBER.search(text)
        if number is None:
            return f"{name}: this is not TOML: {error}"
        line = text.count("\n", 0, number.start()) + 1
        return f"{name}:{line}: this is not TOML: a whole number of far too many digits"
    words = found["words"]
    # The end of the file is told without a line.
    line = int(found["line"] or len(lines))
    table = _TABLE.fullmatch(words)
    if table is not None:
        keys = ".".join(key.strip().strip("'\"") for key in table["keys"].split(","))
        words = f"a table [{keys}] stands there already"
        if keys.rpartition(".")[2] in SEVERAL:
            words += f"; several are [[{keys}]] in two brackets each"
    here = one_line(lines[min(line, len(lines)) - 1].strip(), _LONGEST)
    got = f"got {here}, " if here else ""
    return f"{name}:{line}: this is not TOML: {got}{WORDS.get(words, words)}"
