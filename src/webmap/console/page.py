"""The page itself: a map with everything around it, for each viewer that opens it."""

import asyncio
import atexit
import hashlib
import logging
import math
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import webmap
from webmap.console.bar import BridgeList, RefusedList
from webmap.console.card_parts import RobotHealth
from webmap.console.fleet import make_robot
from webmap.console.floor import Floor, load_floor
from webmap.console.opened import Console
from webmap.console.robot_card import RobotButtons, RobotCard
from webmap.console.robot_list import RobotList
from webmap.features.cameras.camera_panel import CameraPanel
from webmap.features.doctor.doctor_panel import DoctorReports

if TYPE_CHECKING:
    from webmap import Bridge, Map, Page, RobotConfig

log = logging.getLogger("webmap.console")

PRODUCT = "WebMap"
"""What the bar says in any case."""

SPEED = 1.0
ROTATION_SPEED = 1.5
"""What the keys ask for at most, in m/s and rad/s; each robot's own limits hold too."""

PERIOD = 0.25
"""Seconds between two looks at what no trigger tells: ages and links."""


def open_console(
    bridges: Sequence["Bridge"],
    robots: Sequence["RobotConfig"],
    *,
    floor: Path | None = None,
    title: str = PRODUCT,
    place: str | None = None,
) -> Console:
    """Make the console the page at ``/``.

    Args:
        bridges: The links whose state is shown.
        robots: What is shown on the map and in the list, in that order. Their bridges
            are named by address.
        floor: The YAML file of a floor plan, as map_server takes it.
        title: What this installation is called.
        place: What labels and views are kept under; the URLs of the bridges, if not
            given. For bridges whose port is another one at each start.

    Returns:
        The console, to add robots that come later.

    Raises:
        ConfigError: If the floor plan cannot be read.

    """
    plan = None if floor is None else load_floor(floor, _folder_for_this_process())
    fleet = [make_robot(config, bridges) for config in robots]
    opened = Console(fleet)
    if place is None:
        place = "\n".join(sorted(bridge.url for bridge in bridges))
    kept_under = f"console-{hashlib.sha256(place.encode()).hexdigest()[:16]}"
    opened.set_module("Labels", name=kept_under)

    @webmap.page("/", html="console.html", title=title)
    def console(page: "Page") -> None:
        build(page, bridges, opened, plan, title, kept_under)
        opened.opened(page)

    return opened


def build(
    page: "Page",
    bridges: Sequence["Bridge"],
    opened: Console,
    floor: Floor | None,
    title: str,
    kept_under: str,
) -> None:
    """Fill one viewer's page; its views are kept under a name."""
    page.element("title").text = "" if title == PRODUCT else title
    map = webmap.Map(page.element("map"))
    if floor is not None:
        show_floor(map, floor)
    map.add_module("MouseViewControl")
    stops = "#stop-place"
    map.add_module("StopButton", place=stops)
    map.add_module("Teleop", SPEED, ROTATION_SPEED, holonomic=None, stop_place=stops)
    goals = map.add_module("GoalTool")
    poses = map.add_module("InitialPoseTool")
    map.add_module("LayerSwitches", off=["Costmaps"])
    map.add_module("MeasureTool")
    map.add_module("AlignTool")
    map.add_module("RouteTool", title)
    map.add_module("RosoutPanel", bridges)
    saving = {"place": ".map-tools", "classes": "button square"}
    map.add_module("ExportTool", **saving)
    map.add_module(Layout, of=kept_under, **saving)
    map.add_module("ScaleBar")
    map.add_module("PointerReadout")
    frame = map.add_module(Frame, title, floor)
    listed = map.add_module(RobotList, page.element("robots"))
    most = (SPEED, ROTATION_SPEED)
    at = page.element("card")
    card = map.add_module(
        RobotCard,
        at,
        aim_goal=goals.aim,
        forget_goal=goals.forget,
        aim_pose=poses.aim,
        most=most,
        remove=opened.remove,
    )
    cameras = map.add_module(CameraPanel)
    costmaps = map.add_module(CostmapNames)
    health = map.add_module(RobotHealth, page.element("card"))
    map.add_module(RobotButtons, page.element("card"))
    doctor = map.add_module(DoctorReports, page.element("bridges"), bridges)
    links = BridgeList(page.element("bridges"), bridges, doctor.buttons)
    refused = RefusedList(page.element("refused"), page.viewer.role)
    polls = [frame.place, listed.poll, card.poll, cameras.poll, health.poll]
    polls += [opened.bring_back, links.poll, refused.poll, doctor.poll, costmaps.poll]
    task = asyncio.get_running_loop().create_task(poll_on(polls))
    page.on_close(task.cancel)


def _folder_for_this_process() -> Path:
    folder = tempfile.TemporaryDirectory(prefix="webmap-")
    atexit.register(folder.cleanup)
    return Path(folder.name)


def show_floor(map: "Map", floor: Floor) -> None:
    """Place a floor plan for the day and one for the night; map.css shows one."""
    for name, file in (("day", floor.day), ("night", floor.night)):
        image = map.add_image(str(file), floor.x, floor.y, floor.width, floor.height)
        image.set_matrix(floor.matrix)
        image.classes.add("floor", name)


async def poll_on(polls: Sequence[Callable[[], None]]) -> None:
    """Look again at what no trigger tells, until cancelled."""
    while True:
        for poll in polls:
            try:
                poll()
            except Exception:
                log.exception("a part of the console failed")
        await asyncio.sleep(PERIOD)


MARGIN = 4.0
"""Metres around robots that are shown without a floor."""

DOT_PIXELS = 3.0
"""How large the dots of a scan are on the screen."""

PATIENCE = 12
"""Looks after which robots whose pose is unknown are waited for no longer."""

Bounds = tuple[float, float, float, float]
"""Left, bottom, width and height, in metres."""


class Frame:
    """Connection state, zoom buttons, help and the card's buttons; a module of maps.

    All of it acts in the browser, since it must work over a bad link, and some of it
    just then.

    Args:
        map: The map.
        title: What this installation is called.
        floor: The floor plan, if there is one.

    """

    def __init__(self, map: "Map", title: str, floor: "Floor | None") -> None:
        self.map = map
        self._bounds = None if floor is None else floor.bounds
        self._looks = 0
        self._placed = False
        self._dot_size = 0.0
        self.half = map.add_browser_half(
            self, "console/console.js", {"title": title, "bounds": self._bounds}
        )

    def place(self) -> None:
        """Show the floor, or the robots where they are as soon as that is known."""
        self._looks += 1
        bounds = self._bounds or self._around_robots()
        if bounds is not None and not self._placed:
            self._placed = True
            self.map.fit(*bounds)

    def on_own_view(self) -> None:
        """Leave the view to a page that begins with the one it was left with."""
        self._placed = True

    def on_view_found(self) -> None:
        """Show what the page begins with, when nobody left it with another view."""
        self._placed = False
        self.place()

    def on_view(self) -> None:
        """Keep the dots of scans as large on the screen, whatever the zoom."""
        scale = math.sqrt(abs(self.map.world.tf.determinant))
        size = min(max(DOT_PIXELS / max(scale, 1e-3), 0.02), 0.3)
        if abs(size - self._dot_size) > 0.1 * size:
            self._dot_size = size
            self.map.root.set_style("--dot-size", round(size, 3))

    def on_message(self, message: dict[str, Any]) -> None:
        """Follow the selected robot, from the middle, which the page asks for."""
        robot = self.map.selected
        if message.get("op") != "follow" or robot is None:
            return
        x, y = self.map.world.tf.apply(robot.position.x, robot.position.y)
        self.map.translate(
            self.map.canvas_width / 2 - x, self.map.canvas_height / 2 - y
        )
        self.map.follow(robot)

    def _around_robots(self) -> Bounds | None:
        places = [robot.position for robot in self.map.robots if robot.valid]
        waiting = len(places) < len(self.map.robots) and self._looks < PATIENCE
        if not places or waiting:
            return None
        left, bottom = min(p.x for p in places), min(p.y for p in places)
        right, top = max(p.x for p in places), max(p.y for p in places)
        return (
            left - MARGIN,
            bottom - MARGIN,
            right - left + 2 * MARGIN,
            top - bottom + 2 * MARGIN,
        )


class Layout:
    """Saves and loads what a viewer sees of the page; a module of maps.

    All of it is the browser's: the view, what is switched on, which panels are open,
    where the camera is. No robot, selection, lease or goal is any part of it, and the
    page sends nothing but what :meth:`on_message` takes.

    Fires ``on_own_view()`` when the page has shown the view that it was left with, and
    ``on_view_found()`` when the viewer wants the one that it would begin with else.

    Args:
        map: The map.
        of: What the page shows: the last view is kept for that and the page's address.
        place: A CSS selector of the page's element that the button goes into; over the
            map if not given.
        classes: What the button is styled by there.
        restore: Whether the page opens with the last view.

    """

    def __init__(
        self,
        map: "Map",
        *,
        of: str = "",
        place: str = "",
        classes: str = "",
        restore: bool = True,
    ) -> None:
        self.map = map
        self.half = map.add_browser_half(
            self,
            "features/layout/layout_tool.js",
            {"of": of, "place": place, "classes": classes, "restore": restore},
            "features/layout/layout_tool.css",
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Take what the page says of its view."""
        if message.get("own") is True:
            self.map.notify_modules("on_own_view")
            # Behind what was said of the view before this was known.
            self.half.send({"own": True})
        elif message.get("found") is True:
            self.map.notify_modules("on_view_found")


class CostmapNames:
    """Says which costmap each one is, for the list of layers; a module of maps.

    Robots that are alike are switched together, so the name is what their topics end
    in: ``global_costmap/costmap``.
    """

    def __init__(self, map: "Map") -> None:
        self.map = map

    def poll(self) -> None:
        """Name those that came since."""
        for module in self.map.modules:
            layer = getattr(module, "layer", None)
            if layer is None or getattr(layer, "palette", None) != "costmap":
                continue
            if "data-layer" not in layer.svg.attributes:
                layer.svg.set("data-layer", ending(layer.topic))


def ending(topic: str) -> str:
    """Return the last two parts of a topic's name."""
    return "/".join(topic.strip("/").split("/")[-2:])
