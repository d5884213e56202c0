"""What a client says to rosbridge: one function per operation, each giving bytes.

Nothing here does I/O or keeps state. The text is strict JSON: NaN and the infinities
are refused, because the JSON of some bridges would carry them to the robot as numbers.

See Also:
    https://github.com/RobotWebTools/rosbridge_suite/blob/ros2/ROSBRIDGE_PROTOCOL.md

"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

_dumps = json.JSONEncoder(
    allow_nan=False, ensure_ascii=False, separators=(",", ":"), default=None
).encode


def _frame(**fields: Any) -> bytes:
    """Return the operation as JSON, without the fields that are ``None``.

    Raises:
        ValueError: If a number is NaN or infinite, or text is not Unicode.
        TypeError: If a value is nothing that JSON knows.

    """
    given = {name: value for name, value in fields.items() if value is not None}
    try:
        return _dumps(given).encode()
    except RecursionError:
        raise ValueError("the message is nested too deeply for JSON") from None


def advertise(
    topic: str, type: str, *, id: str, queue_size: int = 1, latch: bool = False
) -> bytes:
    """Announce that this client will publish ``type`` on ``topic``."""
    return _frame(
        op="advertise",
        id=id,
        topic=topic,
        type=type,
        queue_size=queue_size,
        latch=latch,
    )


def unadvertise(topic: str, *, id: str | None = None) -> bytes:
    """Take back the announcement made under ``id``."""
    return _frame(op="unadvertise", id=id, topic=topic)


def publish(topic: str, message: Mapping[str, Any], *, id: str | None = None) -> bytes:
    """Publish ``message``, a mapping of the message's fields, on ``topic``.

    Raises:
        ValueError: If a number in it is NaN or infinite.
        TypeError: If a value in it is nothing that JSON knows.

    """
    return _frame(op="publish", id=id, topic=topic, msg=message)


def subscribe(
    topic: str,
    *,
    id: str,
    type: str | None = None,
    throttle_rate: int = 0,
    queue_length: int = 1,
    compression: str | None = None,
    fragment_size: int | None = None,
) -> bytes:
    """Ask for the messages of ``topic``.

    Args:
        topic: The resolved name of the topic.
        id: What :func:`unsubscribe` names later. Without one a bridge ends every
            subscription of the link to the topic, so it is not optional here.
        type: The message type; ``None`` leaves it to the bridge, which then needs
            a publisher to be there already.
        throttle_rate: Least time between two messages, in milliseconds.
        queue_length: How many messages the bridge may hold back for us.
        compression: ``"none"``, ``"png"``, ``"cbor"`` or ``"cbor-raw"``.
        fragment_size: Largest frame to be sent in one piece, in bytes.

    """
    return _frame(
        op="subscribe",
        id=id,
        topic=topic,
        type=type,
        throttle_rate=throttle_rate,
        queue_length=queue_length,
        compression=compression,
        fragment_size=fragment_size,
    )


def unsubscribe(topic: str, *, id: str) -> bytes:
    """End the subscription made under ``id``, and no other."""
    return _frame(op="unsubscribe", id=id, topic=topic)


def call_service(
    service: str,
    args: Mapping[str, Any] | Sequence[Any] | None = None,
    *,
    id: str,
    type: str | None = None,
) -> bytes:
    """Call ``service``; the answer carries ``id``.

    Raises:
        ValueError: If a number in ``args`` is NaN or infinite.
        TypeError: If a value in ``args`` is nothing that JSON knows.

    """
    return _frame(
        op="call_service",
        id=id,
        service=service,
        type=type,
        args={} if args is None else args,
    )


def service_response(
    service: str, values: Mapping[str, Any] | str, *, id: str | None, result: bool
) -> bytes:
    """Answer a call that the bridge passed on to this client."""
    return _frame(
        op="service_response", id=id, service=service, values=values, result=result
    )


def status(level: str, message: str, *, id: str | None = None) -> bytes:
    """Tell the peer of something: ``level`` is error, warning, info or none."""
    return _frame(op="status", id=id, level=level, msg=message)


def set_level(level: str) -> bytes:
    """Ask for status messages from ``level`` on: error, warning, info or none."""
    return _frame(op="set_level", level=level)
