"""Layers with messages of the simulator over real sockets, in both dialects."""

import asyncio
import time

import numpy as np
import pytest
from module_fakes import images, pixel

from equipment.waiting import until
from webmap import Bridge, Map
from webmap.core.page import Page
from webmap.sim.maps import FLOOR, load_map
from webmap.sim.process import run_simulator


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_drawn_cells_match_the_floor_plan_of_the_simulator(
    dialect, map: Map, page: Page, robot
):
    async def scenario():
        urls, stop = [], asyncio.Event()
        simulator = asyncio.create_task(
            run_simulator(robots=1, dialect=dialect, on_ready=urls.append, stop=stop)
        )
        await until(lambda: urls)
        bridge = Bridge(urls[0])
        module = map.add_module("OccupancyGrid", bridge, "/map")
        way = robot.add_module("Path", bridge, "/robot_0/plan")
        bridge.start(asyncio.get_running_loop())
        layer = module.layer
        try:
            await until(lambda: images(layer) and not layer.tiles.is_drawing)
            assert module.layer.problems == {}
            check(layer)
            assert way.points == []
            assert robot.problems == {}
        finally:
            page.close()
            await bridge.stop()
            stop.set()
            await simulator

    asyncio.run(scenario())


def test_missing_frames_are_a_problem_some_time_after_the_link_opens(
    monkeypatch, map: Map, page: Page, robot
):
    """No frame arrives, so only the passing time triggers the check."""
    monkeypatch.setattr("webmap.poses.frames.GRACE", 0.6)
    monkeypatch.setattr("webmap.poses.placing.PROBLEM_DELAY", 0.1)

    async def scenario():
        urls, stop = [], asyncio.Event()
        simulator = asyncio.create_task(
            run_simulator(robots=1, on_ready=urls.append, stop=stop)
        )
        await until(lambda: urls)
        bridge = Bridge(urls[0])
        opened = []
        # Added before the frames, whose time starts when they learn of the link.
        bridge.on_open(lambda: opened.append(time.monotonic()))
        robot.set_tf(bridge, namespace="/ghost")
        grid = map.add_module(
            "OccupancyGrid", bridge, "/map", map_frame="other", namespace="/ghost"
        ).layer
        bridge.start(asyncio.get_running_loop())
        try:
            await until(lambda: grid.problems or robot.problems)
            assert time.monotonic() - opened[0] > 0.55
            await until(lambda: grid.problems and robot.problems)
            (of_grid,), (of_robot,) = grid.problems.values(), robot.problems.values()
            assert "there is no frame 'ghost/other'" in of_grid
            assert "there is no frame 'map'; there are: none" in of_robot
        finally:
            page.close()
            robot.unset_tf()
            await bridge.stop()
            stop.set()
            await simulator

    asyncio.run(scenario())


def check(layer) -> None:
    """Compare 200 places of the map with the floor plan of the simulator."""
    plan = load_map(FLOOR)
    rows, columns = plan.occupancy.shape
    random = np.random.default_rng(3)
    seen = set()
    for row, column in random.integers((rows, columns), size=(200, 2)):
        value = int(plan.occupancy[row, column])
        at = plan.center(row, column)
        tiles = [colour for each in images(layer) if (colour := pixel(each, *at))]
        assert len(set(tiles)) == 1, "tiles overlap with the same cells"
        r, _, _, alpha = tiles[0]
        drawn = -1 if alpha == 0 else round(100 * (255 - r) / 255)
        assert drawn == value, (row, column)
        seen.add(value)
    assert len(seen) > 1
