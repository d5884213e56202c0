"""Grids with too many cells are drawn coarser, without losing an occupied cell."""

import asyncio

import numpy as np
import pytest
from module_fakes import images, pixel
from test_layers_grid import drawn
from test_layers_grid_tiles import CELL, change, count, module, publish  # noqa: F401

from webmap.base.geometry import Pose
from webmap.features.layers import grid_tiles as room
from webmap.features.layers.grid_tiles import MOST, OVERLAP, SIDE, GridTiles, downsample
from webmap.scene import svg

FREE = np.zeros((1100, 1200), np.int8)
"""More cells than these tests draw one by one."""


@pytest.fixture
def few(monkeypatch):
    monkeypatch.setattr(room, "MOST", 300_000)


@pytest.mark.parametrize("palette", ["map", "costmap", "raw"])
@pytest.mark.parametrize("times", [1, 2, 3, 7])
def test_a_square_of_cells_has_its_greatest_value(palette, times):
    low, high = (-128, 128) if palette == "raw" else (-1, 101)
    cells = np.random.default_rng(2).integers(low, high, (45, 61)).astype(np.int8)
    found = downsample(cells, times, palette)
    kind = np.uint8 if palette == "raw" else np.int8
    for row in range(0, 45, times):
        for column in range(0, 61, times):
            square = cells[row : row + times, column : column + times].view(kind)
            assert found.view(kind)[row // times, column // times] == square.max()
    assert found.flags.c_contiguous


@pytest.mark.usefixtures("few")
def test_every_occupied_cell_of_a_coarse_grid_is_visible(link, module, count, map):  # noqa: F811
    async def scenario():
        grids, cells = module(), FREE.copy()
        spots = [(0, 0), (5, 700), (1099, 1199), (512, 511), (1098, 3)]
        for spot in spots:
            cells[spot] = 100
        publish(link, cells)
        await drawn(grids)
        assert grids.layer.tiles.coarse == 3
        assert len(count) == len(images(grids.layer)) == 1
        for row, column in spots:
            x, y = (column + 0.5) * CELL, (row + 0.5) * CELL
            colours = [pixel(each, x, y) for each in images(grids.layer)]
            assert (0, 0, 0, 255) in colours
        assert all(
            pixel(each, 600.5 * CELL, 300.5 * CELL) == (255, 255, 255, 255)
            for each in images(grids.layer)
        )
        assert any("each 3 x 3 cells" in str(p) for p in grids.layer.problems.values())
        change(link, 600, 300, np.full((1, 1), 100))
        await drawn(grids)
        (image,) = images(grids.layer)
        assert pixel(image, 600.5 * CELL, 300.5 * CELL) == (0, 0, 0, 255)
        publish(link, FREE[:500, :500])
        await drawn(grids)
        assert grids.layer.tiles.coarse == 1
        assert not grids.layer.problems

    asyncio.run(scenario())


def test_a_grid_of_400_million_cells_is_read_in_small_steps(monkeypatch):
    """Other work of the display must wait during a step."""
    steps = []

    async def draw(pieces, palette):
        assert sum(piece.size for piece in pieces) <= room.BATCH * (SIDE + OVERLAP) ** 2
        return [b"" for _ in pieces]

    def read(cells, times, palette):
        steps.append(cells.size)
        return downsample(cells, times, palette)

    monkeypatch.setattr(room, "draw_in_worker", draw)
    monkeypatch.setattr(room, "downsample", read)

    async def scenario():
        # The system allocates no memory for zeros that are never written.
        cells = np.zeros((20_000, 20_000), np.int8)
        tiles = GridTiles(svg.g(), "map", print)
        tiles.show(cells, CELL, Pose(0.0, 0.0, 0.0))
        while tiles.is_drawing:
            await asyncio.sleep(0)
        assert len(tiles.tiles) == len(steps) == 64
        assert max(steps) <= (5 * (SIDE + OVERLAP)) ** 2
        assert cells.size / tiles.coarse**2 <= MOST

    asyncio.run(scenario())
