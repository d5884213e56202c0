"""Messages in the encodings of a Foxglove server, read and written by their schemas."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, cast, get_args

import msgspec

from webmap.base.errors import ConfigError, ProtocolError
from webmap.ros.decoding import check_depth, decode_json
from webmap.ros.definitions import Definitions, shipped
from webmap.ros.foxglove.protocol import PAYLOAD, Channel, MessageSchema
from webmap.ros.names import is_topic, ros2_type, split_type
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.rosbridge.events import check_count
from webmap.ros.serialized.reader import make_reader
from webmap.ros.serialized.schemas import (
    Encoding,
    Schema,
    SchemaEncoding,
    read_schema,
    texts_in,
)
from webmap.ros.serialized.type_hash import check_hash
from webmap.ros.serialized.writer import make_writer

_SCHEMAS: dict[str, SchemaEncoding] = {"cdr": "ros2msg", "ros1": "ros1msg"}
"""The usual language of schemas, by the encoding of the messages."""

TYPE_HASH = "rihs01"
"""In place of the language of a schema: the schema is only the hash of the type."""

SERIALIZED = tuple(_SCHEMAS)
"""The encodings in which WebMap writes to a server, the preferred one first."""


class Format:
    """The encoding of the messages of one type, and the type's schema.

    Args:
        type: The name of the type.
        encoding: ``cdr``, ``ros1`` or ``json``.
        schema_encoding: The language of the schema; None for the usual one.
        text: The schema; None for the definition that is included in WebMap.

    """

    def __init__(
        self, type: str, encoding: str, schema_encoding: str | None, text: str | None
    ) -> None:
        self.arguments = (type, encoding, schema_encoding, text)
        self.type = type
        self.encoding = encoding
        self._schema_encoding = schema_encoding or _SCHEMAS.get(encoding, "")
        self._text = text
        self._readers: dict[Any, Callable[[bytes | bytearray], Any] | str] = {}

    def read(
        self, data: bytes | bytearray, wanted: type[msgspec.Struct] | None = None
    ) -> Any:
        """Return a message as ``wanted``, or as a plain dict.

        Raises:
            ProtocolError: If the schema is invalid, or the bytes do not fit it.

        """
        reader = self._readers.get(wanted)
        if reader is None:
            reader = self._readers[wanted] = self._make_reader(wanted)
        if isinstance(reader, str):
            raise ProtocolError(reader)
        return reader(data)

    def write(self, message: Mapping[str, Any] | Sequence[Any] | None) -> bytes:
        """Return a message as bytes; a sequence has the values in the schema's order.

        Raises:
            ConfigError: If the schema is invalid, or the message does not fit it.

        """
        if self.encoding == "json":
            return json.dumps(message or {}, allow_nan=False).encode()
        schema = self.schema
        if not isinstance(message, Mapping):
            names = [field.name for field in schema.fields]
            message = dict(zip(names, message or (), strict=False))
        return make_writer(schema, cast(Encoding, self.encoding))(message)

    @property
    def schema(self) -> Schema:
        """The schema; ConfigError if it is invalid."""
        language, text = self._schema_encoding, self._text
        if language == TYPE_HASH:
            check_hash(self.type, text or "")
            language, text = "ros2msg", None
        # Checked there: any other text is refused with an error.
        return read_schema(self.type, cast(SchemaEncoding, language), text)

    @property
    def has_schema(self) -> bool:
        """Whether there is a schema that can be read."""
        try:
            return bool(self.schema)
        except ConfigError:
            return False

    @property
    def definitions(self) -> Definitions:
        """The definitions of the type and of its parts; ConfigError if not readable."""
        language, name = self._schema_encoding or "", str(split_type(self.type))
        if language == TYPE_HASH:
            return shipped(ros2=True)
        texts = texts_in(self._text or "", language, name)
        return Definitions(texts, ros2=language != "ros1msg")

    def _make_reader(
        self, wanted: type[msgspec.Struct] | None
    ) -> Callable[[bytes | bytearray], Any] | str:
        if self.encoding == "json":
            return lambda data: _read_json(data, wanted)
        try:
            return make_reader(self.schema, wanted, cast(Encoding, self.encoding))
        except (ConfigError, ProtocolError) as error:
            return f"the bridge's schema of {self.type} cannot be used: {error}"


def _read_json(data: bytes | bytearray, wanted: type[msgspec.Struct] | None) -> Any:
    value = decode_json(data, wanted or dict[str, Any])
    if wanted is None:
        check_depth(value)
    return value


format_of = lru_cache(maxsize=4096)(Format)
"""Returns the format for its arguments; the same one for the same arguments."""


def is_readable(channel: Channel) -> bool:
    """Return whether a channel has messages of ROS that WebMap can read."""
    known = channel.encoding == "json" or (
        channel.encoding in _SCHEMAS
        and channel.schema_encoding in (*get_args(SchemaEncoding), TYPE_HASH, None, "")
    )
    return known and is_topic(channel.topic) and _is_type(channel.schema_name)


def _is_type(name: str) -> bool:
    try:
        split_type(name)
    except ConfigError:
        return False
    return True


def format_of_channel(channel: Channel) -> Format:
    """Return the format of the messages of a channel."""
    # A bridge without a definition of a type offers the channel without a schema.
    text = channel.schema or None
    return format_of(
        channel.schema_name, channel.encoding, channel.schema_encoding, text
    )


def format_of_part(
    part: MessageSchema | None, name: str, encodings: Sequence[str]
) -> Format:
    """Return the format of the request or the response of a service.

    Args:
        part: The description of the server; None if there is none.
        name: The name of the part's type.
        encodings: The encodings that the server accepts.

    Raises:
        ConfigError: If none of the encodings is known.

    """
    given = part.encoding if part is not None else None
    encoding = given or next((each for each in SERIALIZED if each in encodings), None)
    if encoding is None or encoding not in (*SERIALIZED, "json"):
        got = encoding or ", ".join(encodings) or "not stated"
        raise ConfigError(
            f"the encoding of {name} is {got}; expected cdr, ros1 or json"
        )
    if part is None:
        return format_of(name, encoding, None, None)
    return format_of(name, encoding, part.schema_encoding, part.schema)


def own_channel(id: int, topic: str, type: str, encodings: Sequence[str]) -> Channel:
    """Return a channel on which this client publishes, in the server's dialect.

    JSON is never used: bridges of ROS 2 before 3.5 publish wrong bytes for it.

    Raises:
        ConfigError: If the server accepts no encoding in which WebMap writes, or the
            fields of the type are not known.

    """
    encoding = next((each for each in SERIALIZED if each in encodings), None)
    if encoding is None:
        raise ConfigError(
            f"the bridge accepts messages in {', '.join(encodings) or 'no encoding'}; "
            f"WebMap publishes in {' or '.join(SERIALIZED)}"
        )
    ros2 = encoding == "cdr"
    name = ros2_type(type) if ros2 else str(split_type(type))
    return Channel(id, topic, encoding, name, "", _SCHEMAS[encoding])


def included_text(type: str, *, ros2: bool) -> str:
    """Return the definition of a type and of its parts, as included in WebMap.

    Raises:
        ConfigError: If the fields of the type are not known.

    """
    known, name = shipped(ros2), str(split_type(type))
    texts = {name: known.text(known.definition(name).name)}
    waiting = list(known.definition(name).fields)
    while waiting:
        field = waiting.pop()
        if field.fields is not None and field.type not in texts:
            texts[field.type] = known.text(field.type)
            waiting += field.fields
    first, *others = texts.items()
    parts = [first[1], *(f"MSG: {each}\n{text}" for each, text in others)]
    return f"\n{'=' * 80}\n".join(parts)


class FoxgloveMessage(ReceivedMessage):
    """A message of a channel.

    Args:
        topic: The topic.
        frame: The frame of message data.
        arguments: Those of the message's format, if that is not given.
        format: The format.

    """

    __slots__ = ("format",)

    def __init__(
        self,
        topic: str,
        frame: bytes | bytearray,
        *arguments: Any,
        format: Format | None = None,
    ) -> None:
        super().__init__(topic, frame)
        self.format = format or format_of(*arguments)

    @property
    def arguments(self) -> tuple[str | None, ...]:
        """What makes the format of the message in another process."""
        return self.format.arguments

    @property
    def is_binary(self) -> bool:
        """Whether the message is not text."""
        return self.format.encoding != "json"

    @property
    def payload(self) -> bytes | bytearray:
        """The message as the robot's node sent it, without the head of the frame."""
        return self.frame[PAYLOAD:]

    @property
    def serialized(self) -> tuple[Schema, bytes | bytearray] | None:
        """The message as the node sent it; None for JSON and for an invalid schema."""
        if not self.is_binary or not self.format.has_schema:
            return None
        return self.format.schema, self.payload

    def check_count(self) -> None:
        """Check the number of values in JSON; a reader of the others counts them."""
        if not self.is_binary:
            check_count(self.payload)

    def _decode(self, type: type[msgspec.Struct] | None) -> Any:
        return self.format.read(self.payload, type)


class RawMessage(FoxgloveMessage):
    """A message for listeners that asked for the serialized bytes."""

    def _decode(self, type: type[msgspec.Struct] | None) -> Any:
        stamp = int.from_bytes(self.frame[5:PAYLOAD], "little")
        secs, nsecs = divmod(stamp, 10**9)
        return {"secs": secs, "nsecs": nsecs, "bytes": self.payload}
