"""Looking at a bridge: a thin shell around sockets and clocks.

Nothing is published, and only those services of rosapi are called that were seen to
answer on every bridge. ``get_param_names``, which hangs rosapi for ROS 2, and
``message_details``, which ends it, are never called.
"""

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from webmap.discovery.asking import ask_topics
from webmap.discovery.doctor.frames import FrameListening
from webmap.discovery.doctor.listening import Listening
from webmap.discovery.doctor.observed import Clock, Heard, Observed, Way
from webmap.discovery.found import Findings
from webmap.discovery.robots import discover, host_name
from webmap.errors import BridgeClosed, BridgeError
from webmap.ros import ops
from webmap.ros.calls import Calls
from webmap.ros.decoding import convert
from webmap.ros.events import Publish
from webmap.ros.messages import Time
from webmap.ros.protocol import MAX_FRAME, Protocol

MOST_ROBOTS = 10
"""How many robots are listened to."""

PATIENCE = 3.0
PARAMETER = "/rosbridge_websocket:call_services_in_new_thread"


async def observe(
    url: str,
    *,
    wait: float = 0.0,
    seconds: float = 3.0,
    ask_parameters: bool = False,
    waiting: Callable[[str], object] = lambda _why: None,
) -> Observed:
    """Return what can be seen of a bridge and of the robots behind it.

    Args:
        url: The bridge's address.
        wait: How long to wait for a bridge that cannot be reached, in seconds.
        seconds: How long to listen to topics.
        ask_parameters: Whether rosapi is asked for a parameter of rosbridge.
        waiting: Called once with the reason if the bridge is waited for.

    """
    findings, rosapi = Findings(), ""
    try:
        topics = await ask_topics(url, wait=wait, waiting=waiting)
        findings = discover(topics, host_name(url))
    except BridgeClosed as error:
        return Observed(url, trouble=error.why or str(error))
    except BridgeError as error:
        rosapi = str(error)
    calls = Calls(url)
    try:
        asking = _Asking(calls)
        clock = None if rosapi else await asking.clock()
        writers, listeners = await asking.ends(findings)
        threads = await asking.threads() if ask_parameters and not rosapi else None
    finally:
        await calls.stop()
    try:
        topics = _worth_hearing(findings)
        frames = FrameListening()
        spaces = {one.tf_namespace for one in findings.robots[:MOST_ROBOTS]} - {None}
        tf = [f"{space}/{name}" for space in spaces for name in ("tf", "tf_static")]
        peer, deflate, heard = await listen(url, topics, seconds, tf, frames)
    except (OSError, TimeoutError) as error:
        return Observed(url, trouble=str(error) or type(error).__name__)
    return Observed(
        url,
        peer=peer,
        deflate=deflate,
        rosapi=rosapi,
        findings=findings,
        clock=clock,
        publishers=writers,
        subscribers=listeners,
        heard=heard,
        ways=_ways(findings, heard, frames),
        calls_in_threads=threads,
    )


def _worth_hearing(findings: Findings) -> dict[str, str]:
    """Return the topics to listen to, with how each is to be packed."""
    topics: dict[str, str] = {}
    for robot in findings.robots[:MOST_ROBOTS]:
        where = robot.topic("odometry") or robot.topic("pose")
        if where:
            topics[where] = "none"
        if robot.topic("scan"):
            topics[robot.topic("scan")] = "cbor"
    return topics


def _ways(
    findings: Findings, heard: Mapping[str, Heard], frames: FrameListening
) -> dict[str, Way]:
    """Return what the frames say of each robot whose odometry names its frame."""
    ways = {}
    for robot in findings.robots:
        namespace = robot.tf_namespace
        where = heard.get(robot.topic("odometry") or robot.topic("pose"))
        if namespace is not None and where is not None and where.frame:
            missing = frames.missing(namespace, where.frame)
            oddities = frames.oddities(namespace)
            ways[robot.name] = Way(where.frame, missing, oddities)
    return ways


class _Asking:
    """Questions to rosapi; when one is not answered no more are asked."""

    def __init__(self, calls: Calls) -> None:
        self._calls = calls
        self._silent = False

    async def clock(self) -> Clock | None:
        """Compare the clocks; the quickest of three answers tells most."""
        found: list[Clock] = []
        for _ in range(3):
            began, wall = time.monotonic(), time.time()
            answer = await self._ask("/rosapi/get_time")
            trip = time.monotonic() - began
            if answer is None:
                break
            try:
                theirs = convert(answer.get("time"), Time).seconds
            except BridgeError:
                break
            found.append(Clock(theirs - (wall + trip / 2), trip))
        # The first call opens the socket, which takes time of its own.
        return min(found, key=lambda each: each.round_trip, default=None)

    async def ends(
        self, findings: Findings
    ) -> tuple[dict[str, tuple[str, ...]], dict[str, tuple[str, ...]]]:
        """Return who writes to velocity topics, and who listens to them."""
        writers: dict[str, tuple[str, ...]] = {}
        listeners: dict[str, tuple[str, ...]] = {}
        for robot in findings.robots:
            topic = robot.topic("velocity")
            for kind, into in (("publishers", writers), ("subscribers", listeners)):
                answer = await self._ask(f"/rosapi/{kind}", {"topic": topic})
                names = None if answer is None else answer.get(kind)
                if topic and isinstance(names, list):
                    into[topic] = tuple(str(name) for name in names)
        return writers, listeners

    async def threads(self) -> bool | None:
        """Return whether rosbridge says that it calls services in threads."""
        request = {"name": PARAMETER, "default_value": "", "default": ""}
        answer = await self._ask("/rosapi/get_param", request)
        value = "" if answer is None else str(answer.get("value", "")).lower()
        return {"true": True, "false": False}.get(value.strip('"'))

    async def _ask(
        self, service: str, args: Mapping[str, Any] | Sequence[Any] | None = None
    ) -> dict[str, Any] | None:
        if self._silent:
            return None
        try:
            answer = await self._calls.call(service, args, None, PATIENCE)
        except BridgeError as error:
            self._silent = "did not answer" in str(error)
            return None
        return answer if isinstance(answer, dict) else None


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
        came on each topic.

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
                await socket.send(
                    ops.subscribe(topic, id=topic, compression=packing).decode()
                )
            for topic in tf:
                await socket.send(
                    ops.subscribe(topic, id=topic, queue_length=100).decode()
                )
            listening, protocol = Listening(topics, time.monotonic()), Protocol()
            try:
                async with asyncio.timeout(seconds if topics else 0):
                    while True:
                        frame = await socket.recv(decode=False)
                        event = protocol.receive(frame, time.monotonic())
                        if not isinstance(event, Publish):
                            continue
                        if frames is not None and event.topic in tf:
                            frames.received(event)
                        else:
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
