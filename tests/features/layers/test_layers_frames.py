"""Frames of a robot place the drawings of modules on the map."""

import math

import pytest
from module_fakes import dots, header, image_of, images, numbers, pose, to_root
from test_layers_cloud import cloud
from test_layers_grid import BLACK, CORNERS, grid
from test_layers_poses import sonar
from test_layers_ways import in_world, near, path

from webmap.base.geometry import Affine
from webmap.modules.topic_layer import LayerMessage
from webmap.poses.frames import _shared_frames


def transform(parent, child, x, y, yaw, secs=3) -> dict:
    at = pose(x, y, yaw)
    return {
        "header": {"stamp": {"secs": secs, "nsecs": 5}, "frame_id": parent},
        "child_frame_id": child,
        "transform": {"translation": at["position"], "rotation": at["orientation"]},
    }


def send_transforms(link, *transforms, static=False) -> None:
    topic = "/tf_static" if static else "/tf"
    link.publish(topic, {"transforms": list(transforms)})


@pytest.fixture(autouse=True)
def no_patience(monkeypatch):
    monkeypatch.setattr("webmap.poses.placing.PROBLEM_DELAY", 0.0)
    monkeypatch.setattr("webmap.poses.frames.GRACE", 0.0)


@pytest.fixture
def robot(robot, link):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    robot.set_tf(link)
    return robot


ODOM = (10.0, -5.0, math.pi / 2)
IN_ODOM = Affine.translation(10, -5) @ Affine.rotation(math.pi / 2)


def odometry(link, x, y, yaw):
    link.publish("/odom", {"header": header("odom"), "pose": pose(x, y, yaw)})


def test_a_path_in_the_odometry_frame_is_placed_by_that_frame(link, robot):
    module = robot.add_module("Path", link, "/plan")
    send_transforms(link, transform("map", "odom", *ODOM))
    message = path([(1.0, 2.0), (3.0, 4.0)], "odom")
    link.publish("/plan", message)
    wanted = [IN_ODOM.apply(1, 2), IN_ODOM.apply(3, 4)]
    assert in_world(module.line) == near(wanted)
    odometry(link, 7, 7, 1.0)
    assert in_world(module.line) == near(wanted)
    link.publish("/plan", path([(1.0, 2.0), (3.0, 4.0)]))
    assert in_world(module.line) == near([(1, 2), (3, 4)])


def test_a_path_without_a_frame_is_placed_by_the_frame_of_its_poses(link, robot):
    module = robot.add_module("Path", link, "/plan")
    send_transforms(link, transform("map", "odom", *ODOM))
    message = path([(0.0, 0.0), (1.0, 2.0), (3.0, 4.0)])
    message["header"] = header("")
    for each, name in zip(message["poses"], ("", "odom", "/odom"), strict=True):
        each["header"] = header(name)
    link.publish("/plan", message)
    wanted = [IN_ODOM.apply(0, 0), IN_ODOM.apply(1, 2), IN_ODOM.apply(3, 4)]
    assert in_world(module.line) == near(wanted)
    assert robot.problems == {}


def test_a_path_with_poses_of_two_frames_is_drawn_in_one_and_reported(link, robot):
    module = robot.add_module("Path", link, "/plan")
    send_transforms(link, transform("map", "odom", *ODOM))
    message = path([(1.0, 2.0), (3.0, 4.0)])
    message["poses"][1]["header"] = header("odom")
    link.publish("/plan", message)
    assert in_world(module.line) == near([(1, 2), (3, 4)])
    (problem,) = robot.problems.values()
    assert problem == (
        "/plan: poses of this path name the frame 'odom'; all its poses are drawn in "
        "'map'"
    )
    message["poses"][1]["header"] = header("map")
    link.publish("/plan", message)
    assert robot.problems == {}


def test_a_message_without_a_frame_has_the_frame_of_the_first_of_its_parts():
    parts = [{"header": header("camera")}, {"header": header("laser")}]
    fields = {"header": header(""), "words": ["a"], "none": [], "boxes": parts}
    assert LayerMessage(fields).frame_id == "camera"
    assert LayerMessage({**fields, "header": header("map")}).frame_id == "map"
    assert LayerMessage({"points": [{"x": 1.0}]}).frame_id == ""


def test_a_frame_is_looked_up_at_the_stamp_of_the_message(link, robot):
    module = robot.add_module("Path", link, "/plan")
    send_transforms(link, transform("map", "odom", 1, 0, 0, secs=3))
    send_transforms(link, transform("map", "odom", 2, 0, 0, secs=4))
    message = path([(0.0, 0.0), (0.0, 4.0)], "odom")
    link.publish("/plan", message)
    assert in_world(module.line) == near([(1, 0), (1, 4)])


def test_sensor_data_is_placed_by_the_frame_of_the_sensor(link, robot):
    cone = robot.add_module("Range", link, "/sonar")
    points = robot.add_module("PointCloud", link, "/points")
    send_transforms(
        link,
        transform("base_link", "sonar", 0.3, 0.1, math.pi),
        transform("base_link", "laser", 0.0, 0.5, -math.pi / 2),
        static=True,
    )
    link.publish("/sonar", sonar(1.0))
    link.publish("/points", cloud([[2.0, 0.0, 0.0]]))
    on_robot = to_root(robot.svg).inverse @ to_root(cone.cone)
    assert on_robot.apply(1, 0) == pytest.approx((-0.7, 0.1))
    (dot,) = dots(points.dots[0])
    on_robot = to_root(robot.svg).inverse @ to_root(points.dots[0])
    assert on_robot.apply(*dot) == pytest.approx((0.0, -1.5), abs=2e-3)


def test_a_configured_sensor_position_overrides_the_frames(link, robot):
    cone = robot.add_module("Range", link, "/sonar", 0.2, 0.0, 0.0)
    send_transforms(link, transform("base_link", "sonar", 5, 5, 1), static=True)
    link.publish("/sonar", sonar(1.0))
    on_robot = to_root(robot.svg).inverse @ to_root(cone.cone)
    assert on_robot.apply(0, 0) == pytest.approx((0.2, 0))


def test_an_unknown_frame_is_a_problem_until_it_is_known(link, robot):
    module = robot.add_module("Path", link, "/plan")
    message = path([(1.0, 2.0), (3.0, 4.0)], "odom")
    link.publish("/plan", message)
    assert in_world(module.line) == near([(1, 2), (3, 4)])
    (problem,) = robot.problems.values()
    assert "the pose of 'odom' is unknown" in problem
    send_transforms(link, transform("map", "odom", *ODOM))
    link.publish("/plan", message)
    assert robot.problems == {}
    assert len(numbers(module.line.get("points"))) == 4
    link.publish("/plan", path([(1.0, 2.0)], "nowhere"))
    assert len(robot.problems) == 1
    robot.remove_module(module)
    assert robot.problems == {}


def colour(image, x: float, y: float) -> tuple[int, ...]:
    """Return the colour of a picture at a place; its group may be moved."""
    u, v = to_root(image).inverse.apply(x, y)
    picture = image_of(image)
    width, height = float(image.get("width")), float(image.get("height"))
    return picture.getpixel(
        (int(u / width * picture.width), int(v / height * picture.height))
    )


def local(**info) -> dict:
    return {**grid(CORNERS, 1.0, pose(2, 3), **info), "header": header("odom")}


def test_a_costmap_in_the_odometry_frame_moves_with_that_frame(map, link, channel):
    before = dict(_shared_frames)
    module = map.add_module("OccupancyGrid", link, "/local", map_frame="map")
    link.publish("/local", {**local(), "header": header("map")})
    assert "/tf" not in link.listeners, "no module needs frames yet"
    link.publish("/local", local())
    (error,) = channel.errors
    assert "the pose of 'odom' on the map is unknown" in error
    (image,) = images(module.layer)
    for at in [ODOM, (0.0, 0.0, -1.0)]:
        send_transforms(link, transform("map", "odom", *at, secs=4 + int(at != ODOM)))
        there = Affine.translation(*at[:2]) @ Affine.rotation(at[2])
        # The occupied cell is the lower left one of the grid, at (2, 3) of odom.
        assert colour(image, *there.apply(2.5, 3.5)) == BLACK
        assert colour(image, *there.apply(3.5, 3.5)) != BLACK
    assert module.layer.problems == {}
    map.remove_module(module)
    assert link.listeners == {}
    assert _shared_frames == before


def test_a_costmap_is_placed_by_the_frames_of_its_namespace(map, link):
    module = map.add_module(
        "OccupancyGrid", link, "/r1/local", map_frame="map", namespace="/r1"
    )
    link.publish("/r1/local", local())
    link.publish("/r1/tf", {"transforms": [transform("map", "odom", *ODOM)]})
    (image,) = images(module.layer)
    assert colour(image, *IN_ODOM.apply(2.5, 3.5)) == BLACK
    assert "/tf" not in link.listeners


def test_a_grid_without_a_map_frame_ignores_frames(map, link):
    module = map.add_module("OccupancyGrid", link, "/local")
    link.publish("/local", local())
    (image,) = images(module.layer)
    assert colour(image, 2.5, 3.5) == BLACK
    assert set(link.listeners) == {"/local", "/local_updates"}
