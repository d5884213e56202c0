"""Playing of a recording for subscribers: at a rate, from any position."""

import asyncio
import contextlib
import itertools
import logging
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

from webmap.bags.marks import find_marks
from webmap.bags.playback import (
    FASTEST,
    MARKS,
    SLOWEST,
    STATUS,
    TYPE,
    Marks,
    Playback,
    PlaybackStatus,
    read_command,
    text_of,
)
from webmap.bags.recording import FRAMES, AllFrames, Recorded, Recording, is_static
from webmap.bags.times import SECOND, Pace, Stamps
from webmap.base.errors import ConfigError
from webmap.ros.rosbridge.server.dialect import POLITE
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi

if TYPE_CHECKING:
    from webmap.bags.foxglove_server import FoxgloveServer

log = logging.getLogger("webmap.bags")

NODE = "/recording"
"""The node that publishes the recorded messages."""

REFUSED = "this is a recording: it accepts no messages, services or actions"


class Replay:
    """Publishes recorded messages as if they came now.

    Its graph accepts no publishers or services once it is started: clients may
    subscribe and ask questions, and no node would follow their commands.

    Args:
        recording: The recording.
        clock: Returns the time in seconds since 1970.

    """

    def __init__(self, recording: Recording, clock: Callable[[], float]) -> None:
        self.recording = recording
        self.graph = Graph(recording.schema, clock=clock)
        self._stamps = Stamps(recording.schema)
        self._static: dict[str, AllFrames] = {}

    def start(self) -> None:
        """Advertise all topics of the recording; the graph accepts no others then."""
        for topic in self.recording.topics.values():
            if topic.name in (STATUS, MARKS):
                continue
            self.graph.advertise(
                self, topic.name, topic.type, node=NODE, latch=topic.latched
            )
        for name in (STATUS, MARKS):
            self.graph.advertise(self, name, TYPE, node=NODE, latch=True)
        self.forget()
        Rosapi(self.graph, POLITE).start()
        self.graph.refusal = REFUSED

    def forget(self) -> None:
        """Forget all latched messages: they may be from after the next position."""
        for topic in self.recording.topics.values():
            if topic.name not in (STATUS, MARKS):
                self.graph.forget_latched(self, topic.name)
            if is_static(topic.name) and topic.type == FRAMES:
                self._static[topic.name] = AllFrames()

    def publish(self, recorded: Recorded, pace: Pace) -> None:
        """Publish a message with shifted stamps, if there is a subscriber."""
        message = self._message(recorded, pace)
        if message is None:
            return
        if recorded.topic in self._static:
            message = self._static[recorded.topic].with_all(message)
        self.graph.publish(self, recorded.topic, message)

    def publish_state(self, state: Sequence[Recorded], pace: Pace) -> None:
        """Publish the state at a position, the frames of each topic as one message."""
        frames: dict[str, AllFrames] = {}
        whole: dict[str, dict[str, Any]] = {}
        for recorded in state:
            name = recorded.topic
            if self.recording.topics[name].type != FRAMES:
                self.publish(recorded, pace)
            elif (message := self._message(recorded, pace)) is not None:
                known = self._static.get(name) or frames.setdefault(name, AllFrames())
                whole[name] = known.with_all(message)
        for name, message in whole.items():
            self.graph.publish(self, name, message)

    def publish_status(self, status: PlaybackStatus) -> None:
        """Publish the position on ``STATUS``, which keeps the newest for new pages."""
        self.graph.publish(self, STATUS, {"data": text_of(status)})

    def publish_marks(self, marks: Marks) -> None:
        """Publish all marks found so far on ``MARKS``, in place of the ones before."""
        self.graph.publish(self, MARKS, {"data": text_of(marks)})

    def _message(self, recorded: Recorded, pace: Pace) -> dict[str, Any] | None:
        name = recorded.topic
        if name in (STATUS, MARKS) or not self.graph.is_wanted(name):
            return None
        message: dict[str, Any] | None = self.recording.message(recorded)
        if message is None:
            return None
        topic = self.recording.topics[name]
        if topic.latched:  # said once: its age is right, however old it is
            pace = replace(pace, earliest=0)
        self._stamps.move(topic.type, message, pace.moved)
        return message


STATUS_PERIOD = 0.5
"""Seconds between two status messages with the position in the recording."""

HOLD = 0.5
"""Seconds between two publications of the state at a position that does not move, so
that the page does not show it as stale."""

ROUND = 1.0
"""Least seconds from one round to the next; a recording may be one message."""

SOON = 1_000_000
"""Nanoseconds that are too short to wait for."""

T = TypeVar("T")


def steady_clock() -> Callable[[], int]:
    """Return a clock in nanoseconds since 1970 that ignores changes of the time."""
    since = time.time_ns() - time.monotonic_ns()
    return lambda: since + time.monotonic_ns()


class Player:
    """Plays a recording for all subscribers.

    Args:
        recording: The recording.
        rate: Seconds of the recording that are played per second, from 0.001 to 1000.
        start: The position where the playing begins, in seconds.
        loop: Whether to play again from there after the end.
        now: Returns the time in nanoseconds since 1970.

    Raises:
        ConfigError: If the recording is shorter than ``start``, or the rate is invalid.

    """

    def __init__(
        self,
        recording: Recording,
        *,
        rate: float = 1.0,
        start: float = 0.0,
        loop: bool = False,
        now: Callable[[], int] | None = None,
    ) -> None:
        if not SLOWEST <= rate <= FASTEST:
            raise ConfigError(
                f"a rate is a number from {SLOWEST:g} to {FASTEST:g}, got {rate:g}"
            )
        if not 0 <= start < recording.seconds:
            raise ConfigError(
                f"{recording.name} is {recording.seconds:.1f} s long, so it cannot be "
                f"played from {start:g} s on"
            )
        self.foxglove: FoxgloveServer | None = None
        """Also gets what is played, if set before :meth:`run`."""
        self._now = now or steady_clock()
        self.replay = Replay(recording, clock=lambda: self._now() / SECOND)
        self._recording = recording
        self._loop = loop
        self._playback = Playback(
            recording.begin,
            recording.end,
            start=start,
            rate=rate,
            loop=loop,
            now=self._now(),
        )
        self._last = recording.begin  # the time of the newest message
        self._marks = Marks([], read=0.0)
        self._problem = ""
        self._over = False
        self._late = False
        self._woken = asyncio.Event()
        self._shown = asyncio.Event()

    @property
    def status(self) -> PlaybackStatus:
        """The position in the recording, and how it is played."""
        playback = self._playback
        return PlaybackStatus(
            name=self._recording.name,
            at=round(playback.seconds_at(self._now()), 3),
            seconds=round(self._recording.seconds, 3),
            rate=playback.rate,
            playing=playback.playing,
            ended=playback.ended,
            jumps=playback.jumps,
            problem=self._problem,
        )

    def obey(self, line: str) -> None:
        """Carry out a command; one that is not valid is logged and changes nothing."""
        try:
            self._playback.obey(read_command(line), self._now())
        except ConfigError as error:
            log.warning("%s", error)
            return
        self._woken.set()

    async def run(self) -> None:
        """Play until cancelled; playing begins with the first subscription."""
        await self.replay.graph.subscribed.wait()
        async with asyncio.TaskGroup() as group:
            group.create_task(self._publish_status())
            group.create_task(self._find_marks())
            group.create_task(self._take_turns())

    async def _take_turns(self) -> None:
        jumps = self._playback.jumps
        while True:
            if self._playback.jumps != jumps:
                jumps = self._playback.jumps
                self._problem = ""
                self.replay.forget()
            self._show_status()  # first, as poses jump
            await self._take_turn(self._playback.turn)

    async def _take_turn(self, turn: int) -> None:
        """Play, or hold the position, until the next turn."""
        playback = self._playback
        start = self._last = playback.at(self._now())
        state, messages = await self._in_thread(lambda: self._read(start, turn))
        if playback.turn != turn:
            return
        playback.begin(self._now())
        soonest = self._now() + round(ROUND * SECOND)
        if self.foxglove is not None:
            self.foxglove.send_state(state)
            state = [one for one in state if one.topic in self._recording.topics]
        self.replay.publish_state(state, playback.pace(self._now()))
        self._shown.set()
        if not playback.playing:
            await self._hold(turn, state)
            return
        try:
            await self._play(turn, messages)
        except ConfigError as error:
            log.error("%s; the rest of the recording is not played", error)
            self._problem = str(error)
        await self._finish(turn, soonest)

    def _read(self, start: int, turn: int) -> tuple[list[Recorded], Iterator[Recorded]]:
        """Read the state at a position, and the first message, which may take long."""
        state: list[Recorded] = []
        messages = self._recording.messages(start + 1)
        first: list[Recorded] = []
        try:
            state = self._recording.state_at(
                start, lambda: not self._over and self._playback.turn == turn
            )
            first = list(itertools.islice(messages, 1))
        except ConfigError as error:
            log.error("%s; a part of the recording is not played", error)
            self._problem = str(error)
        return state, itertools.chain(first, messages)

    async def _play(self, turn: int, messages: Iterator[Recorded]) -> None:
        for recorded in messages:
            if not await self._until(turn, recorded.time):
                return
            self.replay.publish(recorded, self._playback.pace(self._now()))
            if self.foxglove is not None:
                self.foxglove.send(recorded, self._playback.rate)
            self._last = recorded.time

    async def _finish(self, turn: int, soonest: int) -> None:
        """End the recording, or wait for its end and begin the next round."""
        if self._loop and self._playback.turn == turn:
            await self._until(turn, self._recording.end)
            while self._playback.turn == turn and self._now() < soonest:
                if not await self._wait((soonest - self._now()) / SECOND):
                    break
        if self._playback.turn == turn:
            self._playback.finish(self._last)

    async def _hold(self, turn: int, state: list[Recorded]) -> None:
        """Publish the state again and again, as it ages while the position does not."""
        topics = self._recording.topics
        state = [one for one in state if not topics[one.topic].latched]
        while self._playback.turn == turn:
            await self._wait(HOLD)
            if self._playback.turn == turn:
                pace = self._playback.pace(self._now())
                self.replay.publish_state(state, pace)

    async def _until(self, turn: int, recorded: int) -> bool:
        """Wait until a time of the recording; return whether the turn continues."""
        while self._playback.turn == turn:
            pace = self._playback.pace(self._now())
            wait = pace.due(recorded) - self._now()
            if wait < -SECOND:
                pace.put_off(-wait)
                if not self._late:
                    self._late = True
                    log.warning(
                        "this computer is too slow for this rate: messages are played "
                        "late"
                    )
            if wait < SOON:
                await asyncio.sleep(0)  # let the subscribers run
                break
            if not await self._wait(wait / SECOND):
                break
        return self._playback.turn == turn

    async def _wait(self, seconds: float) -> bool:
        """Wait for a time; return whether a command came meanwhile."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._woken.wait()
        if not self._woken.is_set():
            return False
        self._woken.clear()
        self._show_status()
        return True

    async def _find_marks(self) -> None:
        """Find the marks, in a thread, after the first picture."""

        def found(marks: Marks) -> None:
            self._marks = marks

        await self._shown.wait()
        paths = self._recording.paths
        await self._in_thread(lambda: find_marks(paths, found, lambda: not self._over))

    async def _in_thread(self, call: Callable[[], T]) -> T:
        running = asyncio.create_task(asyncio.to_thread(call))
        try:
            return await asyncio.shield(running)
        except asyncio.CancelledError:
            self._over = True
            await asyncio.wait([running])  # the file is closed afterwards
            raise

    def _show_status(self) -> None:
        status = self.status
        self.replay.publish_status(status)
        if self.foxglove is not None:
            self.foxglove.show(status)

    async def _publish_status(self) -> None:
        published: Marks | None = None
        while True:
            self._show_status()
            if self._marks is not published:
                published = self._marks
                self.replay.publish_marks(published)
            await asyncio.sleep(STATUS_PERIOD)
