"""Text from outside, for a terminal or a log: on one line, and of a limited length.

Robots, bridges, browsers and files choose what is in it. A line break would forge a
line of the log, and an escape sequence would steer the terminal.
"""

LONGEST = 1000
"""Characters of a text that are shown, unless a caller names another number."""

_CUT = "..."


def escaped(text: str) -> str:
    r"""Return a text with everything escaped that is not printable.

    Control characters become ``\n`` or ``\x1b``, characters that reverse the direction
    of text ``\u202e``, lone surrogates ``\ud800``. Applied to its own result, the
    function changes nothing.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else _escape(c) for c in text)


def one_line(text: object, longest: int = LONGEST) -> str:
    """Return a text as a terminal may show it: :func:`escaped`, and cut.

    Args:
        text: The text, or what ``str`` makes of an object.
        longest: The most characters of the result.

    """
    shown = str(text)
    shown = escaped(shown[: longest + 1])  # the rest would be cut anyway
    if len(shown) > longest:
        shown = shown[: longest - len(_CUT)] + _CUT
    return shown


def lines_of(text: object, longest: int = LONGEST) -> str:
    """Return a text of several lines, each of them as :func:`one_line` makes it.

    Only for texts whose line breaks WebMap itself has written.
    """
    return "\n".join(one_line(line, longest) for line in str(text).split("\n"))


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")
