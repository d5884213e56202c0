"""Measures a bridge and the robots behind it: a thin layer around sockets and clocks.

Nothing is published, the connections are closed afterwards, and only requests that
every tested bridge answers are sent.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

from webmap.agents.announcements import about_agent
from webmap.base.errors import BridgeClosed, BridgeError
from webmap.discovery.doctor.facts import (
    MOST_ROBOTS,
    BridgeFacts,
    Clock,
    ConfiguredRobot,
    FramePath,
    Measurement,
    merge_configured,
)
from webmap.discovery.doctor.samples import FrameCheck, listen, sample
from webmap.discovery.doctor.topic_rules import shown_topics
from webmap.discovery.findings import Findings, FoundRobot
from webmap.discovery.frames import FrameCollector, frame_topics
from webmap.discovery.robots import discover, host_name
from webmap.ros.bridge import Bridge
from webmap.ros.foxglove.protocol import SUBPROTOCOLS
from webmap.ros.names import (
    is_agent_url,
    is_foxglove_url,
    is_rosbridge_url,
    is_type,
    web_socket_url,
)
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.rosbridge import checks
from webmap.ros.subscriptions import Encoding
from webmap.ros.temporary_bridge import TemporaryBridge, ask_topics

PATIENCE = 3.0
"""Seconds for an answer; if a bridge takes longer, it gets no more requests."""

SLOW_TOPICS = 1.0
"""Least seconds for maps and pictures, which come a few times a second."""

MOST_SCANS = 6
"""Most scans of a robot that are listened to."""

LATCHED = ("nav_msgs/OccupancyGrid", "sensor_msgs/PointCloud2")
"""Types of maps, which are published once: if none arrives, it may be too large."""

AS_TEXT = 10.0
"""Seconds to wait for a map as text, if it did not come in binary."""

ONCE = 300_000
"""Least milliseconds between two messages of a map: encoding one takes long."""

NEEDLESS = ("/rosout", "/parameter_events")
"""Topics of every ROS that no client needs; a bridge that hides topics hides these."""

T = TypeVar("T")

TRYING = "Testing what a slow service call delays."


async def observe(
    url: str,
    *,
    wait: float = 0.0,
    seconds: float = 3.0,
    ask_parameters: bool = False,
    try_call: bool = False,
    topics: Mapping[str, str] | None = None,
    configured: Callable[[Findings], Sequence[ConfiguredRobot]] = lambda _found: (),
    waiting: Callable[[str], object] = lambda _why: None,
    progress: Callable[[str], object] = lambda _what: None,
) -> BridgeFacts:
    """Return the observations of a bridge and of the robots behind it.

    Args:
        url: The bridge's address.
        wait: How long to wait for an unreachable bridge, in seconds.
        seconds: How long to listen to topics.
        ask_parameters: Whether to read a parameter of the bridge.
        try_call: Whether to offer and call a service that takes a second to answer,
            to find out what it delays.
        topics: Types by topic, which replace the list of the bridge.
        configured: Receives the findings and returns the robots as a person configured
            them; if there are any, only these are measured.
        waiting: Called once with the reason if the bridge is waited for.
        progress: Called with a sentence about the current step.

    Raises:
        ConfigError: If ``configured`` finds that the settings do not fit.

    """
    unlisted, topics_given, asked = "", topics is not None, dict(topics or {})
    progress("Requesting the list of topics.")
    try:
        found = await ask_topics(url, wait=wait, waiting=waiting)
        asked = asked if topics_given else found
    except BridgeClosed as error:
        return BridgeFacts(url, trouble=error.why or str(error))
    except BridgeError as error:
        unlisted = str(error)
    async with TemporaryBridge(url) as bridge:
        try:
            await bridge.open()
            trees = None
            if frame_topics(asked):
                progress("Listening to frames for a moment.")
                trees = await FrameCollector(bridge).listen(asked)
            seen = BridgeFacts(
                url,
                unlisted=unlisted,
                topics_given=topics_given,
                shown=tuple(
                    name for name in NEEDLESS if name in asked and not topics_given
                ),
                types=asked,
                findings=discover(asked, host_name(url), trees),
                **await _look(url),
            )
            seen = _with_configured(seen, configured(seen.findings))
            if not unlisted:
                progress("Requesting the time, the publishers and the subscribers.")
                seen = await _ask(seen, bridge)
                if ask_parameters and (is_rosbridge_url(url) or is_agent_url(url)):
                    link = await checks.asked_about_threads(
                        seen.link, bridge.call_service
                    )
                    seen = replace(seen, link=link)
            if try_call:
                progress(TRYING)
                seen = await tried(seen)
            progress(f"Listening for {seconds:g} s.")
            seen = await _listen(seen, bridge, seconds)
            return await _sample(seen, bridge, seconds, progress)
        except BridgeClosed as error:
            return BridgeFacts(url, trouble=error.why or str(error))
        except (OSError, TimeoutError) as error:
            return BridgeFacts(url, trouble=str(error) or type(error).__name__)


async def _look(url: str) -> dict[str, Any]:
    """Return what is seen of the bridge itself, or known by its agent."""
    if is_foxglove_url(url):
        return {"link": await checks.look(web_socket_url(url), SUBPROTOCOLS)}
    if is_rosbridge_url(url):
        return {"link": await checks.look(url, ())}
    if not is_agent_url(url):
        return {}
    about = await asyncio.to_thread(about_agent, url)
    if about is None or about.open_at is None:
        return {}
    return {"open_at": tuple(about.open_at)}


async def tried(seen: BridgeFacts) -> BridgeFacts:
    """Return the observations, with a test of what a slow service call delays."""
    if is_agent_url(seen.url):
        why = "an agent lets a display offer no service"
    elif is_foxglove_url(seen.url):
        why = "clients of a Foxglove bridge can offer no service"
    elif not is_rosbridge_url(seen.url):
        why = "it is a test of a rosbridge"
    elif seen.unlisted:
        return replace(seen, link=checks.not_tried(seen.link))
    else:
        return replace(seen, link=await checks.tried_a_call(seen.link, seen.url))
    return replace(seen, link=checks.not_tried(seen.link, why))


def _with_configured(
    seen: BridgeFacts, robots: Sequence[ConfiguredRobot]
) -> BridgeFacts:
    """Return the observations with the robots as a person configured them, if any."""
    if not robots:
        return seen
    findings, configured = merge_configured(seen.findings, robots, seen.types)
    known = {one.found_as for one in configured.values()}
    others = [robot.name for robot in seen.findings.robots if robot.name not in known]
    return replace(
        seen,
        topics_given=seen.topics_given or seen.unlisted != "",
        findings=findings,
        configured=configured,
        others=tuple(others),
    )


class _Questions:
    """Requests to a bridge; after one without an answer in time, none are sent."""

    def __init__(self) -> None:
        self._silent = False

    async def ask(self, question: Callable[[], Awaitable[T]]) -> T | None:
        if self._silent:
            return None
        try:
            async with asyncio.timeout(PATIENCE):
                return await question()
        except TimeoutError:
            self._silent = True
            return None

    async def nodes(
        self, of: Callable[[str], Awaitable[list[str] | None]], topics: Iterable[str]
    ) -> dict[str, tuple[str, ...]]:
        """Return nodes by topic, if the bridge named them."""
        found = {}
        for topic in dict.fromkeys(filter(None, topics)):
            names = await self.ask(partial(of, topic))
            if names is not None:
                found[topic] = tuple(names)
        return found

    async def clock(self, bridge: Bridge) -> Clock | None:
        """Compare the clocks; the quickest of three answers is the most accurate."""
        found: list[Clock] = []
        for _ in range(3):
            began, wall = time.monotonic(), time.time()
            theirs = await self.ask(bridge.time)
            trip = time.monotonic() - began
            if is_foxglove_url(bridge.url):  # its messages have its time: no question
                trip = bridge.lag
            if theirs is None:
                break
            found.append(Clock(theirs - (wall + trip / 2), trip))
        # The first call opens the socket, which takes extra time.
        return min(found, key=lambda each: each.round_trip, default=None)


async def _ask(seen: BridgeFacts, bridge: Bridge) -> BridgeFacts:
    robots = seen.findings.robots
    velocities = [robot.topic("velocity") for robot in robots]
    read = [
        topic
        for robot in robots[:MOST_ROBOTS]
        for topic in (place_of(robot), *_scans(robot), *_shown([robot]))
    ]
    questions = _Questions()
    return replace(
        seen,
        clock=await questions.clock(bridge),
        publishers=await questions.nodes(bridge.publishers, [*velocities, *read]),
        subscribers=await questions.nodes(bridge.subscribers, velocities),
    )


async def _listen(seen: BridgeFacts, bridge: Bridge, seconds: float) -> BridgeFacts:
    robots = seen.findings.robots[:MOST_ROBOTS]
    topics: dict[str, Encoding] = {}
    for robot in robots:
        topics[place_of(robot)] = topics[robot.topic("battery")] = "text"
        topics.update(dict.fromkeys(_scans(robot), "binary"))
    topics.pop("", None)
    spaces = sorted({each.tf_namespace for each in robots} - {None})  # type: ignore[type-var]
    tf = [f"{space}/{name}" for space in spaces for name in ("tf", "tf_static")]
    frames = FrameCheck()
    measured = await listen(bridge, topics, seconds, tf, frames)
    frame_paths = {}
    for robot in robots:
        one = seen.configured.get(robot.name)
        path = _frame_path(robot, measured, frames, one.map_frame if one else "")
        if path is not None:
            frame_paths[robot.name] = path
    return replace(seen, measured=measured, frame_paths=frame_paths)


async def _sample(
    seen: BridgeFacts, bridge: Bridge, seconds: float, progress: Callable[[str], object]
) -> BridgeFacts:
    """Return the observations, with pictures, maps and plans.

    They are measured last, because they would delay the poses whose age is measured.
    """
    topics = _shown(seen.findings.robots[:MOST_ROBOTS])
    if not topics:
        return seen
    progress("Listening for a few pictures, maps and plans.")
    too_large: dict[str, int] = {}

    def received(message: ReceivedMessage) -> None:
        if checks.came_in_parts(message) and is_type(topics[message.topic], *LATCHED):
            too_large[message.topic] = message.size

    measured = await sample(bridge, topics, max(seconds, SLOW_TOPICS), received)
    silent = {
        topic: topics[topic]
        for topic, each in measured.items()
        if is_type(topics[topic], *LATCHED)
        and seen.publishers.get(topic)
        and not each.count
    }
    if silent:
        names = ", ".join(silent)
        progress(
            f"No binary message was received on {names}: listening to text for "
            f"{AS_TEXT:g} s."
        )
        late = await sample(
            bridge,
            silent,
            AS_TEXT,
            received,
            enough=1,
            encoding="text",
            throttle=ONCE,
        )
        measured |= {topic: each for topic, each in late.items() if each.count}
    link = replace(seen.link, too_large=too_large)
    return replace(seen, measured={**seen.measured, **measured}, link=link)


def _scans(robot: FoundRobot) -> list[str]:
    return [guess.topic for guess in robot.guesses.get("scan", ())[:MOST_SCANS]]


def _shown(robots: Iterable[FoundRobot]) -> dict[str, str]:
    return {topic: type for each in robots for _, topic, type in shown_topics(each)}


def place_of(robot: FoundRobot) -> str:
    """Return the topic with a robot's pose, empty if there is none."""
    return robot.topic("odometry") or robot.topic("pose")


def _frame_path(
    robot: FoundRobot,
    measured: Mapping[str, Measurement],
    frames: FrameCheck,
    start: str,
) -> FramePath | None:
    """Return the frames of a robot whose odometry names its frame.

    Without odometry, the frame of the base is used. The robot is drawn in the frame
    ``start`` if it is configured, else in the frame that was found.
    """
    tf, where = robot.tf, measured.get(place_of(robot), Measurement())
    frame, base = where.frame, where.child
    if robot.tf_alone:
        frame = base = robot.base_frame
    if tf is None or not frame:
        return None
    space, start = tf.namespace, start or tf.map_frame
    scan = measured.get(robot.topic("scan"), Measurement()).frame
    return FramePath(
        frame,
        frames.missing(space, frame, start),
        frames.oddities(space),
        base,
        frames.missing(space, base, frame) if base else "",
        scan,
        frames.missing(space, scan, base) if scan and base else "",
        start,
    )
