"""The transforms between all frames, over the last seconds."""

import difflib
import heapq
import math
from collections import deque
from collections.abc import Iterable, Sequence

from webmap.tf.errors import (
    FrameMissing,
    NotConnected,
    NotKnownThen,
    TransformError,
)
from webmap.tf.track import Track
from webmap.tf.transform import Transform

HISTORY = 10.0
"""Seconds of transforms that are kept."""

GAP = 1.0
"""Seconds between two transforms beyond which nothing is told in between."""

JUMP = 1.0
"""Seconds by which a stamp may be older than the newest; more is a jump of time."""

SHARED = ("map", "world", "earth")
"""Frames that are the same for all robots, whatever namespace tells of them."""

MOST_FRAMES = 4096
"""Frames that are known at a time; of more, those heard of longest ago go."""

LONGEST_NAME = 256
"""Characters of a frame's name."""

MOST_COMPARED = 200
"""Frames up to which it is looked for one whose name is like a missing one."""

_LISTED = 12
_SENTENCES = 100


class Buffer:
    """Knows where frames are in each other, from what it is told.

    Args:
        history: How much is kept before the newest transform, in seconds.
        gap: The longest time between two transforms that is bridged, in seconds.
        shared: Frames that no namespace gets in front of.

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
        """What was odd and was dealt with, in sentences, the newest last."""
        self._tracks: dict[str, Track] = {}
        """By the frame; the one that was heard of longest ago is the first."""
        self._roots: dict[str, int] = {}
        """How many frames hang from each that any hangs from."""
        self._missing: dict[str, str] = {}
        """What is said of frames that are missing, until others come or go."""

    @property
    def frames(self) -> list[str]:
        """The names of all frames, sorted."""
        return sorted({*self._tracks, *self._roots})

    def name(self, frame: str, namespace: str = "") -> str:
        """Return the whole name of a frame that was told in a namespace.

        ``base_link`` on ``/robot_0/tf`` is ``robot_0/base_link``. A slash in front,
        as ROS 1 had it once, is left out, and what has the namespace in front
        already keeps its name.
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
        """Take one transform.

        Args:
            parent: The frame that the numbers are in: the header's.
            child: The frame whose place they are.
            transform: Takes coordinates of the child to those of the parent.
            stamp: When it held, in seconds of the robot's clock.
            static: Whether it holds for all times: it came on ``/tf_static``.
            namespace: Of the topic: ``/robot_0`` for ``/robot_0/tf``.

        Returns:
            What was odd and was dealt with, in a sentence; None if nothing was.

        Raises:
            TransformError: If it is none, would close a loop, or is of one frame too
                many; nothing is changed. There are too many once all are static, or
                have others that hang from them.

        """
        parent, child = self.name(parent, namespace), self.name(child, namespace)
        longest = max(len(parent), len(child))
        if longest > LONGEST_NAME:
            raise TransformError(
                f"a frame has a name of {longest} characters; {LONGEST_NAME} are the "
                f"limit: {max(parent, child, key=len)[:40]!r}..."
            )
        said = f"{parent!r} -> {child!r}"
        if not parent or not child:
            raise TransformError(f"{said}: a frame has no name")
        try:
            transform = transform.checked()
        except TransformError as error:
            raise TransformError(f"{said}: {error}") from None
        if not math.isfinite(stamp):
            raise TransformError(f"{said}: the stamp is {stamp}")
        track, note = self._track(parent, child, static)
        newest = track.newest
        if newest is not None and stamp < newest - JUMP:
            note = (
                f"{said}: time jumped back by {newest - stamp:.3f} s; what was known "
                f"of it is forgotten"
            )
            track.clear()
        track.add(transform, stamp, self.history)
        if note is not None:
            self.notes.append(note)
        return note

    def lookup(
        self,
        target: str,
        source: str,
        time: float | None = None,
        *,
        ahead: float = 0.0,
    ) -> Transform:
        """Return what takes coordinates of ``source`` to those of ``target``.

        Args:
            target: The frame that is wanted.
            source: The frame that the numbers are in.
            time: When, in seconds of the robot's clock; None for the newest time at
                which the whole way is known.
            ahead: How long after its newest transform a frame is taken to go on as it
                did, in seconds.

        Raises:
            FrameMissing: If nobody told of a frame; the words name what there is.
            NotConnected: If nothing leads from one to the other.
            NotKnownThen: If a part of the way is not known at that time.

        """
        target, source = self._known(target), self._known(source)
        if target == source:
            return Transform()
        down, up = self._way(target, source)
        if time is None:
            time = self._newest_common([*down, *up])
        return self._along(down, time, ahead).inverse @ self._along(up, time, ahead)

    def newest(self, target: str, source: str) -> float | None:
        """Return the newest time at which the way is known; None for all times.

        Raises:
            FrameMissing: If nobody told of a frame.
            NotConnected: If nothing leads from one to the other.

        """
        down, up = self._way(self._known(target), self._known(source))
        stamps = [self._tracks[frame].newest for frame in (*down, *up)]
        return min((stamp for stamp in stamps if stamp is not None), default=None)

    def chain(self, frame: str) -> list[str]:
        """Return a frame and those that it hangs from, up to the root."""
        return self._ancestors(self.name(frame))

    def clear(self) -> None:
        """Forget everything."""
        self._tracks.clear()
        self._roots.clear()
        self._missing.clear()

    def _track(self, parent: str, child: str, static: bool) -> tuple[Track, str | None]:
        """Return where to keep a transform; parents and kinds may change."""
        track = self._tracks.get(child)
        if track is not None and track.parent == parent and track.static == static:
            self._tracks[child] = self._tracks.pop(child)
            return track, None
        self._refuse_loop(parent, child)
        if track is None and len(self._tracks) >= MOST_FRAMES:
            self._make_room(parent, child)
        note = None
        if track is not None and track.parent != parent:
            note = (
                f"{child!r} was in {track.parent!r} and is in {parent!r} now; if that "
                f"happens again and again, two nodes tell of it"
            )
            self._let_go(track.parent)
        if track is None or parent not in self._roots:
            self._missing.clear()
        if track is None or track.parent != parent:
            self._roots[parent] = self._roots.get(parent, 0) + 1
        self._tracks.pop(child, None)
        self._tracks[child] = found = Track(parent, static=static)
        return found, note

    def _make_room(self, parent: str, child: str) -> None:
        """Forget the frame that was heard of longest ago, for one that is new.

        What detects things may name a new frame for each. Static frames stay, as they
        are told once, and so does whatever others hang from.
        """
        for frame, track in self._tracks.items():
            if not track.static and frame not in self._roots and frame != parent:
                self._let_go(track.parent)
                del self._tracks[frame]
                return
        raise TransformError(
            f"{parent!r} -> {child!r}: there are {MOST_FRAMES} frames already"
        )

    def _let_go(self, parent: str) -> None:
        self._roots[parent] -= 1
        if not self._roots[parent]:
            del self._roots[parent]
            self._missing.clear()

    def _refuse_loop(self, parent: str, child: str) -> None:
        way = [parent]
        while way[-1] != child:
            track = self._tracks.get(way[-1])
            if track is None:
                return
            way.append(track.parent)
        loop = " -> ".join(map(repr, [child, *reversed(way[:-1]), child]))
        raise TransformError(f"{parent!r} -> {child!r} would close a loop: {loop}")

    def _known(self, frame: str) -> str:
        name = self.name(frame)
        if name in self._tracks or name in self._roots:
            return name
        if len(name) > LONGEST_NAME:
            raise FrameMissing(
                f"there is no frame with a name of {len(name)} characters; "
                f"{LONGEST_NAME} are the limit: {name[:40]!r}..."
            )
        said = self._missing.get(name)
        if said is None:  # Robots and modules ask for it at each message.
            if len(self._missing) >= _SENTENCES:
                self._missing.clear()
            self._missing[name] = said = self._sentence(name)
        raise FrameMissing(said)

    def _sentence(self, name: str) -> str:
        """Return what is said of a frame that is missing."""
        frames = {*self._tracks, *self._roots}
        hint = ""
        if len(frames) <= MOST_COMPARED:
            near = difflib.get_close_matches(name, sorted(frames), n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
        listed = ", ".join(heapq.nsmallest(_LISTED, frames)) or "none"
        more = f" and {len(frames) - _LISTED} more" if len(frames) > _LISTED else ""
        return f"there is no frame {name!r}{hint}; there are: {listed}{more}"

    def _way(self, target: str, source: str) -> tuple[list[str], list[str]]:
        """Return the frames below the common ancestor, on both sides."""
        down, up = self._ancestors(target), self._ancestors(source)
        common = set(down) & set(up)
        if not common:
            raise NotConnected(
                f"nothing leads from {source!r} to {target!r}: the one is in the tree "
                f"of {up[-1]!r}, the other in that of {down[-1]!r}"
            )
        meet = next(frame for frame in up if frame in common)
        return down[: down.index(meet)], up[: up.index(meet)]

    def _ancestors(self, frame: str) -> list[str]:
        way = [frame]
        while (track := self._tracks.get(way[-1])) is not None:
            way.append(track.parent)
        return way

    def _along(self, frames: Sequence[str], time: float, ahead: float) -> Transform:
        """Return what takes the first frame's coordinates to the last one's parent."""
        total = Transform()
        for frame in reversed(frames):
            track = self._tracks[frame]
            try:
                total = total @ track.at(time, self.gap, ahead)
            except NotKnownThen as error:
                raise NotKnownThen(f"{track.parent!r} -> {frame!r}: {error}") from None
        return total

    def _newest_common(self, frames: Iterable[str]) -> float:
        stamps = [self._tracks[frame].newest for frame in frames]
        return min((stamp for stamp in stamps if stamp is not None), default=0.0)
