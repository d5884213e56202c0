"""Identifiers that no other process uses."""

import itertools
import secrets

PROCESS = secrets.token_hex(4)
"""A random word of this process: a robot may still know what an earlier one sent."""

_numbers = itertools.count(1)


def generate_id() -> str:
    """Return a new identifier for a connection, which no other process uses.

    Returns:
        ``"WebMap-"``, as in the WebMap report of 2012, so that it differs from the
        identifiers of other libraries, the random word, and a number.

    """
    return f"WebMap-{PROCESS}-{next(_numbers)}"
