"""The rosapi node: the services with which clients discover a ROS graph."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from webmap.ros.definitions import FLOATS, INTEGERS, TIMES, Field, UnknownType
from webmap.ros.rosbridge.server.dialect import Quirks, canonical, resolve
from webmap.ros.rosbridge.server.graph import Graph, GraphTopic, Respond, ServiceFailed
from webmap.ros.rosbridge.server.schema import Schema

NODE = "/rosapi"

_RULE = "=" * 80
_TIME = re.compile(r"^builtin_interfaces/(Time|Duration)\b", re.MULTILINE)

Args = dict[str, Any]


@dataclass(slots=True)
class Rosapi:
    """Answers discovery, until a quirk hangs it."""

    graph: Graph
    quirks: Quirks
    hung: bool = False

    def start(self) -> None:
        """Add the services to the graph."""
        services: dict[str, tuple[str, Callable[[Args], Any]]] = {
            "topics": ("Topics", self._topics),
            "topics_for_type": ("TopicsForType", self._topics_for_type),
            "topics_and_raw_types": ("TopicsAndRawTypes", self._raw_types),
            "topic_type": ("TopicType", self._topic_type),
            "services": ("Services", self._services),
            "services_for_type": ("ServicesForType", self._services_for_type),
            "service_type": ("ServiceType", self._service_type),
            "service_providers": ("ServiceProviders", self._service_providers),
            "service_request_details": (
                "ServiceRequestDetails",
                partial(self._details, "Request"),
            ),
            "service_response_details": (
                "ServiceResponseDetails",
                partial(self._details, "Response"),
            ),
            "publishers": ("Publishers", self._publishers),
            "subscribers": ("Subscribers", self._subscribers),
            "nodes": ("Nodes", self._nodes),
            "node_details": ("NodeDetails", self._node_details),
            "message_details": ("MessageDetails", partial(self._details, "")),
            "action_servers": ("GetActionServers", self._action_servers),
            "get_time": ("GetTime", self._get_time),
            "get_param": ("GetParam", self._get_param),
            "get_param_names": ("GetParamNames", self._get_param_names),
        }
        if self.graph.schema.dialect.is_ros2:
            services["get_ros_version"] = ("GetROSVersion", self._get_ros_version)
        for name, (type_name, answer) in services.items():
            self._serve(name, type_name, answer)

    def _serve(self, name: str, type_name: str, answer: Callable[[Args], Any]) -> None:
        hangs = self.quirks.hanging_param_names and name == "get_param_names"
        kills = self.quirks.deadly_message_details and name == "message_details"

        def handle(request: Args, respond: Respond) -> None:
            if kills:
                self._die()
            if hangs:
                self.hung = True
            if not (kills or self.hung):
                respond(answer(request))

        self.graph.serve(
            self, f"{NODE}/{name}", f"rosapi/{type_name}", handle, node=NODE
        )

    def _die(self) -> None:
        for name in [s.name for s in self.graph.services.values() if s.owner is self]:
            self.graph.unserve(self, name)

    def _spell(self, type_name: str) -> str:
        return self.graph.schema.dialect.spell(type_name)

    def _listed(self) -> list[GraphTopic]:
        """Return the topics that rosapi lists: in ROS 2, those with a plain name."""
        hides = self.graph.schema.dialect.is_ros2
        return [
            topic
            for topic in self.graph.topics.values()
            if not (hides and "/_" in topic.name)
        ]

    def _topics(self, _: Args) -> Any:
        topics = self._listed()
        return {
            "topics": [topic.name for topic in topics],
            "types": [self._spell(topic.type) for topic in topics],
        }

    def _raw_types(self, _: Args) -> Any:
        texts = [
            definition_text(self.graph.schema, topic.type) for topic in self._listed()
        ]
        return {**self._topics({}), "typedefs_full_text": texts}

    def _topics_for_type(self, request: Args) -> Any:
        type_name = canonical(request["type"])
        return {"topics": [t.name for t in self._listed() if t.type == type_name]}

    def _topic_type(self, request: Args) -> Any:
        name = resolve(request["topic"])
        found = [topic for topic in self._listed() if topic.name == name]
        return {"type": self._spell(found[0].type) if found else ""}

    def _services(self, _: Args) -> Any:
        return {"services": list(self.graph.services)}

    def _services_for_type(self, request: Args) -> Any:
        type_name = canonical(request["type"])
        services = self.graph.services.values()
        return {"services": [s.name for s in services if s.type == type_name]}

    def _service_type(self, request: Args) -> Any:
        service = self.graph.services.get(resolve(request["service"]))
        spell = self.graph.schema.dialect.spell
        return {"type": spell(service.type, "srv") if service else ""}

    def _service_providers(self, request: Args) -> Any:
        service = self.graph.services.get(resolve(request["service"]))
        return {"providers": [service.node] if service else []}

    def _publishers(self, request: Args) -> Any:
        topic = self.graph.topics.get(resolve(request["topic"]))
        return {"publishers": sorted(set(topic.publishers.values())) if topic else []}

    def _subscribers(self, request: Args) -> Any:
        topic = self.graph.topics.get(resolve(request["topic"]))
        nodes = {node for node, _ in topic.subscribers.values()} if topic else set()
        return {"subscribers": sorted(nodes)}

    def _nodes(self, _: Args) -> Any:
        nodes = {service.node for service in self.graph.services.values()}
        for topic in self.graph.topics.values():
            nodes.update(topic.publishers.values())
            nodes.update(node for node, _ in topic.subscribers.values())
        return {"nodes": sorted(nodes)}

    def _node_details(self, request: Args) -> Any:
        node = resolve(request["node"])
        topics = self.graph.topics.values()
        services = self.graph.services.values()
        return {
            "subscribing": sorted(
                t.name for t in topics if node in (n for n, _ in t.subscribers.values())
            ),
            "publishing": sorted(
                t.name for t in topics if node in t.publishers.values()
            ),
            "services": sorted(s.name for s in services if s.node == node),
        }

    def _details(self, part: str, request: Args) -> Any:
        name = f"{canonical(request['type'])}{part}"
        try:
            return {"typedefs": type_definitions(self.graph.schema, name)}
        except UnknownType:
            why = f"Unable to load the type {request['type']}"
            raise ServiceFailed(why) from None

    def _action_servers(self, _: Args) -> Any:
        names = set(self.graph.actions)
        suffix = "/goal"
        for topic in self.graph.topics.values():
            if topic.type.endswith("ActionGoal") and topic.subscribers:
                names.add(topic.name.removesuffix(suffix))
        return {"action_servers": sorted(names)}

    def _get_time(self, _: Args) -> Any:
        return {"time": self.graph.schema.dialect.time(self.graph.clock())}

    def _get_param(self, request: Args) -> Any:
        # There are no parameters; like rosapi, return the default unchanged.
        return {"value": request["default"]}

    def _get_param_names(self, _: Args) -> Any:
        return {"names": []}

    def _get_ros_version(self, _: Args) -> Any:
        return {"version": 2, "distro": "kilted"}


def type_definitions(schema: Schema, type_name: str) -> list[dict[str, Any]]:
    """Return rosapi's definitions of a type and of all types in it.

    Raises:
        UnknownType: If the type is not in the schema.

    """
    return [_definition(schema, name) for name in _closure(schema, type_name)]


def definition_text(schema: Schema, type_name: str) -> str:
    """Return the text of the definitions of a type and of all types in it."""
    first, *others = (name for name in _closure(schema, type_name) if name not in TIMES)
    parts = [_text(schema, first)]
    parts += [f"{_RULE}\nMSG: {name}\n{_text(schema, name)}" for name in others]
    return "\n".join(parts)


def _closure(schema: Schema, type_name: str) -> list[str]:
    found = [canonical(type_name)]
    for name in found:
        for field in _fields(schema, name):
            is_part = field.fields is not None or field.type in TIMES
            if is_part and field.type not in found:
                found.append(field.type)
    return found


def _fields(schema: Schema, name: str) -> tuple[Field, ...]:
    if name not in TIMES:
        return schema.fields(name)
    whole, rest = schema.dialect.time(0)
    return Field(whole, "int32"), Field(
        rest, "uint32" if schema.dialect.is_ros2 else "int32"
    )


def _spell(schema: Schema, name: str) -> str:
    # Definitions have pkg/Name in both dialects.
    if name in TIMES and schema.dialect.is_ros2:
        return f"builtin_interfaces/{name.capitalize()}"
    return name


def _definition(schema: Schema, name: str) -> dict[str, Any]:
    fields = _fields(schema, name)
    constants = () if name in TIMES else schema.definition(name).constants
    return {
        "type": _spell(schema, name),
        "fieldnames": [field.name for field in fields],
        "fieldtypes": [_spell(schema, field.type) for field in fields],
        # -1 is a single value here, 0 a sequence.
        "fieldarraylen": [
            (field.size or 0) if field.is_array else -1 for field in fields
        ],
        "examples": [_example(field) for field in fields],
        "constnames": [each.name for each in constants],
        "constvalues": [str(each.value) for each in constants],
    }


def _example(field: Field) -> str:
    if field.is_array:
        return "[]"
    if field.type == "string":
        return ""
    if field.type == "bool":
        return "False"
    if field.type in FLOATS:
        return "0.0"
    return "0" if field.type in INTEGERS else "{}"


def _text(schema: Schema, name: str) -> str:
    text = schema.text(name).strip() + "\n"
    if schema.dialect.is_ros2:
        return text
    return _TIME.sub(lambda match: match[1].lower(), text)
