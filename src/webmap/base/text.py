"""Text for people: what comes from outside is on one line and of limited length.

Robots, bridges, browsers and files choose this text. A line break in it would forge a
line of the log, and an escape sequence would control the terminal.
"""

from unicodedata import bidirectional

LONGEST = 1000
"""Characters of a text that are shown, unless a caller sets another number."""

_CUT = "..."

RIGHT_TO_LEFT = frozenset({"R", "AL", "AN"})


def escaped(text: str) -> str:
    r"""Return a text with all characters escaped that are not printable.

    Control characters become ``\n`` or ``\x1b``, characters that reverse the direction
    of text ``\u202e``, lone surrogates ``\ud800``. Applied to its own result, the
    function changes nothing.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else _escape(c) for c in text)


def one_line(text: object, longest: int = LONGEST) -> str:
    """Return a text that is safe for a terminal: :func:`escaped`, and cut.

    Args:
        text: The text, or an object, converted by ``str``.
        longest: The most characters of the result.

    """
    shown = str(text)
    shown = escaped(shown[: longest + 1])  # the rest would be cut anyway
    if len(shown) > longest:
        shown = shown[: longest - len(_CUT)] + _CUT
    return shown


def lines_of(text: object, longest: int = LONGEST) -> str:
    """Return a text of several lines, each treated by :func:`one_line`.

    Only for texts whose line breaks WebMap itself has written.
    """
    return "\n".join(one_line(line, longest) for line in str(text).split("\n"))


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def isolated(name: str) -> str:
    """Return a name that does not change the direction of the text around it.

    A name in Hebrew or Arabic would otherwise move numbers and brackets beside it.
    """
    if name.isascii() or RIGHT_TO_LEFT.isdisjoint(map(bidirectional, name)):
        return name
    return f"\u2068{name}\u2069"


def counted(number: int, thing: str) -> str:
    """Return a count with its noun, such as "1 robot" and "2 robots".

    Args:
        number: How many there are.
        thing: The noun in the singular; its plural ends in "s".

    """
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"
