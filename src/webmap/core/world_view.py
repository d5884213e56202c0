"""A view of the world on a page: the base class of maps, without robots."""

import itertools
import logging
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from webmap.base.errors import ConfigError
from webmap.base.geometry import Affine
from webmap.base.roles import NOT_YOURS, ROLES, Role, covers, who_may
from webmap.base.scope import Removal, keep
from webmap.core.base_page import BasePage, page_of
from webmap.core.extendable import Extendable
from webmap.core.operators import named_robots
from webmap.core.pictures import pixels_across
from webmap.core.registry import Namespace
from webmap.scene import svg
from webmap.scene.element import Element, Handler
from webmap.scene.node import Fragment

log = logging.getLogger("webmap.map")

_numbers = itertools.count(1)


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle in pixels, with the names of the browser's ``DOMRect``."""

    left: float = 0.0
    top: float = 0.0
    width: float = 0.0
    height: float = 0.0

    @property
    def right(self) -> float:
        """The right edge, in pixels."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """The lower edge, in pixels."""
        return self.top + self.height


def initial_view(width: float, height: float) -> Affine:
    """Return the view with the world's origin in the centre, one pixel per metre.

    World y points up and screen y down (REP 103), so the view mirrors.
    """
    return Affine(1.0, 0.0, 0.0, -1.0, width / 2, height / 2)


def apply_operation(
    view: Affine, rect: Rect, operation: str, args: tuple[float, ...]
) -> Affine:
    """Return the view after an operation that is sent to the browser.

    The browser owns the view; this keeps Python's copy correct until the browser
    reports. ``follow`` changes nothing here, as only the browser then moves the view.
    """
    if operation == "translate":
        return Affine.translation(*args) @ view
    if operation == "scale":
        return Affine.scaling(*args) @ view
    if operation == "rotate":
        angle, x, y = args
        return Affine.rotation(-math.radians(angle), x, y) @ view
    if operation == "set":
        return Affine(*args)
    if operation == "fit":
        return fit_view(rect, *args)
    return view


def fit_view(rect: Rect, x0: float, y0: float, x1: float, y1: float) -> Affine:
    """Return the unrotated view in which a rectangle of the world fills the canvas."""
    across, up = max(abs(x1 - x0), 1e-6), max(abs(y1 - y0), 1e-6)
    factor = min(max(rect.width, 1) / across, max(rect.height, 1) / up)
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    return Affine(
        factor,
        0.0,
        0.0,
        -factor,
        rect.width / 2 - factor * x,
        rect.height / 2 + factor * y,
    )


class BrowserPart:
    """An ES module in one page that belongs to one module of one map."""

    def __init__(
        self,
        page: BasePage,
        map_element: int,
        module: Any,
        script: str | Path,
        options: dict[str, Any],
        style: str | Path | None,
        ended: Callable[[int], object],
    ) -> None:
        self.instance = next(_numbers)
        self.module = module
        self._channel = page.channel
        self._ended: Callable[[int], object] | None = ended
        self._channel.attach(
            map_element,
            self.instance,
            page.asset(script),
            options,
            None if style is None else page.asset(style),
        )

    def send(self, message: dict[str, Any]) -> None:
        """Send a message to the ES module; does nothing once it has ended."""
        if self._ended is not None:
            self._channel.send(self.instance, message)

    def remove(self) -> None:
        """End the ES module; a second call does nothing."""
        ended, self._ended = self._ended, None
        if ended is not None:
            ended(self.instance)
            self._channel.detach(self.instance)


class WorldGroup(Element):
    """The group whose children are in metres, x east and y north (REP 103)."""

    def __init__(self) -> None:
        super().__init__("g", class_="world")
        self.tf = Affine()
        """The transform from world coordinates to pixels from the canvas's top left."""


class WorldView(Extendable):
    """An extendable that shows the world from above on one page; base class of maps.

    It has the canvas, the view, images, mounted fragments, listeners and the browser
    parts of modules, but no robots.

    Args:
        container: The page's element to draw in.
        canvas_width: The width in pixels; the container's if not given.
        canvas_height: The height in pixels; the container's if not given.
        namespace: The namespace of its modules.

    Raises:
        ConfigError: If the container is on no page, or its page was closed.

    """

    def __init__(
        self,
        container: Element,
        canvas_width: float | None,
        canvas_height: float | None,
        namespace: Namespace,
    ) -> None:
        super().__init__(namespace)
        self.page: BasePage = page_of(container)
        if self.page.closed:  # the map would never be destroyed
            raise ConfigError(
                f"page {self.page.entry.path!r} of {self.page.viewer.operator} was "
                "closed, so no map can be created on it: create maps in the page "
                "function, not in a task that may end after the viewer has left"
            )
        self.container = container
        self.selected: object = None
        """The robot that the viewer selected; only :class:`webmap.Map` has robots."""
        width, height = self.page.size_of(container)
        self._rect = Rect(0.0, 0.0, canvas_width or width, canvas_height or height)
        self.images = svg.g(class_="images")
        self.world = WorldGroup()
        self.world.append(self.images)
        self.world.tf = initial_view(self._rect.width, self._rect.height)
        self.root: Element = svg.svg(self.world, class_="webmap", tabindex=0)
        self.root.set(role="application", aria_label="Map")
        self.root.set_map(self.world, canvas_width or 0.0, canvas_height or 0.0)
        self.fragment = Fragment(self.root)
        self._parts: dict[int, BrowserPart] = {}
        self._published: dict[Element, Removal] = {}
        self._mount = self.page.channel.mount(
            self.fragment, under=container.id, within=self.page.mount
        )
        self._mounts = {self.fragment.id: self._mount}

    @property
    def canvas_width(self) -> float:
        """The width of the canvas, in pixels."""
        return self._rect.width

    @property
    def canvas_height(self) -> float:
        """The height of the canvas, in pixels."""
        return self._rect.height

    def get_bounding_rect(self) -> Rect:
        """Return the rectangle of the canvas in the browser's viewport, in pixels."""
        return self._rect

    # Contents.

    def add_image(
        self, iri: str, x: float, y: float, width: float, height: float
    ) -> Element:
        """Place an image in the world, under everything else.

        It is drawn with sharp pixels, and smoothly when zoomed out; a CSS rule for
        ``.images > image`` can change that.

        If the file does not exist, the page shows an error and the program continues.

        Args:
            iri: A file in the page's folder, or the absolute path of a file.
            x: The left edge, in metres.
            y: The lower edge, in metres.
            width: In metres.
            height: In metres.

        Returns:
            The image, to keep for :meth:`remove_image`.

        """
        image = svg.image(
            x=x, y=y, width=width, height=height, preserveAspectRatio="none"
        )
        try:
            url, self._published[image] = self.page.publish_image(str(iri))
        except ConfigError as error:
            self.report_error(f"image {Path(str(iri)).name!r} is not shown: {error}")
        else:
            image.set("href", url)
            pixels = pixels_across(self.page.image_file(str(iri)))
            image.set("data-cell", width / pixels if pixels else None)
        image.set_matrix(Affine(1, 0, 0, -1, 0, 2 * y + height))
        self.images.append(image)
        return image

    def remove_image(self, img: Element) -> None:
        """Remove and withdraw an image that :meth:`add_image` returned."""
        img.remove()
        published = self._published.pop(img, None)
        if published is not None:
            published.remove()

    def remove_robot(self, robot: Any) -> None:
        """Remove a robot; only :class:`webmap.Map` has robots."""

    def mount(
        self, fragment: Fragment, *, order: float, into: Fragment | None = None
    ) -> int:
        """Show a fragment in the world.

        Args:
            fragment: The fragment.
            order: Of two fragments in one place, the one with the greater order is
                drawn above; with the same order, the newer one.
            into: The mounted fragment in whose root it is placed; the world if not
                given.

        """
        under = self.world if into is None else into.root
        within = self._mount if into is None else self._mounts[into.id]
        mount = self.page.channel.mount(
            fragment, under=under.id, order=order, within=within
        )
        self._mounts[fragment.id] = mount
        return mount

    def unmount(self, fragment: Fragment) -> None:
        """Remove a fragment from the map."""
        mount = self._mounts.pop(fragment.id, None)
        if mount is not None:
            self.page.forget_mount(mount)
            self.page.channel.unmount(mount)

    def shows(self, mount: int) -> bool:
        """Return whether a mount belongs to this map."""
        return mount in self._mounts.values()

    # Events of the viewer.

    def on(
        self,
        element: Element,
        event: str,
        handler: Handler,
        *,
        role: Role = "operator",
        prevent: bool = False,
        stop: bool = False,
    ) -> Removal:
        """Call ``handler`` for an event of an element on this page.

        Args:
            element: An element that this map shows.
            event: The DOM's name: ``"click"``, ``"pointerdown"``, ``"keydown"``.
            handler: Called with the event, in the model's thread.
            role: The least role of a viewer whose events the handler gets.
            prevent: Whether the browser's own reaction is prevented.
            stop: Whether the event does not propagate to outer elements.

        Raises:
            ValueError: If this map does not show the element.

        """
        fragment = element.fragment
        mount = None if fragment is None else self._mounts.get(fragment.id)
        if mount is None:
            raise ValueError(f"this map does not show {element!r}")
        return self.page.listen(
            mount, element, event, handler, role=role, prevent=prevent, stop=stop
        )

    def add_browser_part(
        self,
        module: Any,
        script: str | Path,
        options: dict[str, Any] | None = None,
        style: str | Path | None = None,
    ) -> BrowserPart:
        """Give a module an ES module in the browser, its browser part.

        Args:
            module: The module. Its ``on_message(message)`` gets the messages of the
                browser part that the viewer may send (:func:`least_role`); its
                ``on_ready()`` is called whenever the browser part was loaded.
            script: An ES module: the name of a built-in one, or a file's path. Its
                default export is called with the map, the options and a function that
                sends a message, and returns an object with ``destroy()`` and, to
                receive messages, ``receive(message)``.
            options: Plain data for the browser part.
            style: A style sheet to load with it: a built-in name or a path.

        Returns:
            The browser part, for sending messages; it ends with the module.

        """
        part = BrowserPart(
            self.page,
            self.root.id,
            module,
            script,
            options or {},
            style,
            self._parts.pop,
        )
        self._parts[part.instance] = part
        return keep(part)

    # View.

    def translate(self, x: float, y: float) -> None:
        """Move the view by an amount of pixels, right and down."""
        self._operate("translate", x, y)

    def scale(
        self, factor: float, x: float | None = None, y: float | None = None
    ) -> None:
        """Zoom by a factor about a fixed point.

        Args:
            factor: Above 1 zooms in.
            x: Pixels from the canvas's left edge; its centre if not given.
            y: Pixels from the canvas's top edge; its centre if not given.

        """
        self._operate("scale", factor, *self._point(x, y))

    def rotate(
        self, angle: float, x: float | None = None, y: float | None = None
    ) -> None:
        """Turn the world about a fixed point.

        Args:
            angle: Degrees, counter-clockwise on the page.
            x: Pixels from the canvas's left edge; its centre if not given.
            y: Pixels from the canvas's top edge; its centre if not given.

        """
        self._operate("rotate", angle, *self._point(x, y))

    def fit(self, x: float, y: float, width: float, height: float) -> None:
        """Show a rectangle of the world, in metres, as large as possible."""
        self._operate("fit", x, y, x + width, y + height)

    def on_view_report(self, tf: Affine, rect: Rect) -> None:
        """Store the view and the size that the browser reports."""
        changed = (rect.width, rect.height) != (self._rect.width, self._rect.height)
        self.world.tf, self._rect = tf, rect
        if changed:
            self.notify_modules("on_resize")
        self.notify_modules("on_view")

    def on_module_message(self, instance: int, message: Any) -> bool:
        """Pass a message to its module; return whether the module is of this map."""
        part = self._parts.get(instance)
        if part is None:
            return False
        least, viewer = least_role(part.module, message), self.page.viewer
        if least is None:
            name = type(part.module).__name__
            self.show_error(f"{name} has no such message: reload the page.")
        elif not covers(viewer.role, least):
            self.show_error(who_may(least))
        elif least != "viewer" and not all(map(viewer.may_drive, _robots_in(message))):
            self.show_error(NOT_YOURS)
        else:
            self._call(part.module, "on_message", (message,))
        return True

    def on_module_ready(self, instance: int) -> None:
        """Notify a module that its browser part was loaded, possibly after a reload."""
        part = self._parts.get(instance)
        if part is not None:
            self._call(part.module, "on_ready", ())

    def report_error(self, text: str) -> None:
        """Log a failure and show it on this map's page."""
        log.warning("%s", text)
        self.show_error(text)

    def show_error(self, text: str) -> None:
        """Show an error that is already in the log on this map's page."""
        if not self.page.closed:
            self.page.notice(text)

    def leave_page(self) -> None:
        """Remove the map, its images and its mounts from the page."""
        for published in self._published.values():
            published.remove()
        self._published.clear()
        self.page.forget_mount(self._mount)
        self.page.channel.unmount(self._mount)

    def _operate(self, operation: str, *args: float) -> None:
        self.world.tf = apply_operation(self.world.tf, self._rect, operation, args)
        self.page.channel.view(self.root.id, operation, *args)

    def _point(self, x: float | None, y: float | None) -> tuple[float, float]:
        return (
            self._rect.width / 2 if x is None else x,
            self._rect.height / 2 if y is None else y,
        )


def least_role(module: object, message: Mapping[str, Any]) -> Role | None:
    """Return the least role of a viewer whose page may send a module a message.

    The class of the module states it in ``MAY_SEND``: a role for each ``op`` of its
    messages, or for each of their fields if they have no ``op``. Further fields need an
    operator, and so do the messages of a class without ``MAY_SEND``.

    Returns:
        None if the class states others, so that nobody may send the message.
    """
    stated: Mapping[str, Role] | None = getattr(type(module), "MAY_SEND", None)
    if stated is None:
        return "operator"
    op = message.get("op")
    names = [op] if isinstance(op, str) else message
    if stated.keys().isdisjoint(names):
        return None
    return max((stated.get(name, "operator") for name in names), key=ROLES.index)


def _robots_in(message: object) -> Iterator[str]:
    """Return the ids of all robots that a message names, wherever it names them."""
    if isinstance(message, str):
        if message in named_robots:
            yield message
    elif isinstance(message, Mapping | list):
        parts = message.values() if isinstance(message, Mapping) else message
        for part in parts:
            yield from _robots_in(part)
