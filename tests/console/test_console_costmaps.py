"""Costmaps have names in the list of layers."""

from types import SimpleNamespace

import pytest

from webmap import svg
from webmap.console.page import CostmapNames


def grid(topic, palette="costmap"):
    layer = SimpleNamespace(topic=topic, palette=palette, svg=svg.g())
    return SimpleNamespace(layer=layer)


def named(*modules):
    CostmapNames(SimpleNamespace(modules=modules)).poll()
    return [module.layer.svg.attributes.get("data-layer") for module in modules]


@pytest.mark.parametrize(
    ("topic", "name"),
    [
        ("/bob/global_costmap/costmap", "global_costmap/costmap"),
        ("/bob/move_base/local_costmap/costmap", "local_costmap/costmap"),
        ("/costmap", "costmap"),
    ],
)
def test_a_costmap_is_named_after_the_end_of_its_topic(topic, name):
    assert named(grid(topic)) == [name]


def test_a_named_costmap_is_not_renamed_and_a_map_gets_no_name():
    costmap = grid("/costmap")
    costmap.layer.svg.set("data-layer", "/costmap (north)")
    assert named(costmap, grid("/map", "map")) == ["/costmap (north)", None]


def test_modules_without_a_layer_are_ignored():
    CostmapNames(SimpleNamespace(modules=[object()])).poll()
