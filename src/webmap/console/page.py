"""The console's page: a map with all controls around it, for each open page."""

import asyncio
import atexit
import hashlib
import logging
import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import webmap
from webmap import Bridge, Map, Page, RobotConfig
from webmap.base.map_file import cell_at
from webmap.console.bar import BridgeList, OperatorName, RefusedList
from webmap.console.card_parts import RobotHealth
from webmap.console.console import Console, robot_now
from webmap.console.floor import Floor, load_floor
from webmap.console.robot_card import RobotButtons, RobotCard
from webmap.console.robot_list import RobotList
from webmap.console.robot_looks import make_robot
from webmap.features.alerts.alerts import AlertPanel
from webmap.features.cameras.camera_panel import CameraPanel
from webmap.features.check.check_panel import CheckPanel
from webmap.features.doctor.doctor_panel import DoctorReports, entry
from webmap.features.incidents.incidents import IncidentButton
from webmap.features.selection.several_robots import SeveralRobots
from webmap.features.shift_log.hand_over import HTML, HandOver
from webmap.features.shift_log.shift_panel import ShiftPanel

log = logging.getLogger("webmap.console")

PRODUCT = "WebMap"
"""Shown in the bar in any case."""

SPEED = 1.0
ROTATION_SPEED = 1.5
"""Greatest speeds for keys, in m/s and rad/s; each robot's limits apply too."""

HAND_OVER = "/hand-over"
"""The path of the page that hands over a shift."""

PERIOD = 0.25
"""Seconds between two updates of values without a trigger: ages and connections."""


def open_console(
    bridges: Sequence[Bridge],
    robots: Sequence[RobotConfig],
    *,
    floor: Path | None = None,
    title: str = PRODUCT,
    place: str | None = None,
    layers_off: Sequence[str] = (),
    incidents: bool = False,
) -> Console:
    """Make the console the page at ``/``.

    Args:
        bridges: The bridges whose state is shown; more may be added to the list later.
        robots: The robots on the map and in the list, in that order. Their bridges are
            named by address.
        floor: The YAML file of a floor plan, in the format of map_server.
        title: The name of this installation.
        place: The name under which labels and views are stored; by default the URLs of
            the bridges. Use it for bridges whose port changes at each start.
        layers_off: The layers that are off until the user switches them on; costmaps
            are also off where several robots have one.
        incidents: Whether the last minutes of all robots are recorded, and kept after a
            STOP or an alarm.

    Returns:
        The console, to add robots later.

    Raises:
        ConfigError: If the floor plan cannot be read.
    """
    plan = None if floor is None else load_floor(floor, _folder_for_this_process())
    fleet = [make_robot(config, bridges) for config in robots]
    opened = Console(fleet, layers_off)
    if place is None:
        place = "\n".join(sorted(bridge.url for bridge in bridges))
    kept_under = f"console-{hashlib.sha256(place.encode()).hexdigest()[:16]}"
    opened.set_module("Labels", name=kept_under)
    opened.keep_alerts(kept_under)
    if incidents:
        opened.record_incidents()

    @webmap.page("/", html="console.html", title=title)
    def console(page: Page) -> None:
        build(page, bridges, opened, plan, title, kept_under)
        opened.opened(page)

    @webmap.page(HAND_OVER, html=HTML)
    def hand_over(page: Page) -> None:
        HandOver(
            page,
            lambda: [robot_now(robot) for robot in opened.shown_robots()],
            opened.alerts.listed.values,
        )

    return opened


def build(
    page: Page,
    bridges: Sequence[Bridge],
    opened: Console,
    floor: Floor | None,
    title: str,
    kept_under: str,
) -> None:
    """Fill one page; its views are stored under ``kept_under``."""
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
    map.add_module(
        "LayerSwitches",
        off=opened.layers_off,
        several_off=["Costmaps"],
        legend="#legend",
    )
    map.add_module("MeasureTool")
    map.add_module("AlignTool")
    map.add_module("RouteTool", title)
    map.add_module("RosoutPanel", bridges)
    alerts = map.add_module(AlertPanel, opened.alerts)
    shift = map.add_module(ShiftPanel, HAND_OVER)
    saving = {"place": ".tools", "classes": "webmap-button"}
    map.add_module("ExportTool", **saving)
    map.add_module(Layout, of=kept_under, **saving)
    map.add_module(
        SeveralRobots,
        goals.aim,
        rows="#robots > .row:not(.filtered)",
        button="#select-shown",
    )
    map.add_module("ScaleBar")
    map.add_module("PointerReadout")
    frame = map.add_module(Frame, title, floor)
    listed = map.add_module(
        RobotList,
        page.element("robots"),
        none=page.element("no-robots"),
        search=page.element("search-part"),
    )
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
    health = map.add_module(RobotHealth, card.notes)
    check = map.add_module(CheckPanel, card.notes, card.more, entry)
    map.add_module(RobotButtons, card.more)
    doctor = map.add_module(DoctorReports, page.element("bridges"))
    links = BridgeList(
        page.element("bridges"),
        bridges,
        doctor.add,
        opened.routers,
        page.element("routers"),
    )
    refused = RefusedList(page.element("refused"), page.viewer.role)
    polls = [frame.place, listed.poll, card.poll, cameras.poll, health.poll]
    polls += [opened.bring_back, links.poll, refused.poll, doctor.poll, costmaps.poll]
    polls += [alerts.poll, shift.poll, check.poll, map.add_module(OperatorName).poll]
    if opened.incidents is not None:
        button = map.add_module(IncidentButton, card.more, opened.incidents)
        polls.append(button.poll)
    task = asyncio.get_running_loop().create_task(poll_on(polls))
    page.on_close(task.cancel)


def _folder_for_this_process() -> Path:
    folder = tempfile.TemporaryDirectory(prefix="webmap-")
    atexit.register(folder.cleanup)
    return Path(folder.name)


def show_floor(map: Map, floor: Floor) -> None:
    """Place a floor plan for each theme, light and dark; map.css shows one."""
    for name, file in (("day", floor.day), ("night", floor.night)):
        image = map.add_image(str(file), floor.x, floor.y, floor.width, floor.height)
        image.set_matrix(floor.matrix)
        image.classes.add("floor", name)


async def poll_on(polls: Sequence[Callable[[], None]]) -> None:
    """Call the functions periodically, until canceled."""
    while True:
        for poll in polls:
            try:
                poll()
            except Exception:
                log.exception("a part of the console failed")
        await asyncio.sleep(PERIOD)


MARGIN = 4.0
"""Margin around robots that are shown without a floor, in metres."""

DOT_PIXELS = 3.0
"""Size of a scan's dots on the screen, in pixels."""

PATIENCE = 12
"""Number of updates for which the page waits for robots with unknown pose."""

Bounds = tuple[float, float, float, float]
"""Left, bottom, width and height, in metres."""


class Frame:
    """Connection state, zoom buttons, help and the card's buttons; a module of maps.

    All of it runs in the browser, because it must work over a bad connection, and some
    of it is needed exactly then.

    Args:
        map: The map.
        title: The name of this installation.
        floor: The floor plan, if there is one.
    """

    MAY_SEND: ClassVar[Mapping[str, str]] = {"follow": "viewer"}

    def __init__(self, map: Map, title: str, floor: Floor | None) -> None:
        self.map = map
        self._floor = floor
        self._bounds = None if floor is None else floor.bounds
        self._looks = 0
        self._placed = False
        self._dot_size = 0.0
        tab = PRODUCT if title == PRODUCT else f"{title} - {PRODUCT}"
        self.browser_part = map.add_browser_part(
            self, "console/console.js", {"title": tab, "bounds": self._bounds}
        )

    def cell_at(self, x: float, y: float) -> int | None:
        """Return the value of the floor's cell at a place; None without a floor."""
        if self._floor is None:
            return None
        plan = self._floor.plan
        return cell_at(plan.cells, plan.resolution, plan.origin, x, y)

    def place(self) -> None:
        """Show the floor, or the robots as soon as their poses are known."""
        self._looks += 1
        bounds = self._bounds or self._around_robots()
        if bounds is not None and not self._placed:
            self._placed = True
            self.map.fit(*bounds)

    def on_own_view(self) -> None:
        """Keep the view that the page has restored."""
        self._placed = True

    def on_view_found(self) -> None:
        """Show the initial view, because no view was stored for this page."""
        self._placed = False
        self.place()

    def on_view(self) -> None:
        """Keep the size of a scan's dots on the screen at every zoom."""
        scale = math.sqrt(abs(self.map.world.tf.determinant))
        size = min(max(DOT_PIXELS / max(scale, 1e-3), 0.02), 0.3)
        if abs(size - self._dot_size) > 0.1 * size:
            self._dot_size = size
            self.map.root.set_style("--dot-size", round(size, 3))

    def on_message(self, message: dict[str, Any]) -> None:
        """Follow the selected robot in the middle of the map, when the page asks."""
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
    """Saves and loads the layout of a page; a module of maps.

    The browser stores the layout: the view, the visible layers, the open panels, the
    camera's position. The layout never contains a robot, selection, control or goal,
    and the page sends only the messages that :meth:`on_message` accepts.

    Fires ``on_own_view()`` when the page has restored its last view, and
    ``on_view_found()`` when the page needs the initial view.

    Args:
        map: The map.
        of: What the page shows: the last view is stored under this and the page's
            address.
        place: A CSS selector of the page's element for the button; by default the
            button is over the map.
        classes: CSS classes of the button in that element.
        restore: Whether the page opens with the last view.
    """

    MAY_SEND: ClassVar[Mapping[str, str]] = {"own": "viewer", "found": "viewer"}

    def __init__(
        self,
        map: Map,
        *,
        of: str = "",
        place: str = "",
        classes: str = "",
        restore: bool = True,
    ) -> None:
        self.map = map
        self.browser_part = map.add_browser_part(
            self,
            "features/layout/layout_tool.js",
            {"of": of, "place": place, "classes": classes, "restore": restore},
            "features/layout/layout_tool.css",
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Handle the page's messages about its view."""
        if message.get("own") is True:
            self.map.notify_modules("on_own_view")
            # The page receives this after all messages about the view that were sent
            # before.
            self.browser_part.send({"own": True})
        elif message.get("found") is True:
            self.map.notify_modules("on_view_found")


class CostmapNames:
    """Names each costmap in the list of layers; a module of maps.

    Similar robots are switched together, so the name is the end of the topics' names:
    ``global_costmap/costmap``.
    """

    def __init__(self, map: Map) -> None:
        self.map = map

    def poll(self) -> None:
        """Name the costmaps that were added since the last call."""
        for module in self.map.modules:
            layer = getattr(module, "layer", None)
            if layer is None or getattr(layer, "palette", None) != "costmap":
                continue
            if "data-layer" not in layer.svg.attributes:
                layer.svg.set("data-layer", ending(layer.topic))


def ending(topic: str) -> str:
    """Return the last two parts of a topic name."""
    return "/".join(topic.strip("/").split("/")[-2:])
