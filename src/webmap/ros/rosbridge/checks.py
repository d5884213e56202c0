"""Checks of a rosbridge itself: where it listens, and what it does under load.

:mod:`~webmap.ros.rosbridge.advice` puts into words what they find.
"""

import asyncio
import ipaddress
import json
import secrets
import struct
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

from webmap.base.errors import BridgeError
from webmap.ros.limits import MAX_FRAME
from webmap.ros.received import ReceivedMessage
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.events import CallService, Publish, ServiceResponse
from webmap.ros.rosbridge.protocol import Protocol

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection

E = TypeVar("E")

PARAMETER = "/rosbridge_websocket:call_services_in_new_thread"
PATIENCE = 3.0
"""Seconds in which rosapi has to tell a parameter."""

TYPE = "std_srvs/Trigger"
QUICK = "/rosapi/get_time"
"""A service that is known to answer."""

TRIES = 6
COMES = 0.5
"""Seconds until our own call has to have come back to us, at each try."""

HANGS = 1.0
"""Seconds for which it is not answered."""


@dataclass(frozen=True, slots=True)
class LinkFacts:
    """What was found out about a rosbridge itself."""

    peer: str = ""
    """The address that answered."""

    listens: tuple[str, ...] = ()
    """Where the bridge listens, if it is on this machine and that is known."""

    deflate: bool = False
    """Whether the bridge would compress its socket."""

    calls_in_threads: bool | None = None
    """Whether calls do not hold up what comes after them, if that is known."""

    tried: bool = False
    """Whether that was tried with a call that hangs, and not only asked."""

    untold: str = ""
    """Why trying it told nothing; empty if it did, or if it was not tried."""

    too_large: Mapping[str, int] = field(default_factory=dict)
    """Bytes of a message in JSON, by topic, where it is too large for CBOR."""


async def look(url: str) -> LinkFacts:
    """Return what a handshake shows of a rosbridge.

    Raises:
        OSError: If the bridge cannot be reached.

    """
    from websockets.asyncio.client import connect
    from websockets.exceptions import WebSocketException

    try:
        async with connect(
            url, open_timeout=5.0, close_timeout=0.5, proxy=None
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
    """Return the facts with what rosbridge says of how it calls services."""
    request = {"name": PARAMETER, "default_value": "", "default": ""}
    try:
        answer = await call_service("/rosapi/get_param", request, timeout=PATIENCE)
    except BridgeError:
        return facts
    value = answer.get("value", "") if isinstance(answer, Mapping) else ""
    threads = {"true": True, "false": False}.get(str(value).lower().strip('"'))
    return replace(facts, calls_in_threads=threads)


async def tried_a_call(facts: LinkFacts, url: str) -> LinkFacts:
    """Return the facts with what a call that hangs holds up; it is tried.

    Args:
        facts: What is known of the bridge.
        url: Its address; its rosapi is known to answer.

    """
    facts = not_tried(facts)
    try:
        free = await try_a_call(url)
    except (OSError, TimeoutError) as error:
        return not_tried(facts, str(error) or type(error).__name__)
    if free is None:
        return not_tried(facts, "the bridge offers no services of its clients")
    return replace(facts, calls_in_threads=free, tried=True, untold="")


def not_tried(
    facts: LinkFacts, why: str = "it takes a rosapi that answers"
) -> LinkFacts:
    """Return the facts where a call could not be tried."""
    if facts.tried:  # what was found out before may be so no more
        facts = replace(facts, calls_in_threads=None, tried=False)
    return replace(facts, untold=why)


def came_in_parts(message: ReceivedMessage) -> bool:
    """Return whether a message came in fragments, as only JSON does.

    A map that was asked for in CBOR and comes so is larger than the bridge sends in
    CBOR.
    """
    return isinstance(message, Publish) and message.in_parts


async def try_a_call(url: str) -> bool | None:
    """Return whether a call that hangs leaves its socket open for others.

    A service of our own is offered to the ROS system, under a name that nobody else
    has, and called: so what hangs, for a moment, is ours, and no node of the robot is
    asked. None if it cannot be told: the bridge offers no services of its clients.

    Args:
        url: The bridge's address; its rosapi is known to answer.

    Raises:
        OSError: If the bridge cannot be reached, or ends the link.

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
        # A bridge takes a moment to offer it, and refuses a call that comes before.
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
            return None  # it does not answer in any case
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
    """Return the addresses at which something on this machine takes a port's links.

    Args:
        port: The port.
        tables: The text of the kernel's tables; they are read if none is given.

    Returns:
        Each once, such as ``0.0.0.0`` for all of this machine; nothing where the
        system does not tell.

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
    """Tell whether only this machine reaches an address."""
    try:
        found = ipaddress.ip_address(address.partition("%")[0])
        return (getattr(found, "ipv4_mapped", None) or found).is_loopback
    except ValueError:
        return address == "localhost"


def _address(text: str) -> str:
    """Read an address as the kernel writes it: words in the machine's own order."""
    words = [text[i : i + 8] for i in range(0, len(text), 8)]
    packed = b"".join(struct.pack("=I", int(word, 16)) for word in words)
    return str(ipaddress.ip_address(packed))


def _read(table: str) -> str:
    try:
        return Path(table).read_text()
    except OSError:
        return ""
