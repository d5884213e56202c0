"""From messages that came over rosbridge to what rosbags writes."""

import base64
import binascii
import math
from array import array
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from webmap.bags.shapes import Shape, attribute
from webmap.sim.rosbridge.dialect import canonical
from webmap.sim.rosbridge.schema import DTYPES, TIMES, Field

Make = Callable[[Any], Any]


class Misfit(Exception):
    """A message has other fields than its type, or values that do not fit them."""


class Objects:
    """Makes rosbags' objects of messages.

    In JSON a ``null`` stands for a float that is not finite; it becomes NaN. Bytes come
    as they are, as a list, or as text in base64.

    Args:
        classes: rosbags' classes by the names of types: ``nav_msgs/msg/Odometry``.
        shapes: The fields of those types, by canonical name.

    """

    def __init__(
        self, classes: Mapping[str, Callable[..., Any]], shapes: Mapping[str, Shape]
    ) -> None:
        self._classes = {canonical(name): made for name, made in classes.items()}
        self._shapes = shapes
        self._known: dict[str, Make] = {}

    def object(self, type_name: str, message: object) -> object:
        """Return what rosbags writes of a message.

        Args:
            type_name: Of the message, canonical.
            message: As :meth:`webmap.Bridge.subscribe` gives it, without ``decode``.

        Raises:
            Misfit: If it does not fit its type.

        """
        return self._of(type_name)(message)

    def _of(self, type_name: str) -> Make:
        make = self._known.get(type_name)
        if make is None:
            make = self._known[type_name] = self._record(type_name)
        return make

    def _record(self, type_name: str) -> Make:
        shape, made = self._shapes[type_name], self._classes[type_name]
        names = {field.name for field in shape}
        parts = [
            (field.name, attribute(field.name), self._field(field)) for field in shape
        ]

        def make(value: Any) -> Any:
            if not isinstance(value, Mapping):
                raise Misfit(f"{type_name} is a table of fields, got {_short(value)}")
            if value.keys() != names:
                odd = sorted(names ^ set(value))
                raise Misfit(f"its {type_name} differs in {', '.join(map(str, odd))}")
            return made(**{inner: make(value[name]) for name, inner, make in parts})

        return make

    def _field(self, field: Field) -> Make:
        def placed(make: Make) -> Make:
            def place(value: Any) -> Any:
                try:
                    return make(value)
                except (TypeError, ValueError, OverflowError) as error:
                    raise Misfit(f"{field.name}: {error}") from None

            return place

        if field.length is None:
            return placed(self._single(field.type))
        if field.type in (*DTYPES, "bool"):
            return placed(lambda value: _numbers(field, value))
        single = self._single(field.type)
        return placed(lambda value: [single(item) for item in _sized(field, value)])

    def _single(self, type_name: str) -> Make:
        if type_name in TIMES:
            times = self._classes[f"builtin_interfaces/{type_name.capitalize()}"]
            return lambda value: times(*_time(value))
        if type_name.startswith("float"):
            return _float
        if type_name in DTYPES:
            limits = np.iinfo(DTYPES[type_name])
            return lambda value: _whole(value, int(limits.min), int(limits.max))
        if type_name == "string":
            return _text
        return _truth if type_name == "bool" else self._of(type_name)


def _float(value: Any) -> float:
    return math.nan if value is None else float(value)


def _whole(value: Any, least: int, most: int) -> int:
    if isinstance(value, str | bytes):  # ROS 2 has a kind of number that is one byte
        octets = _octets(value) if isinstance(value, bytes) or len(value) != 1 else None
        value = ord(value) if octets is None else int.from_bytes(octets, "little")
    number = int(value)
    if number != value or not least <= number <= most:
        raise ValueError(f"expected a whole number up to {most}, got {value!r}")
    return number


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"expected text, got {_short(value)}")
    return value


def _truth(value: Any) -> bool:
    if not isinstance(value, bool | int):
        raise TypeError(f"expected a bool, got {_short(value)}")
    return bool(value)


def _time(value: Any) -> tuple[int, int]:
    if not isinstance(value, Mapping):
        raise TypeError(f"expected a time, got {_short(value)}")
    whole = value.get("sec", value.get("secs"))
    rest = value.get("nanosec", value.get("nsecs"))
    if whole is None or rest is None:
        raise ValueError(f"expected seconds and nanoseconds, got {_short(value)}")
    return int(whole), int(rest)


def _octets(value: Any) -> bytes:
    if isinstance(value, str):
        try:
            return base64.b64decode(value, validate=True)
        except binascii.Error as error:
            raise ValueError(f"no base64: {error}") from None
    return bytes(value)


def _numbers(field: Field, value: Any) -> Any:
    """Return the array of a field, in the width that its type has."""
    dtype = np.dtype("?" if field.type == "bool" else DTYPES[field.type])
    octets = isinstance(value, str | bytes)
    if octets:
        value = np.frombuffer(_octets(value), np.uint8)
    elif not isinstance(value, list | array | np.ndarray):
        raise TypeError(f"expected numbers, got {_short(value)}")
    with np.errstate(invalid="ignore"):
        numbers = np.ascontiguousarray(value, dtype)  # of None it makes NaN, for floats
    if dtype.kind in "iu" and not octets:
        same = value == numbers.tolist() if isinstance(value, list) else None
        if not (np.array_equal(value, numbers) if same is None else same):
            raise ValueError(f"expected whole numbers of the kind {field.type}")
    _sized(field, numbers)
    return numbers.reshape(-1)


def _sized(field: Field, values: Any) -> Any:
    if not isinstance(values, list | np.ndarray):
        raise TypeError(f"expected a list, got {_short(values)}")
    if field.length is not None and 0 <= field.length != len(values):
        raise ValueError(f"expected {field.length} values, got {len(values)}")
    return values


def _short(value: Any) -> str:
    return f"{value!r:.60}"
