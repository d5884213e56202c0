"""Grids: the colours at places of the world."""

import asyncio
import math

import numpy as np
import pytest
from module_fakes import header, image_of, images, pixel, pose, typed

from equipment.waiting import until
from webmap import Map
from webmap.base.geometry import Affine
from webmap.core.map import Layer
from webmap.core.pictures import pictures
from webmap.features.layers import grid_tiles as room
from webmap.server.files import Published

WHITE, BLACK, CLEAR = (255, 255, 255, 255), (0, 0, 0, 255), (0, 0, 0, 0)


def grid(cells, resolution=0.5, origin=None, *, ros2=False, **info) -> dict:
    """Return a message; ``cells`` has its lowest row first."""
    cells = np.asarray(cells, np.int8)
    height, width = cells.shape
    received = {
        "map_load_time": header(ros2=ros2)["stamp"],
        "resolution": resolution,
        "width": width,
        "height": height,
        "origin": origin or pose(0, 0),
        **info,
    }
    return {
        "header": header(ros2=ros2),
        "info": received,
        "data": cells.ravel().tolist(),
    }


def update(x, y, cells) -> dict:
    cells = np.asarray(cells, np.int8)
    height, width = cells.shape
    return {
        "header": header(),
        "x": x,
        "y": y,
        "width": width,
        "height": height,
        "data": cells.ravel().tolist(),
    }


def shown(module):
    """Return the only tile of a grid, or None without a tile."""
    found = images(module.layer)
    assert len(found) <= 1
    return found[0] if found else None


@pytest.fixture
def module(map, link):
    return map.add_module("OccupancyGrid", link, "/map")


CORNERS = [[100, 0, 0], [0, -1, 50]]
"""Occupied at the lower left, unknown above the middle, 50 at the upper right."""


@pytest.mark.parametrize("ros2", [False, True])
@pytest.mark.parametrize(
    ("x", "y", "yaw"),
    [(0, 0, 0), (-12.34, 7.89, 0), (3.3, -4.4, math.pi / 2), (-1, -2, -2.5)],
)
def test_every_cell_is_placed_by_the_origin_of_the_grid(link, module, x, y, yaw, ros2):
    link.publish("/map", grid(CORNERS, 0.35, pose(x, y, yaw), ros2=ros2))
    placed = Affine.translation(x, y) @ Affine.rotation(yaw)
    colours = {100: BLACK, 0: WHITE, -1: CLEAR, 50: (128, 128, 128, 255)}
    for row, values in enumerate(CORNERS):
        for column, value in enumerate(values):
            at = placed.apply(0.35 * (column + 0.5), 0.35 * (row + 0.5))
            assert pixel(shown(module), *at) == colours[value], (row, column)
    outside = placed.apply(-0.1, 0.1)
    assert pixel(shown(module), *outside) is None


def test_the_image_has_the_highest_row_at_the_top(link, module):
    link.publish("/map", grid(CORNERS))
    assert image_of(shown(module)).getpixel((0, 1)) == BLACK


def test_cells_in_cbor_give_the_same_picture(link, module):
    message = grid(CORNERS)
    message["data"] = typed(72, np.array(CORNERS, np.int8))
    link.publish("/map", message, cbor=True)
    assert pixel(shown(module), 0.2, 0.2) == BLACK
    assert pixel(shown(module), 0.7, 0.7) == CLEAR


def test_a_costmap_has_one_hue_that_is_denser_with_the_cost(map, link):
    module = map.add_module("OccupancyGrid", link, "/costmap", palette="costmap")
    link.publish("/costmap", grid([[0, 1, 98, 99, 100, -1]], 1.0))
    colours = [pixel(shown(module), x + 0.5, 0.5) for x in range(6)]
    assert colours[0] == colours[5] == CLEAR
    assert {colour[:3] for colour in colours[1:5]} == {(79, 70, 229)}
    densities = [colour[3] for colour in colours[:5]]
    assert densities == sorted(set(densities))
    assert densities[-1] == 255
    assert module.layer.svg.classes


def test_a_costmap_is_drawn_over_the_map_and_both_under_robots(
    map, link, channel, robot
):
    map.add_robot(robot)
    layers = [
        map.add_module("OccupancyGrid", link, "/costmap", palette="costmap").layer,
        map.add_module("OccupancyGrid", link, "/map").layer,
    ]
    number = {fragment: mount for mount, fragment in channel.mounted.items()}
    group = next(each for each in number if "robots" in each.root.classes)
    fragments = [group, *(layer.fragment for layer in layers)]
    robots, costs, plan = (channel.orders[number[f]] for f in fragments)
    assert plan < costs < robots


def test_an_update_changes_only_its_rectangle(link, module):
    link.publish("/map", grid(np.zeros((4, 5)), 1.0, pose(10, 20)))
    link.publish("/map_updates", update(1, 2, [[100, 100], [-1, 100]]))
    black = {
        (x, y)
        for x in range(5)
        for y in range(4)
        if pixel(shown(module), 10.5 + x, 20.5 + y) == BLACK
    }
    assert black == {(1, 2), (2, 2), (2, 3)}
    assert pixel(shown(module), 11.5, 23.5) == CLEAR


def test_an_update_before_the_grid_changes_nothing(link, module, channel):
    link.publish("/map_updates", update(0, 0, [[100]]))
    assert shown(module) is None
    assert channel.errors == []


@pytest.mark.parametrize(("x", "y"), [(-1, 0), (0, -1), (2, 0), (0, 2), (2**31, 0)])
def test_an_update_outside_the_grid_is_refused(link, module, channel, x, y):
    link.publish("/map", grid(np.zeros((3, 3))))
    before = shown(module).get("href")
    link.publish("/map_updates", update(x, y, [[100, 100], [100, 100]]))
    assert shown(module).get("href") == before
    (error,) = channel.errors
    assert "reaches out of a grid of 3 x 3" in error


BAD = {
    "a cell must be a number of metres above 0, got 0": grid(CORNERS, 0),
    "above 0, got -0.05": grid(CORNERS, -0.05),
    "above 0, got nan": grid(CORNERS, None),
    "got 6 cells for a grid of 4 x ": grid(CORNERS, width=4),
    "of -3 x -2 cells, expected at least 1 x 1": grid(CORNERS, width=-3, height=-2),
    "0 x 0 cells, expected at least 1 x 1": grid(np.zeros((0, 0))),
    "cells, expected at most 67108864 in all": grid(CORNERS, width=2**31, height=2**31),
    "8193 x 8193 cells, expected at most": grid(CORNERS, width=8193, height=8193),
    "finite": grid(CORNERS, origin=pose(math.nan, 0)),
    "expected an array of numbers": {**grid(CORNERS), "data": ["a"] * 6},
    "missing required field `info`": {"data": []},
}


@pytest.mark.parametrize("why", BAD)
def test_an_invalid_grid_is_refused_and_the_last_grid_stays(link, module, channel, why):
    link.publish("/map", grid(CORNERS))
    before = shown(module).attributes, shown(module)._transform
    link.publish("/map", BAD[why])
    link.publish("/map", BAD[why])
    assert (shown(module).attributes, shown(module)._transform) == before
    (error,) = channel.errors
    assert why in error
    link.publish("/map", grid([[0]]))
    assert pixel(shown(module), 0.1, 0.1) == WHITE


def test_a_map_added_later_also_shows_the_problem_of_a_grid(map, page, link, channel):
    first = map.add_module("OccupancyGrid", link, "/map")
    link.publish("/map", grid(CORNERS, 0))
    other = Map(page.element("other"), 10, 10)
    second = other.add_module("OccupancyGrid", link, "/map")
    assert first.layer is second.layer
    assert len(channel.errors) == 2
    link.publish("/map", grid(CORNERS))
    assert first.layer.problems == {}


def test_raw_cells_may_have_any_value(map, link, channel):
    module = map.add_module("OccupancyGrid", link, "/raw", palette="raw")
    link.publish("/raw", grid([[0, 101, -2]], 1.0))
    greys = [pixel(shown(module), x + 0.5, 0.5)[0] for x in range(3)]
    assert greys == [255, 154, 1]
    assert channel.errors == []


def test_an_unknown_palette_is_refused_with_the_known_names(map, link):
    with pytest.raises(ValueError, match='"map" or "costmap" or "raw", got'):
        map.add_module("OccupancyGrid", link, "/map", palette="heat")
    assert Layer._shared == {}


def test_fifty_maps_share_one_picture_and_release_it(page, link, monkeypatch):
    drawn, before = [], len(pictures)
    monkeypatch.setattr(
        room, "grid_png", lambda *args: drawn.append(args) or b"picture"
    )
    maps = [Map(page.element(f"m{i}"), 10, 10) for i in range(50)]
    for map in maps:
        map.add_module("OccupancyGrid", link, "/map")
    link.publish("/map", grid(CORNERS))
    assert len(drawn) == 1
    page.close()
    assert link.listeners == {}
    assert Layer._shared == {}
    assert len(pictures) == before


def test_the_newest_picture_is_served_and_old_pictures_are_dropped(
    link, module, monkeypatch
):
    monkeypatch.setattr("webmap.core.pictures.KEPT_FOR", 0.0)
    published, before = Published(), len(pictures)
    tags = []
    for value in range(4):
        link.publish("/map", grid([[value * 10]]))
        tags.append(shown(module).get("href").rpartition("/")[2])
    tag = tags.pop()
    assert published.image(tag).media_type == "image/png"
    assert published.image(tag).data.startswith(b"\x89PNG")
    assert [pictures.get(each) for each in tags] == [None] * 3
    assert len(pictures) == before + 1


def test_a_large_grid_is_drawn_in_the_background_and_the_newest_is_shown(map, link):
    async def scenario():
        module = map.add_module("OccupancyGrid", link, "/map")
        cells = np.zeros((600, 600), np.int8)
        for value in (10, 20, 100):
            cells[:] = value
            message = grid(cells)
            message["data"] = typed(72, cells)
            link.publish("/map", message, cbor=True)
        assert images(module.layer) == [], "the callback does not draw the grid"
        await drawn(module)
        assert all(image_of(each).getcolors() for each in images(module.layer))
        colours = {image_of(each).getcolors()[0][1] for each in images(module.layer)}
        assert colours == {BLACK}

    asyncio.run(scenario())


async def drawn(module) -> None:
    """Wait until the tiles of a grid are drawn."""
    layer = module.layer
    await until(lambda: not layer.tiles.is_drawing and not layer._copying)


def test_a_grid_becomes_stale_only_with_an_age_limit(map, link):
    once = map.add_module("OccupancyGrid", link, "/map")
    often = map.add_module("OccupancyGrid", link, "/costmap", age_limit=2.0)
    for topic in ("/map", "/costmap"):
        link.publish(topic, grid(CORNERS))
    assert once.layer.svg._age.limit > 1e6
    assert often.layer.svg._age.limit == 2.0


def test_a_slow_page_still_gets_recent_pictures(link, module, monkeypatch):
    monkeypatch.setattr("webmap.core.pictures.KEPT_FOR", 60.0)
    urls, before = [], len(pictures)
    for value in range(100):
        link.publish("/map", grid([[value]]))
        urls.append(shown(module).get("href"))
    assert all(Published().image(each.rpartition("/")[2]).data for each in urls)
    assert len(pictures) == before + 1
