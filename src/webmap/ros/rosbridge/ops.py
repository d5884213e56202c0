"""The operations that a client sends to rosbridge: one function each, returning bytes.

Nothing here does I/O or keeps state. The text is strict JSON: NaN and the infinities
are refused, because the JSON of some bridges would send them to the robot as numbers.

See Also:
    https://github.com/RobotWebTools/rosbridge_suite/blob/ros2/ROSBRIDGE_PROTOCOL.md

"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

LEAST_THROTTLE = 1
"""The least ``throttle_rate`` that is ever sent, in milliseconds."""

BURST = 10
"""Messages of a burst that the bridge queues for a subscription to every message.

rosbridge for ROS 2 itself subscribes with a depth of 10: it loses deeper bursts.
"""

_dumps = json.JSONEncoder(
    allow_nan=False, ensure_ascii=False, separators=(",", ":"), default=None
).encode


def _frame(**fields: Any) -> bytes:
    """Return the operation as JSON, without the fields that are ``None``.

    Raises:
        ValueError: If a number is NaN or infinite, or text is not Unicode.
        TypeError: If a value has no form in JSON.

    """
    given = {name: value for name, value in fields.items() if value is not None}
    try:
        return _dumps(given).encode()
    except RecursionError:
        raise ValueError("the message is nested too deeply for JSON") from None


def advertise(topic: str, type: str, *, id: str) -> bytes:
    """Advertise ``type`` on ``topic``; no message is latched."""
    return _frame(
        op="advertise", id=id, topic=topic, type=type, queue_size=1, latch=False
    )


def unadvertise(topic: str, *, id: str | None = None) -> bytes:
    """End the advertisement made under ``id``."""
    return _frame(op="unadvertise", id=id, topic=topic)


def publish(topic: str, message: Mapping[str, Any]) -> bytes:
    """Publish ``message``, a mapping of the message's fields, on ``topic``.

    Raises:
        ValueError: If a number in the message is NaN or infinite.
        TypeError: If a value in the message has no form in JSON.

    """
    return _frame(op="publish", topic=topic, msg=message)


def subscribe(
    topic: str,
    *,
    id: str,
    type: str | None = None,
    throttle_rate: int = 0,
    queue_length: int = 1,
    compression: str | None = None,
) -> bytes:
    """Subscribe to ``topic``.

    The frame never carries a ``throttle_rate`` of 0 or a ``queue_length`` of 0:

    - rosbridge for ROS 2 before 2.2 keeps a queue and a thread for each subscription
      with a ``queue_length`` above 0. When the client unsubscribes, closes or is cut
      off while a message is queued, the thread sends that message again and again until
      less than ``throttle_rate`` has passed since the last one. With 0 it never ends:
      the bridge uses all its processor time and answers no handshake (rosbridge_suite,
      issue 891). With 1 ms it ends after one message.
    - A ``queue_length`` of 0 has no such thread, but with a ``throttle_rate`` of 1 it
      drops each message that comes within 1 ms of the one before. A burst loses its
      last messages: transforms of several publishers, latched ``tf_static``, feedback
      of goals. For ROS 2 the bridge also encodes in its only thread, so a large message
      delays velocity and STOP.

    The thread also spins when encoding one message takes longer than ``throttle_rate``.
    CBOR is encoded once and then kept, so it is safe. JSON is encoded for each sending:
    request JSON of many megabytes with a ``throttle_rate`` above the time that encoding
    takes.

    A bridge serves several subscriptions of one connection to a topic as one, with the
    lowest ``throttle_rate`` and the lowest ``queue_length`` of them.

    Args:
        topic: The resolved name of the topic.
        id: The id for :func:`unsubscribe`. Without an id a bridge ends every
            subscription of the connection to the topic, so it is required here.
        type: The message type; with ``None`` the bridge determines it, and then needs
            an existing publisher.
        throttle_rate: Least time between two messages, in milliseconds. 0 asks for
            every message: it is sent as 1, and in JSON with a queue of at least
            :data:`BURST` messages.
        queue_length: Most messages that the bridge may queue, at least 1.
        compression: ``"none"``, ``"png"``, ``"cbor"`` or ``"cbor-raw"``.

    """
    is_binary = compression in ("cbor", "cbor-raw")
    # Binary messages may be large: a deeper queue would only make them late.
    least_queue = BURST if throttle_rate == 0 and not is_binary else 1
    return _frame(
        op="subscribe",
        id=id,
        topic=topic,
        type=type,
        throttle_rate=max(throttle_rate, LEAST_THROTTLE),
        queue_length=max(queue_length, least_queue),
        compression=compression,
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
    timeout: float | None = None,
) -> bytes:
    """Call ``service``; the response carries ``id``.

    Args:
        service: The resolved name of the service.
        args: The fields of its request.
        id: The id of the call.
        type: The type of the service.
        timeout: Seconds after which the bridge ends the call as failed. rosbridge for
            ROS 2 since 2.2 takes its own ``default_call_service_timeout`` otherwise,
            5 s by default; older bridges wait for ever in any case.

    Raises:
        ValueError: If a number in ``args`` is NaN or infinite.
        TypeError: If a value in ``args`` has no form in JSON.

    """
    return _frame(
        op="call_service",
        id=id,
        service=service,
        type=type,
        args={} if args is None else args,
        timeout=timeout,
    )


def service_response(
    service: str, values: Mapping[str, Any] | str, *, id: str | None, result: bool
) -> bytes:
    """Respond to a call that the bridge passed on to this client."""
    return _frame(
        op="service_response", id=id, service=service, values=values, result=result
    )


def status(level: str, message: str, *, id: str | None = None) -> bytes:
    """Send a status message: ``level`` is error, warning, info or none."""
    return _frame(op="status", id=id, level=level, msg=message)
