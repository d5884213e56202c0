"""Checks of a rosbridge itself: its listening addresses, and its behaviour under load.

:mod:`~webmap.ros.rosbridge.advice` describes the results.
"""

import asyncio
import ipaddress
import json
import secrets
import struct
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

from webmap.base.errors import BridgeError
from webmap.ros.limits import MAX_FRAME
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.events import CallService, Publish, ServiceResponse
from webmap.ros.rosbridge.protocol import Protocol

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection

E = TypeVar("E")

PARAMETER = "/rosbridge_websocket:call_services_in_new_thread"
PATIENCE = 3.0
"""Longest wait for a parameter from rosapi, in seconds."""

TYPE = "std_srvs/Trigger"
QUICK = "/rosapi/get_time"
"""A service that is known to respond."""

TRIES = 6
COMES = 0.5
"""Longest wait for WebMap's own call to come back, at each try, in seconds."""

HANGS = 1.0
"""Seconds for which that call stays unanswered."""


@dataclass(frozen=True, slots=True)
class LinkFacts:
    """The results of the checks of a rosbridge."""

    peer: str = ""
    """The address that answered."""

    listens: tuple[str, ...] = ()
    """Listening addresses of the bridge, if known and on this machine."""

    deflate: bool = False
    """Whether the bridge offers compression of its socket."""

    calls_in_threads: bool | None = None
    """Whether slow calls do not delay later operations; None if unknown."""

    tried: bool = False
    """Whether a hanging call was tried, and not only the parameter read."""

    no_result: str = ""
    """Why the try gave no result; empty if it did, or if there was none."""

    too_large: Mapping[str, int] = field(default_factory=dict)
    """Bytes of a message in JSON, by topic, if it is too large for CBOR."""


async def look(url: str, subprotocols: Sequence[str] = ()) -> LinkFacts:
    """Return the facts that a WebSocket handshake shows of a bridge.

    Args:
        url: Its ``ws`` or ``wss`` address.
        subprotocols: The subprotocols to offer.

    Raises:
        OSError: If the bridge cannot be reached.

    """
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException
    from websockets.typing import Subprotocol

    try:
        async with connect(
            url,
            subprotocols=[Subprotocol(name) for name in subprotocols] or None,
            open_timeout=5.0,
            close_timeout=0.5,
            proxy=None,
        ) as socket:
            address = socket.remote_address
            peer = str(address[0]) if address else ""
            deflate = bool(socket.protocol.extensions)
    except WebSocketException as error:
        raise OSError(str(error)) from None
    port = urlsplit(url).port
    listens = listening_addresses(port) if port and is_loopback(peer) else ()
    return LinkFacts(peer, listens, deflate)


async def asked_about_threads(
    facts: LinkFacts, call_service: Callable[..., Awaitable[Any]]
) -> LinkFacts:
    """Return the facts with rosbridge's parameter for calls in threads."""
    request = {"name": PARAMETER, "default_value": "", "default": ""}
    try:
        answer = await call_service("/rosapi/get_param", request, timeout=PATIENCE)
    except BridgeError:
        return facts
    value = answer.get("value", "") if isinstance(answer, Mapping) else ""
    threads = {"true": True, "false": False}.get(str(value).lower().strip('"'))
    return replace(facts, calls_in_threads=threads)


async def tried_a_call(facts: LinkFacts, url: str) -> LinkFacts:
    """Make a call that hangs, and return the facts with what it delays.

    Args:
        facts: The known facts of the bridge.
        url: Its address; its rosapi is known to respond.

    """
    try:
        free = await try_a_call(url)
    except (OSError, TimeoutError) as error:
        return not_tried(facts, str(error) or type(error).__name__)
    if free is None:
        return not_tried(facts, "the bridge offers no services of its clients")
    return replace(facts, calls_in_threads=free, tried=True, no_result="")


def not_tried(facts: LinkFacts, why: str = "rosapi does not answer") -> LinkFacts:
    """Return the facts after a call could not be tried."""
    if facts.tried:  # the earlier result may be outdated
        facts = replace(facts, calls_in_threads=None, tried=False)
    return replace(facts, no_result=why)


def came_in_parts(message: ReceivedMessage) -> bool:
    """Return whether a message came in fragments; only JSON does.

    A map that was requested in CBOR and comes in fragments is larger than the bridge
    sends in CBOR.
    """
    return isinstance(message, Publish) and message.in_parts


async def try_a_call(url: str) -> bool | None:
    """Return whether a call that hangs leaves its socket free for other calls.

    WebMap advertises a service under a unique name and calls it. So the call that hangs
    for a moment is WebMap's own, and no node of the robot is involved. None if the
    result is unknown: the bridge offers no services of its clients.

    Args:
        url: The bridge's address; its rosapi is known to respond.

    Raises:
        OSError: If the bridge cannot be reached, or ends the connection.

    """
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException

    service = f"/webmap_doctor_{secrets.token_hex(6)}"
    link = partial(connect, url, max_size=MAX_FRAME, close_timeout=0.5, proxy=None)
    try:
        async with link() as ours, link() as caller:
            return await _try(ours, caller, service)
    except WebSocketException as error:
        raise OSError(str(error)) from None


async def _try(
    ours: "ClientConnection", caller: "ClientConnection", service: str
) -> bool | None:
    offer = {"op": "advertise_service", "type": TYPE, "service": service}
    await ours.send(json.dumps(offer))
    try:
        # A bridge needs a moment to offer the service, and refuses earlier calls.
        for number in range(TRIES):
            call = ops.call_service(service, id=f"hanging {number}")
            await caller.send(call.decode())
            asked = await _next(ours, CallService, COMES)
            if asked is not None:
                break
        else:
            return None
        await caller.send(ops.call_service(QUICK, id="quick").decode())
        free = await _is_answered(caller, "quick")
        answer = ops.service_response(
            service,
            {"success": False, "message": "tried by webmap doctor"},
            id=None if asked.id is None else str(asked.id),
            result=True,
        )
        await ours.send(answer.decode())
        if not free and not await _is_answered(caller, "quick"):
            return None  # it never answers, hanging call or not
        return free
    finally:
        await ours.send(json.dumps({"op": "unadvertise_service", "service": service}))


async def _is_answered(link: "ClientConnection", id: str) -> bool:
    deadline = time.monotonic() + HANGS
    while (left := deadline - time.monotonic()) > 0:
        answer = await _next(link, ServiceResponse, left)
        if answer is not None and answer.id == id:
            return True
    return False


async def _next(link: "ClientConnection", kind: type[E], within: float) -> E | None:
    """Return the next event of a kind, None if none comes in time."""
    protocol = Protocol()
    try:
        async with asyncio.timeout(within):
            while True:
                event = protocol.receive(await link.recv(), time.monotonic())
                if isinstance(event, kind):
                    return event
    except TimeoutError:
        return None


TABLES = ("/proc/net/tcp", "/proc/net/tcp6")
_LISTENS = "0A"


def listening_addresses(port: int, tables: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the addresses on which this machine listens at a port.

    Args:
        port: The port.
        tables: The text of the kernel's tables; they are read if none is given.

    Returns:
        Each address once, such as ``0.0.0.0`` for all of this machine; empty if the
        system does not report them.

    """
    found: dict[str, None] = {}
    for table in tables or map(_read, TABLES):
        for line in table.splitlines()[1:]:
            fields = line.split()
            try:
                address, _, number = fields[1].partition(":")
                if fields[3] == _LISTENS and int(number, 16) == port:
                    found[_address(address)] = None
            except (IndexError, ValueError, struct.error):
                continue
    return tuple(found)


def is_loopback(address: str) -> bool:
    """Return whether only this machine can reach an address."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
        return (getattr(found, "ipv4_mapped", None) or found).is_loopback
    except ValueError:
        return address == "localhost"


def _address(text: str) -> str:
    """Parse an address of the kernel's tables, 32-bit groups in native byte order."""
    groups = [text[i : i + 8] for i in range(0, len(text), 8)]
    packed = b"".join(struct.pack("=I", int(group, 16)) for group in groups)
    return str(ipaddress.ip_address(packed))


def _read(table: str) -> str:
    try:
        return Path(table).read_text()
    except OSError:
        return ""
