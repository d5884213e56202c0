"""Looking at a bridge: a thin shell around sockets and clocks.

Nothing is published, each socket is of its own and closed after, and only those
services of rosapi are called that were seen to answer on every bridge.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from urllib.parse import urlsplit

from webmap.discovery.asking import ask_topics
from webmap.discovery.doctor.asking import Asking
from webmap.discovery.doctor.frames import FrameListening
from webmap.discovery.doctor.hanging import try_a_call
from webmap.discovery.doctor.heard_from import listen, sample
from webmap.discovery.doctor.meant import MeantRobot, lay_over
from webmap.discovery.doctor.observed import MOST_ROBOTS, Heard, Observed, Way
from webmap.discovery.doctor.ports import is_loopback, listening_addresses
from webmap.discovery.doctor.shown_rules import shown_topics
from webmap.discovery.found import Findings, FoundRobot
from webmap.discovery.hearing import frame_topics, hear_frames
from webmap.discovery.robots import discover, host_name
from webmap.discovery.tf_robots import MAP
from webmap.errors import BridgeClosed, BridgeError
from webmap.ros.calls import Calls
from webmap.ros.names import is_type

SLOW_TOPICS = 1.0
"""Seconds that maps and pictures have at the least, which come a few times a second."""

MOST_SCANS = 6
"""How many scans of a robot are listened to."""

LATCHED = ("nav_msgs/OccupancyGrid", "sensor_msgs/PointCloud2")
"""Types of maps, which are published once: one that is silent may be too large."""

IN_JSON = 10.0
"""Seconds for which a map that did not come in CBOR is awaited in JSON."""

NEEDLESS = ("/rosout", "/parameter_events")
"""Topics of every ROS that no client needs; whoever hides topics hides these."""

TRYING = "Trying what a call that hangs holds up."


async def observe(
    url: str,
    *,
    wait: float = 0.0,
    seconds: float = 3.0,
    ask_parameters: bool = False,
    try_call: bool = False,
    topics: Mapping[str, str] | None = None,
    meant: Callable[[Findings], Sequence[MeantRobot]] = lambda _found: (),
    waiting: Callable[[str], object] = lambda _why: None,
    progress: Callable[[str], object] = lambda _what: None,
) -> Observed:
    """Return what can be seen of a bridge and of the robots behind it.

    Args:
        url: The bridge's address.
        wait: How long to wait for a bridge that cannot be reached, in seconds.
        seconds: How long to listen to topics.
        ask_parameters: Whether rosapi is asked for a parameter of rosbridge.
        try_call: Whether a service is offered and called that hangs for a second, to
            see what that holds up.
        topics: Types by topic, which are taken in place of what rosapi says.
        meant: Takes what was found and returns the robots as somebody configured
            them; if there are any, these are measured and no others.
        waiting: Called once with the reason if the bridge is waited for.
        progress: Called with what is being done now, in a sentence.

    Raises:
        ConfigError: If ``meant`` says that what was found cannot be meant.

    """
    rosapi, told, asked = "", topics is not None, dict(topics or {})
    progress("Asking which topics there are.")
    try:
        found = await ask_topics(url, wait=wait, waiting=waiting)
        asked = asked if told else found
    except BridgeClosed as error:
        return Observed(url, trouble=error.why or str(error))
    except BridgeError as error:
        rosapi = str(error)
    trees = None
    if frame_topics(asked):
        progress("Listening to frames for a moment.")
        trees = await hear_frames(url, asked)
    seen = Observed(
        url,
        rosapi=rosapi,
        told=told,
        shown=tuple(name for name in NEEDLESS if name in asked and not told),
        types=asked,
        findings=discover(asked, host_name(url), trees),
    )
    seen = _as_meant(seen, meant(seen.findings))
    if not rosapi:
        progress("Asking for the time, and who writes and who listens.")
        seen = await _ask(seen, ask_parameters=ask_parameters)
    try:
        if try_call:
            progress(TRYING)
            seen = await tried(seen)
        progress(f"Listening for {seconds:g} s.")
        seen = await _listen(seen, seconds)
        rest = _shown(seen.findings.robots[:MOST_ROBOTS])
        if rest:
            # After the rest, and on a socket of its own: pictures and clouds would
            # hold up the poses whose age is asked for.
            progress("Listening for a few pictures, maps and plans.")
            heard = await sample(url, rest, max(seconds, SLOW_TOPICS))
            seen = replace(seen, heard={**seen.heard, **heard})
            seen = await _in_json(seen, rest, progress)
        return seen
    except (OSError, TimeoutError) as error:
        return Observed(url, trouble=str(error) or type(error).__name__)


async def tried(seen: Observed) -> Observed:
    """Return what was seen, with what a call that hangs holds up; it is tried."""
    if seen.tried:  # what was found out before may be so no more
        seen = replace(seen, calls_in_threads=None, tried=False)
    if seen.rosapi:
        return replace(seen, untold="it takes a rosapi that answers")
    try:
        free = await try_a_call(seen.url)
    except (OSError, TimeoutError) as error:
        return replace(seen, untold=str(error) or type(error).__name__)
    if free is None:
        return replace(seen, untold="the bridge offers no services of its clients")
    return replace(seen, calls_in_threads=free, tried=True, untold="")


def _as_meant(seen: Observed, robots: Sequence[MeantRobot]) -> Observed:
    """Return what was seen with the robots as somebody configured them, if any."""
    if not robots:
        return seen
    findings, meant = lay_over(seen.findings, robots, seen.types)
    known = {one.found_as for one in meant.values()}
    others = [robot.name for robot in seen.findings.robots if robot.name not in known]
    return replace(
        seen,
        told=seen.told or seen.rosapi != "",
        findings=findings,
        meant=meant,
        others=tuple(others),
    )


async def _ask(seen: Observed, *, ask_parameters: bool) -> Observed:
    robots = seen.findings.robots
    velocities = [robot.topic("velocity") for robot in robots]
    read = [
        topic
        for robot in robots[:MOST_ROBOTS]
        for topic in (place_of(robot), *_scans(robot), *_shown([robot]))
    ]
    calls = Calls(seen.url)
    try:
        asking = Asking(calls)
        return replace(
            seen,
            clock=await asking.clock(),
            publishers=await asking.publishers([*velocities, *read]),
            subscribers=await asking.subscribers(velocities),
            calls_in_threads=await asking.threads() if ask_parameters else None,
        )
    finally:
        await calls.stop()


async def _listen(seen: Observed, seconds: float) -> Observed:
    robots = seen.findings.robots[:MOST_ROBOTS]
    topics: dict[str, str] = {}
    for robot in robots:
        topics[place_of(robot)] = topics[robot.topic("battery")] = "none"
        topics.update(dict.fromkeys(_scans(robot), "cbor"))
    topics.pop("", None)
    spaces = sorted({each.tf_namespace for each in robots} - {None})  # type: ignore[type-var]
    tf = [f"{space}/{name}" for space in spaces for name in ("tf", "tf_static")]
    frames = FrameListening()
    peer, deflate, heard = await listen(seen.url, topics, seconds, tf, frames)
    ways = {}
    for robot in robots:
        one = seen.meant.get(robot.name)
        way = _way(robot, heard, frames, one.map_frame if one else "")
        if way is not None:
            ways[robot.name] = way
    port = urlsplit(seen.url).port
    listens = listening_addresses(port) if port and is_loopback(peer) else ()
    return replace(
        seen, peer=peer, listens=listens, deflate=deflate, heard=heard, ways=ways
    )


async def _in_json(
    seen: Observed, topics: Mapping[str, str], progress: Callable[[str], object]
) -> Observed:
    """Return what was seen, with published maps that came only in JSON."""
    silent = {
        topic: type
        for topic, type in topics.items()
        if is_type(type, *LATCHED)
        and seen.publishers.get(topic)
        and topic in seen.heard
        and not seen.heard[topic].count
    }
    if not silent:
        return seen
    names = ", ".join(silent)
    progress(f"Nothing came of {names} in CBOR: listening for {IN_JSON:g} s in JSON.")
    came = await sample(seen.url, silent, IN_JSON, in_json=True)
    found = {
        topic: replace(heard, not_in_cbor=heard.in_parts)
        for topic, heard in came.items()
        if heard.count
    }
    return replace(seen, heard={**seen.heard, **found})


def _scans(robot: FoundRobot) -> list[str]:
    return [guess.topic for guess in robot.guesses.get("scan", ())[:MOST_SCANS]]


def _shown(robots: Iterable[FoundRobot]) -> dict[str, str]:
    return {topic: type for each in robots for _, topic, type in shown_topics(each)}


def place_of(robot: FoundRobot) -> str:
    """Return the topic that says where a robot is, empty if there is none."""
    return robot.topic("odometry") or robot.topic("pose")


def _way(
    robot: FoundRobot, heard: Mapping[str, Heard], frames: FrameListening, start: str
) -> Way | None:
    """Return what the frames say of a robot whose odometry names its frame.

    Of one without odometry it is the frame of its base that counts. It is drawn in the
    frame ``start``, if somebody said so, else in the one that was found.
    """
    space, where = robot.tf_namespace, heard.get(place_of(robot), Heard())
    frame, base = where.frame, where.child
    if robot.tf_alone:
        frame = base = robot.base_frame
    if space is None or not frame:
        return None
    start = start or robot.tf_options.get("map_frame", MAP)
    scan = heard.get(robot.topic("scan"), Heard()).frame
    return Way(
        frame,
        frames.missing(space, frame, start),
        frames.oddities(space),
        base,
        frames.missing(space, base, frame) if base else "",
        scan,
        frames.missing(space, scan, base) if scan and base else "",
        start,
    )
