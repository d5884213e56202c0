"""Large grids: which tiles are drawn, where, and which are not drawn again."""

import asyncio

import numpy as np
import pytest
from module_fakes import image_of, images, matrix_of, pixel, pose, typed
from test_layers_grid import CLEAR, drawn, grid, update

from webmap.base.geometry import Affine
from webmap.core.map import Layer
from webmap.core.pictures import pictures
from webmap.features.layers import grid_tiles as room
from webmap.features.layers.grid_picture import grid_png
from webmap.features.layers.grid_tiles import OVERLAP, SIDE
from webmap.ros.offload import _Worker
from webmap.scene.wire.encode import encode_snapshot

CELL = 0.05
SPECKLED = np.random.default_rng(1).integers(-1, 101, (1100, 1200)).astype(np.int8)
"""Three tiles on each side."""


@pytest.fixture
def count(monkeypatch):
    """Record the shapes of the drawn tiles; this process draws them."""
    shapes = []

    async def draw(pieces, palette):
        shapes.extend(piece.shape for piece in pieces)
        await asyncio.sleep(0)
        return [grid_png(piece, palette) for piece in pieces]

    monkeypatch.setattr(room, "draw_in_worker", draw)
    return shapes


@pytest.fixture
def module(map, link):
    """Return a map layer; the tests add it within a running loop."""
    return lambda **options: map.add_module("OccupancyGrid", link, "/map", **options)


def publish(link, cells, *at, resolution=CELL) -> None:
    message = grid(np.zeros((1, 1)), resolution, pose(*(at or (0, 0))))
    message["info"] |= {"height": len(cells), "width": len(cells[0])}
    message["data"] = typed(72, np.ascontiguousarray(cells))
    link.publish("/map", message, cbor=True)


def change(link, x, y, cells) -> None:
    link.publish("/map_updates", update(x, y, cells))


def seen(layer, shape, at=(0, 0, 0)) -> np.ndarray:
    """Return the colours of all cells, of shape (height, width, 4)."""
    found = np.full((*shape, 4), 255, np.uint8)
    found[...] = CLEAR
    known = np.zeros(shape, bool)
    to_cells = (Affine.translation(*at[:2]) @ Affine.rotation(at[2])).inverse
    for each in images(layer):
        colours = np.asarray(image_of(each))[::-1]
        height, width = colours.shape[:2]
        corner = matrix_of(each).apply(0, float(each.get("height")))
        x, y = (round(metres / CELL) for metres in to_cells.apply(*corner))
        part = slice(y, y + height), slice(x, x + width)
        again = known[part]
        assert np.array_equal(found[part][again], colours[again])
        found[part], known[part] = colours, True
    return found


def expected(cells) -> np.ndarray:
    grey = (255 - 255 * np.asarray(cells, int) // 100).astype(np.uint8)
    colours = np.stack([grey, grey, grey, np.full_like(grey, 255)], axis=-1)
    colours[cells < 0] = CLEAR
    return colours


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_the_tiles_of_a_large_grid_show_every_cell_in_place(link, module, count, yaw):
    async def scenario():
        grids = module()
        publish(link, SPECKLED, 3, -4, yaw)
        await drawn(grids)
        assert len(count) == len(images(grids.layer)) == 9
        picture = seen(grids.layer, SPECKLED.shape, (3, -4, yaw))
        visible = picture[..., 3] > 0
        assert np.array_equal(visible, SPECKLED >= 0)
        assert np.array_equal(picture[visible], expected(SPECKLED)[visible])

    asyncio.run(scenario())


def test_neighbouring_tiles_overlap_so_that_no_seam_is_visible(link, module, count):
    async def scenario():
        grids = module()
        publish(link, SPECKLED)
        await drawn(grids)
        for side in (SIDE * CELL, 2 * SIDE * CELL):
            for at in ((side + CELL / 2, 1.0), (1.0, side + CELL / 2)):
                over = [pixel(each, *at) for each in images(grids.layer)]
                assert sum(colour is not None for colour in over) == 2
        assert max(count) == (SIDE + OVERLAP, SIDE + OVERLAP)

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("x", "y", "size", "tiles"),
    [
        (600, 600, 100, 1),
        (SIDE, 600, 5, 2),  # the neighbouring tile draws these columns, too
        (SIDE - 5, SIDE - 5, 10, 4),
        (1190, 1090, 10, 1),
        (0, 0, 1, 1),
    ],
)
def test_an_update_draws_and_sends_only_the_tiles_it_touches(
    link, module, count, x, y, size, tiles
):
    async def scenario():
        grids = module()
        publish(link, SPECKLED)
        await drawn(grids)
        before = {each: each.get("href") for each in images(grids.layer)}
        count.clear()
        patch = np.full((size, size), 77, np.int8)
        change(link, x, y, patch)
        await drawn(grids)
        after = {each: each.get("href") for each in images(grids.layer)}
        assert before.keys() == after.keys()
        assert sum(before[each] != after[each] for each in after) == tiles
        assert len(count) == tiles
        cells = SPECKLED.copy()
        cells[y : y + size, x : x + size] = patch
        assert np.array_equal(
            seen(grids.layer, cells.shape)[cells >= 0], expected(cells)[cells >= 0]
        )
        change(link, x, y, patch)
        await drawn(grids)
        assert len(count) == tiles, "the cells are the same"

    asyncio.run(scenario())


def test_a_grid_with_few_changed_cells_draws_only_their_tiles(link, module, count):
    async def scenario():
        grids = module()
        publish(link, SPECKLED)
        await drawn(grids)
        count.clear()
        publish(link, SPECKLED)
        await drawn(grids)
        assert count == []
        cells = SPECKLED.copy()
        cells[700, 700] ^= 1
        publish(link, cells)
        await drawn(grids)
        assert len(count) == 1

    asyncio.run(scenario())


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_a_map_that_grows_keeps_the_tiles_it_has(link, module, count, yaw):
    async def scenario():
        grids = module()
        publish(link, SPECKLED, 3, -4, yaw)
        await drawn(grids)
        before = {
            each: (each.get("href"), matrix_of(each)) for each in images(grids.layer)
        }
        count.clear()
        grown = np.full((1100, 1300), 40, np.int8)
        grown[:, 100:] = SPECKLED
        x, y = Affine.rotation(yaw).apply(-100 * CELL, 0)
        publish(link, grown, 3 + x, -4 + y, yaw)
        await drawn(grids)
        assert len(count) == 3, "only tiles of the new columns are drawn"
        assert {width for _, width in count} == {100 + OVERLAP}
        after = {
            each: (each.get("href"), matrix_of(each)) for each in images(grids.layer)
        }
        assert before.items() <= after.items()
        picture = seen(grids.layer, grown.shape, (3 + x, -4 + y, yaw))
        assert np.array_equal(picture[grown >= 0], expected(grown)[grown >= 0])

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("at", "resolution"), [((0.02, 0), CELL), ((0, 0, 0.1), CELL), ((0, 0), 2 * CELL)]
)
def test_a_grid_with_other_cells_is_drawn_anew(link, module, count, at, resolution):
    async def scenario():
        grids = module()
        publish(link, SPECKLED)
        await drawn(grids)
        count.clear()
        publish(link, SPECKLED, *at, resolution=resolution)
        await drawn(grids)
        assert len(count) == len(images(grids.layer)) == 9
        placed = Affine.translation(*at[:2]) @ Affine.rotation((*at, 0)[2])
        for row, column in [(3, 5), (700, 1), (1098, 1199)]:
            centre = (column + 0.5) * resolution, (row + 0.5) * resolution
            tiles = [
                pixel(each, *placed.apply(*centre)) for each in images(grids.layer)
            ]
            wanted = tuple(expected(SPECKLED[row, column : column + 1])[0])
            assert {colour for colour in tiles if colour} == {wanted}

    asyncio.run(scenario())


def test_a_smaller_grid_removes_tiles_and_their_pictures(link, module, count, page):
    async def scenario():
        before = len(pictures)
        grids = module()
        publish(link, SPECKLED)
        await drawn(grids)
        assert len(pictures) == before + 9
        publish(link, SPECKLED[:, :1000])
        await drawn(grids)
        assert len(images(grids.layer)) == 6
        publish(link, SPECKLED[:600, :500])
        await drawn(grids)
        assert len(images(grids.layer)) == 1
        page.close()
        assert Layer._shared == {}
        assert len(pictures) == before

    asyncio.run(scenario())


@pytest.mark.parametrize(("palette", "clear"), [("map", -1), ("costmap", 0)])
def test_a_tile_without_a_visible_cell_has_no_picture(
    link, module, count, palette, clear
):
    async def scenario():
        grids = module(palette=palette)
        cells = np.full((1100, 1200), clear, np.int8)
        cells[10, 10] = 50
        publish(link, cells)
        await drawn(grids)
        assert len(count) == 9
        assert len(images(grids.layer)) == 1
        change(link, 1100, 1000, [[50]])
        await drawn(grids)
        assert len(images(grids.layer)) == 2
        change(link, 10, 10, [[clear]])
        await drawn(grids)
        assert len(images(grids.layer)) == 1

    asyncio.run(scenario())


def test_late_viewers_get_all_tiles(link, module, count):
    async def scenario():
        grids = module()
        publish(link, SPECKLED)
        await drawn(grids)
        change(link, 600, 600, [[1]])
        await drawn(grids)
        snapshot = encode_snapshot(grids.layer.fragment)
        addresses = [each.get("href").encode() for each in images(grids.layer)]
        assert len(addresses) == 9
        assert all(address in snapshot for address in addresses)

    asyncio.run(scenario())


def test_updates_wait_while_a_large_grid_is_copied_and_leave_the_message(
    link, module, count
):
    async def scenario():
        grids = module()
        publish(link, SPECKLED)
        message = grids.layer.cells
        for number in range(5):
            change(link, number, 3, [[number, 90]])
        assert grids.layer.cells is message, "the callback does not copy the cells"
        await drawn(grids)
        assert np.array_equal(message, SPECKLED)
        assert grids.layer.cells[3, :6].tolist() == [0, 1, 2, 3, 4, 90]
        picture = seen(grids.layer, SPECKLED.shape)
        assert np.array_equal(picture[3, :6], expected(grids.layer.cells[3, :6]))

    asyncio.run(scenario())


def test_a_whole_grid_replaces_updates_that_still_wait(link, module, count):
    async def scenario():
        grids = module()
        publish(link, SPECKLED)
        change(link, 0, 0, [[33]])
        later = np.full_like(SPECKLED, 20)
        publish(link, later)
        change(link, 5, 0, [[44]])
        await drawn(grids)
        later[0, 5] = 44
        assert np.array_equal(grids.layer.cells, later)
        assert np.array_equal(seen(grids.layer, later.shape), expected(later))

    asyncio.run(scenario())


def test_an_older_drawing_never_replaces_a_newer_one(link, module, monkeypatch):
    begun, go_on = asyncio.Event(), asyncio.Event()

    async def draw(pieces, palette):
        begun.set()
        await go_on.wait()
        return [grid_png(piece, palette) for piece in pieces]

    monkeypatch.setattr(room, "draw_in_worker", draw)

    async def scenario():
        grids = module()
        publish(link, SPECKLED)
        await begun.wait()
        small = np.full((100, 100), 30, np.int8)
        publish(link, small)  # drawn at once, during the large grid
        go_on.set()
        await drawn(grids)
        assert np.array_equal(seen(grids.layer, small.shape), expected(small))
        assert len(images(grids.layer)) == 1

    asyncio.run(scenario())


def test_a_failing_worker_is_a_problem_until_it_draws_again(link, module, monkeypatch):
    fails = True

    async def ask(self, request, data):
        if fails:
            raise EOFError("the worker has ended")
        return await original(self, request, data)

    original = _Worker._ask
    monkeypatch.setattr(_Worker, "_ask", ask)

    async def scenario():
        nonlocal fails
        grids = module()
        publish(link, SPECKLED)
        await drawn(grids)
        assert images(grids.layer) == []
        (problem,) = grids.layer.problems.values()
        assert problem.startswith("/map: its decoder ended")
        fails = False
        publish(link, SPECKLED)
        await drawn(grids)
        assert grids.layer.problems == {}
        assert len(images(grids.layer)) == 9

    asyncio.run(scenario())


def test_the_drawing_ends_with_the_layer(link, module, page, monkeypatch):
    begun, batches = asyncio.Event(), []

    async def draw(pieces, palette):
        batches.append(len(pieces))
        begun.set()
        await asyncio.sleep(0)
        return [grid_png(piece, palette) for piece in pieces]

    monkeypatch.setattr(room, "draw_in_worker", draw)

    async def scenario():
        before = len(pictures)
        grids = module()
        publish(link, SPECKLED)
        await begun.wait()
        page.close()
        await drawn(grids)
        assert len(batches) == 1
        assert len(pictures) == before

    asyncio.run(scenario())


def test_a_grid_of_a_million_cells_is_one_tile_that_moves_with_the_grid(
    link, module, count
):
    async def scenario():
        grids = module()
        cells = SPECKLED[:1000, :1048]
        for at in ((0, 0), (3, -4, 0.5), (600 * CELL, 0)):
            publish(link, cells, *at)
            await drawn(grids)
            (only,) = images(grids.layer)
            assert image_of(only).size == (1048, 1000)
            visible = cells >= 0
            at = (*at, 0)[:3]
            picture = seen(grids.layer, cells.shape, at)
            assert np.array_equal(picture[visible], expected(cells)[visible])

    asyncio.run(scenario())
