"""Messages that other tools draw, although they are unusual."""

import asyncio
import json
from pathlib import Path

import numpy as np
import pytest
from module_fakes import images, pixel

from equipment.waiting import until
from webmap import Bridge
from webmap.features.layers import occupancy_grid
from webmap.ros.rosbridge.events import Publish

MESSAGES = json.loads(Path(__file__).with_name("unusual_messages.json").read_text())
COSTMAP, UPDATES = "/global_costmap/costmap", "/global_costmap/costmap_updates"
LETHAL = [(2, 2)]


def lethal(layer) -> list[tuple[int, int]]:
    """Return column and row of the lethal cells."""
    rows, columns = np.nonzero(layer.cells == 100)
    return list(zip(columns.tolist(), rows.tolist(), strict=True))


@pytest.mark.serial  # messages come within half a second
def test_updates_that_overtake_a_grid_in_the_throttle_are_drawn_on_it(map, page):
    async def scenario():
        bridge = Bridge("ws://127.0.0.1:9")  # it is not connected
        bridge._fan_out.begin(asyncio.get_running_loop())
        options = {"palette": "costmap", "throttle": 500}
        layer = map.add_module("OccupancyGrid", bridge, COSTMAP, **options).layer
        before = 0.0
        for each in MESSAGES["costmap"]:
            await asyncio.sleep((each["at"] - before) / 10)
            before, topic = each["at"], each["topic"]
            op = {"op": "publish", "topic": topic, "msg": each["msg"]}
            event = Publish(topic, json.dumps(op).encode())
            bridge._received(bridge._topics[topic], event)
        assert layer.cells.shape == (4, 8)
        assert lethal(layer) == [], "an update waits for the grid that it belongs to"
        assert layer.problems
        await until(lambda: layer.cells.shape == (4, 12))
        assert lethal(layer) == LETHAL
        assert layer.problems == {}
        page.close()
        await bridge.stop()

    asyncio.run(scenario())


@pytest.fixture
def costmap(map, link):
    options = {"palette": "costmap", "throttle": 5000}
    return map.add_module("OccupancyGrid", link, COSTMAP, **options).layer


def send(link, seconds: int = 100, *numbers: int) -> None:
    """Publish some messages of the costmap, as of a second of the robot's clock."""
    for number in numbers:
        each = MESSAGES["costmap"][number]
        stamped = {**each["msg"]["header"], "stamp": {"sec": seconds, "nanosec": 0}}
        link.publish(each["topic"], {**each["msg"], "header": stamped})


@pytest.mark.parametrize(
    ("updated", "sent", "drawn"),
    [
        (100, 100, LETHAL),
        (101, 100, LETHAL),
        (99, 100, [(10, 1)]),  # the grid is newer
        (500, 100, [(10, 1)]),  # the clock was set back
        (5, 0, [(10, 1)]),  # the grid has no stamp
    ],
)
def test_the_stamps_decide_which_updates_are_drawn_on_a_later_grid(
    link, costmap, updated, sent, drawn
):
    send(link, updated, 0, 2, 3)
    send(link, sent, 1)
    assert lethal(costmap) == drawn


def test_an_update_that_fits_no_grid_does_not_end_the_updates(
    link, costmap, monkeypatch
):
    now = [0.0]
    monkeypatch.setattr(occupancy_grid.time, "monotonic", lambda: now[0])
    send(link, 100, 0, 2, 3)
    assert lethal(costmap) == []
    now[0] += 5 + occupancy_grid.SOON
    send(link, 107, 2)
    assert lethal(costmap) == []
    send(link, 107, 3)
    assert lethal(costmap) == LETHAL
    assert costmap.problems == {}


def test_the_kept_updates_of_a_grid_are_limited(link, costmap, monkeypatch):
    monkeypatch.setattr(occupancy_grid, "MOST", 3)
    send(link, 100, 0, *[3] * 300)
    assert len(costmap._newest) == 3


@pytest.mark.parametrize("ros2", [True, False])
def test_delete_all_is_limited_to_a_namespace_in_ros_2_only(map, link, ros2):
    layer = map.add_module("Markers", link, "/markers").layer
    for message in MESSAGES["one namespace"]:
        for marker in message["markers"] if not ros2 else ():
            marker["header"]["seq"] = 7
        link.publish("/markers", message)
    assert list(layer.shapes) == ([("zones", 2)] if ros2 else [])


def test_delete_all_without_a_namespace_deletes_all_markers(map, link):
    layer = map.add_module("Markers", link, "/markers").layer
    first, second = json.loads(json.dumps(MESSAGES["one namespace"]))
    second["markers"][0]["ns"] = ""
    link.publish("/markers", first)
    link.publish("/markers", second)
    assert layer.shapes == {}


ZEROS = dict.fromkeys("xyzw", 0.0)
PLACE = {"position": {"x": 1.0, "y": 2.0, "z": 0.0}, "orientation": ZEROS}
HEADER = {"frame_id": "map"}


def test_a_map_with_a_quaternion_of_zeros_is_drawn_without_rotation(map, link):
    module = map.add_module("OccupancyGrid", link, "/map")
    link.publish("/map", MESSAGES["zero quaternion"])
    (image,) = images(module.layer)
    assert pixel(image, 0.75, -0.75) == (0, 0, 0, 255)
    assert pixel(image, -0.75, -0.75) == (255, 255, 255, 255)
    assert module.layer.problems == {}


POSES = {
    "PoseStamped": {"header": HEADER, "pose": PLACE},
    "PoseWithCovariance": {
        "header": HEADER,
        "pose": {"pose": PLACE, "covariance": [0.1] * 36},
    },
    "PoseArray": {"header": HEADER, "poses": [PLACE]},
    "Path": {"header": HEADER, "poses": [{"header": HEADER, "pose": PLACE}] * 2},
}


@pytest.mark.parametrize("layer", POSES)
def test_a_pose_with_a_quaternion_of_zeros_is_drawn_without_rotation(
    link, robot, layer
):
    message, looks = json.dumps(POSES[layer]), []
    for text in (message, message.replace('"w": 0.0', '"w": 1.0')):
        module = robot.add_module(layer, link, "/topic")
        link.publish("/topic", text)
        looks.append([(e.attributes, e._transform) for e in module.svg.children])
        module.svg.remove()
    assert looks[0] == looks[1]
    assert robot.problems == {}


@pytest.mark.parametrize("layer", ["PoseStamped", "PoseArray"])
def test_a_quaternion_of_almost_zeros_is_still_refused(link, robot, layer):
    robot.add_module(layer, link, "/topic")
    text = json.dumps(POSES[layer]).replace('"w": 0.0', '"w": 1e-9')
    link.publish("/topic", text)
    (problem,) = robot.problems.values()
    assert "a quaternion of length 1e-09, which is no rotation" in problem


GREEN, YELLOW = (0, 255, 0, 255), (255, 255, 0, 255)


@pytest.mark.parametrize("palette", ["map", "costmap"])
def test_cells_of_other_values_are_marked_and_reported_once(
    map, link, channel, caplog, palette
):
    module = map.add_module("OccupancyGrid", link, "/map", palette=palette)
    above, below = MESSAGES["other values"]
    for _ in range(3):
        link.publish("/map", above)
    (image,) = images(module.layer)
    assert pixel(image, 0.75, 0.25)[3] > 0, "the other cells are drawn"
    assert pixel(image, 1.75, 0.25) == GREEN
    link.publish("/map", below)
    (image,) = images(module.layer)
    assert pixel(image, 0.75, 0.25) == YELLOW
    assert pixel(image, 1.25, 0.25)[:2] == (255, 252)
    assert pixel(image, 1.75, 0.25)[3] == 0, "-1 is unknown"
    (problem,) = channel.errors
    assert "cells are -1 to 100, but 1 of 4 are not: one is 101" in problem
    assert len(caplog.records) == 1
    link.publish("/map", {**above, "data": [0, 50, 100, 100]})
    assert module.layer.problems == {}


def test_an_update_with_other_values_is_drawn_and_reported(map, link, channel):
    module = map.add_module("OccupancyGrid", link, "/map")
    link.publish("/map", {**MESSAGES["other values"][0], "data": [0] * 4})
    patch = {"x": 0, "y": 0, "width": 1, "height": 1, "data": [101]}
    for _ in range(3):
        link.publish("/map_updates", {"header": HEADER, **patch})
    (image,) = images(module.layer)
    assert pixel(image, 0.25, 0.25) == GREEN
    (problem,) = channel.errors
    assert problem.startswith("/map: cells are -1 to 100, but 1 of 1 are not")


def test_the_pose_of_a_robot_with_a_quaternion_of_zeros_is_still_refused(link, robot):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    link.publish("/odom", POSES["PoseStamped"])
    assert robot.position.x == 0.0
    (problem,) = robot.problems.values()
    assert "a quaternion of zeros was ignored" in problem
