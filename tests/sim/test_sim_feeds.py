"""Other messages of simulated robots, compared with their true poses."""

import base64
import math

import numpy as np
import pytest
from simulated import Bench, room

from webmap.base.geometry import Pose, Twist
from webmap.sim.feeds.localization import SURE, Belief
from webmap.sim.feeds.navigation import Costs, distances
from webmap.sim.feeds.sensors import LIDAR_POINT, cloud_points
from webmap.sim.maps import UNKNOWN, Obstacles
from webmap.sim.navigator import SimGoal

DIALECTS = pytest.mark.parametrize("dialect", ["ros1", "ros2"])
LOCAL = {
    "ros1": "/robot_0/move_base/local_costmap/costmap",
    "ros2": "/robot_0/local_costmap/costmap",
}


def messages_of(bench, topic, seconds=1.2, **asked):
    """Return a list that receives the messages of a topic."""
    client = bench.client()
    client.send(op="subscribe", topic=topic, **asked)
    bench.run(seconds)
    return [operation["msg"] for operation in client.operations("publish", topic)]


def cells_of(message):
    info = message["info"]
    return np.array(message["data"], np.int8).reshape(info["height"], info["width"])


def place_of(message):
    at = message["info"]["origin"]["position"]
    return at["x"], at["y"]


@DIALECTS
def test_every_topic_has_the_type_of_its_dialect_and_publishes_to_subscribers(dialect):
    bench = Bench(dialect)
    between = "msg/" if dialect == "ros2" else ""
    above = "" if dialect == "ros2" else "move_base/"
    foot = "published_footprint" if dialect == "ros2" else "footprint"
    expected = {
        f"/robot_1/{above}local_costmap/costmap": "nav_msgs/OccupancyGrid",
        f"/robot_1/{above}global_costmap/costmap": "nav_msgs/OccupancyGrid",
        f"/robot_1/{above}local_costmap/{foot}": "geometry_msgs/PolygonStamped",
        "/robot_1/points": "sensor_msgs/PointCloud2",
        "/robot_1/particlecloud": "geometry_msgs/PoseArray",
        "/robot_1/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
        "/robot_1/sonar": "sensor_msgs/Range",
        "/robot_1/fix": "sensor_msgs/NavSatFix",
        "/robot_1/markers": "visualization_msgs/MarkerArray",
        "/diagnostics": "diagnostic_msgs/DiagnosticArray",
    }
    for topic, type in expected.items():
        package, _, name = type.partition("/")
        known = bench.client().call("/rosapi/topic_type", {"topic": topic})
        assert known["values"]["type"] == f"{package}/{between}{name}"
        assert messages_of(bench, topic), topic


def names_of(fields, message):
    """The names of all fields, by the definition and as the message has them."""
    known, names = [field.name for field in fields], list(message)
    for field in fields:
        if field.fields is not None:
            value = message[field.name]
            for each in value if field.is_array else [value]:
                more, received = names_of(field.fields, each)
                known, names = known + more, names + received
    return known, names


@DIALECTS
def test_every_message_has_the_fields_of_its_definition_in_their_order(dialect):
    bench = Bench(dialect, robots=2, tilted=True)
    published = {}
    for topic in [*bench.graph.topics]:
        deliver = lambda each: published.setdefault(each.topic, each)  # noqa: E731
        bench.graph.subscribe(object(), topic, deliver)
    bench.world.send_goal(0, SimGoal(Pose(3.0, 1.5)))
    bench.run(3)
    assert len(published) > 30
    for each in published.values():
        fields = bench.graph.schema.fields(each.type)
        known, names = names_of(fields, each.message)
        assert names == known, each.topic
        assert each.form("cbor-raw", bench.encoder)


@DIALECTS
def test_the_lookahead_point_is_published_in_the_base_frame_during_a_goal(dialect):
    bench = Bench(dialect, robots=1, plan=room(boxes=[(4.5, 0, 5.5, 4)]))
    (robot,), (navigator,) = bench.world.robots, bench.world.navigators
    robot.pose = Pose(2.0, 1.5, 0.4)
    topic = "/robot_0/lookahead_point"
    assert messages_of(bench, topic) == [], "the robot has no goal"
    bench.world.send_goal(0, SimGoal(Pose(8.0, 1.5)))
    sent = messages_of(bench, topic)[-1]
    assert sent["header"]["frame_id"] == "robot_0/base_link"
    at = robot.pose @ Pose(sent["point"]["x"], sent["point"]["y"])
    here, corner = (robot.pose.x, robot.pose.y), navigator.path[1]
    assert corner != (8.0, 1.5), "a box is in the way"
    assert math.dist(here, (at.x, at.y)) == pytest.approx(1.5)
    rest = math.dist(here, corner) - 1.5
    assert math.dist((at.x, at.y), corner) == pytest.approx(rest), (
        "the point is on the path"
    )
    bench.world.stop(0)
    assert messages_of(bench, topic) == []


def test_topics_without_subscribers_are_not_computed(monkeypatch):
    bench = Bench()
    for name in ("window", "whole"):
        monkeypatch.setattr(Costs, name, lambda *_: pytest.fail("costs"))
    monkeypatch.setattr(Belief, "particles", lambda *_: pytest.fail("particles"))
    messages_of(bench, "/robot_0/odom")
    assert "costs" not in bench.node._feeds._costmaps.__dict__


def test_without_extras_the_extra_topics_are_missing(monkeypatch):
    from webmap.ros.rosbridge.server.dialect import parse_quirks
    from webmap.ros.rosbridge.server.graph import Graph
    from webmap.sim.node import RobotsNode

    bench = Bench()
    graph = Graph(bench.graph.schema)
    node = RobotsNode(
        bench.world, graph, "Twist", parse_quirks("real", "ros1"), extras=False
    )
    node.start()
    assert "/robot_0/odom" in graph.topics
    assert "/robot_0/points" not in graph.topics
    assert node.believed(0) == bench.world.robots[0].pose


@DIALECTS
def test_a_local_costmap_is_centred_on_the_robot_and_inflates_walls(dialect):
    bench = Bench(dialect, robots=1, drift=0.2)
    robot = bench.world.robots[0]
    for _ in range(20):
        bench.world.command(0, Twist(vx=0.4, wz=0.3))
        bench.run(0.05)
    bench.run(1)
    assert robot.odometry != robot.pose, "the odometry frame differs from the map frame"
    grid = messages_of(bench, LOCAL[dialect])[0]
    assert grid["header"]["frame_id"] == "robot_0/odom"
    cells, (x, y) = cells_of(grid), place_of(grid)
    assert cells.shape == (100, 100)
    assert math.hypot(x + 2.5 - robot.odometry.x, y + 2.5 - robot.odometry.y) < 0.1
    map_from_odom = robot.pose @ robot.odometry.inverse
    obstacles, seen = bench.world.obstacles, set()
    for row in range(0, 100, 3):
        for column in range(0, 100, 3):
            local = Pose(x + (column + 0.5) * 0.05, y + (row + 0.5) * 0.05)
            at = map_from_odom @ local
            r, c = bench.world.plan.cell(at.x, at.y)
            if not (0 <= r < 120 and 0 <= c < 200):
                continue
            cost = cells[row, column]
            if obstacles.solid[r, c]:
                assert cost == 100
            elif obstacles.touches(at.x, at.y, 0.18):
                assert cost >= 99
            elif not obstacles.touches(at.x, at.y, 0.62):
                assert cost == 0
            seen.add(int(cost))
    assert {0, 99, 100} <= seen
    assert any(0 < cost < 99 for cost in seen)


@DIALECTS
def test_the_costmap_of_a_standing_robot_is_sent_as_updates(dialect):
    bench = Bench(dialect)
    one, other = bench.world.robots
    one.pose = one.odometry = Pose(3, 3)
    other.pose = other.odometry = Pose(4.2, 3, math.pi / 2)
    client = bench.client()
    topic = LOCAL[dialect]
    client.send(op="subscribe", topic=topic)
    client.send(op="subscribe", topic=f"{topic}_updates", compression="cbor")
    bench.run(0.6)
    (whole,) = client.operations("publish")
    cells, (x, y) = cells_of(whole["msg"]), place_of(whole["msg"])
    for _ in range(20):
        bench.world.command(1, Twist(vx=0.5))
        bench.run(0.05)
    bench.run(0.4)
    changes = client.operations("publish")
    assert changes
    assert {change["topic"] for change in changes} == {f"{topic}_updates"}
    for change in (change["msg"] for change in changes):
        assert change["data"].tag == 72
        patch = np.frombuffer(change["data"].value, np.int8)
        assert patch.size < cells.size / 4
        height, width = change["height"], change["width"]
        rows = slice(change["y"], change["y"] + height)
        columns = slice(change["x"], change["x"] + width)
        cells[rows, columns] = patch.reshape(height, width)
    # The last change came in the last 0.2 s, in which the robot did not move.
    now = bench.node._feeds._costmaps.costs.window(
        x, y, 100, Pose(), bench.world.others(0)
    )
    assert (cells == now).all()
    row, column = int((other.pose.y - y) / 0.05), int((other.pose.x - x) / 0.05)
    assert cells[row, column] == 100


def test_a_late_subscriber_receives_a_whole_costmap():
    bench = Bench(robots=1)
    assert len(messages_of(bench, LOCAL["ros1"])) == 1
    assert len(messages_of(bench, LOCAL["ros1"])) == 1


@pytest.mark.parametrize("seed", range(3))
def test_costmap_distances_match_an_exhaustive_search(seed):
    solid = np.random.default_rng(seed).random((20, 30)) < 0.02
    found = distances(solid, 7)
    rows, columns = np.nonzero(solid)
    for row in range(20):
        for column in range(30):
            true = np.hypot(rows - row, columns - column).min(initial=np.inf)
            if true <= 7:
                assert found[row, column] == pytest.approx(true)
            else:
                assert found[row, column] >= 7


def test_a_whole_costmap_contains_other_robots_and_unknown_cells():
    plan = room(4, 3)
    plan.occupancy[-20:, -20:] = UNKNOWN
    costs = Costs(Obstacles(plan), 0.25)
    cells = costs.whole([(1.5, 1.5, 0.25), (-9.0, 50.0, 0.25)])
    assert cells[30, 30] == 100
    assert costs.whole([])[30, 30] == 0
    assert cells[0, 0] == 100
    assert cells[45, 65] == UNKNOWN


@DIALECTS
@pytest.mark.parametrize("compression", ["none", "cbor"])
def test_a_point_cloud_contains_the_walls_and_the_floor(dialect, compression):
    bench = Bench(dialect, robots=1)
    cloud = messages_of(bench, "/robot_0/points", compression=compression)[0]
    data = cloud["data"]
    if compression == "none":
        data = base64.b64decode(data, validate=True)
    assert cloud["row_step"] == len(data) == cloud["width"] * cloud["point_step"]
    named = {field["name"]: field for field in cloud["fields"]}
    assert [named[name]["offset"] for name in ("x", "y", "z")] == [0, 4, 8]
    points = np.frombuffer(data, LIDAR_POINT)
    assert set(points["ring"].tolist()) == {0, 1, 2, 3}
    assert points["z"].max() > 0.3
    at = bench.world.robots[0].pose
    xs = at.x + math.cos(at.yaw) * points["x"] - math.sin(at.yaw) * points["y"]
    ys = at.y + math.sin(at.yaw) * points["x"] + math.cos(at.yaw) * points["y"]
    walls = points["ring"] > 0
    edge = np.minimum(np.minimum(xs, 10 - xs), np.minimum(ys, 6 - ys))
    assert abs(edge[walls] - 0.05).max() < 0.01
    floor = ~walls & (edge > 0.1)
    assert abs(points["z"][floor] + 0.2).max() < 1e-3


def test_a_lidar_ring_above_another_robot_hits_the_wall_behind_the_robot():
    whole, walls = np.full(8, 2.0, np.float32), np.full(8, 5.0, np.float32)
    points = cloud_points(whole, walls)
    reach = np.hypot(points["x"], points["y"])
    assert reach[points["ring"] == 1] == pytest.approx(2)
    assert reach[points["ring"] == 2] == pytest.approx(2)
    assert reach[points["ring"] == 3] == pytest.approx(5)


@DIALECTS
def test_the_footprint_outlines_the_base_in_the_odometry_frame(dialect):
    bench = Bench(dialect, robots=1)
    robot = bench.world.robots[0]
    topic = LOCAL[dialect].replace(
        "costmap/costmap",
        "costmap/published_footprint" if dialect == "ros2" else "costmap/footprint",
    )
    message = messages_of(bench, topic)[-1]
    assert message["header"]["frame_id"] == "robot_0/odom"
    points = message["polygon"]["points"]
    ways = [math.hypot(p["x"] - robot.pose.x, p["y"] - robot.pose.y) for p in points]
    assert ways == pytest.approx([0.25] * 16, abs=1e-5)


@DIALECTS
def test_the_spread_of_particles_matches_the_covariance(dialect):
    bench = Bench(dialect, robots=1)
    robot = bench.world.robots[0]
    cloud = messages_of(bench, "/robot_0/particlecloud")[0]
    doubtful = messages_of(bench, "/robot_0/amcl_pose")[0]["pose"]
    assert doubtful["pose"]["position"]["x"] == robot.pose.x
    spots = np.array([[p["position"][k] for k in "xy"] for p in cloud["poses"]])
    assert len(spots) == 150
    assert np.hypot(*(spots.mean(axis=0) - (robot.pose.x, robot.pose.y))) < 0.05
    covariance = np.array(doubtful["covariance"]).reshape(6, 6)
    assert np.cov(spots.T) == pytest.approx(covariance[:2, :2], abs=0.008)
    assert covariance[5, 5] == pytest.approx(SURE[2] ** 2)


def test_an_initial_pose_is_accepted_and_corrected_while_driving():
    bench = Bench(robots=1)
    robot = bench.world.robots[0]
    client = bench.client()
    given = robot.pose @ Pose(0.6, 0.3, 0.2)
    half = given.yaw / 2
    covariance = [0.0] * 36
    covariance[0] = covariance[7] = 0.25
    covariance[35] = 0.07
    message = {
        "header": {"frame_id": "map"},
        "pose": {
            "pose": {
                "position": {"x": given.x, "y": given.y},
                "orientation": {"z": math.sin(half), "w": math.cos(half)},
            },
            "covariance": covariance,
        },
    }
    client.send(op="publish", topic="/robot_0/initialpose", msg=message)
    estimate = messages_of(bench, "/robot_0/amcl_pose")[-1]["pose"]
    assert estimate["pose"]["position"]["x"] == pytest.approx(given.x)
    assert estimate["covariance"][0] == pytest.approx(0.25)
    bench.world.send_goal(0, SimGoal(Pose(8.5 if robot.pose.x < 5 else 1.5, 3.0)))
    bench.run(20)
    estimate = messages_of(bench, "/robot_0/amcl_pose")[-1]["pose"]
    at = estimate["pose"]["position"]
    assert math.hypot(at["x"] - robot.pose.x, at["y"] - robot.pose.y) < 0.05
    assert estimate["covariance"][35] == pytest.approx(SURE[2] ** 2, rel=0.2)


@pytest.mark.parametrize(
    "wrong",
    [
        {"header": {"frame_id": "moon"}},
        {"pose": {"covariance": [math.inf] * 36}},
        {"pose": {"pose": {"position": {"x": math.inf}}}},
    ],
)
def test_an_invalid_initial_pose_is_ignored(wrong):
    bench = Bench(robots=1, quirks="real")
    client = bench.client()
    client.send(op="publish", topic="/robot_0/initialpose", msg=wrong)
    assert bench.node.believed(0) == bench.world.robots[0].pose


def test_a_sonar_measures_the_wall_and_robots_in_its_cone():
    bench = Bench()
    one, other = bench.world.robots
    one.pose = Pose(2.0, 3.0, math.pi)
    other.pose = Pose(6.0, 3.0)
    (near, *_) = messages_of(bench, "/robot_0/sonar")
    assert near["range"] == pytest.approx(2.0 - 0.25 - 0.05, abs=0.01)
    one.pose = Pose(4.0, 3.0, 0.0)
    assert messages_of(bench, "/robot_0/sonar")[0]["range"] == pytest.approx(
        1.5, abs=0.01
    )
    other.pose = Pose(4.0, 1.0)
    binary = messages_of(bench, "/robot_0/sonar", compression="cbor")
    assert binary[0]["range"] == math.inf, "nothing in range"
    assert messages_of(bench, "/robot_0/sonar")[0]["range"] is None, (
        "JSON has null for infinity"
    )
    one.pose = Pose(0.29, 3.0, math.pi)
    assert (
        messages_of(bench, "/robot_0/sonar", compression="cbor")[0]["range"]
        == -math.inf
    )


def test_a_gps_fix_matches_the_pose_of_the_robot():
    from webmap.base.local_plane import LocalPlane
    from webmap.sim.feeds.localization import DATUM

    bench = Bench(robots=1)
    robot = bench.world.robots[0]
    fix = messages_of(bench, "/robot_0/fix")[0]
    east, north = LocalPlane(*DATUM).from_globe(fix["latitude"], fix["longitude"])
    assert (east, north) == pytest.approx((robot.pose.x, robot.pose.y), abs=1e-3)


def test_markers_show_the_goal_and_the_visible_robots():
    bench = Bench()
    one, other = bench.world.robots
    one.pose, other.pose = Pose(2, 3), Pose(5, 3)
    marks = messages_of(bench, "/robot_0/markers")[-1]["markers"]
    assert [mark["action"] for mark in marks if mark["ns"] == "goal"] == [2, 2]
    (seen,) = [mark for mark in marks if mark["ns"] == "seen"]
    assert seen["pose"]["position"]["x"] == 5
    bench.world.send_goal(0, SimGoal(Pose(8, 2, 1)))
    arrow, text, _ = messages_of(bench, "/robot_0/markers")[-1]["markers"]
    assert (arrow["pose"]["position"]["x"], arrow["action"]) == (8, 0)
    assert text["text"].endswith(" m")


@DIALECTS
def test_diagnostics_and_logs_report_a_low_battery_and_a_goal(dialect):
    bench = Bench(dialect, robots=1)
    log = bench.client()
    log.send(op="subscribe", topic="/rosout")
    bench.world.robots[0].charge = 0.2
    parts = messages_of(bench, "/diagnostics")[-1]["status"]
    levels = {part["name"]: part["level"] for part in parts}
    # In ROS 2 diagnostic updaters leave out the namespace of their node.
    space = "" if dialect == "ros2" else "robot_0/"
    assert levels == {
        f"{space}base: Motors": 0,
        f"{space}base: Battery": 1,
        f"{space}laser: Frequency": 0,
    }
    bench.world.send_goal(0, SimGoal(Pose(2.0, 3.0)))
    bench.run(1)
    bench.world.stop(0)
    bench.run(1)
    messages = [operation["msg"] for operation in log.operations("publish", "/rosout")]
    warn, info = (30, 20) if dialect == "ros2" else (4, 2)
    lines = [(line["level"], line["msg"]) for line in messages]
    assert lines[0] == (info, "ready, the battery is at 20 %")
    assert lines[1] == (warn, "the battery is at 20 %")
    assert (info, "a goal at (2.00, 3.00)") in lines
    assert (info, "the goal canceled: stopped") in lines
    name = "robot_0.base" if dialect == "ros2" else "/robot_0/base"
    assert messages[0]["name"] == name


@DIALECTS
@pytest.mark.parametrize("part", ["points", "markers", "sonar", "fix", "amcl_pose"])
def test_extra_topics_can_be_sent_as_raw_cbor(dialect, part):
    bench = Bench(dialect, robots=1)
    (message, *_) = messages_of(bench, f"/robot_0/{part}", compression="cbor-raw")
    frame = "map" if part in ("markers", "amcl_pose") else "robot_0/"
    assert frame.encode() in message["bytes"]
