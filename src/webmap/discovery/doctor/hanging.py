"""Trying whether a service that hangs holds up what comes after it on a socket.

A service of our own is offered to the ROS system, under a name that nobody else has,
and called: so what hangs, for a moment, is ours, and no node of the robot is asked.
"""

import asyncio
import json
import secrets
import time
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from webmap.ros import ops
from webmap.ros.events import CallService, ServiceResponse
from webmap.ros.limits import MAX_FRAME
from webmap.ros.protocol import Protocol

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection

E = TypeVar("E")

TYPE = "std_srvs/Trigger"
QUICK = "/rosapi/get_time"
"""A service that is known to answer."""

TRIES = 6
COMES = 0.5
"""Seconds until our own call has to have come back to us, at each try."""

HANGS = 1.0
"""Seconds for which it is not answered."""


async def try_a_call(url: str) -> bool | None:
    """Return whether a call that hangs leaves its socket open for others.

    None if it cannot be told: the bridge offers no services of its clients.

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
