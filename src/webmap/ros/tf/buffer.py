"""The transforms between all frames, over the last seconds."""

import difflib
import heapq
import math
from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST, Quaternion, Vector3
from webmap.ros.messages import Time, TransformRow
from webmap.ros.tf.track import Track
from webmap.ros.tf.transform import (
    FrameMissing,
    NotConnected,
    NotKnownThen,
    Transform,
    TransformError,
)

HISTORY = 10.0
"""Seconds of transforms that are kept."""

GAP = 1.0
"""Seconds between two transforms above which nothing is interpolated."""

JUMP = 1.0
"""Seconds by which a stamp may be older than the newest; more is a jump of time."""

SHARED = ("map", "world", "earth")
"""Frames that are the same for all robots, in any namespace."""

MOST_FRAMES = 4096
"""Most frames; above that, the one without a transform for the longest time goes."""

LONGEST_NAME = 256
"""Most characters of a frame's name."""

_EXACT = 1e-9
"""Greatest difference of a quaternion's norm from 1 that is only rounding."""

MOST_COMPARED = 200
"""Frames up to which a name like that of a missing frame is searched."""

_LISTED = 12
_SENTENCES = 100
_MOST_PATHS = 1000


def names_of(row: TransformRow) -> tuple[str, str]:
    """Return the names of the parent frame and of the child frame."""
    return row[4], row[5]


class Found(NamedTuple):
    """The transform between two frames, as far as it is known."""

    transform: Transform
    """From coordinates of the source to those of the target."""

    newest: float | None
    """The newest time at which all transforms between are known; None for all times."""

    on_time: bool
    """Whether the transform is of the requested time, not of the newest."""


class _TrackPath(NamedTuple):
    """The tracks between two frames, up to their nearest common ancestor."""

    down: list[Track]
    """From the target up."""

    up: list[Track]
    """From the source up."""

    @property
    def newest(self) -> float | None:
        """The newest time at which all tracks are known; None for all times."""
        found = None
        for tracks in self:
            for track in tracks:
                newest = track.newest
                if newest is not None and (found is None or newest < found):
                    found = newest
        return found


class Buffer:
    """The frames of one ROS system, each in its parent, over the last seconds.

    Args:
        history: Time before the newest transform that is kept, in seconds.
        gap: The longest time between two transforms for interpolation, in seconds.
        shared: Frames whose names get no namespace.

    """

    def __init__(
        self,
        history: float = HISTORY,
        *,
        gap: float = GAP,
        shared: Iterable[str] = SHARED,
    ) -> None:
        self.history = history
        self.gap = gap
        self.shared = frozenset(shared)
        self.notes: deque[str] = deque(maxlen=20)
        """Faults that were handled, in sentences, the newest last."""
        self._tracks: dict[str, Track] = {}
        """By the frame; the first one has had no transform for the longest time."""
        self._usual: dict[tuple[str, str, str], Track] = {}
        """The tracks since the tree of frames last changed, by the names in messages
        and the namespace."""
        self._roots: dict[str, int] = {}
        """The number of child frames of each parent frame."""
        self._missing: dict[str, str] = {}
        """The sentences about missing frames, until the frames change."""
        self._paths: dict[tuple[str, str], _TrackPath] = {}
        """The results of lookups since the tree of frames last changed."""

    @property
    def frames(self) -> list[str]:
        """The names of all frames, sorted."""
        return sorted({*self._tracks, *self._roots})

    def name(self, frame: str, namespace: str = "") -> str:
        """Return the full name of a frame that was published in a namespace.

        ``base_link`` on ``/robot_0/tf`` is ``robot_0/base_link``. A leading slash, as
        in early ROS 1, is removed. A name that already begins with the namespace is
        unchanged.
        """
        frame, space = frame.strip().strip("/"), namespace.strip("/")
        if not space or frame in self.shared or frame.startswith(f"{space}/"):
            return frame
        return f"{space}/{frame}" if frame else ""

    def add(
        self,
        parent: str,
        child: str,
        transform: Transform,
        stamp: float,
        *,
        static: bool = False,
        namespace: str = "",
    ) -> str | None:
        """Add one transform.

        Args:
            parent: The frame of the header.
            child: The frame whose position and rotation the numbers give.
            transform: From coordinates of the child to those of the parent.
            stamp: The time of the transform, in seconds of the robot's clock.
            static: Whether it holds for all times: it came on ``/tf_static``.
            namespace: The namespace of the topic: ``/robot_0`` for ``/robot_0/tf``.

        Returns:
            A fault that was handled, in a sentence; None if there was none.

        Raises:
            TransformError: If the transform is invalid, would close a loop, or is of
                one frame too many; nothing is changed. A frame is too many if no other
                can be dropped: static frames and frames with children stay.

        """
        parent, child = self._full_names(parent, child, namespace)
        names = f"{parent!r} -> {child!r}"
        try:
            transform = transform.checked()
        except TransformError as error:
            raise TransformError(f"{names}: {error}") from None
        if not math.isfinite(stamp):
            raise TransformError(f"{names}: the stamp is {stamp}")
        track, note = self._track(parent, child, static)
        newest = track.newest
        if newest is not None and stamp < newest - JUMP:
            note = (
                f"{names}: time jumped back by {newest - stamp:.3f} s; the previous "
                f"transforms of this frame were discarded"
            )
            track.clear()
        track.add(transform, stamp, self.history)
        if note is not None:
            self.notes.append(note)
        return note

    def add_row(
        self, row: TransformRow, *, static: bool = False, namespace: str = ""
    ) -> str | None:
        """Add one transform of a message; see :meth:`add`.

        Raises:
            TransformError: As :meth:`add` does; and if the stamp is invalid.

        """
        secs, nsecs, sec, nanosec, parent, child, x, y, z, qx, qy, qz, qw = row
        try:
            stamp = Time(secs, nsecs, sec, nanosec).seconds
        except ProtocolError as error:
            parent, child = self._full_names(parent, child, namespace)
            raise TransformError(f"{parent!r} -> {child!r}: {error}") from None
        transform = Transform(Vector3(x, y, z), Quaternion(qx, qy, qz, qw))
        track = self._usual.get((parent, child, namespace))
        if (  # nearly always; else the same is done by steps that find the reason
            track is not None
            and track.static == static
            and stamp > track.last
            and abs(math.hypot(qx, qy, qz, qw) - 1.0) < _EXACT
            and math.hypot(x, y, z) < FARTHEST
        ):
            self._tracks[track.frame] = self._tracks.pop(track.frame)
            track.add(transform, stamp, self.history)
            return None
        note = self.add(
            parent, child, transform, stamp, static=static, namespace=namespace
        )
        if len(self._usual) >= MOST_FRAMES:
            self._usual.clear()
        known = self._tracks[self.name(child, namespace)]
        self._usual[parent, child, namespace] = known
        return note

    def lookup(
        self,
        target: str,
        source: str,
        time: float | None = None,
        *,
        ahead: float = 0.0,
    ) -> Transform:
        """Return the transform from coordinates of ``source`` to those of ``target``.

        Args:
            target: The frame of the result.
            source: The frame of the given coordinates.
            time: The time, in seconds of the robot's clock; None for the newest time at
                which all transforms between are known.
            ahead: Seconds after the newest transform of a frame for which its motion is
                extrapolated.

        Raises:
            FrameMissing: If a frame does not exist; the sentence names existing ones.
            NotConnected: If the frames are in two trees.
            NotKnownThen: If a transform between them is not known at that time.

        """
        path = self._path(target, source)
        return self._along(path, (path.newest or 0.0) if time is None else time, ahead)

    def lookup_carried(
        self, target: str, source: str, carrier: str, time: float
    ) -> tuple[Transform, Transform | None]:
        """Return the transform of a frame at a time, and that of one that carries it.

        Args:
            target: The frame of the results.
            source: The frame of the given coordinates, such as that of a sensor.
            carrier: A frame that is usually between both, such as that of the base:
                both transforms then cost as much as one.
            time: The time, in seconds of the robot's clock.

        Returns:
            The transforms from the source, as by :meth:`lookup`, and from the carrier,
            as by :meth:`find`; None if the latter is not known.

        Raises:
            TransformError: If the first is not known; see :meth:`lookup`.

        """
        path = self._path(target, source)
        if not path.down:
            whole, carried = self._to_ancestor(path.up, time, 0.0, carrier)
            if carried is not None:
                return whole, carried
        else:
            whole = self._along(path, time, 0.0)
        try:
            return whole, self.find(target, carrier, time).transform
        except TransformError:
            return whole, None

    def find(self, target: str, source: str, time: float = 0.0) -> Found:
        """Return the transform at a time, or the newest one if that time is not known.

        Args:
            target: The frame of the result.
            source: The frame of the given coordinates.
            time: The time, in seconds of the robot's clock; 0 for the newest.

        Raises:
            FrameMissing: If a frame does not exist; the sentence names existing ones.
            NotConnected: If the frames are in two trees.
            NotKnownThen: If there is no time at which all transforms between are known.

        """
        path = self._path(target, source)
        newest = path.newest
        if time:
            try:
                return Found(self._along(path, time, 0.0), newest, True)
            except NotKnownThen:
                pass
        return Found(self._along(path, newest or 0.0, 0.0), newest, False)

    def newest(self, target: str, source: str) -> float | None:
        """Return the newest time at which all between is known; None for all times.

        Raises:
            FrameMissing: If a frame does not exist.
            NotConnected: If the frames are in two trees.

        """
        return self._path(target, source).newest

    def chain(self, frame: str) -> list[str]:
        """Return a frame and its ancestors, up to the root."""
        return self._ancestors(self.name(frame))

    def _full_names(self, parent: str, child: str, namespace: str) -> tuple[str, str]:
        """Return the full names of two frames; TransformError if one is invalid."""
        parent, child = self.name(parent, namespace), self.name(child, namespace)
        longest = max(len(parent), len(child))
        if longest > LONGEST_NAME:
            raise TransformError(
                f"a frame has a name of {longest} characters; the limit is "
                f"{LONGEST_NAME}: {max(parent, child, key=len)[:40]!r}..."
            )
        if not parent or not child:
            raise TransformError(f"{parent!r} -> {child!r}: a frame has no name")
        return parent, child

    def _track(self, parent: str, child: str, static: bool) -> tuple[Track, str | None]:
        """Return the track of a frame, a new one if its parent or kind has changed."""
        track = self._tracks.get(child)
        if track is not None and track.parent == parent and track.static == static:
            self._tracks[child] = self._tracks.pop(child)
            return track, None
        self._paths.clear()
        self._usual.clear()
        self._refuse_loop(parent, child)
        if track is None and len(self._tracks) >= MOST_FRAMES:
            self._make_room(parent, child)
        note = None
        if track is not None and track.parent != parent:
            note = (
                f"{child!r} was in {track.parent!r} and is in {parent!r} now; if that "
                f"happens again and again, two nodes publish it"
            )
            self._remove_child(track.parent)
        if track is None or parent not in self._roots:
            self._missing.clear()
        if track is None or track.parent != parent:
            self._roots[parent] = self._roots.get(parent, 0) + 1
        self._tracks.pop(child, None)
        self._tracks[child] = found = Track(parent, child, static=static)
        return found, note

    def _make_room(self, parent: str, child: str) -> None:
        """Drop the frame without a transform for the longest time, for a new frame.

        A detector may name a new frame for each detected object. Static frames stay,
        since they are published once, and so do frames with children.
        """
        for frame, track in self._tracks.items():
            if not track.static and frame not in self._roots and frame != parent:
                self._remove_child(track.parent)
                del self._tracks[frame]
                return
        raise TransformError(
            f"{parent!r} -> {child!r}: there are {MOST_FRAMES} frames already"
        )

    def _remove_child(self, parent: str) -> None:
        self._roots[parent] -= 1
        if not self._roots[parent]:
            del self._roots[parent]
            self._missing.clear()

    def _refuse_loop(self, parent: str, child: str) -> None:
        chain = [parent]
        while chain[-1] != child:
            track = self._tracks.get(chain[-1])
            if track is None:
                return
            chain.append(track.parent)
        loop = " -> ".join(map(repr, [child, *reversed(chain[:-1]), child]))
        raise TransformError(f"{parent!r} -> {child!r} would close a loop: {loop}")

    def _known(self, frame: str) -> str:
        name = self.name(frame)
        if name in self._tracks or name in self._roots:
            return name
        if len(name) > LONGEST_NAME:
            raise FrameMissing(
                f"there is no frame with a name of {len(name)} characters; "
                f"the limit is {LONGEST_NAME}: {name[:40]!r}..."
            )
        sentence = self._missing.get(name)
        if sentence is None:  # asked for at each message
            if len(self._missing) >= _SENTENCES:
                self._missing.clear()
            self._missing[name] = sentence = self._sentence(name)
        raise FrameMissing(sentence)

    def _sentence(self, name: str) -> str:
        """Return the sentence about a missing frame."""
        frames = {*self._tracks, *self._roots}
        hint = ""
        if len(frames) <= MOST_COMPARED:
            near = difflib.get_close_matches(name, sorted(frames), n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
        listed = ", ".join(heapq.nsmallest(_LISTED, frames)) or "none"
        more = f" and {len(frames) - _LISTED} more" if len(frames) > _LISTED else ""
        return f"there is no frame {name!r}{hint}; there are: {listed}{more}"

    def _path(self, target: str, source: str) -> _TrackPath:
        """Return the tracks between two frames, by their names as given."""
        path = self._paths.get((target, source))
        if path is None:
            path = self._find_path(self._known(target), self._known(source))
            if len(self._paths) >= _MOST_PATHS:
                self._paths.clear()
            self._paths[target, source] = path
        return path

    def _find_path(self, target: str, source: str) -> _TrackPath:
        down, up = self._ancestors(target), self._ancestors(source)
        common = set(down) & set(up)
        if not common:
            raise NotConnected(
                f"no transform connects {source!r} to {target!r}: {source!r} is in the "
                f"tree of {up[-1]!r}, {target!r} in the tree of {down[-1]!r}"
            )
        meet = next(frame for frame in up if frame in common)
        return _TrackPath(
            [self._tracks[frame] for frame in down[: down.index(meet)]],
            [self._tracks[frame] for frame in up[: up.index(meet)]],
        )

    def _ancestors(self, frame: str) -> list[str]:
        chain = [frame]
        while (track := self._tracks.get(chain[-1])) is not None:
            chain.append(track.parent)
        return chain

    def _along(self, path: _TrackPath, time: float, ahead: float) -> Transform:
        """Return the transform from the source of the tracks to their target."""
        up, _ = self._to_ancestor(path.up, time, ahead)
        if not path.down:
            return up
        down, _ = self._to_ancestor(path.down, time, ahead)
        return down.inverse @ up

    def _to_ancestor(
        self, tracks: list[Track], time: float, ahead: float, carrier: str = ""
    ) -> tuple[Transform, Transform | None]:
        """Return the transform from the first frame to the last one's parent.

        And that from the carrier, None if it is not one of the frames.
        """
        total = carried = None
        for track in reversed(tracks):
            try:
                found = track.at(time, self.gap, ahead)
            except NotKnownThen as error:
                raise NotKnownThen(f"{track.name}: {error}") from None
            total = found if total is None else total @ found
            if track.frame == carrier:
                carried = total
        return total or Transform(), carried
