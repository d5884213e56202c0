"""The recording of a bridge, from the question for its topics to the summary."""

import asyncio
import contextlib
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import click

from webmap.bags.playback import MARKS, STATUS
from webmap.bags.recorder import Recorder, RecorderThread, new_bag
from webmap.bags.types import Types
from webmap.base.echo import echo
from webmap.base.errors import BridgeError, ConfigError, ServiceError
from webmap.base.text import counted
from webmap.ros.bridge import Bridge
from webmap.ros.names import PICTURES, is_type, normalise_topic, split_type
from webmap.ros.received_message import ReceivedMessage
from webmap.ros.rosbridge.server.dialect import DialectName
from webmap.ros.temporary_bridge import ask_topics
from webmap.sim.process import signals_set

EVERY = 10.0
"""Seconds between two progress lines if one cannot replace the other."""


def stated_types(
    names: Sequence[str], types: Sequence[str], topics: Mapping[str, str] | None
) -> dict[str, str] | None:
    """Return the types that a person stated, by topic; None if there are none.

    Args:
        names: The topics of ``--topic``.
        types: The types of ``--type``.
        topics: The topics and types of ``--topics``.

    Raises:
        UsageError: If there are not as many types as topics, or a type is invalid.

    """
    if not types:
        return None if topics is None else dict(topics)
    if len(types) != len(names):
        raise click.UsageError(
            f"--type needs one type for each --topic, in the same order: got "
            f"{len(types)} types for {len(names)} topics"
        )
    for name in types:
        split_type(name)
    return {**(topics or {}), **dict(zip(names, types, strict=True))}


async def record_to(
    url: str,
    out: Path | None,
    *,
    only: Sequence[str],
    stated: Mapping[str, str] | None,
    wait: float,
    duration: float | None,
) -> bool:
    """Record until a signal or for a time; return whether the file failed.

    Args:
        url: The bridge's address.
        out: The bag; None for a name with the time in it.
        only: The topics to record; all if empty.
        stated: Types by topic; None to ask the bridge for them.
        wait: Longest time to wait for an unreachable bridge, in seconds.
        duration: Longest duration of the recording, in seconds.

    Raises:
        BridgeError: If the bridge cannot be reached.
        ConfigError: If there is nothing to record, or nowhere to record to.
        OSError: If the bag cannot be created.

    """
    topics = await _topics(url, stated, wait)
    dialect = _dialect(topics)
    if out is None:
        out = Path(time.strftime("webmap-%Y-%m-%d-%H-%M-%S"))
    bag = new_bag(out, dialect)
    failure: OSError | None = None
    lasted = 0.0
    line = ProgressLine()
    recorder = Recorder(bag, Types(dialect), line.show_text)
    try:
        subscriber = TopicSubscriber(
            Bridge(url), recorder, only=only, stated_types=stated, report=line.show_text
        )
        stop = asyncio.Event()

        def ready() -> None:
            echo(f"Recording {url} to {bag.path}")
            if subscriber.missing:
                line.show_text(f"Waiting for: {', '.join(subscriber.missing)}")

        with signals_set(stop):
            lasted = await subscriber.run(
                topics,
                stop,
                duration=duration,
                ready=ready,
                show=lambda seconds: line.show(seconds, recorder),
            )
    except OSError as error:
        failure = error
    finally:
        try:
            bag.close()
        except OSError as error:
            failure = failure or error
    if failure is not None:
        line.show_text(f"Error: {bag.path} cannot be written: {failure}")
    line.show_text(
        f"Recorded {counted(recorder.messages, 'message')} of "
        f"{counted(recorder.topics, 'topic')} in "
        f"{lasted:.1f} s to {bag.path}: {megabytes(recorder)}, "
        f"{recorder.dropped} dropped"
    )
    return failure is not None


class ProgressLine:
    """The progress of a recording, on one line of standard error that is rewritten.

    If standard error is not a terminal, it prints a line from time to time.
    """

    def __init__(self) -> None:
        self._terminal = sys.stderr.isatty()
        self._shown = 0
        self._next = EVERY

    def show(self, seconds: float, recorder: Recorder) -> None:
        """Show the progress.

        Args:
            seconds: Duration of the recording until now.
            recorder: Its counts are shown.

        """
        text = (
            f"{seconds:.0f} s, {recorder.messages} messages, {megabytes(recorder)}, "
            f"{recorder.dropped} dropped"
        )
        if self._terminal:
            click.echo(f"\r{text.ljust(self._shown)}", err=True, nl=False)
            self._shown = len(text)
        elif seconds >= self._next:
            self._next += EVERY
            echo(text, err=True)

    def show_text(self, text: str) -> None:
        """Print another text, on a line of its own."""
        if self._shown:
            echo("", err=True)
        echo(text, err=True)
        self._shown = 0


def megabytes(recorder: Recorder) -> str:
    """Return the recorded size, for people."""
    return f"{recorder.size / 1e6:.1f} MB"


async def _topics(
    url: str, stated: Mapping[str, str] | None, wait: float
) -> dict[str, str]:
    if stated is not None:
        return dict(stated)

    def waiting(why: str) -> None:
        echo(f"Waiting for the bridge at {url}: {why}", err=True)

    try:
        return await ask_topics(url, wait=wait, waiting=waiting)
    except ServiceError as error:
        raise BridgeError(
            f"{url} has no rosapi that lists its topics ({error}): name them with "
            f"--topic and --type, or list them with --topics"
        ) from None


def _dialect(topics: Mapping[str, str]) -> DialectName:
    slashes = {type_name.count("/") for type_name in topics.values()}
    if 2 in slashes:
        return "ros2"
    if 1 in slashes:
        return "ros1"
    raise ConfigError(
        "there are no topics: nothing can be recorded, and it is not known whether the "
        "bridge is of ROS 1 or ROS 2"
    )


LOOK = 2.0
"""Seconds between two checks for new topics."""

SHOW = 1.0
"""Seconds between two displays of the progress."""

OPEN_WITHIN = 5.0
"""Seconds after which a message states that the connection is not open yet."""

QUEUE = 100
"""Messages of a topic that the bridge may queue; none should be lost."""


class TopicSubscriber:
    """Subscribes to topics behind a bridge, also to those that appear later.

    Args:
        bridge: The bridge, not started yet.
        recorder: Gets the messages.
        only: The topics to record; all if empty.
        stated_types: Types by topic; None to ask the bridge for them.
        report: Called with each sentence to show.

    """

    def __init__(
        self,
        bridge: Bridge,
        recorder: Recorder,
        *,
        only: Sequence[str] = (),
        stated_types: Mapping[str, str] | None = None,
        report: Callable[[str], object],
    ) -> None:
        self._bridge = bridge
        self._recorder = recorder
        self._only = frozenset(only)
        self._stated_types = stated_types
        self._report = report
        self._seen: set[str] = set()
        self._lost = 0.0
        self._was_open = False
        self._incoming = RecorderThread(recorder, self._failed)
        self._stop = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._failure: OSError | None = None

    async def run(
        self,
        topics: Mapping[str, str],
        stop: asyncio.Event,
        *,
        duration: float | None = None,
        ready: Callable[[], object],
        show: Callable[[float], object],
    ) -> float:
        """Record until ``stop`` is set or the time is over; return the seconds.

        Args:
            topics: Types by topic, as the bridge lists them now.
            stop: The event that ends the recording.
            duration: Longest duration, in seconds.
            ready: Called when all topics are subscribed.
            show: Called once a second with the seconds since then.

        Raises:
            OSError: If the bag can no longer be written.

        """
        self._stop, self._loop = stop, asyncio.get_running_loop()
        removals = [
            self._bridge.on_open(self._opened),
            self._bridge.on_close(self._closed),
        ]
        self._incoming.start()
        self.take(topics)
        self._bridge.start(self._loop)
        began = time.monotonic()
        tasks = [
            asyncio.create_task(self._find_new_topics()),
            asyncio.create_task(self._report_if_not_open()),
            asyncio.create_task(_show_progress(began, show)),
        ]
        ready()
        try:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(duration):
                    await stop.wait()
        finally:
            lasted = time.monotonic() - began
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)
            for removal in removals:
                removal.remove()
            why = self._why_not_open()
            await self._bridge.stop()
            await self._incoming.finish()
        if not self._was_open:
            self._report(f"Nothing is recorded: the connection was never open{why}")
        if self._failure is not None:
            raise self._failure
        return lasted

    def take(self, topics: Mapping[str, str]) -> None:
        """Subscribe to new topics to record, and report those left out."""
        unknown = []
        for topic, type_name in sorted(topics.items()):
            about_replay = topic in (STATUS, MARKS)
            chosen = topic in self._only if self._only else not about_replay
            if not chosen or topic in self._seen or not type_name:
                continue
            self._seen.add(topic)
            if not self._subscribe(topic, type_name):
                unknown.append(f"{topic} ({type_name})")
        if unknown:
            self._report(
                f"Not recorded, since their types are unknown: {', '.join(unknown)}"
            )

    @property
    def missing(self) -> list[str]:
        """The topics to record that do not exist yet."""
        return sorted(self._only - self._seen)

    def _subscribe(self, topic: str, type_name: str) -> bool:
        try:
            name = normalise_topic(topic)
            if not self._recorder.add(name, type_name):
                return False
            subscription = self._bridge.subscribe(
                name,
                partial(self._received, name),
                type_name,
                queue_length=QUEUE,
                encoding="binary" if is_type(type_name, *PICTURES) else None,
            )
            subscription.undecoded = True
        except ConfigError as error:
            self._report(f"{topic} is not recorded: {error}")
        return True

    def _received(self, topic: str, message: ReceivedMessage) -> None:
        if not self._stop.is_set():
            self._incoming.put(topic, message, time.time_ns())

    def _failed(self, error: OSError) -> None:
        self._failure = error
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._stop.set)

    async def _report_if_not_open(self) -> None:
        await asyncio.sleep(OPEN_WITHIN)
        if not self._was_open:
            why = self._why_not_open()
            self._report(f"Nothing is recorded yet: the connection is not open{why}")

    def _why_not_open(self) -> str:
        trouble = self._bridge.trouble
        return f" ({trouble})" if trouble else ""

    async def _find_new_topics(self) -> None:
        while self._stated_types is None:
            await asyncio.sleep(LOOK)
            if self._bridge.state == "open":
                with contextlib.suppress(BridgeError):  # it is asked again
                    self.take(await self._bridge.topics())

    def _closed(self, reason: str) -> None:
        self._lost = time.monotonic()
        self._report(
            f"The connection was lost ({reason}): nothing is recorded until it is open "
            "again"
        )

    def _opened(self) -> None:
        self._was_open = True
        if self._lost:
            gone = time.monotonic() - self._lost
            self._lost = 0.0
            self._report(
                f"The connection is open again; {gone:.1f} s are missing in the bag"
            )


async def _show_progress(began: float, show: Callable[[float], object]) -> None:
    while True:
        await asyncio.sleep(SHOW)
        show(time.monotonic() - began)
