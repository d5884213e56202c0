"""The model's thread: one event loop with all objects that user code touches.

User code, callbacks and the robots' data live in this one thread, so they need no
locks. The web thread passes the messages of pages to this thread and takes finished
bytes from it.
"""

import asyncio
import inspect
import logging
import sys
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Protocol

from webmap.agents.peer import close_peers
from webmap.base.audience import audience
from webmap.base.geometry import Quaternion, Twist
from webmap.base.lifecycle import lifecycle
from webmap.base.scope import Removal
from webmap.core.frame_pace import frame_pace
from webmap.core.motion import RobotMotion, robot_motions
from webmap.core.refusals import refusals
from webmap.core.shift_events import ShiftWatch
from webmap.core.shift_files import FOLDER
from webmap.core.shift_log import shift_log
from webmap.core.visible_robot import robots
from webmap.gate.locks import state_folder
from webmap.gate.protocol import (
    GateDown,
    Refused,
    RefusedCount,
    Report,
    RobotReport,
    SentGoal,
    SentPose,
    SentTwist,
)
from webmap.scene.node import frame_request

if TYPE_CHECKING:
    from webmap.agents.gates import Gates
    from webmap.gate.display.client import GateClient

log = logging.getLogger("webmap")

SWITCH = 0.0001
"""Seconds after which a running thread yields to a waiting one.

While the model's thread is busy, the web thread waits this long several times for each
message to a page. With 1 ms, the ticks to operators came up to 0.3 s late.
"""

FRAME_RATE = 60.0
"""Frames a second for each viewer, at most: more than most displays show."""

REST = 0.1
"""Seconds between frames while nothing changes: ages, and signs of life."""


class Watcher(Protocol):
    """An observer of the model, usually a page."""

    def tick(self, now: float) -> bool:
        """Take the changes, at the monotonic time ``now``; return whether some came."""

    def notice(self, text: str) -> None:
        """Show a sentence that every viewer should read."""


class Runtime:
    """The model's thread, its tick, and the gate."""

    def __init__(self) -> None:
        self.gate: Gates | GateClient | None = None
        self.make_gate: Callable[[], Gates | GateClient] = _all_gates
        """Makes the gate's client at each start."""
        self.frame_rate = FRAME_RATE
        """Frames a second for each viewer, at most."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread: threading.Thread | None = None
        self._watchers: dict[int, Watcher] = {}
        self._serves_pages = False
        self._on_stop: list[Callable[[], None]] = []
        self._next_frames: asyncio.Handle | None = None
        self._ending = asyncio.Event()

    @property
    def running(self) -> bool:
        """Whether the model's thread runs."""
        return self._thread is not None

    def start(self) -> None:
        """Start the model's thread and the gate; return when the thread is up.

        The gate's process is ready a moment later. A second call does nothing.
        """
        if self._thread is not None:
            return
        # A busy model's thread keeps the interpreter for this long at a time, while the
        # web thread must pass on the ticks to operators.
        sys.setswitchinterval(min(SWITCH, sys.getswitchinterval()))
        self._ending = asyncio.Event()
        ready = threading.Event()
        failure: list[BaseException] = []
        self._thread = threading.Thread(
            target=self._run, args=(ready, failure), name="webmap-model", daemon=True
        )
        self._thread.start()
        ready.wait()
        if failure:
            self._thread.join()
            self._thread = None
            raise failure[0]

    def stop(self) -> None:
        """Stop driven robots, close all connections and end the thread."""
        thread, self._thread = self._thread, None
        if thread is None or self._loop is None:
            return
        self._loop.call_soon_threadsafe(self._ending.set)
        thread.join(10.0)

    def call(self, fn: Callable[..., object], /, *args: Any) -> None:
        """Schedule a call of ``fn`` in the model's thread.

        Raises:
            RuntimeError: If WebMap has not been started.

        """
        self._started_loop().call_soon_threadsafe(fn, *args)

    def _started_loop(self) -> asyncio.AbstractEventLoop:
        if self._loop is None:
            raise RuntimeError("WebMap has not been started: call webmap.start()")
        return self._loop

    def run(self, fn: Callable[..., Any], /, *args: Any) -> Any:
        """Call ``fn`` in the model's thread and wait for its result.

        Raises:
            RuntimeError: If WebMap has not been started, or this is the model's thread.

        """
        loop = self._started_loop()
        if threading.current_thread() is self._thread:
            raise RuntimeError(
                "webmap.call waits for the model's thread, and this is that thread: "
                "call the function itself, or await it"
            )

        async def called() -> Any:
            result = fn(*args)
            return await result if inspect.isawaitable(result) else result

        work = asyncio.run_coroutine_threadsafe(called(), loop)
        try:
            return work.result()
        finally:
            work.cancel()  # it has not ended if the waiting was interrupted

    def serve_pages(self) -> None:
        """Receive what is only shown less often while no page is open."""
        self._serves_pages = True
        if self._loop is not None:
            self.call(audience.expect_pages, self._loop)

    def on_stop(self, fn: Callable[[], None]) -> None:
        """Call ``fn`` in the model's thread whenever the thread is about to end."""
        self._on_stop.append(fn)

    def watch(self, watcher: Watcher) -> Removal:
        """Tick ``watcher`` until the removal; called in the model's thread."""
        if not self._watchers:
            frame_request.listen(self._on_change)
        self._watchers[id(watcher)] = watcher
        if self._next_frames is None:
            self._make_frames_in(REST)
        opened = audience.page_opened()

        def undo() -> None:
            opened.remove()
            self._watchers.pop(id(watcher), None)
            if not self._watchers:
                frame_request.listen(None)
                frame_pace.end()

        return Removal(undo)

    def notice(self, text: str) -> None:
        """Show a sentence on every open page; called in the model's thread."""
        for watcher in list(self._watchers.values()):
            watcher.notice(text)

    def _run(self, ready: threading.Event, failure: list[BaseException]) -> None:
        try:
            with asyncio.Runner(loop_factory=_new_loop) as runner:
                runner.run(self._run_model(ready))
        except BaseException as error:
            failure.append(error)
            log.exception("the model's thread ended")
        finally:
            self._loop = None
            ready.set()

    async def _run_model(self, ready: threading.Event) -> None:
        loop = self._loop = asyncio.get_running_loop()
        gate = self.gate = self.make_gate()
        watch = ShiftWatch(shift_log)

        def pass_on(report: Report) -> None:
            loop.call_soon_threadsafe(self._on_report, report)

        gate.on_report(pass_on)
        if not RobotMotion.agent:  # displays log what they do with an agent's robots
            shift_log.begin(state_folder() / FOLDER)
            shift_log.note("webmap", "WebMap started", event="started")
            gate.on_report(watch.on_report)
        gate.start()
        try:
            lifecycle.begin(loop)
            if self._serves_pages:
                audience.expect_pages(loop)
            RobotMotion.gate = gate
            for motion in list(robot_motions):
                motion.declare_or_complain()
            ready.set()
            await self._ending.wait()
        finally:
            for fn in self._on_stop:
                fn()
            frame_request.listen(None)
            frame_pace.end()
            if self._next_frames is not None:
                self._next_frames.cancel()
                self._next_frames = None
            audience.end()
            RobotMotion.gate = None
            watch.end()
            await asyncio.to_thread(gate.stop)
            self.gate = None
            shift_log.note("webmap", "WebMap ended", event="ended")
            await lifecycle.end()
            await asyncio.to_thread(close_peers)
            await asyncio.to_thread(shift_log.end)

    def _on_change(self) -> None:
        """Make frames soon: the first change since the last ones."""
        if threading.current_thread() is not self._thread:
            self.call(self._on_change)
        elif self._watchers:
            self._make_frames_in(frame_pace.due(self.frame_rate) - time.monotonic())

    def _make_frames_in(self, seconds: float) -> None:
        if self._next_frames is not None:
            self._next_frames.cancel()
        loop = self._started_loop()
        if seconds <= 0.0:  # after what came with the change
            self._next_frames = loop.call_soon(self._make_frames)
        else:
            self._next_frames = loop.call_later(seconds, self._make_frames)

    def _make_frames(self) -> None:
        now, number = time.monotonic(), 0
        frame_pace.prepare()
        frame_request.begin()
        for watcher in list(self._watchers.values()):
            try:
                number += watcher.tick(now)
            except Exception:
                log.exception("a frame for %r failed", watcher)
        frame_pace.made(now, time.monotonic() - now, number)
        self._next_frames = None
        if frame_request.is_made:  # something changed meanwhile
            self._on_change()
        elif self._watchers:
            self._make_frames_in(max(REST, frame_pace.due(self.frame_rate) - now))

    def _on_report(self, report: Report) -> None:
        if isinstance(report, RefusedCount):
            now = datetime.now(UTC)
            refusals.note(report.by, report.count, report.last, now)
            shift_log.note("refused", report.last, person=report.by, count=report.count)
            return
        if isinstance(report, GateDown):
            for each in list(robots.values()):
                if not each.motion.is_far:
                    each.on_gate_down()
            if report.failing:
                self.notice(report.why)
            return
        name = getattr(report, "robot", None)
        robot = None if name is None else robots.get(name)
        if robot is None:
            return
        if isinstance(report, RobotReport):
            robot.on_gate_report(report)
        elif isinstance(report, SentTwist):
            robot.on_written("twist", twist_message(report))
        elif isinstance(report, SentGoal):
            robot.on_written("move", goal_message(report))
        elif isinstance(report, SentPose):
            robot.expect_jump()
        elif isinstance(report, Refused):
            robot.notify_modules("on_refused", report.what, report.why)


def twist_message(sent: SentTwist) -> dict[str, Any]:
    """Return a velocity that the gate wrote as a ``geometry_msgs/Twist``.

    It is in the robot's own frame, in metres and radians per second. It is a Twist also
    if the topic has type TwistStamped.
    """
    twist = Twist(sent.vx, sent.vy, sent.wz, sent.vz, sent.wx, sent.wy)
    return twist.to_message()


def goal_message(sent: SentGoal) -> dict[str, Any]:
    """Return a goal that the gate sent as a ``geometry_msgs/Pose``.

    It is on the common map, in metres, and has no header. The robot received the same
    pose in its own map, in the frame of its move topic.
    """
    q = Quaternion.from_yaw(sent.yaw)
    return {
        "position": {"x": sent.x, "y": sent.y, "z": 0.0},
        "orientation": {"x": q.x, "y": q.y, "z": q.z, "w": q.w},
    }


def _all_gates() -> "Gates":
    from webmap.agents.gates import Gates

    return Gates()


def _new_loop() -> asyncio.AbstractEventLoop:
    try:
        import uvloop
    except ImportError:
        return asyncio.new_event_loop()
    return uvloop.new_event_loop()


runtime = Runtime()
"""The model's thread of this process."""
