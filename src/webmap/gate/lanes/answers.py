"""What a bridge answers to the call of a service, as far as the gate cares. No I/O."""

from typing import Any, NamedTuple

import msgspec

from webmap.gate.lanes.navigation import readable
from webmap.gate.lanes.reading import plain


class Answer(NamedTuple):
    """How a call went."""

    why: str | None
    """Why it failed, in words; ``None`` if it did not."""


class _Frame(msgspec.Struct):
    op: str = ""
    id: str | int | None = None
    result: Any = None
    values: Any = None
    level: str = ""
    msg: Any = None


def answer_to(data: bytes, id: str) -> Answer | None:
    """Return what a message says of the call ``id``; ``None`` if nothing.

    Only what says that the call failed is taken for that: old bridges leave out
    ``result``, and a service of another type than Trigger has no ``success``.

    Raises:
        ProtocolError: If it holds too many values or is nested too deeply.

    """
    try:
        frame = msgspec.convert(plain(data), _Frame)
    except ValueError:  # msgspec's own errors are of that kind too
        return None
    if str(frame.id) != id:
        return None
    if frame.op == "status" and frame.level == "error":
        return Answer(_because("refused", frame.msg))
    if frame.op != "service_response":
        return None
    if frame.result is False:
        return Answer(_because("refused", frame.values))
    values = frame.values
    if isinstance(values, dict) and values.get("success") is False:
        return Answer(_because("the service reported a failure", values.get("message")))
    return Answer(None)


def _because(what: str, said: Any) -> str:
    words = readable(said) if isinstance(said, str) else ""
    return f"{what} ({words})" if words else what
