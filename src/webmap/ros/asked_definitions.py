"""The fields of a type that is not shipped, asked of a robot of ROS 1.

A rosapi of ROS 2 may end for good when it is asked for them, so none ever is: not
where a topic is spelled as ROS 2 spells it, nor where that cannot be told.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import msgspec

from webmap.errors import BridgeError, ProtocolError, ServiceError
from webmap.ros.decoding import convert
from webmap.ros.definitions import definition
from webmap.ros.names import split_type

if TYPE_CHECKING:
    from webmap.ros.bridge import Bridge

QUESTIONS = {
    "msg": "/rosapi/message_details",
    "srv": "/rosapi/service_request_details",
}
MAX_PARTS = 100
"""Definitions that one answer may hold."""


class _Part(msgspec.Struct):
    type: str
    fieldnames: list[str] = []
    fieldtypes: list[str] = []
    fieldarraylen: list[int] = []
    constnames: list[str] = []
    constvalues: list[str] = []


class _Answer(msgspec.Struct):
    typedefs: list[_Part]


async def is_ros2(bridge: "Bridge") -> bool | None:
    """Tell by the topics whether a bridge is of ROS 2; None if that is not known."""
    try:
        types = (await bridge.topics()).values()
    except BridgeError:
        return None
    slashes = {type.count("/") for type in types if type}
    if 2 in slashes:
        return True
    return False if 1 in slashes else None


async def ask_definitions(bridge: "Bridge", type: str, kind: str) -> Mapping[str, str]:
    """Return the definitions of a type and of all its parts, by their names.

    Args:
        bridge: The bridge.
        type: The type.
        kind: ``"msg"``, or ``"srv"`` for the request of a service.

    Raises:
        ServiceError: If it may not be asked, or does not answer what makes sense.
        BridgeClosed: If there is no link.

    """
    ros2 = await is_ros2(bridge)
    if ros2 is not False:
        why = "a ROS 2 bridge is not" if ros2 else "one whose ROS nobody knows is not"
        raise ServiceError(
            f"{why} asked for the fields of {type}, since that can end its rosapi: "
            "write the values into the button's configuration"
        )
    name = str(split_type(type))
    answer = await bridge.call_service(QUESTIONS[kind], {"type": name})
    try:
        parts = convert(answer, _Answer).typedefs
        if not parts or len(parts) > MAX_PARTS:
            raise ProtocolError(f"got {len(parts)} definitions")
        texts = {part.type: _text(part) for part in parts}
    except (ProtocolError, ValueError) as error:
        raise ServiceError(f"{QUESTIONS[kind]} made no sense: {error}") from None
    # The first is the one that was asked for; of a service it is called ...Request.
    texts[name] = texts[parts[0].type]
    return texts


def lookup_in(texts: Mapping[str, str]) -> Any:
    """Return what finds a definition among those asked for, then the shipped ones."""
    return lambda type: texts.get(type) or definition(type)


def _text(part: _Part) -> str:
    lines = []
    lengths = part.fieldarraylen or [-1] * len(part.fieldnames)
    constants = zip(part.constnames, part.constvalues, strict=True)
    for name, value in constants:
        kind = "string" if not _is_number(value) else _kind_of(part, name)
        lines.append(f"{kind} {name}={value}")
    for name, type, length in zip(
        part.fieldnames, part.fieldtypes, lengths, strict=True
    ):
        array = "" if length < 0 else f"[{length or ''}]"
        lines.append(f"{type}{array} {name}")
    return "\n".join(lines)


def _kind_of(part: _Part, constant: str) -> str:
    """Return the type of the field that a constant is most likely for.

    rosapi tells the names and values of constants and not their types.
    """
    for name, type in zip(part.fieldnames, part.fieldtypes, strict=True):
        if constant.startswith(f"{name.upper()}_"):
            return type
    whole = [type for type in part.fieldtypes if type.startswith(("int", "uint"))]
    return whole[0] if whole else "int64"


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
