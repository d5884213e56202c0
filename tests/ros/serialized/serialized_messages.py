"""Messages of any type, as hypothesis draws them and as the reader returns them."""

from array import array

from hypothesis import strategies as st

from webmap.ros.definitions import FLOATS, INTEGERS, OCTETS, shipped
from webmap.ros.serialized.schemas import CODES

TYPES = [
    (encoding, name)
    for encoding, ros2 in (("cdr", True), ("ros1", False))
    for name in shipped(ros2)
]
"""The serializations, and the names of the types that are included in WebMap."""

LANGUAGES = {"cdr": "ros2msg", "ros1": "ros1msg"}


def messages(fields, encoding):
    """Return a strategy of messages with these fields."""
    return st.fixed_dictionaries({each.name: values(each, encoding) for each in fields})


def values(field, encoding):
    """Return a strategy of values of a field, as the reader returns them."""
    one = values_of_one(field, encoding)
    if not field.is_array:
        return one
    least, most = field.size or 0, field.size or min(field.most or 3, 3)
    if field.type in OCTETS:
        return st.binary(min_size=least, max_size=most)
    several = st.lists(one, min_size=least, max_size=most)
    if field.type in CODES and field.type != "bool":
        return several.map(lambda items: array(CODES[field.type], items))
    return several


def values_of_one(field, encoding):
    """Return a strategy of values of a field that is no array, or of one item."""
    if field.fields is not None:
        return messages(field.fields, encoding)
    if field.type in INTEGERS:
        return st.integers(*INTEGERS[field.type])
    if field.type in FLOATS:
        return st.floats(allow_nan=False, width=32)
    if field.type == "bool":
        return st.booleans()
    if field.type == "string":
        letters = st.characters(exclude_categories=["Cs"], exclude_characters="\0")
        return st.text(letters, max_size=min(field.longest or 9, 9))
    names = ("sec", "nanosec") if encoding == "cdr" else ("secs", "nsecs")
    return st.tuples(st.integers(0, 2**31 - 1), st.integers(0, 10**9 - 1)).map(
        lambda pair: dict(zip(names, pair, strict=True))
    )
