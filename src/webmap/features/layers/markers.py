"""Markers: shapes that ROS programs publish for people."""

import asyncio
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from webmap.base.errors import ProtocolError, WebMapError
from webmap.base.geometry import Affine, Pose, Quaternion
from webmap.base.scope import Removal, keep
from webmap.features.layers.marker_drawing import (
    ADD,
    CLASSES,
    DELETE,
    DELETE_ALL,
    LETTERS,
    TEXT_VIEW_FACING,
    MarkerArrayMsg,
    MarkerMsg,
    draw,
    sizes,
)
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import check_finite, flat, in_space
from webmap.modules.map_layer import LayerFrames, MapLayer, not_known
from webmap.ros.tf import Transform, TransformError
from webmap.scene import svg
from webmap.scene.element import Element

Put = Callable[[Transform], object]
"""Places a marker at the present pose of its frame."""


@dataclass(slots=True)
class _Moving:
    frame: str
    stamp: float
    locked: bool
    put: Put


class MarkerFrames(LayerFrames):
    """Finds the frames of markers on the map, and follows those that move."""

    def _begin(self) -> None:
        self._moving: dict[object, _Moving] = {}
        self._lost: dict[str, str] = {}

    def place(
        self, key: object, frame_id: str, stamp: float, locked: bool, put: Put
    ) -> Transform:
        """Return the transform from a marker's frame to the map.

        Args:
            key: The key of the marker.
            frame_id: The marker's frame; empty if not given.
            stamp: Time of the frame, in seconds of the robot's clock; 0 for now.
            locked: Whether the marker follows later motion of the frame.
            put: Called when the frame has moved, or becomes known.
        """
        self._moving.pop(key, None)
        source = self._source(frame_id)
        if source is None:
            return Transform()
        stamp = 0.0 if locked else stamp
        found, settled = self._find(source, stamp)
        if locked or not settled:
            self._moving[key] = _Moving(source, stamp, locked, put)
        return found

    def forget(self, key: object) -> None:
        """Forget a deleted marker, whose frame need not be known any more."""
        self._moving.pop(key, None)

    def report_unknown(self) -> None:
        """Report the unknown frames, or withdraw the report."""
        needed = {moving.frame for moving in self._moving.values()}
        self._lost = {f: text for f, text in self._lost.items() if f in needed}
        text = ""
        if self._lost:
            frame, why = next(iter(self._lost.items()))
            more = len(self._lost) - 1
            text = not_known(frame, why) + f" (and {more} more)" * bool(more)
        self._show_trouble(text)

    def _on_frames(self) -> None:
        if not self._moving:
            return
        places: dict[tuple[str, float], tuple[Transform, bool]] = {}
        for key, each in tuple(self._moving.items()):
            wanted = (each.frame, each.stamp)
            if wanted not in places:
                places[wanted] = self._find(*wanted)
            found, settled = places[wanted]
            each.put(found)
            if settled and not each.locked:
                self.forget(key)
        self.report_unknown()

    def _find(self, source: str, stamp: float) -> tuple[Transform, bool]:
        """Return the pose of a frame, and whether it is final."""
        try:
            found = self._look(source, stamp)
        except TransformError as error:
            if source not in self._lost:
                self._lost[source] = str(error)
            return Transform(), False
        self._lost.pop(source, None)
        return found

    def _align(self, aligned: Pose) -> None:
        self._layer.svg.set_pose(aligned.x, aligned.y, aligned.yaw)


MAX_MARKERS = 5000
"""Greatest number of markers of one topic."""


MarkerType: TypeAlias = Literal[
    "visualization_msgs/MarkerArray",
    "visualization_msgs/Marker",
    "visualization_msgs/msg/MarkerArray",
    "visualization_msgs/msg/Marker",
]
"""The types of markers, in both dialects."""

VIEWS: dict[str, type[MarkerMsg] | type[MarkerArrayMsg]] = {
    "visualization_msgs/MarkerArray": MarkerArrayMsg,
    "visualization_msgs/Marker": MarkerMsg,
}

Key = tuple[str, int]

LONGEST_NAME = 256
"""Greatest number of characters of a marker's namespace."""

MOST_COUNTED = 100_000
"""Greatest number of left-out markers that are counted."""

SETTLED = 0.5
"""Seconds from the first left-out marker to the report of their number."""

_LEFT_OUT = "left out"
"""The problem of too many markers."""

_MOVED = "moved"
"""The problem of markers that cannot be drawn at the new pose of their frames."""


@layer(
    *VIEWS,
    view=VIEWS,
    kinds=[TopicKind("markers")],
    switch="Markers",
    rank=120,
)
class Markers(MapLayer):
    """Markers that ROS programs publish, as seen from above.

    Arrows, cubes, spheres, cylinders, lines, lists of them, points, triangles and texts
    are drawn, with their colours; meshes are not. A marker that is not valid is left
    out and reported; all others are drawn. The action DELETEALL deletes all markers of
    the topic; in ROS 2, with a namespace, only those of the namespace.

    Each marker is drawn where its own frame was at its stamp, and a ``frame_locked``
    marker follows the frame. A marker whose frame is unknown is drawn without a
    transform, and this is reported until the frame is known. A tilted marker is drawn
    as its outline looks from above.

    Style it by CSS: ``.markers > .marker``, with the type as a further class
    (``arrow``, ``cube``, ``line-strip``, ``text`` and so on) and the namespace in
    ``data-ns``: ``.marker[data-ns="goals"] { display: none }``.
    """

    # Every message counts, because it may delete earlier markers.
    queue_length = 100

    type: MarkerType = "visualization_msgs/MarkerArray"
    """``visualization_msgs/MarkerArray`` or ``visualization_msgs/Marker``."""

    def lay(self) -> None:
        """Place the layer on the common map, and each marker in its frame."""
        self.frames = MarkerFrames(
            self, self.bridge, self.map_frame, self.namespace, self.robot
        )

    def build(self) -> None:
        """Prepare the layer; there are no markers yet."""
        self.shapes: dict[Key, Element] = {}
        """The drawn markers, by namespace and number."""
        self._appearances: dict[Key, tuple[object, ...]] = {}
        self._ends: dict[Key, float] = {}
        self._timer: asyncio.TimerHandle | None = None
        self._left_out: set[Key] = set()
        """Markers beyond :data:`MAX_MARKERS`."""
        self._count_timer: asyncio.TimerHandle | None = None
        keep(Removal(self._forget_timer))
        keep(Removal(self._forget_count))
        keep(Removal(lambda: self.clear_problem(_MOVED)))
        keep(Removal(lambda: self.clear_problem(_LEFT_OUT)))

    def take(self, message: MarkerArrayMsg | MarkerMsg) -> None:
        """Add, change and delete markers.

        Raises:
            ProtocolError: If a marker is not valid; all others are drawn.
        """
        single = isinstance(message, MarkerMsg)
        markers = [message] if isinstance(message, MarkerMsg) else message.markers
        wrong: list[str] = []
        self.clear_problem(_MOVED)
        for marker in markers:
            try:
                self._take(marker)
            except WebMapError as error:
                wrong.append(_wrong(marker, error))
        self.frames.report_unknown()
        self._set_timer()
        self.be_new()
        if wrong:
            more = "" if single else f" ({len(wrong)} of {len(markers)} are left out)"
            raise ProtocolError(wrong[0] + more)

    def _take(self, marker: MarkerMsg) -> None:
        key = (marker.ns, marker.id)
        if len(marker.ns) > LONGEST_NAME:
            raise ProtocolError(
                f"a namespace of {len(marker.ns)} characters; the limit is "
                f"{LONGEST_NAME}"
            )
        if marker.action == ADD:
            self._put(key, marker)
        elif marker.action == DELETE:
            self._forget_left_out({key})
            self._drop(key)
        elif marker.action == DELETE_ALL:
            cleared = {
                k for k in (*self.shapes, *self._left_out) if marker.clears(k[0])
            }
            self._forget_left_out(cleared)
            for each in cleared:
                self._drop(each)
        else:
            raise ProtocolError(
                f"an action is 0 (add or modify), 2 (delete) or 3 (delete all), got "
                f"{marker.action}"
            )

    def _put(self, key: Key, marker: MarkerMsg) -> None:
        if key not in self.shapes and len(self.shapes) >= MAX_MARKERS:
            self._leave_out(key)
            return
        self._forget_left_out({key})
        lifetime = marker.lifetime.seconds
        frame = self.frames.place(
            key,
            marker.frame_id,
            marker.stamp,
            marker.frame_locked,
            lambda frame: self._move(key, marker, frame),
        )
        try:
            self._show(key, marker, frame)
        except WebMapError:
            self.frames.forget(key)
            raise
        self._ends.pop(key, None)
        if lifetime > 0:
            self._ends[key] = time.monotonic() + lifetime

    def _forget_left_out(self, keys: set[Key]) -> None:
        if self._left_out:
            self._left_out -= keys
            if not self._left_out:
                self.clear_problem(_LEFT_OUT)

    def _leave_out(self, key: Key) -> None:
        """Count a marker beyond the limit; the number is reported with a delay."""
        if len(self._left_out) < MOST_COUNTED:
            self._left_out.add(key)
        if self._count_timer is None:
            loop = asyncio.get_running_loop()
            self._count_timer = loop.call_later(SETTLED, self._report_left_out)

    def _report_left_out(self) -> None:
        self._count_timer = None
        count = len(self._left_out)
        if count:
            more = " or more" * (count == MOST_COUNTED)
            self.set_problem(
                _LEFT_OUT,
                f"{self.topic}: {count}{more} markers are left out: at most "
                f"{MAX_MARKERS} are drawn",
            )
        else:
            self.clear_problem(_LEFT_OUT)

    def _move(self, key: Key, marker: MarkerMsg, frame: Transform) -> None:
        """Place a marker at the present pose of its frame.

        A marker that cannot be drawn there is left out, because its old position is
        wrong. The first such marker is reported until the next message.
        """
        try:
            self._show(key, marker, frame)
        except WebMapError as error:
            self._drop(key)
            if _MOVED not in self.problems:
                self.set_problem(_MOVED, f"{self.topic}: {_wrong(marker, error)}")

    def _show(self, key: Key, marker: MarkerMsg, frame: Transform) -> None:
        """Place a marker, and draw it again if it looks different from above."""
        before, look = self.shapes.get(key), appearance(marker, frame)
        if before is not None and self._appearances[key] == look:
            place(before, marker, frame)
        else:
            self._draw(key, before, shape_of(marker, frame), marker)
            self._appearances[key] = look

    def _draw(
        self, key: Key, before: Element | None, shape: Element, marker: MarkerMsg
    ) -> None:
        shape.set(data_ns=marker.ns, data_id=str(marker.id))
        if before is None:
            self.svg.append(shape)
        else:
            self.svg.insert(self.svg.children.index(before), shape)
            before.remove()
        self.shapes[key] = shape

    def _drop(self, key: Key) -> None:
        shape = self.shapes.pop(key, None)
        self._appearances.pop(key, None)
        self._ends.pop(key, None)
        self.frames.forget(key)
        if shape is not None:
            shape.remove()

    def _set_timer(self) -> None:
        """Wake up when the next marker's lifetime ends."""
        self._forget_timer()
        if self._ends:
            wait = max(0.0, min(self._ends.values()) - time.monotonic())
            loop = asyncio.get_running_loop()
            self._timer = loop.call_later(wait, self._end_some)

    def _end_some(self) -> None:
        now = time.monotonic()
        for key in [key for key, end in self._ends.items() if end <= now]:
            self._drop(key)
        self._set_timer()

    def _forget_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _forget_count(self) -> None:
        if self._count_timer is not None:
            self._count_timer.cancel()
            self._count_timer = None


def _wrong(marker: MarkerMsg, error: WebMapError) -> str:
    return f"marker {marker.id} of {marker.ns[:LONGEST_NAME]!r}: {error}"


MAX_POINTS = 20_000
"""Greatest number of points of one marker."""

DECIMALS = 3
"""Decimals of a rotation that decide whether a tilting marker is drawn again."""

IDENTITY = Transform()
"""The identity: draws a marker with its own coordinates."""


def shape_of(marker: MarkerMsg, frame: Transform = IDENTITY) -> Element:
    """Return a marker as a group at its pose, seen from above.

    Args:
        marker: The marker.
        frame: See :func:`place`.

    Raises:
        ProtocolError: If its type cannot be drawn, or a number is not valid.
    """
    name = CLASSES.get(marker.type)
    if name is None:
        raise ProtocolError(f"markers of type {marker.type} are not drawn")
    if len(marker.points) > MAX_POINTS:
        raise ProtocolError(
            f"it has {len(marker.points)} points; the limit is {MAX_POINTS}"
        )
    if marker.colors and len(marker.colors) != len(marker.points):
        raise ProtocolError(
            f"it has {len(marker.colors)} colours for {len(marker.points)} points"
        )
    group = svg.g(class_=f"marker {name}")
    place(group, marker, frame)
    group.append(*draw(marker, _split(marker, frame)[1]))
    return group


def appearance(marker: MarkerMsg, frame: Transform = IDENTITY) -> tuple[object, ...]:
    """Return all values that a marker's shape depends on, except its position.

    Args:
        marker: The marker.
        frame: See :func:`place`.

    Raises:
        ProtocolError: If its pose is not valid.
    """
    m = marker
    q = _split(m, frame)[1].rotation
    sign = math.copysign(1.0, q.w)  # both signs are the same rotation
    tilt = (round(sign * part, DECIMALS) + 0.0 for part in (q.x, q.y, q.z, q.w))
    return (m.type, m.scale, m.color, m.points, m.colors, m.text, *tilt)


def place(shape: Element, marker: MarkerMsg, frame: Transform = IDENTITY) -> None:
    """Place an already drawn shape at its marker's pose.

    Args:
        shape: The shape.
        marker: The shape's marker.
        frame: The transform from the marker's frame to the map.

    Raises:
        ProtocolError: If its pose is not valid.
    """
    at, _ = _split(marker, frame)
    if marker.type == TEXT_VIEW_FACING:
        # y points up in the world, and down in letters.
        size = sizes(marker, "z")[0] / LETTERS
        shape.set_matrix(Affine(size, 0, 0, -size, at.x, at.y))
    else:
        shape.set_pose(at.x, at.y, at.yaw)


def _split(marker: MarkerMsg, frame: Transform) -> tuple[Pose, Transform]:
    """Return the marker's pose in the plane, and its tilt there."""
    if marker.type == TEXT_VIEW_FACING:
        # The orientation of this type has no meaning, and is often not set.
        at = marker.pose.position
        check_finite([(at.x, at.y)], "the place of a text")
        (found,) = flat(in_space([at]), frame)
        return Pose(*found), Transform()
    (place,) = in_space([marker.pose.position])
    _ = marker.pose.usable
    q = marker.pose.orientation.quaternion
    n = q.norm
    turn = Quaternion(q.x / n, q.y / n, q.z / n, q.w / n)
    pose, tilt = (frame @ Transform(place, turn)).heading_and_tilt
    return pose, Transform(rotation=tilt.rotation)
