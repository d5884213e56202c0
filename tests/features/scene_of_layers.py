"""A page with layers of every kind, with a link whose messages this script makes.

Run by ``webmap run``; the messages are decoded as those of a robot are.
"""

import asyncio

import numpy as np
from module_fakes import Link, header, pose

import webmap

link = Link()
UNSTAMPED = {"stamp": {"secs": 0, "nsecs": 0}, "frame_id": "base_link"}
"""The header of messages in the frame of the robot."""

bob = webmap.Robot("Bob")
bob.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
bob.add_module("Path", link, "/plan")
bob.add_module("PointCloud", link, "/points")
bob.add_module("Polygon", link, "/footprint", frame="robot")


def grid(cells, resolution, at) -> dict:
    height, width = cells.shape
    size = {"resolution": resolution, "width": width, "height": height}
    info = {"map_load_time": header()["stamp"], **size, "origin": pose(*at)}
    return {"header": header(), "info": info, "data": cells.ravel().tolist()}


def plan(value: int) -> dict:
    """Return a turned floor of 6 x 4 m whose lower left metre is occupied."""
    cells = np.zeros((40, 60), np.int8)
    cells[:10, :10] = 100
    cells[-1, -1] = value
    return grid(cells, 0.1, (-3, -2, 0.2))


def costs(column: int) -> dict:
    """Return ten square cells of 0.2 m; the cell in ``column`` is lethal."""
    cells = np.zeros((1, 10), np.int8)
    cells[0, column] = 100
    return grid(cells, 0.2, (-1, 1, 0))


def marker(id, type, at, scale, text="") -> dict:
    return {
        "header": header(),
        "ns": "test",
        "id": id,
        "type": type,
        "action": 0,
        "pose": pose(*at),
        "scale": dict(zip("xyz", scale, strict=True)),
        "color": {"r": 0, "g": 0, "b": 1, "a": 1},
        "lifetime": {"secs": 0, "nsecs": 0},
        "text": text,
    }


def first() -> None:
    link.publish("/odom", {"header": header(), "pose": pose(1.0, -1.0, 0.5)})
    link.publish("/map", plan(0))
    link.publish("/costs", costs(2))
    poses = [{"header": header(), "pose": pose(*at)} for at in [(1, -1), (2, 1)]]
    link.publish("/plan", {"header": header(), "poses": poses})
    foot = [(0.3, 0.2), (0.3, -0.2), (-0.3, -0.2), (-0.3, 0.2)]
    points = [{"x": x, "y": y, "z": 0} for x, y in foot]
    link.publish("/footprint", {"header": UNSTAMPED, "polygon": {"points": points}})
    cube = marker(1, 1, (-1.5, 0.25, 0.3), (0.5, 0.5, 0.5))
    words = marker(2, 9, (0, 0.4, 0), (0, 0, 0.3), "<b>Küche</b>")
    link.publish("/markers", {"markers": [cube, words]})
    data = np.array([[1.0, 0.0, 0.2]], np.float32)
    fields = [
        {"name": name, "offset": 4 * i, "datatype": 7, "count": 1}
        for i, name in enumerate("xyz")
    ]
    step = {"point_step": 12, "row_step": 12, "is_bigendian": False}
    cloud = {"header": UNSTAMPED, "height": 1, "width": 1, "fields": fields, **step}
    link.publish("/points", {**cloud, "data": list(data.tobytes()), "is_dense": True})


async def go_on() -> None:
    """Publish the map again and again, and move the robot back and forth."""
    for number in range(10_000):
        await asyncio.sleep(0.05)
        link.publish("/map", plan(number % 100))
        if number % 20 == 0:
            at = (0.5, -0.5, -2.0) if number % 40 else (1.0, -1.0, 0.5)
            link.publish("/odom", {"header": header(), "pose": pose(*at)})


going: set[asyncio.Task] = set()


@webmap.page("/broken")
def broken(page) -> None:
    build(page)
    for _ in range(3):
        link.publish("/costs", {**costs(5), "data": [0] * 3})


@webmap.page("/")
def build(page) -> None:
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("OccupancyGrid", link, "/map")
    map.add_module("OccupancyGrid", link, "/costs", palette="costmap")
    map.add_module("Markers", link, "/markers")
    map.add_robot(bob)
    map.fit(-3.5, -2.5, 7, 5)
    first()
    if not going:
        going.add(asyncio.get_running_loop().create_task(go_on()))
