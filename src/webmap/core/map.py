"""Maps, the drawing areas of pages, seen from above; the layers that maps share."""

import logging
import sys
from collections.abc import Hashable
from typing import Any, ClassVar, Self, TypeGuard

from webmap.base.scope import Removal, Scope, keep, no_scope
from webmap.core.problems import Problems
from webmap.core.registry import Namespace, map_modules
from webmap.core.robot import Robot
from webmap.core.world_view import WorldView
from webmap.scene import svg
from webmap.scene.element import Element, Event
from webmap.scene.node import Fragment

log = logging.getLogger("webmap.layer")

LAYER_ORDER = 10.0
ROBOT_ORDER = 100.0


class Layer:
    """A part of the scene that maps share, kept while at least one map shows it.

    A subclass subscribes in :meth:`start` and draws into :attr:`svg`. Two maps that ask
    for a layer of the same class with the same arguments share one layer, so its data
    is received, decoded and encoded once.
    """

    _shared: ClassVar[dict[Hashable, "Layer"]] = {}

    def __init__(self, *args: Any, **options: Any) -> None:
        del args, options
        self.svg: Element = svg.g(class_="layer")
        self.fragment = Fragment(self.svg)
        self.users = 0
        self.scope = Scope(type(self).__name__, self._failed, self.clear_problem)
        self._shown_problems = Problems(log)
        self.maps = self._shown_problems.maps
        """The maps that show the layer's failures; see :meth:`show_on`."""
        self.problems: dict[object, str] = self._shown_problems.current
        """Current failures, as sentences, by subject."""
        self._key: Hashable = None

    @classmethod
    def shared(cls, *args: Any, **options: Any) -> Self:
        """Return the layer of this class for these arguments, and add a user to it.

        Args:
            *args: Hashable; bridges are compared by identity.
            **options: Hashable.

        """
        key = (cls, args, tuple(sorted(options.items())))
        layer = cls._shared.get(key)
        if layer is None:
            layer = cls._made(*args, **options)
            layer._key = key
            try:
                with no_scope(), layer.scope.active():
                    layer.start()
            except BaseException:
                layer.scope.close()
                raise
            cls._shared[key] = layer
        layer.users += 1
        assert isinstance(layer, cls)
        return layer

    @classmethod
    def _made(cls, *args: Any, **options: Any) -> Self:
        return cls(*args, **options)

    def start(self) -> None:
        """Subscribe to the layer's data; called once, in the layer's scope."""

    def show_on(self, map: WorldView, *, order: float) -> Removal:
        """Show the layer on a map, and its failures on the map's page.

        Args:
            map: The map. It counts as one user of the layer until it is removed.
            order: The drawing order: a greater one is drawn above; robots have 100.

        Returns:
            The removal that takes the layer off the map; the end of the current scope
            does the same.

        """
        mounted = self.mount_on(map, order=order)
        self._shown_problems.join(map)

        def undo() -> None:
            self._shown_problems.leave(map)
            mounted.remove()

        return keep(Removal(undo))

    def mount_on(self, map: WorldView, *, order: float) -> Removal:
        """Show the layer on a map without its failures; see ``Map.add_layer``."""
        try:
            map.mount(self.fragment, order=order)
        except BaseException:
            self.release()
            raise

        def undo() -> None:
            map.unmount(self.fragment)
            self.release()

        return keep(Removal(undo))

    def set_problem(self, about: object, text: str) -> None:
        """Show a failure until :meth:`clear_problem`, also to pages opened later.

        Args:
            about: The subject of the failure; a new sentence replaces the old one.
            text: A sentence for people.

        """
        self._shown_problems.set(about, text)

    def clear_problem(self, about: object) -> None:
        """Remove the failure shown for ``about``."""
        self._shown_problems.clear(about)

    def release(self) -> None:
        """Remove one user; without users the layer ends."""
        self.users -= 1
        if self.users == 0:
            self._shared.pop(self._key, None)
            self.scope.close()

    def _failed(self, text: str, about: object) -> None:
        if about is None:
            self._shown_problems.report(text)
        else:
            self.set_problem(about, text)


class Map(WorldView):
    """The map on one page: a view of the world and the robots in it.

    Args:
        container: The page's element to draw in: ``page.element("webmap_container")``.
        canvas_width: The width in pixels; the container's if not given.
        canvas_height: The height in pixels; the container's if not given.
        namespace: The namespace of its modules.

    Raises:
        ConfigError: If the container is on no page, or its page was closed.

    """

    def __init__(
        self,
        container: Element,
        canvas_width: float | None = None,
        canvas_height: float | None = None,
        *,
        namespace: Namespace = map_modules,
    ) -> None:
        super().__init__(container, canvas_width, canvas_height, namespace)
        self.robots: list[Robot] = []
        """The robots shown, in the order in which they were added."""
        self._robots = Fragment(svg.g(class_="robots"))
        self.mount(self._robots, order=ROBOT_ORDER)
        self.selected: Robot | None = None
        self.marked: list[Robot] = []
        """Robots selected in addition, for actions on several robots; never driven."""
        self.page.contents.append(self)
        self.page.listen(
            self._mount,
            self.root,
            "click",
            lambda event: self.set_selected(None),
            role="viewer",
        )

    def __repr__(self) -> str:
        who = self.page.viewer.operator.logged
        return f"<Map of {who} with {len(self.robots)} robots>"

    # Contents.

    def add_robot(self, robot: Robot) -> None:
        """Show a robot; does nothing if the map shows it already."""
        if robot in self.robots:
            return
        self.robots.append(robot)
        # A group of its own, so that :nth-child in CSS counts robots.
        mount = self.mount(robot.fragment, order=0.0, into=self._robots)
        self.page.listen(
            mount,
            robot.svg,
            "click",
            lambda event: self.pick(robot, event),
            role="viewer",
            stop=True,
        )
        robot.on_map(self, True)
        self.notify_modules("on_add_robot", robot)

    def remove_robot(self, robot: Robot) -> None:
        """Remove a robot from this map; it keeps its topics and its other maps."""
        if robot not in self.robots:
            return
        if self.selected is robot:
            self.set_selected(None)
        self.set_marked(robot, False)
        self.robots.remove(robot)
        self.unmount(robot.fragment)
        robot.on_map(self, False)
        self.notify_modules("on_remove_robot", robot)

    def find_robot(self, id: object) -> Robot | None:
        """Return the robot of this map with an id, or None.

        Args:
            id: An id sent by a page, so it may be anything.

        """
        return next((robot for robot in self.robots if robot.id == id), None)

    def add_layer(self, layer: Layer, *, order: float = LAYER_ORDER) -> Removal:
        """Show a shared layer until the returned removal is called or the map ends.

        Args:
            layer: From :meth:`Layer.shared`; released at the end.
            order: The drawing order: a greater one is drawn above; robots have 100.

        Raises:
            WireError: If the map has ended; the layer is released.

        """
        return layer.mount_on(self, order=order)

    def set_selected(self, robot: Robot | None) -> None:
        """Select a robot of this map, on this page; None clears the selection.

        Raises:
            ValueError: If the map does not show the robot.

        """
        if robot is not None and robot not in self.robots:
            raise ValueError(f"{robot!r} is not on this map")
        for other in tuple(self.marked):
            self.set_marked(other, False)
        before = self.selected
        if robot is before:
            return
        self.selected = robot
        for changed, on in ((before, False), (robot, True)):
            if changed is not None:
                mount = self._mounts[changed.fragment.id]
                self.page.channel.set_class(mount, "selected", on)
                changed.update_selected()
        self.notify_modules("on_select")

    def set_marked(self, robot: Robot, on: bool) -> None:
        """Mark or unmark a robot in addition to the selected one; fires ``on_mark``.

        :meth:`set_selected` unmarks all robots.

        Raises:
            ValueError: If the map does not show the robot.

        """
        if robot not in self.robots:
            raise ValueError(f"{robot!r} is not on this map")
        if on == (robot in self.marked) or (on and robot is self.selected):
            return
        (self.marked.append if on else self.marked.remove)(robot)
        self.page.channel.set_class(self._mounts[robot.fragment.id], "marked", on)
        self.notify_modules("on_mark")

    def toggle_marked(self, robot: Robot) -> None:
        """Mark or unmark a robot; select it if no robot is selected."""
        if self.selected is None:
            self.set_selected(robot)
        else:
            self.set_marked(robot, robot not in self.marked)

    def pick(self, robot: Robot, event: Event) -> None:
        """Select a clicked robot, or toggle its mark if Shift was pressed."""
        if event.shift:
            self.toggle_marked(robot)
        else:
            self.set_selected(robot)

    def follow(self, robot: Robot | None) -> None:
        """Keep a robot in place on the page until the viewer moves the view.

        A robot that is out of sight is first brought to the centre.
        """
        if robot is not None:
            self.bring_into_sight(robot)
        self._operate("follow", 0 if robot is None else robot.svg.id)

    def bring_into_sight(self, robot: Robot) -> None:
        """Move the view so that a robot out of sight is in its centre."""
        x, y = self.world.tf.apply(robot.position.x, robot.position.y)
        width, height = self.canvas_width, self.canvas_height
        if not (0 <= x <= width and 0 <= y <= height):
            self.translate(width / 2 - x, height / 2 - y)

    # Removal.

    def destroy(self) -> None:
        """Remove modules in reverse order, then the robots, then the map."""
        if self._destroyed:
            return
        self._destroyed = True
        self.remove_modules()
        for robot in tuple(reversed(self.robots)):
            self.remove_robot(robot)
        self.unmount(self._robots)
        self.page.contents.remove(self)
        self.leave_page()


def robot_and_pose(map: Map, given: Any) -> tuple[Robot, float, float, float] | None:
    """Return the robot, x, y and yaw that a page sent.

    Args:
        map: The map of the page.
        given: A table with ``robot``, its id, ``x`` and ``y`` in metres and ``yaw`` in
            radians. It comes from a page, so it may be anything.

    Returns:
        None if the map has no such robot, or a number is missing.

    """
    if not isinstance(given, dict):
        return None
    robot, place = map.find_robot(given.get("robot")), place_of(given)
    yaw = given.get("yaw")
    if robot is None or place is None or not _finite(yaw):
        return None
    return robot, *place, yaw


def place_of(given: Any) -> tuple[float, float] | None:
    """Return ``x`` and ``y`` of a page's table; None if a number is missing."""
    if not isinstance(given, dict):
        return None
    x, y = given.get("x"), given.get("y")
    return (x, y) if _finite(x) and _finite(y) else None


def _finite(value: object) -> TypeGuard[float]:
    # An integer may be too large for a float.
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max
