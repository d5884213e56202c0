"""Identifiers that are unique in this process."""

import itertools

_numbers = itertools.count(1)


def generate_id() -> str:
    """Return an identifier for a link that no other part of the process uses.

    Returns:
        ``"WebMap-"`` and a number, as the WebMap report of 2012 has it, so that
        it cannot meet the identifiers of another library on the same link.

    """
    return f"WebMap-{next(_numbers)}"
