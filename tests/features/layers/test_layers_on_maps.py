"""Modules of robots that draw on maps."""

import pytest
from module_fakes import header, images, pose

from webmap import Map, Robot
from webmap.base.errors import ConfigError, ModuleNotFound
from webmap.core.map import Layer
from webmap.modules.map_layer import ShownLayer


def grids(map: Map) -> list:
    return [m for m in map.modules if isinstance(m, ShownLayer)]


def test_only_maps_that_show_the_robot_have_its_map_module(map, page, robot, link):
    other = Map(page.element("other"), 10, 10)
    map.add_robot(robot)
    module = robot.add_module("OnMaps", "OccupancyGrid", link, "/c", palette="costmap")
    assert (len(grids(map)), len(grids(other))) == (1, 0)
    other.add_robot(robot)
    assert grids(other)[0].layer is grids(map)[0].layer, "both maps share one layer"
    map.remove_robot(robot)
    assert (len(grids(map)), len(grids(other))) == (0, 1)
    robot.remove_module(module)
    assert grids(other) == []
    assert Layer._shared == {}
    assert link.listeners == {}


def test_closing_a_page_removes_its_map_modules(map, page, robot, link):
    map.add_robot(robot)
    robot.add_module("OnMaps", "Markers", link, "/m")
    page.close()
    assert Layer._shared == {}
    assert robot.maps == []


def test_a_map_module_may_be_removed_from_the_map_before_the_robot(map, robot, link):
    map.add_robot(robot)
    robot.add_module("OnMaps", "OccupancyGrid", link, "/c")
    map.remove_module(grids(map)[0])
    map.remove_robot(robot)
    assert grids(map) == []


def test_the_map_module_of_a_robot_draws_its_grid(map, robot, link, channel):
    map.add_robot(robot)
    robot.add_module("OnMaps", "OccupancyGrid", link, "/c")
    info = {"map_load_time": header()["stamp"], "resolution": 1, "width": 1}
    info |= {"height": 1, "origin": pose(0, 0)}
    link.publish("/c", {"header": header(), "info": info, "data": [100]})
    (image,) = images(grids(map)[0].layer)
    assert image.get("href")


def test_an_unknown_map_module_is_refused_with_its_name(robot):
    with pytest.raises(ModuleNotFound, match="OccupancyGird"):
        robot.add_module("OnMaps", "OccupancyGird")


@pytest.mark.parametrize(
    ("module", "options", "expected"),
    [
        ("OccupancyGrid", {"palette": "grey"}, 'palette: expected "map" or "costmap"'),
        ("OccupancyGrid", {"pallet": "map"}, 'did you mean "palette"'),
        ("Markers", {"type": "std_msgs/String"}, "type: expected"),
    ],
)
def test_invalid_arguments_are_refused_before_the_robot_is_on_a_map(
    robot, link, module, options, expected
):
    with pytest.raises(ConfigError, match=expected):
        robot.add_module("OnMaps", module, link, "/c", **options)


def test_a_map_module_belongs_to_its_robot_unless_another_robot_is_given(
    map, robot, link
):
    map.add_robot(robot)
    robot.add_module("OnMaps", "OccupancyGrid", link, "/c")
    other = Robot("Other")
    robot.add_module("OnMaps", "OccupancyGrid", link, "/d", robot=other)
    owners = [grid.layer.svg.get("data-layer-of") for grid in grids(map)]
    assert owners == [robot.id, other.id]
    other.destroy()


def test_an_unsupported_or_invalid_robot_argument_is_refused(robot):
    with pytest.raises(ConfigError, match=r'Follow: there is no argument "robot"'):
        robot.add_module("OnMaps", "Follow", robot=robot)
    with pytest.raises(ConfigError, match="robot: expected a Robot, got 'Bob'"):
        robot.add_module("OnMaps", "Markers", robot="Bob")


def test_invalid_arguments_of_a_map_module_give_one_notice(map, robot, channel):
    robot.add_module("OnMaps", "TileLayer", "/none", (50.0, 14.0), most=0)
    map.add_robot(robot)
    (error,) = channel.errors
    assert "Bob: TileLayer: the tiles: most: got the whole number 0" in error
