"""What may be switched."""

import pytest

from webmap.errors import ConfigError


def test_a_layer_that_does_not_exist_is_named_with_those_that_do(map):
    there_are = "no layer 'Scan'; there are Tiles, Maps, Costmaps"
    with pytest.raises(ConfigError, match=there_are):
        map.add_module("LayerSwitches", off=["Scan"])


def test_the_browser_is_told_names_selectors_and_what_is_off(map):
    switches = map.add_module("LayerSwitches", {"Dust": ".dust"}, off=["Dust"])
    assert switches in map.modules
