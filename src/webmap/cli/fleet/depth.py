"""How deep a text of TOML is nested, found before it is read.

Reading a key of thousands of parts takes seconds, and a value that is nested very deep
ends in a RecursionError. Both are found by going through the text once.
"""

import re

DEEPEST = 20
"""Parts of a key, and brackets in one another."""

_STRING = (
    r'"""(?:\\.|[^\\])*?""""{0,2}'
    r"|'''.*?''''{0,2}"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
)
_TOKEN = re.compile(
    rf"(?P<part>{_STRING}|[A-Za-z0-9_-]+)|(?P<dot>[ \t]*\.[ \t]*)"
    r"|(?P<opens>[\[{])|(?P<closes>[\]}])|(?P<quote>[\"'])|(?:#[^\n]*|[^\w\"'.\[\]{}#])",
    re.DOTALL,
)


def too_deep(text: str) -> int | None:
    """Return the line where a text is nested deeper than :data:`DEEPEST`, or None."""
    brackets = parts = 0
    for token in _TOKEN.finditer(text):
        kind = token.lastgroup
        if kind == "quote":  # a text without an end; the reader says so
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
