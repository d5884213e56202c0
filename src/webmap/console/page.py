"""The page itself: a map with everything around it, for each viewer that opens it."""

import asyncio
import atexit
import hashlib
import logging
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import webmap
from webmap.console.bridge_list import BridgeList
from webmap.console.camera_panel import CameraPanel
from webmap.console.costmaps import CostmapNames
from webmap.console.doctor import DoctorReports
from webmap.console.fleet import RobotDescription, make_robot
from webmap.console.floor import Floor, load_floor
from webmap.console.frame import Frame
from webmap.console.health import RobotHealth
from webmap.console.layout import Layout
from webmap.console.opened import Console
from webmap.console.refused import RefusedList
from webmap.console.robot_buttons import RobotButtons
from webmap.console.robot_card import RobotCard
from webmap.console.robot_list import RobotList

if TYPE_CHECKING:
    from webmap import Bridge, Map, Page

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
    robots: Sequence[RobotDescription],
    *,
    floor: Path | None = None,
    title: str = PRODUCT,
    place: str | None = None,
) -> Console:
    """Make the console the page at ``/``.

    Args:
        bridges: The links whose state is shown.
        robots: What is shown on the map and in the list, in that order.
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
    fleet = [make_robot(about) for about in robots]
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
    card = map.add_module(RobotCard, at, goals, poses, most, opened.remove)
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
