"""Identifiers that are unique in this process."""

import itertools

_numbers = itertools.count(1)


def generate_id() -> str:
    """Return an identifier for a connection that is unique in this process.

    Returns:
        ``"WebMap-"`` and a number, as in the WebMap report of 2012, so that it differs
        from the identifiers of other libraries on the same connection.

    """
    return f"WebMap-{next(_numbers)}"
