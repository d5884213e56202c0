"""Values that change many times a second: poses, lines, dots, rays and ages."""

import math
import struct
import time
from collections import deque
from collections.abc import Iterable
from typing import Any, NamedTuple, Self

import msgspec

from webmap.base.errors import SceneError
from webmap.base.geometry import Affine
from webmap.scene.node import Fragment, Parent

isfinite = math.isfinite

STILL, STILL_TURN = 1e-4, 1e-5
"""Metres and radians by which a pose must change to be sent: a tenth of a millimetre,
also of what is drawn ten metres from the origin of the element."""

AGES_EVERY = 0.5
"""Seconds between two frames for a page on which only ages change."""

SOON = 0.85
"""The part of its limit that an age may reach on a page while a newer one waits."""

SAME = 0.001
"""Seconds by which two times of measurement may differ and count as the same; pages
get milliseconds."""


class Dots(NamedTuple):
    """Points to draw as small squares."""

    points: bytes
    """Pairs of 16-bit integers, little-endian: x and y."""

    unit: float
    """Metres in one unit of ``points``."""


class Rays(msgspec.Struct, frozen=True, gc=False):
    """Where the rays of a scan hit, to draw a small square at each point."""

    ranges: bytes
    """Distances in metres, as 32-bit floats, little-endian; NaN where nothing was hit.
    """

    total: int
    """Number of rays of the whole scan; those of ``ranges`` are evenly chosen."""

    first: float
    """Bearing of the first ray, in radians."""

    turn: float
    """Radians from each ray of the scan to the next one."""

    place: Affine = Affine()
    """The transform from the plane of the scan to the element, in metres."""

    moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Pose of the sensor after the last ray, relative to that at the first one: x and y
    in metres, yaw in radians."""


class Age(msgspec.Struct, frozen=True, gc=False):
    """When the data of an element was measured, by this process's clock."""

    measured: float
    """Seconds of :func:`time.monotonic`; -inf if there was never any data."""

    limit: float
    """Seconds after which the data is stale."""

    shown: bool
    """Whether the age is shown as the element's text."""


class MapPlace(NamedTuple):
    """The map properties of an ``<svg>``."""

    world_id: int
    """The group in it whose matrix is the view."""

    width: float
    """Pixels, or 0 for the width of its container."""

    height: float
    """Pixels, or 0 for the height of its container."""


_POINT = struct.Struct("<ff").pack


class Line:
    """The points of a line; a page gets only those that it does not have yet."""

    __slots__ = ("added", "points")

    KNOWN = 32
    """Most changes that are known one by one: a page that is later gets all points."""

    def __init__(self, points: bytearray) -> None:
        self.points = points
        """Pairs of 32-bit floats, little-endian: x and y."""
        self.added: deque[tuple[int, int, int]] = deque(maxlen=self.KNOWN)
        """The fragment of each change, its revision then, and how many points came."""

    def __len__(self) -> int:
        return len(self.points) // 8

    def __str__(self) -> str:
        pairs = struct.iter_unpack("<ff", self.points)
        return " ".join(f"{x:.7g},{y:.7g}" for x, y in pairs)

    def new_since(self, fragment: Fragment, revision: int) -> int:
        """Return how many of the last points a page lacks that has a revision."""
        new = 0
        for changed_in, when, added in reversed(self.added):
            # A page got the points of an earlier place together with the element.
            if changed_in != fragment.id or when <= revision:
                return min(new, len(self))
            new += added
        return len(self)


class Live(Parent):
    """A node whose pose, line, dots and age can be set cheaply at every tick."""

    __slots__ = ("_age", "_coded", "_dots", "_map", "_reach", "_transform")

    _attributes: dict[str, str | Line]
    namespace = "svg"

    def __init__(self) -> None:
        super().__init__()
        # The newest of: an attribute's text, a pose (x, y, yaw), a matrix.
        self._transform: str | tuple[float, float, float] | Affine | None = None
        self._dots: Dots | Rays | None = None
        self._coded: dict[float, Any] = {}
        """The encoded dots by detail; a cache of the encoder."""
        self._reach: tuple[Dots | Rays, float] | None = None
        """Dots, and the distance within which they are; a cache of the encoder."""
        self._age: Age | None = None
        self._map: MapPlace | None = None

    def set_pose(self, x: float, y: float, yaw: float) -> None:
        """Place the element in its parent; replaces the previous placement.

        A pose that differs by less than anyone can see changes nothing, so that the
        rounding errors of a robot that does not move are not sent.

        Args:
            x: Metres.
            y: Metres.
            yaw: Radians, counter-clockwise.

        Raises:
            SceneError: If a number is not finite.

        """
        if not isfinite(x + y + yaw):
            raise SceneError(f"a pose must be finite, got {x}, {y}, {yaw}")
        placed = self._transform
        if not isinstance(placed, tuple) or (
            abs(placed[0] - x) >= STILL
            or abs(placed[1] - y) >= STILL
            or abs(placed[2] - yaw) >= STILL_TURN
        ):
            self._place((x, y, yaw))

    def set_matrix(self, matrix: Affine) -> None:
        """Place the element in its parent by an affine map; replaces the previous one.

        Raises:
            SceneError: If a component is not finite.

        """
        if not all(map(isfinite, matrix.values)):
            raise SceneError(f"a matrix must be finite, got {matrix}")
        if matrix != self._transform:
            self._place(matrix)

    def _place(self, transform: tuple[float, float, float] | Affine) -> None:
        if self.namespace != "svg":
            raise SceneError(f"{self!r} is not SVG, so it has no pose")
        self._transform = transform
        self._touch("transform")

    def set_line(self, points: Iterable[tuple[float, float]]) -> Self:
        """Draw the element, a ``polyline`` or a ``polygon``, through points.

        They are sent as 32-bit floats: faster and shorter than text, and as exact as
        browsers draw. ``get("points")`` returns them as text, with seven digits.

        Raises:
            SceneError: If the element is no polyline or polygon, or a number is not
                finite or too large for 32 bits.

        """
        line, before = Line(self._packed(points)), self._attributes.get("points")
        if not isinstance(before, Line) or before.points != line.points:
            self._attributes["points"] = line
            self._record(line, len(line))
        return self

    def extend_line(
        self, points: Iterable[tuple[float, float]], *, drop: int = 0
    ) -> Self:
        """Add points to a line or begin one; a page gets only the new points.

        Args:
            points: x and y of each point.
            drop: How many points are removed from the beginning of the line before.

        Raises:
            SceneError: If ``drop`` is below 0, and in the cases of :meth:`set_line`.

        """
        line, data = self._attributes.get("points"), self._packed(points)
        if drop < 0:
            raise SceneError(f"drop must be at least 0, got {drop}")
        if data or drop:
            if not isinstance(line, Line):
                line = self._attributes["points"] = Line(bytearray())
            del line.points[: 8 * drop]
            line.points += data
            self._record(line, len(data) // 8)
        return self

    def _packed(self, points: Iterable[tuple[float, float]]) -> bytearray:
        if self.tag not in ("polyline", "polygon"):
            raise SceneError(f"{self!r} is not a polyline or polygon, so it is no line")
        data = bytearray()
        try:
            for x, y in points:
                if not isfinite(x + y):
                    raise OverflowError
                data += _POINT(x, y)
        except OverflowError:
            text = "a line must be of finite numbers within 32 bits"
            raise SceneError(text) from None
        return data

    def _record(self, line: Line, added: int) -> None:
        at = self.fragment
        if at is not None:
            at.touch(self, "points")
        line.added.append((0, 0, added) if at is None else (at.id, at.revision, added))

    def set_dots(self, points: bytes | bytearray | memoryview, unit: float) -> None:
        """Draw the element, a ``path``, as a small square at each point.

        The width of the squares is the CSS custom property ``--dot-size``, in metres.

        Args:
            points: Pairs of 16-bit integers, little-endian: x and y of each point.
            unit: Metres in one unit of ``points``.

        Raises:
            SceneError: If the element is no path, if there is half a point, or if
                ``unit`` is not a finite number above 0.

        """
        if self.tag != "path":
            raise SceneError(f"{self!r} is not a path, so it cannot be drawn as dots")
        data = bytes(points)
        if len(data) % 4:
            raise SceneError(f"points are 4 bytes each, got {len(data)} bytes in all")
        if not (isfinite(unit) and unit > 0):
            raise SceneError(f"unit must be a number of metres above 0, got {unit}")
        self._set_dots(Dots(data, unit))

    def set_rays(self, rays: Rays) -> None:
        """Draw the element, a ``path``, as a small square where each ray hit.

        A page gets the distances as exactly as it can show them. The squares are those
        of :meth:`set_dots`.

        Raises:
            SceneError: If the element is no path, there is part of a distance, there
                are more distances than rays, or another number is not finite.

        """
        if self.tag != "path":
            raise SceneError(f"{self!r} is not a path, so it cannot be drawn as rays")
        size = len(rays.ranges)
        if size % 4 or size > 4 * rays.total:
            raise SceneError(
                f"distances are 4 bytes each, got {size} bytes for {rays.total} rays"
            )
        numbers = (rays.first, rays.turn, *rays.place.values, *rays.moved)
        if not all(map(isfinite, numbers)):
            raise SceneError(f"the numbers of rays must be finite, got {numbers}")
        self._set_dots(rays)

    def _set_dots(self, dots: Dots | Rays) -> None:
        if dots != self._dots:
            self._dots = dots
            self._touch("dots")

    def set_age(
        self,
        seconds_old: float,
        *,
        limit: float | None = None,
        age_text: bool | None = None,
    ) -> None:
        """Set the age of the data that the element shows.

        From then on every page counts the age by itself, shows it in ``data-age`` and
        gives the element the class ``stale`` beyond the limit, even when it cannot
        reach this process. A page gets an age with the next change of the scene. If
        nothing else changes, a newer age waits up to :data:`AGES_EVERY` seconds, unless
        the page would show the data as stale meanwhile.

        Args:
            seconds_old: Seconds since the data was measured; infinity if there was none
                yet.
            limit: Seconds after which the data is stale; initially 1.
            age_text: Whether the page shows the age as the element's text; initially
                not.

        Raises:
            SceneError: If ``seconds_old`` or ``limit`` is NaN or below 0.

        """
        if not seconds_old >= 0:
            raise SceneError(f"an age must be at least 0 s, got {seconds_old}")
        if limit is not None and not (limit >= 0 and isfinite(limit)):
            raise SceneError(f"the limit of an age must be at least 0 s, got {limit}")
        old = self._age
        if old is None:
            old = Age(-math.inf, 1.0, False)
            self._touch("age-limit")
        if limit is None:
            limit = old.limit
        if age_text is None:
            age_text = old.shown
        if limit != old.limit or age_text != old.shown:
            self._touch("age-limit")
        now = time.monotonic()
        measured = now - seconds_old
        if measured == old.measured or abs(measured - old.measured) < SAME:
            self._age = Age(old.measured, limit, age_text)
            return
        self._age = Age(measured, limit, age_text)
        self._touch("age", waits=_may_wait(old.measured, measured, now, limit))


def _may_wait(before: float, measured: float, now: float, limit: float) -> bool:
    """Return whether pages that have the age ``before`` can get the newer one later.

    Every page gets the ages at the next multiple of :data:`AGES_EVERY`. Data that is
    older than before goes at once: a page must not show it as newer than it is.
    """
    then = (now // AGES_EVERY + 1) * AGES_EVERY
    return before < measured and then - before <= SOON * limit
