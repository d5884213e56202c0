"""Where the fields of a message are: sizes, and what is known of the padding."""

from collections.abc import Sequence
from typing import NamedTuple

from webmap.ros.definitions import Field
from webmap.ros.serialized.schemas import SIZES, Encoding, parts_of


class Place(NamedTuple):
    """What is known of a position: it is ``rest`` modulo ``unit``."""

    unit: int
    """A power of two, at most 8, since CDR aligns no further."""

    rest: int

    def after(self, size: int) -> "Place":
        """Return the place so many bytes later."""
        return Place(self.unit, (self.rest + size) % self.unit)

    def aligned(self, size: int) -> "Place":
        """Return the next place that is a multiple of ``size``."""
        if self.unit < size:
            return Place(size, 0)
        return self.after(-self.rest % size)

    def either(self, other: "Place") -> "Place":
        """Return what is known if one of the two is right."""
        unit = min(self.unit, other.unit)
        while self.rest % unit != other.rest % unit:
            unit //= 2
        return Place(unit, self.rest % unit)


ANYWHERE = Place(1, 0)


def after_numbers(type: str) -> Place:
    """Return the place after an array of numbers; an empty one has no padding."""
    return Place(min(SIZES[type], 4), 0)


def place_after(field: Field, place: Place) -> Place:
    """Return what is known of the place after a field in CDR."""
    parts = parts_of(field, "cdr")
    if field.is_array and field.size is None:
        if field.type in SIZES:
            return after_numbers(field.type)
        return place.aligned(4).after(4).either(place_after(one_of(field), ANYWHERE))
    if field.type == "string" or (field.is_array and parts is not None):
        return ANYWHERE
    if parts is not None:
        for each in parts:
            place = place_after(each, place)
        return place if parts else place.after(1)
    size = SIZES[field.type]
    return place.aligned(size).after(size * (field.size or 1))


def one_of(field: Field) -> Field:
    """Return one item of an array as a field."""
    return Field(field.name, field.type, field.fields)


def record_size(parts: Sequence[Field], encoding: Encoding) -> tuple[int, int] | None:
    """Return size and alignment of messages that follow each other without padding.

    None if their size varies, if there is padding between them, or if there is an array
    of messages in them.
    """
    sizes = _sizes_of(parts, encoding)
    if not sizes:
        return None
    if encoding == "ros1":
        return sum(size for size, _ in sizes), 1
    unit, at = sizes[0][1], 0
    for size, each in sizes:
        at += -at % each + size
    return (at, unit) if at % unit == 0 and all(u <= unit for _, u in sizes) else None


def _sizes_of(
    parts: Sequence[Field], encoding: Encoding
) -> list[tuple[int, int]] | None:
    """Return size and alignment of all values in a message; None if they vary."""
    found: list[tuple[int, int]] = []
    for field in parts:
        inner = parts_of(field, encoding)
        varies = field.is_array and (field.size is None or inner is not None)
        if varies or field.type == "string":
            return None
        if inner is None:
            size = SIZES[field.type]
            found.append((size * (field.size or 1), size))
            continue
        sizes = _sizes_of(inner, encoding)
        if sizes is None:
            return None
        found += sizes
    if not parts and encoding == "cdr":
        found.append((1, 1))
    return found


def values_of(field: Field, encoding: Encoding) -> int:
    """Return how many values one item of an array is, without the items inside."""
    parts = parts_of(field, encoding) or ()
    return 1 + sum(
        1 if each.is_array else values_of(each, encoding)
        for each in parts
        if each.is_array or parts_of(each, encoding) is not None
    )
