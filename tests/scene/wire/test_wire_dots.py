"""A page receives only the dots near its view that are not switched off."""

import json
import math

import numpy as np
import pytest
from msgspec.structs import replace
from test_wire_browser_reads import Decoder
from test_wire_rays import look, rays, room

from webmap.base.errors import WireError
from webmap.base.geometry import Affine
from webmap.scene import svg
from webmap.scene.live import Dots
from webmap.scene.node import Fragment
from webmap.scene.wire.dots import reach_of
from webmap.scene.wire.messages import MOST_UNSEEN, read_message
from webmap.scene.wire.session import SceneSession

SCAN = rays(room())
OTHER = rays(room(seed=2))


@pytest.fixture(scope="module")
def decoder():
    decoder = Decoder()
    yield decoder
    decoder.close()


class Shown:
    """A page with a map of 700 by 500 pixels, and a robot with a scan."""

    def __init__(self, x=0.0, y=0.0):
        self.world = svg.g()
        self.root = svg.svg(self.world).set_map(self.world, 700, 500)
        self.path = svg.path(class_="dot")
        self.robot = svg.g(svg.g(self.path))
        self.robot.set_pose(x, y, 0.0)
        self.path.set_rays(SCAN)
        self.session = SceneSession()
        within = self.session.mount(Fragment(self.root), under=0)
        self.layer = Fragment(svg.g())
        # As on a map: the robots are in a group in the world.
        group = self.session.mount(self.layer, under=self.world.id, within=within)
        under = self.layer.root.id
        self.fragment = Fragment(self.robot)
        self.mount = self.session.mount(self.fragment, under=under, within=group)
        self.frames = []

    def view(self, pixels=50.0, x=0.0, y=0.0):
        """Show a place in the centre of the map."""
        matrix = {"a": pixels, "b": 0, "c": 0, "d": -pixels}
        shift = {"e": 350 - pixels * x, "f": 250 + pixels * y}
        size = {"width": 700, "height": 500, "left": 0, "top": 0}
        self.send(op="view", map_element=self.root.id, **matrix, **shift, **size)

    def send(self, **message):
        self.session.receive(json.dumps(message))

    def tick(self, now=0.0):
        """Return the size of the next frame; 0 without one."""
        frames = look(self.session, now)
        self.frames += frames
        return sum(map(len, frames))

    def dots(self, decoder):
        """Return how many dots the page has."""
        answer = decoder.read(self.frames)
        assert "error" not in answer, answer
        (mount,) = [m for m in answer["picture"] if m["fragment"] == self.fragment.id]
        (path,) = mount["root"]["children"][0]["children"]
        return len(path.get("dots", {}).get("points", ())) // 2


def test_a_page_that_opens_gets_its_dots_when_it_has_reported_its_view(decoder):
    shown = Shown()
    shown.session.attach(shown.root.id, 7, "modules/x.js", {})
    assert 0 < shown.tick() < 200
    assert shown.dots(decoder) == 0
    assert shown.tick() == 0
    shown.view()
    assert shown.tick() > 200
    assert shown.dots(decoder) == 360
    assert shown.tick() == 0


def test_a_page_that_does_not_report_its_view_gets_its_dots_after_a_second(decoder):
    shown = Shown()
    shown.session.attach(shown.root.id, 7, "modules/x.js", {})
    assert shown.tick() < 200
    shown.path.set_rays(OTHER)
    assert shown.tick(0.9) < 200
    assert shown.tick(1.0) > 200
    assert shown.dots(decoder) == 360
    assert shown.tick(1.1) == 0


def test_a_page_that_starts_again_gets_the_dots_for_its_view_at_once(decoder):
    shown = Shown()
    shown.session.attach(shown.root.id, 7, "modules/x.js", {})
    shown.view()
    shown.tick()
    shown.session.restart()
    assert shown.tick() > 200
    assert shown.dots(decoder) == 360


def test_dots_out_of_the_view_are_not_sent(decoder):
    shown = Shown(x=100.0)
    shown.view()
    assert shown.tick() < 200
    shown.path.set_rays(OTHER)
    assert shown.tick() == 0
    assert shown.dots(decoder) == 0


def test_dots_come_when_the_view_moves_to_them(decoder):
    shown = Shown(x=100.0)
    shown.view()
    shown.tick()
    shown.view(x=95.0)
    assert shown.tick() > 200
    assert shown.dots(decoder) == 360
    assert shown.tick() == 0


def test_dots_come_before_their_robot_is_in_the_view(decoder):
    shown = Shown(x=100.0)
    shown.view()
    shown.tick()
    edge, margin = 350 / 50, 0.25 * 700 / 50
    reach = reach_of(SCAN)
    shown.robot.set_pose(edge + margin + 2 * reach, 0.0, 0.0)
    shown.tick()
    assert shown.dots(decoder) == 0
    shown.robot.set_pose(edge + reach + 0.1, 0.0, 0.0)
    shown.tick()
    assert shown.dots(decoder) == 360


def test_a_page_has_no_old_dots_where_its_view_was(decoder):
    shown = Shown()
    shown.view()
    shown.tick()
    assert shown.dots(decoder) == 360
    shown.view(x=100.0)
    shown.tick()
    assert shown.dots(decoder) == 0
    shown.path.set_rays(OTHER)
    assert shown.tick() == 0
    shown.view()
    shown.tick()
    assert shown.dots(decoder) == 360


def test_dots_of_a_layer_that_is_off_are_not_sent(decoder):
    shown = Shown()
    shown.view()
    shown.tick()
    shown.send(op="unseen", elements=[shown.path.id])
    assert 0 < shown.tick() < 40
    assert shown.dots(decoder) == 0
    for number in range(5):
        shown.path.set_rays(rays(room(seed=number + 5)))
        assert shown.tick() == 0
    shown.send(op="unseen", elements=[])
    assert shown.tick() > 200
    assert shown.dots(decoder) == 360


def test_another_page_gets_the_dots_that_one_page_does_not_show(decoder):
    shown, other = Shown(), Shown()
    other.session.mount(shown.fragment, under=other.world.id, within=1)
    for each in (shown, other):
        each.view()
        each.tick()
    shown.send(op="unseen", elements=[shown.path.id])
    shown.tick()
    shown.path.set_rays(OTHER)
    assert shown.tick() == 0
    assert other.tick() > 200


def test_a_scan_on_two_maps_is_sent_if_one_of_them_shows_its_place(decoder):
    shown = Shown(x=100.0)
    shown.view()
    shown.tick()
    world = svg.g()
    root = svg.svg(world).set_map(world, 700, 500)
    mount = shown.session.mount(Fragment(root), under=0)
    shown.session.mount(shown.fragment, under=world.id, within=mount)
    shown.session.view(root.id, "scale", 50.0)
    shown.send(
        **{"op": "view", "map_element": root.id, "a": 50, "b": 0, "c": 0, "d": -50},
        **{"e": 350 - 5000, "f": 250, "width": 700, "height": 500},
        **{"left": 0, "top": 0},
    )
    assert shown.tick() > 200
    shown.path.set_rays(OTHER)
    assert shown.tick() > 200


def test_a_page_that_starts_again_gets_its_dots_again(decoder):
    shown = Shown()
    shown.view()
    shown.tick()
    shown.send(op="unseen", elements=[shown.path.id])
    shown.tick()
    shown.session.restart()
    shown.frames.clear()
    shown.tick()
    assert shown.dots(decoder) == 360


@pytest.mark.parametrize("where", ["robot", "layer"])
def test_dots_whose_place_is_not_known_are_sent(decoder, where):
    shown = Shown(x=100.0)
    node = shown.robot if where == "robot" else shown.layer.root
    node.set(transform="translate(1 2)")
    shown.view()
    assert shown.tick() > 200


def test_the_reach_contains_all_dots():
    for scan in (
        SCAN,
        replace(SCAN, place=Affine(0, 1, -1, 0, 3.0, -4.0)),
        replace(SCAN, moved=(0.5, 0.3, 1.0)),
    ):
        from equipment.ray_points import points_of

        farthest = np.hypot(*points_of(scan).T).max()
        assert farthest <= reach_of(scan) <= 2 * farthest + 6
    points = np.array([[100, -300], [20, 40]], "<i2")
    assert math.hypot(1, 3) <= reach_of(Dots(points.tobytes(), 0.01)) < 4.5
    assert reach_of(Dots(b"", 0.01)) == 0
    assert reach_of(rays([math.nan])) == 0


def test_a_page_names_a_limited_number_of_elements():
    most = list(range(MOST_UNSEEN))
    read_message(json.dumps({"op": "unseen", "elements": most}))
    for wrong in ([*most, 1], [-1], ["a"], None):
        with pytest.raises(WireError):
            read_message(json.dumps({"op": "unseen", "elements": wrong}))
