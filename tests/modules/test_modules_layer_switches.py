"""What may be switched."""

import pytest

from webmap.errors import ConfigError


def test_a_layer_that_does_not_exist_is_named_with_those_that_do(map):
    there_are = "no layer 'Scan'; there are Tiles, Maps, Pictures, Costmaps"
    with pytest.raises(ConfigError, match=there_are):
        map.add_module("LayerSwitches", off=["Scan"])


def test_the_browser_is_told_names_selectors_and_what_is_off(map):
    switches = map.add_module("LayerSwitches", {"Dust": ".dust"}, off=["Dust"])
    assert switches in map.modules


def test_each_of_several_drawings_has_the_name_that_it_is_switched_by(map, link, robot):
    made = [
        robot.add_module("Range", link, "/bob/sonar/left"),
        robot.add_module("PoseWithCovariance", link, "/bob/amcl_pose"),
        map.add_module("Markers", link, "/bob/goals", robot=robot).layer,
        map.add_module("Markers", link, "/bob/zones").layer,
    ]
    names = [each.svg.get("data-layer") for each in made]
    assert names == ["sonar/left", "amcl_pose", "goals", "/bob/zones"]
