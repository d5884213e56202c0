"""Messages as ROS itself puts them on its wire: ROS 1 serialisation and CDR."""

import struct
from typing import Any

import numpy as np

from webmap.sim.rosbridge.schema import DTYPES, TIMES, Field, Schema

_CDR_LITTLE_ENDIAN = b"\x00\x01\x00\x00"


def serialize(schema: Schema, type_name: str, message: dict[str, Any]) -> bytes:
    """Return a message's bytes in the serialisation of the schema's dialect."""
    writer = _Writer(schema)
    writer.message(type_name, message)
    body = bytes(writer.out)
    return _CDR_LITTLE_ENDIAN + body if schema.dialect.is_ros2 else body


class _Writer:
    def __init__(self, schema: Schema) -> None:
        self.schema = schema
        self.cdr = schema.dialect.is_ros2
        self.out = bytearray()

    def message(self, type_name: str, message: dict[str, Any]) -> None:
        fields = self.schema.fields(type_name)
        if self.cdr and not fields:
            self.out.append(0)  # CDR has no empty structure
        for field in fields:
            self._field(field, message[field.name])

    def _field(self, field: Field, value: Any) -> None:
        if field.length is None:
            self._scalar(field.type, value)
            return
        if field.length < 0:
            self._scalar("uint32", len(value))
        if field.type in DTYPES:
            self._numbers(field.type, value)
            return
        for item in value:
            self._scalar(field.type, item)

    def _numbers(self, type_name: str, values: Any) -> None:
        dtype = np.dtype(DTYPES[type_name])
        if len(values):
            self._align(dtype.itemsize)
        if isinstance(values, bytes):
            self.out += values
        else:
            self.out += np.asarray(values, dtype).tobytes()

    def _scalar(self, type_name: str, value: Any) -> None:
        if type_name == "string":
            octets = value.encode() + (b"\x00" if self.cdr else b"")
            self._scalar("uint32", len(octets))
            self.out += octets
        elif type_name == "bool":
            self.out.append(bool(value))
        elif type_name in TIMES:
            self._align(4)
            self.out += struct.pack("<iI", *value.values())
        elif type_name in DTYPES:
            dtype = np.dtype(DTYPES[type_name])
            self._align(dtype.itemsize)
            self.out += np.array(value, dtype).tobytes()
        else:
            self.message(type_name, value)

    def _align(self, size: int) -> None:
        if self.cdr:
            self.out += bytes(-len(self.out) % size)
