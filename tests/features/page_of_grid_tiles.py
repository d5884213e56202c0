"""A page with one large grid of free cells, level or turned by the page's address."""

import numpy as np
from module_fakes import Link, header, pose, typed

import webmap

CELLS = np.zeros((1100, 1200), np.int8)


def build(page, yaw: float) -> None:
    link = Link()
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("OccupancyGrid", link, "/map")
    map.fit(-35, -35, 70, 70)
    size = {"resolution": 0.05, "width": 1200, "height": 1100}
    at = pose(
        -30 * np.cos(yaw) + 27.5 * np.sin(yaw),
        -30 * np.sin(yaw) - 27.5 * np.cos(yaw),
        yaw,
    )
    info = {"map_load_time": header()["stamp"], **size, "origin": at}
    grid = {"header": header(), "info": info, "data": typed(72, CELLS)}
    link.publish("/map", grid, cbor=True)


@webmap.page("/")
def level(page) -> None:
    build(page, 0.0)


@webmap.page("/turned")
def turned(page) -> None:
    build(page, 0.3)
