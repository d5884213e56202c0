"""The frames of a ROS system, heard once for all robots that need them."""

import asyncio
import logging
import time
from collections.abc import Callable
from functools import partial

from webmap.core.frame_faults import FrameFaults
from webmap.errors import ProtocolError
from webmap.geometry import Quaternion, Vector3
from webmap.ros.bridge import Bridge
from webmap.ros.messages import TFMessage
from webmap.scope import Removal, no_scope
from webmap.tf import Buffer, Transform, TransformError

log = logging.getLogger("webmap.tf")

TYPE = "tf2_msgs/TFMessage"

QUEUE = 100
"""Messages that a bridge may hold back: many nodes share the topic, and each counts."""

GRACE = 3.0
"""Seconds since the link first opened in which nobody misses a frame: who tells of it
is still being found, and static ones come late."""

_heard: dict[tuple[Bridge, str], "Frames"] = {}


class Frames:
    """A buffer that ``/tf`` and ``/tf_static`` of one namespace fill, while needed.

    Args:
        bridge: The link to the ROS system.
        namespace: Of both topics: ``/robot_0`` for ``/robot_0/tf``.

    """

    def __init__(self, bridge: Bridge, namespace: str) -> None:
        self.bridge = bridge
        self.namespace = namespace
        self.buffer = Buffer()
        self.faults = FrameFaults(self.buffer)
        """What was wrong with transforms of late."""
        self._listeners: dict[int, Callable[[], object]] = {}
        self._since = time.monotonic()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._timer: asyncio.TimerHandle | None = None
        with no_scope():
            self._hears_open = bridge.on_open(self._opened)
            self._subscriptions = [
                bridge.subscribe(
                    f"{namespace}/{topic}",
                    partial(self._hear, topic == "tf_static"),
                    TYPE,
                    decode=TFMessage,
                    queue_length=QUEUE,
                )
                for topic in ("tf", "tf_static")
            ]

    def join(self, listener: Callable[[], object]) -> Removal:
        """Call ``listener`` whenever frames have moved, until the removal."""
        key = id(listener)
        self._listeners[key] = listener

        def leave() -> None:
            del self._listeners[key]
            if not self._listeners:
                self._end()

        return Removal(leave)

    @property
    def complete_from(self) -> float:
        """From when on a frame that is not there is missing, on the monotonic clock."""
        return self._since + GRACE

    def wake(self, after: float) -> None:
        """Call all listeners once more, also if nothing is heard until then.

        Args:
            after: Seconds from now; who wakes them sooner does it for all.

        """
        if self._loop is None:
            return
        when = self._loop.time() + after
        if self._timer is not None:
            if self._timer.when() <= when:
                return
            self._timer.cancel()
        self._timer = self._loop.call_at(when, self._wake)

    def _opened(self) -> None:
        if self._loop is None:
            self._loop = asyncio.get_running_loop()
            self._since = time.monotonic()
            self.wake(GRACE)

    def _wake(self) -> None:
        self._timer = None
        self._tell()

    def _tell(self) -> None:
        for listener in list(self._listeners.values()):
            listener()

    def _end(self) -> None:
        _heard.pop((self.bridge, self.namespace), None)
        self._hears_open.remove()
        for subscription in self._subscriptions:
            subscription.remove()
        if self._timer is not None:
            self._timer.cancel()

    def _hear(self, static: bool, message: TFMessage) -> None:
        now = time.monotonic()
        for each in message.transforms:
            parent = self.buffer.name(each.frame_id, self.namespace)
            child = self.buffer.name(each.child_frame_id, self.namespace)
            place, turn = each.transform.translation, each.transform.rotation
            try:
                note = self.buffer.add(
                    parent,
                    child,
                    Transform(
                        Vector3(place.x, place.y, place.z),
                        Quaternion(turn.x, turn.y, turn.z, turn.w),
                    ),
                    each.stamp,
                    static=static,
                )
            except TransformError as error:
                note = f"a transform was left out: {error}"
            except ProtocolError as error:  # Of its stamp, which names no frames.
                note = f"a transform was left out: {parent!r} -> {child!r}: {error}"
            if note and self.faults.note(parent, child, note, now):
                log.warning("%s: %s", self.bridge.name, note)
        if not static or self.faults.any:
            self._tell()


def frames_of(bridge: Bridge, namespace: str = "") -> Frames:
    """Return the frames of a ROS system; those who ask alike get the same."""
    space = "/" + namespace.strip("/") if namespace.strip("/") else ""
    key = (bridge, space)
    if key not in _heard:
        _heard[key] = Frames(bridge, space)
    return _heard[key]
