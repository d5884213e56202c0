"""One published message in the encodings that subscribers request."""

import base64
import io
import math
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import cbor2
import msgspec

from webmap.ros.definitions import OCTETS, Field
from webmap.ros.rosbridge.server.dialect import Quirks
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.serialized.writer import serialize

# RFC 8746: typed arrays, little-endian.
_ARRAY_TAGS = {
    "u1": 64,
    "u2": 69,
    "u4": 70,
    "u8": 71,
    "i1": 72,
    "i2": 77,
    "i4": 78,
    "i8": 79,
    "f4": 85,
    "f8": 86,
}
_NAN = msgspec.Raw(b"NaN")


@dataclass(slots=True, eq=False)
class Publication:
    """A message on a topic; each encoding is made once for all subscribers."""

    topic: str
    type: str
    message: dict[str, Any]
    stamp: float
    """When it was published, in seconds since 1970."""

    _forms: dict[str, str | bytes | None] = field(default_factory=dict, init=False)

    def form(self, compression: str, encoder: "Encoder") -> str | bytes | None:
        """Return the frame, or None if this server cannot send that encoding."""
        if compression not in self._forms:
            self._forms[compression] = encoder.publication(self, compression)
        return self._forms[compression]


MAX_MESSAGE_SIZE = 10_000_000
"""The default of ``max_message_size`` in rosbridge_websocket."""


class Encoder:
    """Builds frames in one dialect, with the quirks of one server.

    Args:
        schema: The types.
        quirks: The quirks of the server.
        max_message_size: Bytes above which a server with the quirk ``no_large_cbor``
            sends JSON in parts and no CBOR.

    """

    def __init__(
        self, schema: Schema, quirks: Quirks, max_message_size: int = MAX_MESSAGE_SIZE
    ) -> None:
        self.schema = schema
        self.quirks = quirks
        self.max_message_size = max_message_size
        self._fixed: dict[str, bool] = {}

    def json(self, operation: dict[str, Any]) -> str:
        """Return an operation as JSON; NaN and infinity become ``null``."""
        text = to_json(operation).decode()
        return text.replace("/", "\\/") if self.quirks.escaped_slashes else text

    def publication(
        self, publication: Publication, compression: str
    ) -> str | bytes | None:
        """Return a publication's frame in an encoding, or None if it is never sent."""
        operation = {
            "op": "publish",
            "topic": publication.topic,
            "msg": publication.message,
        }
        if compression == "cbor":
            return self._cbor(operation, publication)
        if compression == "cbor-raw":
            return self._cbor_raw(publication)
        if self.quirks.bare_nan and self.has_fixed_array(publication.type):
            operation["msg"] = _bare_nan(publication.message)
        text = self.json(operation)
        if compression != "png":
            return text
        return None if self.quirks.no_png else self.png(text)

    def _cbor(
        self, operation: dict[str, Any], publication: Publication
    ) -> bytes | None:
        if self.quirks.no_fixed_array_cbor and self.has_fixed_array(publication.type):
            return None
        return to_cbor(operation)

    def _cbor_raw(self, publication: Publication) -> bytes:
        seconds, rest = divmod(round(publication.stamp * 1e9), 1_000_000_000)
        octets = serialize(
            self.schema.fields(publication.type),
            publication.message,
            ros2=self.schema.dialect.is_ros2,
        )
        return cbor2.dumps(
            {
                "op": "publish",
                "topic": publication.topic,
                # Both dialects have secs and nsecs here.
                "msg": {"secs": seconds, "nsecs": rest, "bytes": octets},
            }
        )

    def has_fixed_array(self, type_name: str) -> bool:
        """Return whether a type has, at any depth, a fixed array not of bytes."""
        known = self._fixed.get(type_name)
        if known is None:
            known = _has_fixed_array(self.schema.fields(type_name))
            self._fixed[type_name] = known
        return known

    def png(self, text: str) -> str:
        """Return an operation's JSON packed into the pixels of a PNG."""
        from PIL import Image

        octets = text.encode()
        width = max(math.isqrt(len(octets) // 3), 1)
        height = math.ceil(len(octets) / 3 / width)
        padded = octets.ljust(width * height * 3, b"\n")
        out = io.BytesIO()
        Image.frombytes("RGB", (width, height), padded).save(out, "png")
        return self.json(
            {"op": "png", "data": base64.b64encode(out.getvalue()).decode()}
        )

    def fragments(self, text: str, size: int, identifier: Any = None) -> list[str]:
        """Return a frame in pieces of ``size`` characters, or whole if it fits."""
        if len(text) <= size:
            return [text]
        pieces = [text[start : start + size] for start in range(0, len(text), size)]
        total: float = len(pieces)
        if self.quirks.float_fragments:
            # Meant for an integer division; the count is its floor.
            total = (len(text) - 1) / size + 1
        return [
            self.json(
                {
                    "op": "fragment",
                    "id": 0 if identifier is None else identifier,
                    "data": piece,
                    "num": number,
                    "total": total,
                }
            )
            for number, piece in enumerate(pieces)
        ]


def _has_fixed_array(fields: Sequence[Field]) -> bool:
    return any(
        (bool(field.size) and field.type not in OCTETS)
        or (field.fields is not None and _has_fixed_array(field.fields))
        for field in fields
    )


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):  # an array, of numpy or of the standard library
        return value.tolist()
    raise TypeError(f"a message cannot hold a {type(value)}")


to_json: Callable[[dict[str, Any]], bytes] = msgspec.json.Encoder(
    enc_hook=_plain
).encode
"""Returns an operation in JSON: bytes in base64, and null for NaN and infinities."""


def to_cbor(operation: dict[str, Any]) -> bytes:
    """Return an operation in CBOR, with arrays of numbers as typed arrays."""
    return cbor2.dumps(operation, default=_tag_array)


def _tag_array(encoder: cbor2.CBOREncoder, value: Any) -> None:
    import numpy as np  # an agent may never need it

    if not isinstance(value, np.ndarray | array):
        raise TypeError(f"a message cannot hold a {type(value)}")
    value = np.asarray(value)
    tag = _ARRAY_TAGS.get(value.dtype.str[1:])
    if tag is None:
        raise TypeError(f"no typed array for {value.dtype}")
    little = value.astype(value.dtype.newbyteorder("<"), copy=False)
    encoder.encode(cbor2.CBORTag(tag, little.tobytes()))


def _bare_nan(value: Any) -> Any:
    """Return a message whose fixed arrays contain the token NaN, which JSON lacks."""
    if isinstance(value, dict):
        return {name: _bare_nan(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_NAN if item != item else _bare_nan(item) for item in value]
    return value
