"""Which dots a page gets, how exactly, and their bytes, encoded once for all pages.

A page gets the dots of an element while they are near its view and not switched off,
and no dots otherwise: it must not show old ones when its viewer looks there. A page
that has just opened gets dots when it has reported its view: dots are half of the
bytes, and the robots are shown sooner without them.
"""

import math
import struct
from collections.abc import Iterable, Mapping
from typing import NamedTuple, cast

from webmap.base.geometry import Affine, Pose
from webmap.scene.element import Element
from webmap.scene.live import Dots, Rays
from webmap.scene.node import Fragment, Node, frame_request
from webmap.scene.wire.messages import ViewReport
from webmap.scene.wire.opcodes import Op, varint
from webmap.scene.wire.page_state import MapView, Mount

FINEST = 0.001
"""Metres to which the distances of scans are rounded at a close view."""

COARSEST = 1.0
"""Metres to which they are rounded at the most distant view."""

PARTS = 8
"""They are rounded to an eighth of a pixel, or finer."""

PATIENCE = 1.0
"""Seconds after its first frame in which a page reports its view."""

MARGIN = 0.25
"""The part of a map's size by which dots may be outside of its view and are sent."""

_FLOAT = struct.Struct("<f").pack
_NONE = _FLOAT(FINEST) + varint(0)


def detail_for(views: Iterable[MapView]) -> float:
    """Return the metres that a page can distinguish on some of its maps.

    It is one of few steps, so that pages with similar views share what is encoded.
    """
    pixel = min((view.pixel for view in views), default=0.0)
    if pixel <= FINEST * PARTS:
        return FINEST
    steps = math.floor(math.log2(pixel / PARTS / FINEST))
    return min(COARSEST, FINEST * 2.0**steps)


class PageDots:
    """The dots that one page has.

    Args:
        mounts: The mounts of the page, by number.
        map_views: The maps of the page, by the element.

    """

    def __init__(
        self, mounts: Mapping[int, Mount], map_views: Mapping[int, MapView]
    ) -> None:
        self._mounts = mounts
        self._map_views = map_views
        self._detail = FINEST
        self._finer = False
        self._off: frozenset[int] = frozenset()
        self._empty: set[int] = set()
        self._views: dict[Fragment, list[ViewReport | None]] = {}
        self._waits = False
        self._until: float | None = None
        self.due = False
        """Whether the page may need dots of fragments that did not change."""

    def view_changed(self) -> None:
        """Take the views that the page reported."""
        before, self._detail = self._detail, detail_for(self._map_views.values())
        self._finer = self._finer or self._detail < before
        self._look_again()

    def switch_off(self, elements: Iterable[int]) -> None:
        """Set the elements that the page does not show, by their ids."""
        self._off = frozenset(elements)
        self._look_again()

    def mounts_changed(self) -> None:
        """Set that mounts were added or removed."""
        self._views.clear()

    def restart(self) -> None:
        """Set that the page has nothing, and that all it shows is shown."""
        self._off = frozenset()
        self._empty.clear()
        self._until = None
        self._look_again()

    def wait(self, now: float) -> None:
        """Decide for the next frame whether all dots wait for the page's view."""
        if self._until is None:
            self._until = now + PATIENCE
        views = self._map_views.values()
        unknown = bool(views) and all(view.report is None for view in views)
        waited, self._waits = self._waits, unknown and now < self._until
        if waited and not self._waits:
            self._look_again()

    def sent(self) -> None:
        """Set that the page got the records of all fragments."""
        self.due = self._finer = False

    def _look_again(self) -> None:
        frame_request.make()
        self.due = True
        self._views.clear()

    def records(self, fragment: Fragment, since: int | None) -> bytes:
        """Return the records of the dots of a fragment that a page needs.

        Args:
            fragment: The fragment; the records before must be of the same one.
            since: The revision that the page has; None if it has nothing of it.

        """
        if not fragment.dotted:
            return b""
        if self._waits:
            self._empty.update(fragment.dotted)
            return b""
        out: list[bytes] = []
        for element, place in _places(fragment):
            if element.id in self._off or not self._sees(fragment, place):
                if element.id not in self._empty:
                    self._empty.add(element.id)
                    if since is not None and element._attached <= since:
                        out.append(_head(Op.DOTS, element) + _NONE)
                continue
            had = None if self._finer or element.id in self._empty else since
            self._empty.discard(element.id)
            changed = max(element._attached, element._slots.get("dots", 0))
            if had is None or changed > had:
                coded = _coded(element, self._detail)
                if had is None or max(element._attached, coded.since) > had:
                    out.append(coded.data)
        return b"".join(out)

    def _sees(self, fragment: Fragment, place: "Place | None") -> bool:
        views = self._views.get(fragment)
        if views is None:
            views = self._views[fragment] = [
                self._view_of(mount)
                for mount in self._mounts.values()
                if mount.fragment is fragment
            ]
        return place is None or any(_in_view(view, place) for view in views)

    def _view_of(self, mount: Mount) -> ViewReport | None:
        """Return the view that a fragment is in; None if it is not known."""
        while mount.within in self._mounts:
            under, mount = mount.under, self._mounts[mount.within]
            node = mount.fragment.find(under)
            world = self._world_in(mount)
            while node is not None and node.id != world:
                if getattr(node, "_transform", None) is not None:
                    return None
                node = node.parent
            if node is not None:
                return self._report_in(mount)
        return None

    def _world_in(self, mount: Mount) -> int:
        for view in self._map_views.values():
            svg = mount.fragment.find(view.svg) if view.mount == mount.number else None
            if isinstance(svg, Element) and svg._map is not None:
                return svg._map.world_id
        return 0

    def _report_in(self, mount: Mount) -> ViewReport | None:
        views = self._map_views.values()
        return next((v.report for v in views if v.mount == mount.number), None)


class Place(NamedTuple):
    """A circle around dots, in metres of the fragment."""

    x: float
    y: float
    radius: float


def _in_view(view: ViewReport | None, place: Place) -> bool:
    if view is None:
        return True
    x = view.a * place.x + view.c * place.y + view.e
    y = view.b * place.x + view.d * place.y + view.f
    radius = place.radius * math.hypot(view.a, view.b, view.c, view.d)
    radius += MARGIN * max(view.width, view.height)
    return -radius <= x <= view.width + radius and -radius <= y <= view.height + radius


def _places(fragment: Fragment) -> list[tuple[Element, Place | None]]:
    """Return where the dots of a fragment are; the same for all pages."""
    known = fragment.places
    if known is None or known[0] != fragment.revision:
        nodes = cast("Iterable[Element]", fragment.dotted.values())
        found = [(node, _place_of(node)) for node in nodes]
        known = fragment.places = (fragment.revision, found)
    return cast("list[tuple[Element, Place | None]]", known[1])


def _place_of(element: Element) -> Place | None:
    """Return where the dots of an element are; None if that is not known."""
    dots = element._dots
    assert dots is not None  # it is in a fragment's table of dots
    x = y = 0.0
    if element._reach is None or element._reach[0] is not dots:
        element._reach = (dots, reach_of(dots))
    radius = element._reach[1]
    node: Node | None = element
    while node is not None:
        transform = getattr(node, "_transform", None)
        if isinstance(transform, str):
            return None
        if isinstance(transform, tuple):
            transform = Affine.of_pose(Pose(*transform))
        if transform is not None:
            x, y = transform.apply(x, y)
            a, b, c, d, _, _ = transform.values
            # The length of a direction grows by no more than this.
            radius *= 1.0 if (a, b) == (d, -c) else math.hypot(a, b, c, d)
        node = node.parent
    return Place(x, y, radius)


def reach_of(dots: Dots | Rays) -> float:
    """Return the distance from the element's origin within which all dots are."""
    import numpy as np

    if isinstance(dots, Rays):
        reach = np.frombuffer(dots.ranges, "<f4")
        farthest = float(reach.max(initial=0.0, where=np.isfinite(reach)))
        a, b, c, d, e, f = dots.place.values
        farthest += math.hypot(*dots.moved[:2])
        return farthest * math.hypot(a, b, c, d) + math.hypot(e, f)
    points = np.frombuffer(dots.points, "<i2")
    most, least = points.max(initial=0), points.min(initial=0)
    return math.sqrt(2) * max(int(most), -int(least)) * dots.unit


# Bytes ---------------------------------------------------------------------------


class _Coded(NamedTuple):
    """The encoded dots of an element at one detail."""

    dots: Dots | Rays
    """What is encoded."""

    since: int
    """The revision since which the bytes are the same."""

    data: bytes


def _coded(element: Element, detail: float) -> _Coded:
    dots = element._dots
    assert dots is not None  # it is in a fragment's table of dots
    known: _Coded | None = element._coded.get(detail)
    if known is not None and known.dots is dots:
        return known
    if isinstance(dots, Rays):
        from webmap.scene.wire.rays import encode_rays

        data = _head(Op.RAYS, element) + encode_rays(dots, detail)
    else:
        head = _head(Op.DOTS, element)
        data = head + _FLOAT(dots.unit) + varint(len(dots.points) // 4) + dots.points
    since = element._slots.get("dots", 0)
    if known is not None and known.data == data:
        since = known.since
    coded = element._coded[detail] = _Coded(dots, since, data)
    return coded


def _head(op: Op, element: Element) -> bytes:
    return bytes((op, *varint(element.id)))
