"""Listening to a bridge on a socket of its own."""

import asyncio
import time
from collections.abc import Mapping, Sequence

from webmap.discovery.doctor.frames import FrameListening
from webmap.discovery.doctor.listening import Listening
from webmap.discovery.doctor.observed import Heard
from webmap.discovery.doctor.sampling import ENOUGH, Sampling
from webmap.ros import large, ops
from webmap.ros.events import Publish
from webmap.ros.limits import MAX_FRAME
from webmap.ros.protocol import Protocol

FRAMES_AT_ONCE = 100
"""Messages with frames that the bridge may hold back; each one counts."""


async def listen(
    url: str,
    topics: Mapping[str, str],
    seconds: float,
    tf: Sequence[str] = (),
    frames: FrameListening | None = None,
) -> tuple[str, bool, dict[str, Heard]]:
    """Listen to topics for a while.

    Args:
        url: The bridge's address.
        topics: How each is to be packed: ``none`` or ``cbor``.
        seconds: How long.
        tf: Topics with frames.
        frames: What takes those.

    Returns:
        The address that answered, whether the socket could be compressed, and what
        came on each topic, those with frames too.

    Raises:
        OSError: If the bridge cannot be reached.

    """
    from websockets.asyncio.client import connect
    from websockets.exceptions import ConnectionClosed, WebSocketException

    try:
        async with connect(
            url, max_size=MAX_FRAME, open_timeout=5.0, close_timeout=0.5, proxy=None
        ) as socket:
            peer = socket.remote_address
            deflate = bool(socket.protocol.extensions)
            for topic, packing in topics.items():
                request = ops.subscribe(topic, id=topic, compression=packing)
                await socket.send(request.decode())
            for topic in tf:
                request = ops.subscribe(topic, id=topic, queue_length=FRAMES_AT_ONCE)
                await socket.send(request.decode())
            listening = Listening([*topics, *tf], time.monotonic())
            protocol = Protocol()
            try:
                async with asyncio.timeout(seconds if topics or tf else 0):
                    while True:
                        frame = await socket.recv(decode=False)
                        event = protocol.receive(frame, time.monotonic())
                        if not isinstance(event, Publish):
                            continue
                        if frames is not None and event.topic in tf:
                            frames.received(event)
                        listening.received(event, time.monotonic(), time.time())
            except (TimeoutError, ConnectionClosed):
                pass
            return (
                str(peer[0]) if peer else "",
                deflate,
                listening.end(time.monotonic()),
            )
    except WebSocketException as error:
        raise OSError(str(error)) from None


async def sample(
    url: str, topics: Mapping[str, str], seconds: float, *, in_json: bool = False
) -> dict[str, Heard]:
    """Listen to a few messages of each topic, which may be large.

    Args:
        url: The bridge's address.
        topics: The type of each.
        seconds: How long at the most.
        in_json: Whether to ask for one message of each in JSON, not for CBOR. A bridge
            may take longer than ``seconds`` to encode it.

    Returns:
        What came on each topic.

    Raises:
        OSError: If the bridge cannot be reached.

    """
    from websockets.asyncio.client import connect
    from websockets.exceptions import ConnectionClosed, WebSocketException

    try:
        async with connect(
            url, max_size=MAX_FRAME, open_timeout=5.0, close_timeout=0.5, proxy=None
        ) as socket:
            for topic, type in topics.items():
                request = ops.subscribe(
                    topic,
                    id=topic,
                    type=type,
                    throttle_rate=large.THROTTLE if in_json else 0,
                    compression="none" if in_json else "cbor",
                )
                await socket.send(request.decode())
            enough = 1 if in_json else ENOUGH
            sampling = Sampling(topics, time.monotonic(), enough=enough)
            protocol = Protocol()
            try:
                async with asyncio.timeout(seconds):
                    while not sampling.done:
                        frame = await socket.recv(decode=False)
                        event = protocol.receive(frame, time.monotonic())
                        if not isinstance(event, Publish):
                            continue
                        if sampling.received(event, time.monotonic(), time.time()):
                            leave = ops.unsubscribe(event.topic, id=event.topic)
                            await socket.send(leave.decode())
            except (TimeoutError, ConnectionClosed):
                pass
            return sampling.end(time.monotonic())
    except WebSocketException as error:
        raise OSError(str(error)) from None
