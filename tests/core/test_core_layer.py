"""Layers: drawn once, however many maps show them."""

import pytest

from webmap import Layer, Map, svg
from webmap.base.errors import WireError
from webmap.base.scope import Removal, keep


class Link:
    def __init__(self) -> None:
        self.listeners = []

    def subscribe(self, topic, callback):
        self.listeners.append(callback)
        return keep(Removal(lambda: self.listeners.remove(callback)))


class Circles(Layer):
    """Draws a circle with the radius of each message."""

    drawn = 0

    def __init__(self, bridge, topic, *, colour="red") -> None:
        super().__init__()
        self.bridge, self.topic, self.colour = bridge, topic, colour

    def start(self) -> None:
        self.bridge.subscribe(self.topic, self.draw)

    def draw(self, radius) -> None:
        Circles.drawn += 1
        self.svg.clear()
        self.svg.append(svg.circle(r=radius, fill=self.colour))


class ShowCircles:
    def __init__(self, map, bridge, topic, **options) -> None:
        self.layer = Circles.shared(bridge, topic, **options)
        map.add_layer(self.layer)


def test_fifty_maps_of_one_topic_share_one_subscription_and_one_drawing(page):
    link = Link()
    maps = [Map(page.element(f"m{i}"), 100, 100) for i in range(50)]
    modules = [map.add_module(ShowCircles, link, "/circles") for map in maps]
    assert len(link.listeners) == 1
    Circles.drawn = 0
    link.listeners[0](2.0)
    assert Circles.drawn == 1
    for map, module in zip(maps, modules, strict=True):
        map.remove_module(module)
    assert link.listeners == []
    assert Layer._shared == {}


def test_different_options_make_a_different_layer(page, container):
    link = Link()
    map = Map(container, 100, 100)
    red = map.add_module(ShowCircles, link, "/circles")
    blue = map.add_module(ShowCircles, link, "/circles", colour="blue")
    assert red.layer is not blue.layer
    page.close()
    assert link.listeners == []


def test_closing_a_page_releases_its_layers(page, container, channel):
    link = Link()
    Map(container, 100, 100).add_module(ShowCircles, link, "/circles")
    page.close()
    assert Layer._shared == {}
    assert channel.mounted == {}


def test_a_layer_added_to_a_destroyed_map_is_refused_and_released(page, container):
    link = Link()
    map = Map(container, 100, 100)
    map.destroy()
    with pytest.raises(WireError, match="not on the page"):
        map.add_layer(Circles.shared(link, "/circles"))
    assert link.listeners == []
    assert Layer._shared == {}
