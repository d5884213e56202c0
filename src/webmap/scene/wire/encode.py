"""Fragments as records, encoded once for all pages that show them."""

import math
import struct
from collections.abc import Callable
from functools import lru_cache
from typing import cast

from webmap.base.geometry import Affine
from webmap.scene.allowed import ATTRIBUTES, EVENTS
from webmap.scene.document import BoundElement, Document
from webmap.scene.element import Element
from webmap.scene.live import Line
from webmap.scene.node import Added, Changed, Fragment, Node, Removed, Text
from webmap.scene.wire.opcodes import (
    AFTER,
    FIRST,
    LAST,
    PREVENT,
    STOP,
    TAGS,
    Op,
    new_varint,
    string,
    varint,
)

_TAG = {tag: index for index, tag in reversed(list(enumerate(TAGS)))}
_HTML_TAG = {tag: index for index, tag in enumerate(TAGS)}
_ATTRIBUTE = {name: index for index, name in enumerate(ATTRIBUTES)}
EVENT_NUMBER = {kind: index for index, kind in enumerate(EVENTS)}
"""The number of each event in messages."""

_POSE = struct.Struct("<fff").pack
_FAR_POSE = struct.Struct("<ddf").pack
_MATRIX = struct.Struct("<6d").pack
isfinite = math.isfinite
_FLOAT = struct.Struct("<f").pack
# A member of an enum has a hash that is written in Python.
_DELTA, _AGE, _POSE_OP = int(Op.DELTA), int(Op.AGE), int(Op.POSE)
_FAR = 4096.0
"""Metres beyond which the error of single precision exceeds half a millimetre."""


class _Memo:
    """The encoded records of a fragment at one revision."""

    __slots__ = ("changes", "revision", "snapshot")

    def __init__(self) -> None:
        self.revision = -1
        self.changes: dict[int, bytes | None] = {}
        self.snapshot: bytes | None = None


def _memo(fragment: Fragment) -> _Memo:
    memo = cast("_Memo | None", fragment.memo)
    if memo is None:
        memo = fragment.memo = _Memo()
    if memo.revision != fragment.revision:
        memo.revision = fragment.revision
        memo.changes.clear()
        memo.snapshot = None
    return memo


def encode_changes(fragment: Fragment, since: int) -> bytes | None:
    """Return the records that bring a page from revision ``since`` to the current one.

    Args:
        fragment: The fragment.
        since: The revision that the page has.

    Returns:
        The section of the fragment without its dots, empty if nothing else changed, or
        None if a snapshot is needed.

    """
    changes = _memo(fragment).changes
    if since not in changes:
        changes[since] = _encode_changes(fragment, since)
    return changes[since]


def encode_snapshot(fragment: Fragment) -> bytes:
    """Return the records that build the whole current fragment without its dots."""
    memo = _memo(fragment)
    if memo.snapshot is None:
        fragment.mark_sent()
        out = bytearray()
        _put_node(out, fragment.root, 0, LAST)
        memo.snapshot = bytes(out)
    return memo.snapshot


@lru_cache(maxsize=1 << 15)
def _op_and_id(op: int, id: int) -> bytes:
    return bytes((op, *varint(id)))


def delta(fragment: Fragment) -> bytes:
    """Return the record before the changes of a fragment."""
    return _op_and_id(_DELTA, fragment.id)


def _encode_changes(fragment: Fragment, since: int) -> bytes | None:
    out = bytearray(delta(fragment))
    empty = len(out)
    if fragment.restructured <= since:  # nothing was added or removed
        fragment.mark_sent()
        for node, slot in fragment.values_since(since):
            if slot != "dots":
                _put_slot(out, node, slot, since)
        return bytes(out) if len(out) > empty else b""
    changes = fragment.changes_since(since)
    if changes is None:
        return None
    for change in changes:
        match change:
            case Changed(_, "dots"):
                continue
            case Changed(node, slot):
                _put_slot(out, node, slot, since)
            case Removed(node_id):
                out.append(Op.REMOVE)
                out += varint(node_id)
            case Added(node, after):
                parent = cast("Element", node.parent).id
                _put_node(out, node, parent, after.id + AFTER if after else FIRST)
    return bytes(out) if len(out) > empty else b""


# Nodes --------------------------------------------------------------------------


def _put_node(out: bytearray, node: Node, parent: int, place: int) -> None:
    if isinstance(node, Text):
        _head(out, Op.TEXT, node)
        out += varint(parent) + varint(place) + string(node.data)
        return
    element = cast("Element", node)
    if isinstance(element, Document):
        _head(out, Op.DOCUMENT, element)
    elif isinstance(element, BoundElement):
        _head(out, Op.BIND, element)
        out += string(element.html_id)
    else:
        _head(out, Op.CREATE, element)
        tags = _TAG if element.namespace == "svg" else _HTML_TAG
        out += varint(parent) + varint(place)
        out.append(tags[element.tag])
    for slot in _slots_of(element):
        _put_slot(out, element, slot)
    for child in element._children:
        _put_node(out, child, element.id, LAST)


def _slots_of(element: Element) -> list[str]:
    """Return the slots whose values must be sent for a new element."""
    slots = [*element._attributes, *element._styles]
    if isinstance(element, BoundElement):
        slots += element.dropped
        if element.emptied:
            slots.append("emptied")
    if element._classes:
        slots.append("class")
    if element._transform is not None:
        slots.append("transform")
    if element._age is not None:
        slots += ("age-limit", "age")
    if element._listeners:
        slots.append("events")
    if element._map is not None:
        slots.append("map")
    return slots


def _head(out: bytearray, op: int, node: Node) -> None:
    out += _op_and_id(op, node.id)


# Values -------------------------------------------------------------------------


def _put_slot(out: bytearray, node: Node, slot: str, since: int = -1) -> None:
    put = _SLOTS.get(slot)
    if put is not None:
        put(out, node)
    elif slot.startswith("--"):
        _put_style(out, cast("Element", node), slot)
    else:
        _put_attribute(out, cast("Element", node), slot, since)


def _put_attribute(out: bytearray, element: Element, name: str, since: int) -> None:
    value = element._attributes.get(name)
    if isinstance(value, Line):
        _put_line(out, element, value, since)
        return
    number = _ATTRIBUTE.get(name)
    if number is not None:
        _head(out, Op.UNSET if value is None else Op.ATTRIBUTE, element)
        out.append(number)
    else:
        _head(out, Op.NAMED_UNSET if value is None else Op.NAMED_ATTRIBUTE, element)
        out += string(name)
    if value is not None:
        out += string(value)


def _put_line(out: bytearray, element: Element, line: Line, since: int) -> None:
    whole = new = len(line)
    if since >= 0 and element.fragment is not None:
        new = line.new_since(element.fragment, since)
    _head(out, Op.LINE, element)
    out += varint(whole) + varint(new) + line.points[8 * (whole - new) :]


def _put_style(out: bytearray, element: Element, name: str) -> None:
    _head(out, Op.STYLE, element)
    out += string(name) + string(element._styles.get(name, ""))


def _put_transform(out: bytearray, element: Element) -> None:
    transform = element._transform
    if isinstance(transform, tuple):
        _put_pose(out, element, *transform)
    elif isinstance(transform, Affine):
        _head(out, Op.MATRIX, element)
        out += _MATRIX(*transform.values)
    else:
        _head(out, Op.UNSET if transform is None else Op.ATTRIBUTE, element)
        out.append(_ATTRIBUTE["transform"])
        if transform is not None:
            out += string(transform)


def _put_pose(out: bytearray, element: Element, x: float, y: float, yaw: float) -> None:
    # The angle within one turn is equivalent and keeps its precision.
    yaw = math.remainder(yaw, math.tau)
    if -_FAR < x < _FAR and -_FAR < y < _FAR:
        _head(out, _POSE_OP, element)
        out += _POSE(x, y, yaw)
    else:
        _head(out, Op.FAR_POSE, element)
        out += _FAR_POSE(x, y, yaw)


def _put_age(out: bytearray, element: Element) -> None:
    if element._age is not None:
        measured = element._age.measured
        _head(out, _AGE, element)
        out += new_varint(max(1, round(measured * 1000)) if isfinite(measured) else 0)


def _put_age_limit(out: bytearray, element: Element) -> None:
    if element._age is not None:
        _head(out, Op.AGE_LIMIT, element)
        out += _FLOAT(element._age.limit)
        out.append(element._age.shown)


def _put_classes(out: bytearray, element: Element) -> None:
    _head(out, Op.CLASSES, element)
    out += string(" ".join(element._classes))


def _put_events(out: bytearray, element: Element) -> None:
    listening = element.listening
    _head(out, Op.EVENTS, element)
    out.append(len(listening))
    for kind, (prevent, stop) in listening.items():
        out.append(EVENT_NUMBER[kind])
        out.append(PREVENT * prevent | STOP * stop)


def _put_text(out: bytearray, text: Text) -> None:
    _head(out, Op.DATA, text)
    out += string(text.data)


def _put_map(out: bytearray, element: Element) -> None:
    if element._map is not None:
        _head(out, Op.MAP, element)
        out += varint(element._map.world_id)
        out += _FLOAT(element._map.width) + _FLOAT(element._map.height)


def _put_emptied(out: bytearray, element: Element) -> None:
    _head(out, Op.EMPTY, element)


_SLOTS = cast(
    "dict[str, Callable[[bytearray, Node], None]]",
    {
        "transform": _put_transform,
        "age": _put_age,
        "age-limit": _put_age_limit,
        "class": _put_classes,
        "events": _put_events,
        "text": _put_text,
        "map": _put_map,
        "emptied": _put_emptied,
    },
)
"""The encoder of each slot that is not a plain attribute."""
