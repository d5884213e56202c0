"""What a listener wants of a topic, and whether that makes sense."""

from typing import Any, NamedTuple

import msgspec

from webmap.errors import ConfigError


class Wish(NamedTuple):
    """What is asked of the bridge for one topic."""

    type: str | None
    throttle: int
    queue_length: int
    compression: str | None


def checked(
    callback: object, throttle: object, queue_length: object, decode: object
) -> None:
    """Let the arguments of a subscription pass if they make sense.

    Raises:
        ConfigError: If they do not.

    """
    if not callable(callback):
        raise ConfigError(f"a subscription needs a function, got {callback!r}")
    for name, value in (("throttle", throttle), ("queue_length", queue_length)):
        if not isinstance(value, int) or value < 0:
            raise ConfigError(f"{name} is a whole number from 0 up, got {value!r}")
    if decode is not None and not _is_struct(decode):
        raise ConfigError(f"decode is a msgspec.Struct type, got {decode!r}")


def _is_struct(decode: Any) -> bool:
    return isinstance(decode, type) and issubclass(decode, msgspec.Struct)
