"""JSON of a bridge, bounded in parts and depth before anything is made of it. No I/O.

Python needs a tenth of a second for a mebibyte of empty lists, and what nests deeply
exhausts its stack wherever it is gone through later.
"""

import json
from typing import Any

from webmap.base.errors import ProtocolError
from webmap.base.nesting import MAX_DEPTH
from webmap.ros.decoding import check_depth

MOST_PARTS = 20_000
"""Values in the longest message that is read. A dense scan in JSON has 7,200, anything
that the gate asks for in JSON a few hundred."""


def check_parts(data: bytes) -> None:
    """Let a message pass if it does not hold too many values.

    Raises:
        ProtocolError: If it does.

    """
    # Each value but the first comes behind one of these; texts may hold some, too.
    parts = sum(map(data.count, (b"[", b"{", b",")))
    if parts > MOST_PARTS:
        raise ProtocolError(
            f"a message of about {parts} values was sent where at most {MOST_PARTS} "
            "are read"
        )


def too_deep() -> ProtocolError:
    """Return the error for a message that Python cannot go through."""
    return ProtocolError(f"a message nested deeper than {MAX_DEPTH} levels")


def plain(data: bytes) -> Any:
    """Return the JSON in a message, with a bare NaN where bridges write one.

    Raises:
        ProtocolError: If it holds too many values or is nested too deeply.
        ValueError: If it is no JSON.

    """
    check_parts(data)
    try:
        value = json.loads(data)
    except RecursionError:
        raise too_deep() from None
    check_depth(value)
    return value
