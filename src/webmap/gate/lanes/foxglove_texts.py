"""The operations in JSON that the gate reads from a bridge of Foxglove. No I/O."""

import msgspec
from msgspec import Struct

from webmap.base.errors import ProtocolError
from webmap.gate.lanes.navigation import readable
from webmap.ros.foxglove import protocol

SHORT_TEXT = 1 << 16
"""The longest text that lists neither topics nor services, in bytes."""


class _Op(Struct):
    op: str


class Offer(Struct, rename="camel"):
    """What the gate needs of an offered channel; its definition is left out."""

    id: int
    topic: str
    encoding: str
    schema_name: str = ""


class Advertise(Struct):
    """Topics that the server offers."""

    channels: list[Offer]


class Service(Struct):
    """What the gate needs of an offered service."""

    id: int
    name: str
    type: str = ""


class Services(Struct):
    """Services that the server offers."""

    services: list[Service]


Text = (
    Advertise
    | Services
    | protocol.ServerInfo
    | protocol.Unadvertise
    | protocol.UnadvertiseServices
    | protocol.Status
    | protocol.ServiceCallFailure
)
_LONG: dict[str, type[Text]] = {
    "advertise": Advertise,
    "advertiseServices": Services,
}
_SHORT: dict[str, type[Text]] = {
    "serverInfo": protocol.ServerInfo,
    "unadvertise": protocol.Unadvertise,
    "unadvertiseServices": protocol.UnadvertiseServices,
    "status": protocol.Status,
    "serviceCallFailure": protocol.ServiceCallFailure,
}


def read_text(data: bytes) -> Text | None:
    """Return an operation of a server, if the gate needs it.

    One invalid part makes it invalid as a whole: to find the valid ones of a million
    parts takes seconds, in which no other robot gets a zero.

    Raises:
        ProtocolError: If it is invalid or too long.

    """
    try:
        op = msgspec.json.decode(data, type=_Op).op
        if op in _LONG:
            return msgspec.json.decode(data, type=_LONG[op])
        if op not in _SHORT:
            return None
        if len(data) > SHORT_TEXT:
            raise ProtocolError(f"an operation {op} of {len(data)} bytes")
        return msgspec.json.decode(data, type=_SHORT[op])
    except (ValueError, RecursionError) as error:  # msgspec's own errors, too
        raise ProtocolError(
            f"not Foxglove's protocol: {readable(str(error))}"
        ) from None
