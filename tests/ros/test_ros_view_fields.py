"""Typed views of messages, compared with the definitions in the catalogue."""

import importlib
import pkgutil
import re
import types
import typing

import msgspec
import pytest

import webmap
from webmap.ros.arrays import Floats, Int8s, Numbers
from webmap.ros.definitions import FLOATS, INTEGERS, OCTETS, TIMES, shipped
from webmap.ros.messages import Time
from webmap.ros.serialized.views import without_none

NAME = re.compile(r"``([a-z0-9_]+/[A-Za-z0-9]+)``")
WIDTHS = {Floats: ("float32",), Int8s: ("int8",)}
SCALARS = {
    float: tuple(FLOATS),
    int: tuple(INTEGERS),
    str: ("string",),
    bool: ("bool",),
}


def views():
    """Return every struct whose docstring names the message types of the view."""
    for module in pkgutil.walk_packages(webmap.__path__, "webmap."):
        if module.name.startswith(
            ("webmap.ros.", "webmap.modules.", "webmap.features.")
        ):
            importlib.import_module(module.name)
    found, waiting = {}, [msgspec.Struct]
    for struct in waiting:
        waiting += struct.__subclasses__()
        names = NAME.findall(vars(struct).get("__doc__") or "")
        if names and struct.__module__.startswith("webmap."):
            found[f"{struct.__module__}.{struct.__name__}"] = (struct, names)
    return found


VIEWS = views()

ROS1_ONLY = {"seq"}
"""Fields of a header of ROS 1 that ROS 2 has not."""


def misfits(struct, fields, others=()):
    """Return the fields of a view that do not match a definition, as sentences.

    A field with a default may also exist only in another type.
    """
    if struct is Time:
        return []
    known, elsewhere = (
        {each.name: each for each in every} for every in (fields, others)
    )
    hints, wrong = typing.get_type_hints(struct), []
    for field in msgspec.structs.fields(struct):
        name = field.encode_name
        field_of_ros = known.get(name)
        if field_of_ros is None:
            if field.required or name not in (ROS1_ONLY | elsewhere.keys()):
                wrong.append(f"there is no {name}")
        elif not fits(hints[field.name], field_of_ros):
            wrong.append(f"{name} is no {hints[field.name]}")
    return wrong


def fits(hint, field):
    origin = typing.get_origin(hint)
    if origin in (typing.Union, types.UnionType):
        return any(fits(each, field) for each in typing.get_args(hint))
    if hint is Time:
        return field.type in TIMES and not field.is_array
    if hint is bytes:
        return field.type in OCTETS and field.is_array
    if isinstance(hint, type) and issubclass(hint, Numbers):
        return field.is_array and field.type in WIDTHS.get(hint, OCTETS)
    if origin is list:
        (inner,) = typing.get_args(hint)
        return field.is_array and fits_one(inner, field)
    return not field.is_array and fits_one(hint, field)


def fits_one(hint, field):
    hint = without_none(hint)  # nor a tuple of all values
    if field.fields is not None:
        return not misfits(hint, field.fields)
    return field.type in SCALARS.get(hint, ())


def test_there_are_views_to_compare():
    assert len(VIEWS) > 35


@pytest.mark.parametrize("ros2", [False, True], ids=["ros1", "ros2"])
@pytest.mark.parametrize("view", sorted(VIEWS))
def test_every_field_of_a_view_exists_in_its_types_and_fits(view, ros2):
    struct, names = VIEWS[view]
    definitions = [shipped(ros2=ros2).definition(name).fields for name in names]
    every = [field for fields in definitions for field in fields]
    for name, fields in zip(names, definitions, strict=True):
        assert misfits(struct, fields, every) == [], name


def test_a_view_with_wrong_fields_is_detected():
    class Wrong(msgspec.Struct):
        frame: str = ""
        stamp: int = 0

    header = shipped(ros2=True).definition("std_msgs/Header").fields
    assert misfits(Wrong, header) == ["there is no frame", f"stamp is no {int}"]
