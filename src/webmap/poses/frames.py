"""The frames of a ROS system, received once for all robots that need them."""

import asyncio
import logging
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from webmap.base.audience import audience
from webmap.base.scope import Removal, no_scope
from webmap.poses.placing import ProblemDelay
from webmap.ros.bridge import Bridge
from webmap.ros.messages import TFMessage
from webmap.ros.subscriptions import Subscription
from webmap.ros.tf import Buffer, TransformError
from webmap.ros.tf.buffer import LONGEST_NAME, names_of

log = logging.getLogger("webmap.ros.tf")


TYPE = "tf2_msgs/TFMessage"

QUEUE = 100
"""The bridge's queue length: many nodes share the topic, and each message counts."""

GRACE = 3.0
"""Seconds after the connection first opened, or frames are received again, in which no
frame is reported missing: publishers are still being discovered, and static frames
arrive late."""

PERIOD = 1 / 60
"""The least time between two calls of the listeners in seconds: transforms that arrive
meanwhile share one call, however many nodes share the topic."""

SHARE, LONGEST = 0.1, 0.05
"""The part of a core that calls of listeners may take before they come less often, and
the longest time between two of them for that reason, in seconds."""

KEPT_FOR = 10.0
"""Seconds for which a fault of frames that move is shown after it last occurred."""

MOST = 50
"""The greatest number of frames whose faults are kept."""

_shared_frames: dict[tuple[Bridge, str], "Frames"] = {}


@dataclass(slots=True)
class _Fault:
    frames: tuple[str, str]
    text: str
    seen: float


class FrameFaults:
    """The faults of transforms, kept for a while after they last occurred.

    Args:
        buffer: The frames; a fault concerns the robots whose frames descend from it.

    """

    def __init__(self, buffer: Buffer) -> None:
        self._buffer = buffer
        self._faults: dict[str, _Fault] = {}

    @property
    def any(self) -> bool:
        """Whether a fault of any transform is kept now."""
        return bool(self._faults)

    def note(
        self, parent: str, child: str, text: str, now: float, *, lasts: bool = False
    ) -> bool:
        """Add a fault of a transform.

        Args:
            parent: The frame of the transform's numbers.
            child: The frame that is placed.
            text: The fault in a sentence.
            now: The time of any monotonic clock, in seconds.
            lasts: Whether it lasts until :meth:`mend`, since its message is not sent
                again.

        Returns:
            Whether it is new; a fault of every message is new once.

        """
        known, seen = self._faults.get(child), math.inf if lasts else now
        if known is not None:
            known.seen = max(known.seen, seen)
            return False
        if len(self._faults) >= MOST:
            return False
        self._faults[child] = _Fault((parent, child), text, seen)
        return True

    def mend(self, child: str) -> None:
        """Remove a lasting fault of a frame, which has a valid transform now."""
        if child in self._faults and self._faults[child].seen == math.inf:
            del self._faults[child]

    def current(self, now: float) -> list[_Fault]:
        """Return all faults, and forget those that last occurred too long ago."""
        for child in [c for c, f in self._faults.items() if now >= f.seen + KEPT_FOR]:
            del self._faults[child]
        return list(self._faults.values())

    def of(self, base: str, now: float) -> str | None:
        """Return a fault of the frames that place a robot, or None.

        Args:
            base: The robot's own frame. Its ancestors concern the robot, and so do
                frames with the same prefix.
            now: As in :meth:`note`.

        """
        if not self._faults:
            return None
        space = base.rpartition("/")[0]
        chain = set(self._buffer.chain(base))
        for fault in self.current(now):
            if chain.intersection(fault.frames) or (
                space and any(name.startswith(f"{space}/") for name in fault.frames)
            ):
                return fault.text
        return None


class Frames:
    """A buffer filled by ``/tf`` and ``/tf_static`` of one namespace, while needed.

    Args:
        bridge: The connection to the ROS system.
        namespace: The namespace of both topics: ``/robot_0`` for ``/robot_0/tf``.

    """

    def __init__(self, bridge: Bridge, namespace: str) -> None:
        self.bridge = bridge
        self.namespace = namespace
        self.buffer = Buffer()
        self.faults = FrameFaults(self.buffer)
        """The recent faults of transforms."""
        self.received_at = time.monotonic()
        """When the first transform of the current call of the listeners arrived, in
        seconds of :func:`time.monotonic`."""
        self._pending_since: float | None = None
        self._next_call = -math.inf
        self._listeners: dict[int, Callable[[], object]] = {}
        self._needs: dict[int, Callable[[], bool]] = {}
        self._raised: set[tuple[int, type[Exception]]] = set()
        self._since = time.monotonic()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._soon: asyncio.TimerHandle | None = None
        with no_scope():
            self._open_removal = bridge.on_open(self._opened)
            self._moving: Subscription | None = self._subscribe("tf")
            self._static = self._subscribe("tf_static")
        audience.follow(self)

    def _subscribe(self, topic: str) -> Subscription:
        return self.bridge.subscribe(
            f"{self.namespace}/{topic}",
            partial(self._on_message, topic == "tf_static"),
            TYPE,
            decode=TFMessage,
            queue_length=QUEUE,
        )

    def join(
        self,
        listener: Callable[[], object],
        needs: Callable[[], bool] = lambda: False,
    ) -> Removal:
        """Call ``listener`` when frames have moved, until the removal.

        The call is immediate, or :data:`PERIOD` after the last call, or later if the
        calls take long.

        Args:
            listener: The function.
            needs: Returns whether it needs the frames also while nobody looks; else it
                is not called then.

        """
        key = id(listener)
        self._listeners[key], self._needs[key] = listener, needs
        self.audience_changed()

        def leave() -> None:
            del self._listeners[key], self._needs[key]
            self._raised = {raised for raised in self._raised if raised[0] != key}
            if self._listeners:
                self.audience_changed()
            else:
                self._end()

        return Removal(leave)

    def audience_changed(self) -> None:
        """Receive frames that move while somebody looks, or a listener needs them.

        A throttle would lose messages of some of the nodes that share the topic.
        """
        needed = audience.present or any(needs() for needs in self._needs.values())
        if needed and self._moving is None:
            self._since = time.monotonic()
            with no_scope():
                self._moving = self._subscribe("tf")
            self.wake(GRACE)
        elif not needed and self._moving is not None:
            self._moving.remove()
            self._moving = None

    @property
    def complete_from(self) -> float:
        """When absent frames start to count as missing, by the monotonic clock.

        Never while they are not received.
        """
        return math.inf if self._moving is None else self._since + GRACE

    def wake(self, after: float) -> None:
        """Call all listeners once more, even if no transform arrives until then.

        Args:
            after: Seconds from now; the earliest of several requests counts.

        """
        if self._loop is None or after == math.inf:
            return
        when = self._loop.time() + after
        if self._timer is not None:
            if self._timer.when() <= when:
                return
            self._timer.cancel()
        self._timer = self._loop.call_at(when, self._wake)

    def _opened(self) -> None:
        self.faults = FrameFaults(self.buffer)  # static frames are sent again
        if self._loop is None:
            self._loop = asyncio.get_running_loop()
            self._since = time.monotonic()
        self.wake(GRACE)

    def _wake(self) -> None:
        self._timer = None
        self._notify()
        # Faults end also when nothing comes any more, or by the next connection.
        if self.faults.any and self.bridge.state == "open":
            self.wake(KEPT_FOR)

    def _notify_soon(self) -> None:
        """Call all listeners; later if they were only just called."""
        loop = self._loop
        # Before the connection opens there is no loop, and no need to limit calls.
        if loop is None or loop.time() >= self._next_call:
            self._notify()
        elif self._soon is None:
            self._soon = loop.call_at(self._next_call, self._notify)

    def _notify(self) -> None:
        if self._soon is not None:
            self._soon.cancel()
            self._soon = None
        since, self._pending_since = self._pending_since, None
        begun = time.monotonic()
        self.received_at = begun if since is None else since
        for key, listener in list(self._listeners.items()):
            try:
                listener()
            except Exception as error:  # The other listeners must run too.
                self._log_raised(key, error)
        if self._loop is not None:  # A slow call leaves time for the rest.
            took = time.monotonic() - begun
            pause = max(PERIOD, min(took / SHARE, LONGEST))
            self._next_call = self._loop.time() + pause

    def _log_raised(self, key: int, error: Exception) -> None:
        """Log an exception of a listener once: it may occur at every call."""
        raised = (key, type(error))
        if raised not in self._raised:
            self._raised.add(raised)
            log.error(
                "%s: a listener to frames raised", self.bridge.name, exc_info=error
            )

    def _end(self) -> None:
        _shared_frames.pop((self.bridge, self.namespace), None)
        self._open_removal.remove()
        audience.forget(self)
        for subscription in (self._static, self._moving):
            if subscription is not None:
                subscription.remove()
        for timer in (self._timer, self._soon):
            if timer is not None:
                timer.cancel()

    def _on_message(self, static: bool, message: TFMessage) -> None:
        now = time.monotonic()
        for row in message.rows:
            note, added = None, True
            try:
                note = self.buffer.add_row(row, static=static, namespace=self.namespace)
            except TransformError as error:
                note, added = f"a transform was left out: {error}", False
            if note is None and not self.faults.any:  # nearly always
                continue
            parent, child = (
                self.buffer.name(name, self.namespace)[:LONGEST_NAME]
                for name in names_of(row)
            )
            if added:
                self.faults.mend(child)
            lasts = static and not added
            if note and self.faults.note(parent, child, note, now, lasts=lasts):
                log.warning("%s: %s", self.bridge.name, note)
                self.wake(KEPT_FOR)
        if not static or self.faults.any:
            if self._pending_since is None:
                self._pending_since = now
            self._notify_soon()


def frame_faults(bridge: Bridge) -> list[str]:
    """Return the recent faults of the frames of a ROS system, in sentences."""
    now, shared = time.monotonic(), _shared_frames.items()
    faults = [frames.faults for (link, _), frames in shared if link is bridge]
    return [fault.text for each in faults for fault in each.current(now)]


def frames_of(bridge: Bridge, namespace: str = "") -> Frames:
    """Return the frames of a ROS system; all callers share them."""
    space = "/" + namespace.strip("/") if namespace.strip("/") else ""
    key = (bridge, space)
    if key not in _shared_frames:
        _shared_frames[key] = Frames(bridge, space)
    return _shared_frames[key]


def delayed_problem(
    delay: ProblemDelay, trouble: str, frames: Frames | None = None
) -> str:
    """Return a trouble once it has lasted, and the empty string before.

    Args:
        delay: The history of the trouble.
        trouble: The current kind; empty if there is none.
        frames: The frames of the trouble, if any. Nothing is returned while they may
            still arrive, and their listeners are called when the trouble is due.

    """
    now = time.monotonic()
    due = delay.due(trouble, now, -math.inf if frames is None else frames.complete_from)
    if due is None:
        return ""
    if now >= due:
        return trouble
    if frames is not None:
        frames.wake(due - now)
    return ""
