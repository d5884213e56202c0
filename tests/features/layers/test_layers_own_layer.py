"""A layer in one file outside of the package can do all that a built-in layer can."""

import asyncio
import importlib.util
import math
import subprocess
import sys
from pathlib import Path

import pytest
from module_fakes import header, pose, to_root
from test_layers_frames import send_transforms
from tilted_frames import frame

from webmap import Bridge, Map
from webmap.base.errors import ConfigError
from webmap.config.robot import RobotConfig
from webmap.console import Console
from webmap.core.map import Layer
from webmap.core.registry import map_modules, robot_modules
from webmap.discovery import discover
from webmap.discovery.findings import FoundLayer
from webmap.discovery.fleet_toml import fleet_toml
from webmap.discovery.layers import find_layers, with_layers
from webmap.features.view.view import all_layers
from webmap.fleet.periodic_search import LayerSearch
from webmap.fleet.robot_options import Candidate
from webmap.fleet.view_robots import ViewRobots

FILE = Path(__file__).parents[1] / "own_layers.py"
URL = "ws://hall:9090"
TOPICS = {
    f"{space}/{name}": type
    for space in ("/a", "/b")
    for name, type in {
        "odom": "nav_msgs/Odometry",
        "cmd_vel": "geometry_msgs/Twist",
        "temp_1": "sensor_msgs/msg/Temperature",
        "temp_2": "sensor_msgs/msg/Temperature",
        "temp_3": "sensor_msgs/msg/Temperature",
        "oven": "sensor_msgs/msg/Temperature",
        "spot": "my_msgs/Spot",
        "zones": "my_msgs/Zones",
    }.items()
} | {"/zones": "my_msgs/Zones"}


@pytest.fixture(autouse=True)
def own_layers(monkeypatch, tmp_path):
    """Import the file from another folder, and remove its layers afterwards."""
    for namespace in (robot_modules, map_modules):
        namespace.names()  # a module that is first imported later would be lost
        monkeypatch.setattr(namespace, "_registered", dict(namespace._registered))
    file = tmp_path / "my_own_layers.py"
    file.write_text(FILE.read_text("utf-8"), "utf-8")
    spec = importlib.util.spec_from_file_location("my_own_layers", file)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "my_own_layers", module)
    spec.loader.exec_module(module)


@pytest.fixture
def robot(robot, link):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    go(link, 2.9, 4.9, 0.0)
    go(link, 3.1, 5.1, 0.0)
    return robot


def stamped(seconds: float, frame_id: str = "base_link") -> dict:
    whole = int(seconds)
    stamp = {"secs": whole, "nsecs": round((seconds - whole) * 1e9)}
    return {"stamp": stamp, "frame_id": frame_id}


def go(link, seconds: float, x: float, yaw: float) -> None:
    link.publish("/odom", {"header": stamped(seconds, "map"), "pose": pose(x, 0, yaw)})


def degrees(celsius: float | None, seconds: float = 3.0) -> dict:
    return {"header": stamped(seconds), "temperature": celsius, "variance": None}


def test_a_custom_layer_is_found_by_type_and_name_up_to_its_limit():
    for space in ("/a", "/b"):
        found = find_layers(TOPICS, ["/a", "/b"])[space].drawn
        drawn = {layer.topic: layer.kind for layer in found}
        assert drawn == {
            f"{space}/temp_1": "temperature",
            f"{space}/temp_2": "temperature",
            f"{space}/spot": "spot",
            f"{space}/zones": "zones",
            "/zones": "zones",
        }
        (other,) = find_layers(TOPICS, ["/a", "/b"])[space].left_out
        assert other.topic == f"{space}/temp_3"


def test_custom_layers_have_switches_after_the_built_in_layers():
    layers = all_layers()
    assert list(layers)[-2:] == ["Sensors", "Zones"]
    assert (layers["Sensors"], layers["Zones"]) == (".temperature", ".zones")
    assert layers["Points"] == ".pointstamped"


def test_found_layers_are_added_and_a_shared_layer_only_once():
    bridge, console = Bridge(URL), Console()
    shown = ViewRobots(console)
    for found in discover(TOPICS, "host").robots:
        shown.add(Candidate(bridge, found))
    asyncio.run(LayerSearch(bridge, shown).take(TOPICS))
    for robot in console.robots:
        kinds = [type(module).__name__ for module in robot.modules]
        assert kinds.count("Temperature") == 2
        (own,) = (m for m in robot.modules if type(m).__name__ == "OnMaps")
        assert own._arguments[0] == (bridge, f"/{robot.name}/zones")
    assert console._more == [("Zones", (bridge, "/zones"), {})]
    for robot in console.robots:
        robot.destroy()


def test_a_custom_layer_may_draw_the_topic_of_the_battery():
    topic = "/a/battery_state"
    config = RobotConfig(name="a", bridge="hall", battery=topic)
    found = FoundLayer("temperature", topic, "sensor_msgs/BatteryState")
    (module,) = with_layers(config, [found, found], "/a").modules
    assert module.name == "Temperature"


def test_a_shared_custom_layer_is_added_on_a_floor_plan():
    bridge, console = Bridge(URL), Console()
    shown = ViewRobots(console, grid=False)
    topics = TOPICS | {"/map": "nav_msgs/OccupancyGrid"}
    for found in discover(topics, "host").robots:
        shown.add(Candidate(bridge, found))
    asyncio.run(LayerSearch(bridge, shown).take(topics))
    assert console.grids == {}
    assert console._more == [("Zones", (bridge, "/zones"), {})]
    for robot in console.robots:
        robot.destroy()


def test_custom_layers_are_written_to_the_fleet_file(tmp_path):
    text = fleet_toml([("hall", URL, discover(TOPICS, "bob"))])
    assert '{ name = "Temperature", args = [{ bridge = "hall" }, "/a/temp_1"] }' in text
    assert '[[modules]]\nname = "Zones" # its type alone' in text
    assert 'args = [{ bridge = "hall" }, "/zones"]' in text


def test_a_robot_layer_stays_at_its_stamp_pose_with_upright_text(link, robot):
    module = robot.add_module("Temperature", link, "/bob/temp")
    assert link.types["/bob/temp"] == "sensor_msgs/Temperature"
    assert list(module.svg.classes) == ["temperature"]
    assert module.svg.get("data-layer") == "temp", "the name in the list of layers"
    link.publish("/bob/temp", degrees(21.04))
    assert module.text.text == "21.0 °C"
    assert to_root(module.text).apply(0, 0) == pytest.approx((5.5, 0), abs=1e-3)
    go(link, 3.3, 9.0, 2.0)
    place = to_root(module.text)
    assert place.apply(0, 0) == pytest.approx((5.5, 0), abs=1e-3)
    assert place.apply(100, -100) == pytest.approx((6.5, 1), abs=1e-3)
    assert module.svg._age.limit == 5.0


@pytest.mark.parametrize(
    ("wrong", "expected"),
    [
        (degrees(math.nan, 2.95), "temperature must be a finite number, got nan"),
        (degrees(None), "temperature must be a finite number, got null"),
        ({"header": header()}, "the message has no field 'temperature'; there are:"),
        (degrees(1) | {"header": {"stamp": {"secs": 10**400}}}, "hundreds of digits"),
        (degrees(1) | {"temperature": "warm"}, "drawing failed: ValueError"),
    ],
)
def test_invalid_messages_are_logged_once_and_the_last_drawing_stays(
    link, robot, caplog, wrong, expected
):
    module = robot.add_module("Temperature", link, "/bob/temp")
    link.publish("/bob/temp", degrees(21))
    before = to_root(module.text)
    for _ in range(3):
        link.publish("/bob/temp", wrong)
    assert module.text.text == "21.0 °C"
    assert to_root(module.text) == before
    (problem,) = robot.problems.values()
    assert expected in problem
    received = [each for each in caplog.records if expected in each.getMessage()]
    assert len(received) == 1
    link.publish("/bob/temp", degrees(22))
    assert robot.problems == {}


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ({"x": 1e300, "y": 0.0}, "x must be within 1e+07 m of the origin"),
        ({"x": 0.0, "y": math.inf}, "y must be a finite number, got inf"),
    ],
)
def test_an_absurd_position_is_refused_with_a_custom_message_view(
    link, robot, place, expected
):
    module = robot.add_module("OwnSpot", link, "/spot")
    link.publish("/spot", {"header": header(), "point": {"x": 1.0, "y": 2.0}})
    before = to_root(module.spot)
    assert before.apply(0, 0) == pytest.approx((1, 2), abs=1e-3)
    link.publish("/spot", {"header": header(), "point": place})
    assert to_root(module.spot) == before
    (problem,) = robot.problems.values()
    assert expected in problem


def test_invalid_options_of_custom_layers_are_refused(link, robot, map):
    with pytest.raises(ConfigError, match='"siez"; did you mean "size"'):
        robot.add_module("Temperature", link, "/t", siez=1)
    with pytest.raises(ConfigError, match=r"size must be metres above 0, got -1"):
        robot.add_module("Temperature", link, "/t", size=-1.0)
    with pytest.raises(ConfigError, match="size: expected a number, got 'big'"):
        robot.add_module("Temperature", link, "/t", size="big")
    with pytest.raises(ConfigError, match="colour: expected a text, got 3"):
        map.add_module("Zones", link, "/zones", colour=3)
    assert link.listeners.keys() == {"/odom"}


def test_removing_a_custom_layer_removes_its_drawing_and_its_problem(link, robot):
    module = robot.add_module("Temperature", link, "/bob/temp")
    link.publish("/bob/temp", degrees(math.nan))
    robot.remove_module(module)
    assert module.svg.parent is None
    assert robot.problems == {}
    assert link.listeners.keys() == {"/odom"}


def zones(*circles: tuple[float, float, float], frame_id: str = "map") -> dict:
    names = ("x", "y", "radius")
    listed = [dict(zip(names, circle, strict=True)) for circle in circles]
    return {"header": stamped(3.0, frame_id), "zones": listed}


def test_a_map_layer_is_shared_by_maps_and_ends_with_the_last_map(link, map, page):
    other = Map(page.element("other"), 10, 10)
    modules = [each.add_module("Zones", link, "/zones") for each in (map, other)]
    layer = modules[0].layer
    assert modules[1].layer is layer
    assert len(link.listeners["/zones"]) == 1
    link.publish("/zones", zones((1, 2, 3), (4, 5, 6)))
    assert [circle.get("cx") for circle in layer.svg.children] == ["1", "4"]
    assert layer.svg.get("data-layer") == "/zones"
    map.remove_module(modules[0])
    assert link.listeners.keys() == {"/zones"}
    other.remove_module(modules[1])
    assert link.listeners == {}
    assert Layer._shared == {}


def test_a_map_layer_is_placed_by_its_frame_at_the_stamp(link, map):
    layer = map.add_module("Zones", link, "/zones", age_limit=2.0).layer
    link.publish("/zones", zones((1, 2, 3), frame_id="odom"))
    for seconds, x in ((2.9, 4.9), (3.1, 5.1)):
        send_transforms(link, frame("map", "odom", (x, 0.0, 0.0), seconds=seconds))
    link.publish("/zones", zones((1, 2, 3), frame_id="odom"))
    (circle,) = layer.svg.children
    assert to_root(circle).apply(0, 0) == pytest.approx((5.0, 0.0), abs=1e-3)
    assert layer.svg._age.limit == 2.0


def test_an_invalid_map_layer_message_is_a_problem_and_the_last_drawing_stays(
    link, map, channel
):
    layer = map.add_module("Zones", link, "/zones").layer
    link.publish("/zones", zones((1, 2, 3)))
    link.publish("/zones", zones((math.nan, 2, 3)))
    link.publish("/zones", zones((1e9, 2, 3)))
    assert [circle.get("cx") for circle in layer.svg.children] == ["1"]
    (problem,) = channel.problems.values()
    assert "/zones: x must be" in problem
    link.publish("/zones", zones((5, 2, 3)))
    assert channel.problems == {}


ENTRY_POINTS = """
[webmap.modules.robot]
Temperature = my_own_layers:Temperature
[webmap.modules.map]
Zones = my_own_layers:Zones
"""


def test_webmap_view_shows_layers_of_an_installed_package(tmp_path):
    info = tmp_path / "mine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS)
    topics = tmp_path / "topics.txt"
    topics.write_text("".join(f"{topic} {type}\n" for topic, type in TOPICS.items()))
    start = "import sys; sys.path.insert(0, sys.argv.pop(1)); import webmap.cli as c"
    command = [sys.executable, "-c", f"{start}; c.main()", str(tmp_path), "view"]
    options = ["ws://127.0.0.1:9", "--topics", str(topics), "--show", "--wait", "0"]
    done = subprocess.run([*command, *options], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    shown = [line.split() for line in done.stdout.splitlines()]
    why = ["its", "type", "and", "its", "name"]
    assert ["/a/temp_2", "Temperature", *why] in shown
    assert ["/zones", "Zones", "its", "type", "alone"] in shown
    assert "beyond the limit for their kind: /b/temp_3" in done.stdout
