"""The ROS graph as reported by rosapi: topics, services, their types and nodes."""

import json
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Literal

import msgspec

from webmap.base.errors import BridgeError, ProtocolError, ServiceError
from webmap.ros.decoding import convert
from webmap.ros.definitions import Definitions
from webmap.ros.messages import Time
from webmap.ros.names import split_type

ACTIONS = {"navigate_to_pose": "nav2_msgs/action/NavigateToPose"}
"""Actions by the usual names of their servers: rosapi does not report action types."""

BRIEF = 2.0
"""Seconds for rosapi to report the type of a service, after the press of a button."""

SET_PARAM = "/rosapi/set_param"
"""The service that sets a parameter of ROS 1."""

CLIENTS = ("rosbridge", "foxglove", "webmap")
"""Parts of the names of nodes that publish for their clients, such as WebMap."""


def is_client_node(name: str) -> bool:
    """Return whether a node publishes and subscribes for clients of a bridge."""
    return any(part in name for part in CLIENTS)


class BridgeGraph:
    """Questions to the rosapi of a bridge; answers are kept for one connection.

    ``get_param_names`` and ``message_details`` are never called: on ROS 2 the first
    hangs rosapi for ever and the second kills it.

    Args:
        call: Calls a service and returns the fields of its response.

    """

    def __init__(self, call: Callable[..., Awaitable[Any]]) -> None:
        self._call = call
        self._types: dict[str, str] = {}

    def forget(self) -> None:
        """Forget all answers: the robot may have been restarted."""
        self._types.clear()

    def known(self, topic: str) -> str | None:
        """Return the known type of ``topic``, without a question."""
        return self._types.get(topic)

    async def topic_type(self, topic: str) -> str | None:
        """Return the type of ``topic``, or None if unknown or unanswered."""
        if topic in self._types:
            return self._types[topic]
        found = await self._type("/rosapi/topic_type", {"topic": topic})
        if found is not None:
            self._types[topic] = found
        return found

    async def service_type(self, service: str) -> str | None:
        """Return the type of ``service``, or None if unknown or unanswered."""
        question = "/rosapi/service_type"
        return await self._type(question, {"service": service}, timeout=BRIEF)

    async def _type(
        self, question: str, about: Mapping[str, str], **how: float
    ) -> str | None:
        try:
            answer = await self._call(question, about, **how)
        except BridgeError:
            return None
        found = answer.get("type") if isinstance(answer, dict) else None
        return found if isinstance(found, str) and found else None

    async def published(self, topic: str) -> bool | None:
        """Return whether ``topic`` has a publisher, or None without an answer."""
        nodes = await self.nodes("publishers", topic)
        return None if nodes is None else bool(nodes)

    async def nodes(
        self, kind: Literal["publishers", "subscribers"], topic: str
    ) -> list[str] | None:
        """Return the nodes of a kind of a topic, or None without an answer."""
        try:
            answer = await self._call(f"/rosapi/{kind}", {"topic": topic})
            nodes = answer.get(kind) if isinstance(answer, dict) else None
            return convert(nodes, list[str]) if isinstance(nodes, list) else None
        except (BridgeError, ProtocolError):
            return None

    async def time(self) -> float | None:
        """Return the time of the ROS system in seconds, or None without an answer."""
        try:
            answer = await self._call("/rosapi/get_time")
            stamp = answer.get("time") if isinstance(answer, dict) else None
            seconds: float = convert(stamp, Time).seconds
        except (BridgeError, ProtocolError):
            return None
        return seconds

    async def set_parameter(self, name: str, value: Any, patience: float) -> Any:
        """Set a parameter of ROS 1 and return its new value.

        Raises:
            BridgeError: If rosapi does not answer.

        """
        text = json.dumps(value, ensure_ascii=False)
        await self._call(SET_PARAM, {"name": name, "value": text}, timeout=patience)
        # rosapi does not report a parameter that it may not set, so read it.
        answer = await self._call(
            "/rosapi/get_param", {"name": name, "default": ""}, timeout=patience
        )
        now = answer.get("value") if isinstance(answer, dict) else None
        try:
            return json.loads(now) if isinstance(now, str) else None
        except ValueError:
            return now

    async def topics(self) -> dict[str, str]:
        """Return the topics and the type of each.

        In ROS 2 hidden names are missing, such as those of an action's topics. The
        feedback topics of known actions are added, since rosapi reports their servers.

        Raises:
            BridgeError: If rosapi does not answer, or the answer is invalid.

        """
        answer = await self._call("/rosapi/topics")
        try:
            names = convert(answer, _Topics)
            found = dict(zip(names.topics, names.types, strict=True))
        except (ProtocolError, ValueError) as error:
            raise ServiceError(
                f"the answer of /rosapi/topics is invalid: {error}"
            ) from None
        if any("/msg/" in type for type in found.values()):
            found = {**await self._feedbacks(), **found}
        self._types.update({name: type for name, type in found.items() if type})
        return found

    async def _feedbacks(self) -> dict[str, str]:
        """Return the hidden feedback topics of known actions."""
        try:
            answer = await self._call("/rosapi/action_servers")
            servers = convert(answer, _ActionServers).action_servers
        except (BridgeError, ProtocolError):
            return {}
        known = {name: ACTIONS.get(name.rpartition("/")[2]) for name in servers}
        return {
            f"{server}/_action/feedback": f"{type}_FeedbackMessage"
            for server, type in known.items()
            if type is not None
        }

    async def is_ros2(self) -> bool | None:
        """Return whether the types are those of ROS 2; None if unknown."""
        try:
            types = (await self.topics()).values()
        except BridgeError:
            return None
        slashes = {type.count("/") for type in types if type}
        if 2 in slashes:
            return True
        return False if 1 in slashes else None

    async def definitions(self, type: str, kind: str) -> Definitions:
        """Return the definitions of a type and of all its parts, and the included ones.

        A rosapi of ROS 2 may end for ever after a question for definitions, so only a
        bridge that is known to be of ROS 1 is asked.

        Args:
            type: The type.
            kind: ``"msg"``, or ``"srv"`` for the request of a service.

        Raises:
            ServiceError: If rosapi may not be asked, or its answer is invalid.
            BridgeClosed: If there is no connection.

        """
        ros2 = await self.is_ros2()
        if ros2 is not False:
            why = (
                "the bridge is of ROS 2"
                if ros2
                else "it is not known whether the bridge is of ROS 1 or ROS 2"
            )
            raise ServiceError(
                f"{why}, so it is not asked for the fields of {type}, since that can "
                "end its rosapi: write the values into the button's configuration"
            )
        name = str(split_type(type))
        answer = await self._call(QUESTIONS[kind], {"type": name})
        try:
            parts = convert(answer, _RosapiAnswer).typedefs
            if not parts or len(parts) > MAX_PARTS:
                raise ProtocolError(f"got {len(parts)} definitions")
            texts = {part.type: _text(part) for part in parts}
        except (ProtocolError, ValueError) as error:
            raise ServiceError(
                f"the answer of {QUESTIONS[kind]} is invalid: {error}"
            ) from None
        # The first text is that of the type itself; of a service it is named
        # ...Request.
        texts[name] = texts[parts[0].type]
        return Definitions(texts, ros2=False)


class _ActionServers(msgspec.Struct):
    action_servers: list[str]


class _Topics(msgspec.Struct):
    topics: list[str]
    types: list[str]


QUESTIONS = {
    "msg": "/rosapi/message_details",
    "srv": "/rosapi/service_request_details",
}
MAX_PARTS = 100
"""Most definitions in one answer."""


class _Part(msgspec.Struct):
    type: str
    fieldnames: list[str] = []
    fieldtypes: list[str] = []
    fieldarraylen: list[int] = []
    constnames: list[str] = []
    constvalues: list[str] = []


class _RosapiAnswer(msgspec.Struct):
    typedefs: list[_Part]


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
    """Return the type of the field to which a constant most likely belongs.

    rosapi reports the names and values of constants but not their types.
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
