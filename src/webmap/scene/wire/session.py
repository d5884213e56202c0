"""The display's side of one page's ``/scene``, without a socket."""

import itertools
import math
import secrets
import struct
import zlib
from typing import Any

import msgspec

from webmap.base.counts import counts
from webmap.base.errors import WireError
from webmap.scene.allowed import check_event
from webmap.scene.element import Element, split_classes
from webmap.scene.live import AGES_EVERY
from webmap.scene.node import Fragment, frame_request
from webmap.scene.wire.dots import PageDots
from webmap.scene.wire.encode import delta, encode_changes
from webmap.scene.wire.messages import (
    ElementEvent,
    ModuleMessage,
    ModuleReady,
    PageEvent,
    PageHello,
    Resync,
    Seen,
    Unseen,
    ViewReport,
    read_message,
)
from webmap.scene.wire.opcodes import RESET, VERSION, Op, string, varint
from webmap.scene.wire.page_state import (
    MapView,
    Mount,
    PendingRecords,
    flags,
)

_HEADER = struct.Struct("<HBId").pack
_GZIP = 16 + zlib.MAX_WBITS


class SceneSession:
    """The state of one page: what was sent to it, and what to send next.

    Call :meth:`frame` after changes and ten times a second, and send every result in
    order: a frame builds on those before it. While the page has not acknowledged
    :data:`WINDOW` frames, there is no next one; changes in the meantime are later sent
    with their newest values.
    """

    WINDOW = 2
    HEARTBEAT = 1.0
    LATE = 0.25
    """Seconds after which an answer is late."""

    LATE_FOR = 10.0
    """Seconds for which a page whose answer was late gets each age at once."""

    LEAST_PACKED = 2000
    """Bytes of a whole scene that is compressed, for a page that reads gzip.

    Changes are not compressed: they are small, and pages share them.
    """

    def __init__(self) -> None:
        self._key = secrets.randbits(31)
        self._mounts: dict[int, Mount] = {}
        self._map_views: dict[int, MapView] = {}
        self._dots = PageDots(self._mounts, self._map_views)
        self._reads_gzip = False
        self._attached: dict[int, tuple[int, bytes]] = {}
        # The revision of each fragment that the page has; None if none yet.
        self._fragments: dict[Fragment, int | None] = {}
        self._numbers = itertools.count(1)
        self._frame = 0
        self._seen = 0
        self._frames_number = 0  # of the last frames with all changes until then
        self._waits = False  # whether changes may wait for an answer of the page
        self._spoke = math.inf
        self._late = -math.inf  # when an answer of the page was late
        self._aged = -math.inf  # the number of the last period whose ages were sent
        self._pending = PendingRecords()

    # Fragments ------------------------------------------------------------------

    def mount(
        self,
        fragment: Fragment,
        *,
        under: int,
        order: float = 0,
        within: int | None = None,
    ) -> int:
        """Show ``fragment`` on the page; it may be shown at several places.

        Args:
            fragment: The fragment to show.
            under: Id of the element in which the fragment's root is placed, or 0 for
                the document.
            order: The drawing order among the fragments under one element: a greater
                one is drawn above; those below 0 are drawn behind the element's own
                children.
            within: The mount that ``under`` belongs to, if any.

        Returns:
            The number of the mount.

        Raises:
            WireError: If ``within`` is not mounted.

        """
        if within is not None:
            self._mount(within)
        number = next(self._numbers)
        self._mounts[number] = Mount(number, fragment, within or 0, under, order)
        self._fragments.setdefault(fragment, None)
        self._pending.new.append(number)
        frame_request.make()
        self._dots.mounts_changed()
        return number

    def unmount(self, mount: int) -> None:
        """Remove a mount from the page, with the mounts within it.

        An unknown mount is ignored.
        """
        gone = self._mounts.pop(mount, None)
        if gone is None:
            return
        self._dots.mounts_changed()
        for inner in [n for n, m in self._mounts.items() if m.within == mount]:
            self.unmount(inner)
        for map_view in [c for c in self._map_views.values() if c.mount == mount]:
            self._forget(map_view)
        if all(m.fragment is not gone.fragment for m in self._mounts.values()):
            del self._fragments[gone.fragment]
        if mount in self._pending.new:
            self._pending.new.remove(mount)
        else:
            self._pending.unmounted(mount)

    def _forget(self, map_view: MapView) -> None:
        del self._map_views[map_view.svg]
        for instance, (svg, _) in list(self._attached.items()):
            if svg == map_view.svg:
                self.detach(instance)

    def _mount(self, number: int) -> Mount:
        try:
            return self._mounts[number]
        except KeyError:
            raise WireError(f"mount {number} is not on the page") from None

    def set_class(self, mount: int, name: str, on: bool) -> None:
        """Add or remove a class of a mount's root, on this page only."""
        place = self._mount(mount)
        for word in split_classes(name):
            if on != (word in place.classes):
                if on:
                    place.classes[word] = None
                else:
                    del place.classes[word]
                self._pending.record(place.class_record(word, on))

    def listen(
        self,
        mount: int,
        element: int,
        event: str,
        *,
        prevent: bool = False,
        stop: bool = False,
    ) -> None:
        """Listen to an event of an element, on this page only.

        Raises:
            SceneError: If the event is not allowed in a scene.

        """
        check_event(event)
        place = self._mount(mount)
        place.listening[element, event] = flags(prevent=prevent, stop=stop)
        self._pending.record(place.listen_record(element, event))

    def unlisten(self, mount: int, element: int, event: str) -> None:
        """Undo :meth:`listen`; does nothing if there is no listener."""
        place = self._mounts.get(mount)
        if place and place.listening.pop((element, event), None) is not None:
            self._pending.record(place.listen_record(element, event))

    def fragment(self, mount: int) -> Fragment | None:
        """Return the fragment of a mount, or None if it is not on the page."""
        place = self._mounts.get(mount)
        return place.fragment if place else None

    def element(self, mount: int, element: int) -> Element | None:
        """Return an element of a mount by its id, or None if it was removed."""
        fragment = self.fragment(mount)
        node = fragment.find(element) if fragment else None
        return node if isinstance(node, Element) else None

    # Maps and modules -----------------------------------------------------------

    def _map_view(self, map_element: int) -> MapView:
        map_view = self._map_views.get(map_element)
        if map_view is None:
            map_view = self._find_map_view(map_element)
            self._map_views[map_element] = map_view
            self._pending.record(map_view.state(self._key))
        return map_view

    def _find_map_view(self, map_element: int) -> MapView:
        for number in self._mounts:
            element = self.element(number, map_element)
            if element is not None and element._map is not None:
                return MapView(number, map_element)
        raise WireError(f"element {map_element} is no map on the page")

    def view(self, map_element: int, operation: str, *args: float) -> None:
        """Move the view of a map: one of translate, scale, rotate, set, fit, follow.

        Args:
            map_element: Id of the map's ``<svg>``.
            operation: ``translate(x, y)`` in pixels; ``scale(factor[, x, y])`` and
                ``rotate(degrees[, x, y])``, counter-clockwise on the page, about a
                point in pixels or by default the centre; ``set(a, b, c, d, e, f)``;
                ``fit(x0, y0, x1, y1)`` in metres; ``follow(element id or 0)``.
            args: The numbers of the operation.

        Raises:
            ValueError: If the operation or its numbers are wrong.
            WireError: If there is no such map on the page.

        """
        map_view = self._map_view(map_element)
        self._pending.record(map_view.operate(operation, args))

    def attach(
        self,
        map_element: int,
        instance: int,
        module_url: str,
        options: dict[str, Any],
        css_url: str | None = None,
    ) -> None:
        """Make the page load a module's browser part and attach it to a map.

        Args:
            map_element: Id of the map's ``<svg>``.
            instance: A number chosen by the caller, for messages.
            module_url: URL of the ES module, relative to the server's root.
            options: Plain data for the module.
            css_url: URL of a style sheet, relative to the server's root.

        """
        self._map_view(map_element)
        record = bytearray([Op.ATTACH]) + varint(map_element) + varint(instance)
        record += string(module_url) + string(css_url or "")
        record += string(msgspec.json.encode(options).decode())
        self._attached[instance] = (map_element, bytes(record))
        self._pending.record(record)

    def detach(self, instance: int) -> None:
        """Remove a module's browser part."""
        if self._attached.pop(instance, None) is not None:
            self._pending.record(bytes((Op.DETACH, *varint(instance))))

    def send(self, instance: int, message: dict[str, Any]) -> None:
        """Send a message to a module's browser part."""
        if instance in self._attached:
            text = msgspec.json.encode(message).decode()
            self._pending.message(bytes((Op.MESSAGE, *varint(instance))) + string(text))

    def error(self, text: str) -> None:
        """Show a notice on the page, and again after a reload."""
        self._pending.notice(text)

    def problem(self, number: int, text: str) -> None:
        """Show a problem until :meth:`mended`; a new text replaces it.

        Args:
            number: Chosen by the caller; the same for one problem on every page.
            text: A sentence for people, not empty.

        """
        self._pending.problem(number, text)

    def mended(self, number: int) -> None:
        """Remove a problem; an unknown one is ignored."""
        self._pending.problem(number, "")

    # The socket -----------------------------------------------------------------

    def restart(self) -> None:
        """Send the whole state again, to a new socket or after a missed frame."""
        self._pending.send_all = True
        self._seen = self._frame
        self._dots.restart()

    def receive(self, text: str | bytes) -> list[PageEvent]:
        """Process a message from the page.

        Returns:
            The messages for others, without those about an element, a map or a module
            that was removed meanwhile.

        Raises:
            WireError: If it is not a message that a page may send.

        """
        message = read_message(text)
        match message:
            case PageHello(gzip=reads_gzip):
                self._reads_gzip = reads_gzip
            case Seen(frame=frame):
                if self._seen < frame <= self._frame:
                    self._seen = frame
                    if self._waits:
                        frame_request.make()
                return []
            case Unseen(elements=elements):
                self._dots.switch_off(elements)
                return []
            case Resync():
                self.restart()
                return []
            case ElementEvent(mount=mount, element=element, event=event):
                place = self._mounts.get(mount)
                return [message] if place and place.has_listener(element, event) else []
            case ViewReport(map_element=map_element):
                return [message] if self._take_report(map_element, message) else []
            case ModuleReady(instance=instance) | ModuleMessage(instance=instance):
                return [message] if instance in self._attached else []
        return [message]

    def _take_report(self, map_element: int, report: ViewReport) -> bool:
        try:
            self._map_view(map_element).take(report)
        except WireError:
            return False
        self._dots.view_changed()
        return True

    def frame(self, now: float) -> bytes | None:
        """Return the next frame, or None if there is nothing to send, or not yet.

        A page gets the time at least every :data:`HEARTBEAT` seconds, so that it
        detects when the display stops sending. Ages that wait are sent with the first
        frame after each multiple of :data:`webmap.scene.live.AGES_EVERY`, to every page
        at the same time, so that they are encoded once. A page whose answers are late
        gets each age at once: together with the delay, fresh data would look stale.

        Args:
            now: Seconds of :func:`time.monotonic`.

        """
        if self._seen < self._frame and now - self._spoke >= self.LATE:
            self._late = now
        self._waits = self._frame - self._seen >= self.WINDOW
        if self._waits:
            counts["skipped_frames"] += 1
            return None
        self._dots.wait(now)
        period = now // AGES_EVERY
        ages = period != self._aged or now - self._late < self.LATE_FOR
        body = None if self._pending.send_all else self._changes(ages)
        if body == b"" and now - self._spoke < self.HEARTBEAT:
            return None
        if body is None:
            body = self._everything()
        whole = self._pending.send_all
        frame = _HEADER(VERSION, RESET * whole, self._frame + 1, now) + body
        self._frame += 1
        self._spoke = now
        if ages:
            self._aged = period
        self._pending.sent()
        self._dots.sent()
        if whole and self._reads_gzip and len(frame) >= self.LEAST_PACKED:
            return zlib.compress(frame, level=1, wbits=_GZIP)
        return frame

    def _changes(self, ages: bool) -> bytes | None:
        """Return the changes since the last frame; None if they were discarded.

        Args:
            ages: Whether ages that wait are sent too.

        """
        parts: list[bytes | bytearray] = [self._pending.gone]
        fragments, due = self._fragments, self._dots.due
        # A page with everything until the last frames needs what changed since.
        last, self._frames_number = self._frames_number, frame_request.number
        some = not ages and not due and last == frame_request.number - 1
        for fragment in frame_request.changed if some else tuple(fragments):
            known = fragments.get(fragment)
            newest = fragment.revision if ages else fragment.urgent
            looks = due and fragment.dotted
            if known is None or not (known < newest or looks):
                continue
            changes = encode_changes(fragment, known)
            if changes is None:
                self._pending.send_all = True
                return None
            dots = self._dots.records(fragment, known) if fragment.dotted else b""
            parts += (changes or (delta(fragment) if dots else b""), dots)
            fragments[fragment] = fragment.revision
        parts += [self._place(self._mounts[number]) for number in self._pending.new]
        unsaid = self._pending
        parts += (unsaid.records, *unsaid.messages, *unsaid.problems.values())
        return b"".join(parts)

    def _place(self, mount: Mount) -> bytes:
        self._fragments[mount.fragment] = mount.fragment.revision
        return mount.record() + self._dots.records(mount.fragment, None)

    def _everything(self) -> bytes:
        parts = [self._place(mount) for mount in self._mounts.values()]
        parts += [mount.choices() for mount in self._mounts.values()]
        for map_view in self._map_views.values():
            parts += (map_view.state(self._key), map_view.unreported)
        parts += [record for _, record in self._attached.values()]
        parts += self._pending.notices_again()
        parts += self._pending.current_problems.values()
        return b"".join((*parts, *self._pending.messages))
