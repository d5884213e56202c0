"""The specified behaviour of a map: chapter 5.2 of the seed."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap import Map, Robot, svg
from webmap.base.errors import ConfigError
from webmap.base.geometry import Vector3
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.core.world_view import Rect, apply_operation, initial_view

POINTS = st.floats(-2000, 2000)


def test_a_new_map_has_the_origin_in_its_centre_and_one_pixel_per_metre(container):
    map = Map(container, 700, 500)
    assert (map.canvas_width, map.canvas_height) == (700, 500)
    assert map.world.tf.apply(0, 0) == (350, 250)
    assert map.world.tf.apply(1, 1) == (351, 249), "y is up in the world"


def test_a_map_without_a_size_has_the_size_of_its_container(container):
    map = Map(container)
    assert (map.canvas_width, map.canvas_height) == (700, 500)
    assert (map.get_bounding_rect().width, map.get_bounding_rect().height) == (700, 500)


def test_a_container_of_which_the_page_knows_no_size_has_that_of_the_window(
    channel, publisher, tmp_path
):
    entry = PageEntry("/", lambda page: None, None, tmp_path, "test")
    page = Page(entry, channel, Viewer("v1", "Ann"), publisher, {}, (1280, 800))
    with page.scope.active():
        map = Map(page.element("map"))
    assert (map.canvas_width, map.canvas_height) == (1280, 800)
    page.close()


def test_the_view_of_the_tutorial_shows_the_whole_background(container):
    map = Map(container, 700, 500)
    map.scale(500 / 58.7, map.canvas_width * 0.5, map.canvas_height * 0.5)
    left, top = map.world.tf.apply(-29.35, 29.35)
    right, bottom = map.world.tf.apply(29.35, -29.35)
    assert (left, right) == pytest.approx((100, 600))
    assert (top, bottom) == pytest.approx((0, 500))


@given(
    operation=st.sampled_from(["scale", "rotate"]),
    amount=st.floats(0.1, 400),
    x=POINTS,
    y=POINTS,
)
def test_the_fixed_point_of_scale_and_rotate_stays_in_place(operation, amount, x, y):
    before = initial_view(700, 500)
    after = apply_operation(before, Rect(0, 0, 700, 500), operation, (amount, x, y))
    world = before.inverse.apply(x, y)
    assert after.apply(*world) == pytest.approx((x, y), abs=1e-6)


def test_a_positive_rotation_is_counter_clockwise_on_the_screen(container):
    map = Map(container, 200, 200)
    map.rotate(90)
    x, y = map.world.tf.apply(1, 0)
    assert (x, y) == pytest.approx((100, 99)), "east is up after a quarter turn"


def test_translate_moves_by_pixels(container):
    map = Map(container, 200, 200)
    map.translate(10, -5)
    assert map.world.tf.apply(0, 0) == (110, 95)


def test_view_operations_are_sent_to_the_browser_in_order(container, channel):
    map = Map(container, 200, 200)
    map.scale(2)
    map.translate(1, 2)
    assert channel.calls == [("scale", 2, 100, 100), ("translate", 1, 2)]


def test_a_visible_robot_is_followed_without_moving_the_view(container, channel):
    map, robot = Map(container, 200, 100), Robot("Bob")
    map.follow(robot)
    assert channel.calls == [("follow", robot.svg.id)]


def test_a_robot_outside_the_view_is_centred_and_followed(container, channel):
    map, robot = Map(container, 200, 100), Robot("Bob")
    robot.position = Vector3(150.0, 20.0)
    map.follow(robot)
    assert channel.calls == [("translate", -150, 20), ("follow", robot.svg.id)]
    map.follow(None)
    assert channel.calls[-1] == ("follow", 0)


class Witness:
    """A module that records its triggers."""

    def __init__(self, map) -> None:
        self.map = map
        self.received: list[tuple] = []

    def on_add_robot(self, robot):
        self.received.append(("add", robot.name))

    def on_remove_robot(self, robot):
        self.received.append(("remove", robot.name))

    def on_select(self):
        selected = self.map.selected
        self.received.append(("select", selected and selected.name))


def test_triggers_fire_for_added_removed_and_selected_robots(container):
    map = Map(container, 700, 500)
    witness = map.add_module(Witness)
    bob = Robot("Bob")
    map.add_robot(bob)
    map.add_robot(bob)
    map.set_selected(bob)
    map.set_selected(bob)
    map.remove_robot(bob)
    assert witness.received == [
        ("add", "Bob"),
        ("select", "Bob"),
        ("select", None),
        ("remove", "Bob"),
    ]
    assert map.robots == []
    assert map.selected is None


def test_the_class_selected_is_set_on_the_mount_and_not_on_the_robot(
    container, channel
):
    map = Map(container, 700, 500)
    bob = Robot("Bob")
    map.add_robot(bob)
    map.set_selected(bob)
    assert ("class", bob.fragment, "selected", True) in channel.calls
    assert "selected" not in bob.svg.classes


def test_a_robot_on_two_maps_is_selected_while_selected_on_one_map(page):
    one, two = Map(page.element("a"), 10, 10), Map(page.element("b"), 10, 10)
    bob = Robot("Bob")
    changes: list[bool] = []

    class Light:
        def __init__(self, robot) -> None:
            pass

        def on_select(self, selected):
            changes.append(selected)

    bob.add_module(Light)
    one.add_robot(bob)
    two.add_robot(bob)
    assert bob.maps == [one, two]
    one.set_selected(bob)
    two.set_selected(bob)
    one.set_selected(None)
    assert bob.selected
    two.remove_robot(bob)
    assert not bob.selected
    assert changes == [True, False]


def test_a_robot_of_another_map_cannot_be_selected(container):
    map = Map(container, 700, 500)
    with pytest.raises(ValueError, match="not on this map"):
        map.set_selected(Robot("Bob"))


def test_an_image_is_added_with_a_published_url_and_can_be_removed(container, tmp_path):
    (tmp_path / "floor.png").write_bytes(b"png")
    map = Map(container, 700, 500)
    image = map.add_image("floor.png", -2.0, 1.0, 4.0, 3.0)
    assert image.get("href") == "/_webmap/images/floor.png"
    assert image in map.images.children
    map.remove_image(image)
    assert image not in map.images.children


def test_a_missing_image_is_shown_as_an_error_on_the_page(container, channel):
    map = Map(container, 700, 500)
    map.add_image("nowhere.png", 0, 0, 1, 1)
    assert len(channel.errors) == 1
    assert "nowhere.png" in channel.errors[0]


def test_an_image_outside_the_folder_of_the_page_is_not_shown(
    container, channel, publisher
):
    map = Map(container, 700, 500)
    map.add_image("../../etc/passwd", 0, 0, 1, 1)
    assert "outside" in channel.errors[0]
    assert publisher.images == []


def test_a_container_that_is_not_on_a_page_is_refused():
    with pytest.raises(ConfigError, match=r"page\.element"):
        Map(svg.g())


def test_a_map_on_a_closed_page_is_refused(page, container):
    page.close()
    with pytest.raises(ConfigError, match="page '/' of Ann was closed"):
        Map(container, 700, 500)
    assert page.maps == []


def test_a_map_knows_its_position_in_the_browser(container):
    map = Map(container, 700, 500)
    map.on_view_report(map.world.tf, Rect(12.0, 34.0, 700.0, 500.0))
    place = map.get_bounding_rect()
    assert (place.left, place.top) == (12.0, 34.0)


def test_a_browser_part_exchanges_messages_with_its_module_until_its_removal(
    container, channel
):
    map = Map(container, 700, 500)
    got = []

    class Pad:
        def __init__(self, map) -> None:
            self.browser_part = map.add_browser_part(
                self, "modules/pad.js", {"size": 3}
            )

        def on_message(self, message):
            got.append(message)

    pad = map.add_module(Pad)
    assert map.on_module_message(pad.browser_part.instance, {"x": 1})
    pad.browser_part.send({"hello": 1})
    map.remove_module(pad)
    assert not map.on_module_message(pad.browser_part.instance, {"x": 2})
    assert got == [{"x": 1}]
    assert [call[0] for call in channel.calls] == ["attach", "send", "detach"]


def test_a_closed_page_leaves_nothing_behind(page, channel, publisher, tmp_path):
    (tmp_path / "floor.png").write_bytes(b"png")
    bob = Robot("Bob")
    map = Map(page.element("webmap_container"), 700, 500)
    map.add_image("floor.png", 0, 0, 1, 1)
    map.add_robot(bob)
    map.set_selected(bob)
    with page.scope.active():
        map.on(bob.svg, "click", print)
        bob.svg.on("click", print)
        map.add_module("MouseViewControl")
        map.add_module("Teleop", 1.0, 1.5)
    assert page.speeds == (1.0, 1.5)
    page.close()
    assert channel.mounted == {}
    assert page.maps == []
    assert bob.maps == []
    assert not bob.selected
    assert bob.svg.handlers("click") == ()
    assert publisher.images == []
    assert page.speeds == (0.0, 0.0)
    bob.destroy()


def test_teleop_refuses_invalid_speeds(container):
    map = Map(container, 700, 500)
    for speed in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="speed"):
            map.add_module("Teleop", speed, 1.0)


def test_the_speeds_of_a_page_are_those_of_its_active_map(page):
    slow = Map(page.element("a"), 10, 10).add_module("Teleop", 0.2, 0.4)
    fast = Map(page.element("b"), 10, 10).add_module("Teleop", 1.0, 1.5)
    assert page.speeds == (0.2, 0.4), "no map is active yet, so the lowest speeds"
    fast.on_message({"active": True})
    assert page.speeds == (1.0, 1.5)
    slow.on_message({"active": True})
    fast.on_message({"active": False})
    assert page.speeds == (0.2, 0.4)
    fast.map.remove_module(fast)
    assert page.speeds == (0.2, 0.4)
