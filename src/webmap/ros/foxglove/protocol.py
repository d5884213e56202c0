"""The client's half of the Foxglove WebSocket protocol, without I/O.

The frames of its two subprotocols are the same. Servers of ``foxglove.websocket.v1``,
such as ``foxglove_bridge`` up to 0.8.5, the only one for ROS 1, describe the request of
a service in other fields; :class:`Service` has both forms in one.

See Also:
    https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md (in its history), and
    https://github.com/foxglove/foxglove-sdk

"""

import struct
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, TypeAlias, TypeVar

import msgspec
from msgspec import UNSET, Meta, Struct

from webmap.base.errors import ProtocolError
from webmap.base.nesting import MAX_DEPTH, is_too_deep

SUBPROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
"""The subprotocols to offer in the handshake; each server accepts exactly one."""

MAX_TEXT = 32 << 20
"""Most bytes of an operation in JSON; 10,000 channels with their schemas have less."""

MESSAGE_DATA, TIME, SERVICE_CALL_RESPONSE = 1, 2, 3
"""The opcodes of the server's binary frames."""

_CLIENT_MESSAGE_DATA, _SERVICE_CALL_REQUEST = 1, 2

_MESSAGE = struct.Struct("<BIQ")
_TIME = struct.Struct("<BQ")
_CALL = struct.Struct("<BIII")
_CLIENT_MESSAGE = struct.Struct("<BI")

PAYLOAD = _MESSAGE.size
"""Where the message begins in a frame of message data."""

_TEXT_BEGINS = ord("{")

Id: TypeAlias = Annotated[int, Meta(ge=0)]
Id32: TypeAlias = Annotated[int, Meta(ge=0, lt=1 << 32)]

T = TypeVar("T")


class Channel(Struct, frozen=True, rename="camel"):
    """A topic that the server offers, in one encoding."""

    id: Id
    topic: str
    encoding: str
    """Of the messages: ``cdr``, ``ros1``, ``json`` or another one."""
    schema_name: str = ""
    """The message type."""
    schema: str = ""
    schema_encoding: str | None = None
    """Of the schema: ``ros2msg``, ``ros2idl``, ``ros1msg``, ``jsonschema`` or another
    one; None if it follows from ``encoding``."""


class MessageSchema(Struct, frozen=True, rename="camel"):
    """The request or the response of a service."""

    schema_name: str
    schema: str = ""
    encoding: str | None = None
    """None if the server did not name it: that of its ``supportedEncodings``."""
    schema_encoding: str | None = None


class Service(Struct, rename="camel"):
    """A service that the server offers; None where it gave no schema."""

    id: Id32
    name: str
    type: str = ""
    request: MessageSchema | None = None
    response: MessageSchema | None = None
    request_schema: str | None = None
    """Of older servers, which is moved to ``request``."""
    response_schema: str | None = None

    def __post_init__(self) -> None:
        """Bring the descriptions of older servers into the form of newer ones."""
        asked, answered = self.request_schema, self.response_schema
        self.request_schema = self.response_schema = None
        if self.request is None and asked is not None:
            self.request = MessageSchema(f"{self.type}_Request", asked)
        if self.response is None and answered is not None:
            self.response = MessageSchema(f"{self.type}_Response", answered)


class ServerInfo(Struct, frozen=True, rename="camel"):
    """The first message of a server."""

    name: str = ""
    capabilities: list[str] = []
    supported_encodings: list[str] | None = None
    """Encodings for messages of clients and for calls of services."""
    metadata: dict[str, str] | None = None


class Status(Struct, frozen=True):
    """A remark of the server for people."""

    message: str
    level: int = 0
    """0 for information, 1 for a warning, 2 for an error."""
    id: str | None = None


class Advertise(Struct, frozen=True):
    """Channels that are new."""

    channels: list[Channel]
    faults: list[str]
    """Why channels that are not in the list could not be read, one text for each."""


class Unadvertise(Struct, frozen=True, rename="camel"):
    """Channels that have ended."""

    channel_ids: list[int]


class AdvertiseServices(Struct, frozen=True):
    """Services that are new."""

    services: list[Service]
    faults: list[str]
    """Why services that are not in the list could not be read, one text for each."""


class UnadvertiseServices(Struct, frozen=True, rename="camel"):
    """Services that have ended."""

    service_ids: list[int]


class Parameter(Struct, frozen=True, omit_defaults=True):
    """A parameter; one without a value does not exist, or is to be removed."""

    name: str
    value: Any = UNSET
    type: str | None = None
    """``byte_array`` (base64), ``float64`` or ``float64_array``, else None."""


class ParameterValues(Struct, frozen=True):
    """The values of parameters."""

    parameters: list[Parameter]
    id: str | None = None
    """That of the request."""


class TopicNodes(Struct, frozen=True, rename="camel"):
    """The nodes that publish or subscribe to a topic, in place of those before."""

    name: str
    publisher_ids: list[str] = []
    subscriber_ids: list[str] = []


class ConnectionGraphUpdate(Struct, frozen=True, rename="camel"):
    """The changes of the graph of nodes that WebMap uses."""

    published_topics: list[TopicNodes] = []
    subscribed_topics: list[TopicNodes] = []
    removed_topics: list[str] = []


class ServiceCallFailure(Struct, frozen=True, rename="camel"):
    """A call that failed."""

    call_id: int
    message: str = ""


class MessageData(Struct, frozen=True):
    """A message of a subscription; it begins at :data:`PAYLOAD` of its frame."""

    subscription_id: int
    time: int
    """When the server received it, in nanoseconds since 1970, on the server's clock."""


class Time(Struct, frozen=True):
    """The server's time."""

    time: int
    """Nanoseconds since 1970, or of a simulator."""


class ServiceCallResponse(Struct, frozen=True):
    """The response to a call."""

    service_id: int
    call_id: int
    encoding: str
    payload: bytes


class Unknown(Struct, frozen=True):
    """An operation that this client does not know, such as one of a later server."""

    op: str


class Malformed(Struct, frozen=True):
    """Bytes that are not Foxglove's protocol; the connection can still be used."""

    reason: str
    size: int
    """Bytes of the frame."""


Event: TypeAlias = (
    ServerInfo
    | Status
    | Advertise
    | Unadvertise
    | AdvertiseServices
    | UnadvertiseServices
    | ParameterValues
    | ConnectionGraphUpdate
    | ServiceCallFailure
    | MessageData
    | Time
    | ServiceCallResponse
    | Unknown
    | Malformed
)


class _Op(Struct):
    op: str


class _Channels(Struct):
    channels: list[msgspec.Raw]


class _Services(Struct):
    services: list[msgspec.Raw]


_PLAIN: dict[str, type[Any]] = {
    "serverInfo": ServerInfo,
    "status": Status,
    "unadvertise": Unadvertise,
    "unadvertiseServices": UnadvertiseServices,
    "parameterValues": ParameterValues,
    "connectionGraphUpdate": ConnectionGraphUpdate,
    "serviceCallFailure": ServiceCallFailure,
}


def receive(frame: bytes | bytearray) -> Event:
    """Return what a frame of a server says; this never raises.

    A server sends operations in JSON as text and all else as binary frames. Text begins
    with a brace, and no binary frame does.
    """
    try:
        return _read(frame)
    except (ProtocolError, msgspec.MsgspecError, ValueError, RecursionError) as error:
        return Malformed(str(error), len(frame))


def _read(frame: bytes | bytearray) -> Event:
    if not frame:
        raise ProtocolError("an empty frame")
    code = frame[0]
    if code == MESSAGE_DATA:
        _check_length(frame, PAYLOAD, "message data")
        _, subscription, time = _MESSAGE.unpack_from(frame)
        return MessageData(subscription, time)
    if code == _TEXT_BEGINS or frame[:64].lstrip().startswith(b"{"):
        return _read_text(frame)
    if code == TIME:
        _check_length(frame, _TIME.size, "a time")
        return Time(_TIME.unpack_from(frame)[1])
    if code == SERVICE_CALL_RESPONSE:
        return _read_response(frame)
    return Unknown(f"binary operation {code}")


def _read_text(text: bytes | bytearray) -> Event:
    if len(text) > MAX_TEXT:
        raise ProtocolError(
            f"an operation of {len(text)} bytes of JSON; the limit is {MAX_TEXT}"
        )
    op = msgspec.json.decode(text, type=_Op).op
    if op == "advertise":
        found = msgspec.json.decode(text, type=_Channels).channels
        return Advertise(*_each(found, Channel))
    if op == "advertiseServices":
        found = msgspec.json.decode(text, type=_Services).services
        return AdvertiseServices(*_each(found, Service))
    if op not in _PLAIN:
        return Unknown(op[:64])
    event: Event = msgspec.json.decode(text, type=_PLAIN[op])
    if isinstance(event, ParameterValues) and any(
        is_too_deep(each.value) for each in event.parameters
    ):
        raise ProtocolError(f"a parameter nested deeper than {MAX_DEPTH} levels")
    return event


def _each(parts: list[msgspec.Raw], type: type[T]) -> tuple[list[T], list[str]]:
    """Return the parts of a list that can be read, and why the others cannot."""
    good, faults = [], []
    for part in parts:
        try:
            good.append(msgspec.json.decode(part, type=type))
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            faults.append(f"{error}: {bytes(memoryview(part)[:80])!r}")
    return good, faults


def _read_response(frame: bytes | bytearray) -> ServiceCallResponse:
    _check_length(frame, _CALL.size, "a service call response")
    _, service, call, length = _CALL.unpack_from(frame)
    start = _CALL.size + length
    _check_length(frame, start, "a service call response")
    encoding = frame[_CALL.size : start].decode()
    return ServiceCallResponse(service, call, encoding, bytes(frame[start:]))


def _check_length(frame: bytes | bytearray, least: int, name: str) -> None:
    if len(frame) < least:
        raise ProtocolError(f"{name} of {len(frame)} bytes; expected at least {least}")


# Operations of the client. Those in JSON are sent as text, the others as binary frames.


def subscribe(channels: Mapping[int, int]) -> bytes:
    """Return the operation in JSON that begins subscriptions.

    A client may have one subscription for each channel.

    Args:
        channels: The channels, each by the id of its subscription.

    """
    pairs = [{"id": id, "channelId": channel} for id, channel in channels.items()]
    return operation("subscribe", subscriptions=pairs)


def unsubscribe(ids: Iterable[int]) -> bytes:
    """Return the operation in JSON that ends subscriptions."""
    return operation("unsubscribe", subscriptionIds=list(ids))


def advertise(channels: Iterable[Channel]) -> bytes:
    """Return the operation in JSON that offers topics of this client."""
    return operation("advertise", channels=list(channels))


def unadvertise(ids: Iterable[int]) -> bytes:
    """Return the operation in JSON that withdraws topics of this client."""
    return operation("unadvertise", channelIds=list(ids))


def message(channel: int, payload: bytes) -> bytes:
    """Return the binary frame with a message on a topic of this client."""
    return _CLIENT_MESSAGE.pack(_CLIENT_MESSAGE_DATA, channel) + payload


def call_service(service: int, call: int, encoding: str, request: bytes) -> bytes:
    """Return the binary frame that calls a service.

    Args:
        service: The service's id.
        call: A number of the client that comes back with the response.
        encoding: The encoding of the request.
        request: The encoded request.

    """
    name = encoding.encode()
    head = _CALL.pack(_SERVICE_CALL_REQUEST, service, call, len(name))
    return head + name + request


def set_parameters(parameters: Iterable[Parameter], id: str) -> bytes:
    """Return the operation in JSON that sets parameters."""
    return operation("setParameters", parameters=list(parameters), id=id)


def subscribe_connection_graph() -> bytes:
    """Return the operation in JSON that asks for changes of the graph of nodes."""
    return operation("subscribeConnectionGraph")


def operation(op: str, **fields: Any) -> bytes:
    """Return an operation in JSON."""
    return msgspec.json.encode({"op": op, **fields})
