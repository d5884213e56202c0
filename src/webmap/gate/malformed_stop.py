"""A STOP of a page that is not a valid command (S10). No I/O, no state.

A frame that begins like a STOP stops robots, whatever follows. Which ones is read from
it as far as that can be done without doubt.
"""

import json
import re

_SPACE = rb"[ \t\n\r]*"
_STOP = rb"%b\{%b\"op\"%b:%b\"stop\"" % (_SPACE, _SPACE, _SPACE, _SPACE)
_BEGINS = re.compile(_STOP)
_NAMES_NEXT = re.compile(
    _STOP
    + rb"%b,%b\"robot\"%b:%b(\"(?:[^\"\\]|\\.)*\")" % (_SPACE, _SPACE, _SPACE, _SPACE)
)
_NAME_KEY = re.compile(rb"\"robot\"" + _SPACE + rb":")


def begins_like_stop(data: bytes) -> bool:
    """Return whether a frame begins with ``{"op":"stop"``, spaces allowed."""
    return _BEGINS.match(data) is not None


def robot_in(data: bytes) -> str | None:
    """Return the one robot that a frame names, if that can be read without doubt.

    Args:
        data: A frame that begins like a STOP.

    Returns:
        The name, which may be unknown; ``None`` if no robot is named, or several, or
        the name cannot be read.

    """
    try:
        fields = json.loads(data.decode(), object_pairs_hook=list)
        names = [value for name, value in fields if name == "robot"]
    except (ValueError, RecursionError):
        names = _named_next(data)
    name = names[0] if len(names) == 1 else None
    return name if isinstance(name, str) else None


def _named_next(data: bytes) -> list[str]:
    """Return the robot that stands right behind the beginning of what is not JSON."""
    found = _NAMES_NEXT.match(data)
    if found is None or len(_NAME_KEY.findall(data)) > 1:
        return []
    try:
        return [json.loads(found[1].decode())]
    except ValueError:
        return []
