"""From topics with types to robots."""

import json
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from captured_frames import CAPTURED
from webmap.discovery import discover
from webmap.discovery.found import ROLES
from webmap.discovery.robots import host_name
from webmap.discovery.tf_robots import Trees

ODOM, TWIST = "nav_msgs/Odometry", "geometry_msgs/Twist"
STAMPED = "geometry_msgs/msg/TwistStamped"
SCAN = "sensor_msgs/LaserScan"
POSE = "geometry_msgs/PoseWithCovarianceStamped"


def only(topics, host="robot"):
    (robot,) = discover(topics, host).robots
    return robot


def names(topics):
    return [robot.name for robot in discover(topics).robots]


def test_a_bare_robot_is_named_after_the_host():
    robot = only({"/odom": ODOM, "/cmd_vel": TWIST, "/scan": SCAN}, "bob")
    assert (robot.name, robot.namespace) == ("bob", "")
    assert robot.topic("odometry") == "/odom"
    assert robot.topic("velocity") == "/cmd_vel"
    assert robot.topic("scan") == "/scan"


@pytest.mark.parametrize("kind", ["", "msg/"])
def test_each_namespace_is_a_robot_in_either_dialect(kind):
    topics = {
        f"/robot_{n}/{name}": type.replace("/", f"/{kind}", 1)
        for n in range(3)
        for name, type in (("odom", ODOM), ("cmd_vel", TWIST), ("base_scan", SCAN))
    }
    found = discover(topics)
    assert found.dialect == ("ros2" if kind else "ros1")
    assert [robot.namespace for robot in found.robots] == [
        "/robot_0",
        "/robot_1",
        "/robot_2",
    ]
    assert found.robots[1].topic("scan") == "/robot_1/base_scan"


def test_a_velocity_keeps_the_type_that_the_bridge_says():
    robot = only({"/odom": ODOM, "/cmd_vel": STAMPED})
    assert robot.first("velocity").type == STAMPED


def test_a_filter_comes_before_plain_odometry_and_the_rest_is_noted():
    robot = only({"/odom": ODOM, "/odometry/filtered": ODOM, "/cmd_vel": TWIST})
    assert robot.topic("odometry") == "/odometry/filtered"
    assert any("/odom is odometry too" in note for note in robot.notes)


def test_the_truth_of_a_simulator_comes_last():
    robot = only({"/base_pose_ground_truth": ODOM, "/odom": ODOM})
    assert robot.topic("odometry") == "/odom"


def test_amcl_is_noted_and_odometry_used():
    robot = only({"/odom": ODOM, "/amcl_pose": POSE})
    assert robot.topic("odometry") == "/odom"
    assert robot.topic("pose") == "/amcl_pose"
    assert any("amcl_pose has the pose on the map" in n for n in robot.notes)


@pytest.mark.parametrize(
    ("topic", "type"),
    [
        ("/tb/robot_pose", "geometry_msgs/Pose"),
        ("/tb/pose", "geometry_msgs/msg/Pose"),
        ("/mav/pose2d", "geometry_msgs/Pose2D"),
        ("/mav/pose2D", "geometry_msgs/msg/Pose2D"),
    ],
)
def test_a_pose_without_a_header_says_where_a_robot_is(topic, type):
    robot = only({topic: type})
    assert robot.namespace == topic.rpartition("/")[0]
    assert (robot.first("pose").topic, robot.first("pose").type) == (topic, type)


def test_a_pose_that_says_its_frame_comes_before_one_that_does_not():
    bare = {"/robot_pose": "geometry_msgs/Pose", "/pose2D": "geometry_msgs/Pose2D"}
    assert only({**bare, "/amcl_pose": POSE}).topic("pose") == "/amcl_pose"


def test_a_controller_is_a_part_and_no_robot():
    robot = only(
        {
            "/diff_drive_controller/odom": ODOM,
            "/diff_drive_controller/cmd_vel": STAMPED,
        },
        "bob",
    )
    assert robot.name == "bob"
    assert robot.topic("velocity") == "/diff_drive_controller/cmd_vel"


def test_a_robot_with_parts_in_its_namespace_is_one_robot():
    robot = only(
        {
            "/j100_0001/platform/odom": ODOM,
            "/j100_0001/platform/odom/filtered": ODOM,
            "/j100_0001/cmd_vel": STAMPED,
            "/j100_0001/platform/cmd_vel_unstamped": TWIST,
            "/j100_0001/sensors/lidar2d_0/scan": SCAN,
            "/j100_0001/platform/bms/state": "sensor_msgs/BatteryState",
        }
    )
    assert robot.name == "j100_0001"
    assert robot.topic("odometry") == "/j100_0001/platform/odom/filtered"
    assert robot.topic("velocity") == "/j100_0001/cmd_vel"
    assert robot.topic("scan") == "/j100_0001/sensors/lidar2d_0/scan"
    assert robot.topic("battery") == "/j100_0001/platform/bms/state"


def test_the_base_s_own_input_is_taken_where_there_is_no_cmd_vel():
    robot = only({"/odom": ODOM, "/mobile_base/commands/velocity": TWIST})
    assert robot.topic("velocity") == "/mobile_base/commands/velocity"


def test_an_input_that_was_made_for_webmap_comes_first():
    robot = only({"/odom": ODOM, "/cmd_vel": TWIST, "/webmap/cmd_vel": TWIST})
    assert robot.topic("velocity") == "/webmap/cmd_vel"


def test_steps_on_the_way_to_the_base_are_not_driven_and_are_named():
    robot = only({"/odom": ODOM, "/cmd_vel": TWIST, "/cmd_vel_nav": TWIST})
    assert robot.topic("velocity") == "/cmd_vel"
    assert any("/cmd_vel_nav" in note for note in robot.notes)


def test_a_twist_with_another_name_is_no_velocity():
    robot = only({"/odom": ODOM, "/cmd_vel_smoothed": TWIST})
    assert robot.first("velocity") is None
    assert any("Its velocity topic is unknown" in note for note in robot.notes)


def test_a_camera_with_odometry_of_its_own_is_part_of_the_robot():
    robot = only({"/odom": ODOM, "/cmd_vel": TWIST, "/t265/odom/sample": ODOM})
    assert robot.topic("odometry") == "/odom"


def test_many_inputs_of_a_mux_are_one_robot():
    robot = only(
        {
            "/odom": ODOM,
            "/cmd_vel": TWIST,
            "/pad/cmd_vel": TWIST,
            "/phone/cmd_vel": TWIST,
        }
    )
    assert robot.topic("velocity") == "/cmd_vel"


def test_a_fleet_beside_a_topic_for_all_is_a_fleet():
    topics = {"/cmd_vel": TWIST, "/a/odom": ODOM, "/a/cmd_vel": TWIST}
    topics |= {"/b/odom": ODOM, "/b/cmd_vel": TWIST}
    assert names(topics) == ["robot", "a", "b"]


def test_what_is_outside_of_the_only_robot_is_its_own():
    robot = only({"/bob/odom": ODOM, "/bob/cmd_vel": TWIST, "/scan": SCAN})
    assert robot.name == "bob"
    assert robot.topic("scan") == "/scan"
    assert "shared" in robot.first("scan").rule


def test_a_map_without_a_namespace_is_everybody_s_and_a_scan_is_not():
    topics = {"/a/odom": ODOM, "/b/odom": ODOM, "/scan": SCAN}
    found = discover(topics | {"/map": "nav_msgs/OccupancyGrid"})
    assert [robot.topic("map") for robot in found.robots] == ["/map", "/map"]
    assert [robot.topic("scan") for robot in found.robots] == ["", ""]


def test_frames_are_everybody_s_unless_a_robot_has_its_own():
    frames = "tf2_msgs/msg/TFMessage"
    topics = {"/a/odom": ODOM, "/b/odom": ODOM, "/tf": frames, "/a/tf": frames}
    found = discover(topics | {"/tf_static": frames})
    assert [robot.tf_namespace for robot in found.robots] == ["/a", ""]
    assert only({"/odom": ODOM}).tf_namespace is None


def test_a_robot_s_own_map_comes_before_the_shared_one():
    grid = "nav_msgs/OccupancyGrid"
    robot = only({"/a/odom": ODOM, "/a/map": grid, "/map": grid})
    assert robot.topic("map") == "/a/map"


def test_costmaps_are_no_maps():
    grid = "nav_msgs/msg/OccupancyGrid"
    robot = only(
        {
            "/odom": ODOM,
            "/global_costmap/costmap": grid,
            "/local_costmap/costmap": grid,
        }
    )
    assert robot.first("map") is None
    assert len(robot.guesses["costmap"]) == 2


def test_goals_of_both_navigations_are_found():
    stamped = "geometry_msgs/PoseStamped"
    robot = only(
        {
            "/odom": ODOM,
            "/move_base_simple/goal": stamped,
            "/move_base/cancel": "actionlib_msgs/GoalID",
        }
    )
    assert robot.topic("goal") == "/move_base_simple/goal"
    assert robot.topic("cancel") == "/move_base/cancel"
    robot = only({"/odom": ODOM, "/goal_pose": stamped})
    assert robot.topic("goal") == "/goal_pose"


RAW, PACKED = "sensor_msgs/Image", "sensor_msgs/msg/CompressedImage"


def cameras(topics):
    robot = only({"/odom": ODOM, **topics})
    return [guess.topic for guess in robot.guesses.get("camera", ())]


def test_packed_pictures_come_before_plain_ones_and_once_for_a_camera():
    assert cameras(
        {
            "/camera/image_raw": RAW,
            "/camera/image_raw/compressed": PACKED,
            "/back/image_raw": RAW,
            "/front/image_raw/compressed": PACKED,
        }
    ) == [
        "/camera/image_raw/compressed",
        "/front/image_raw/compressed",
        "/back/image_raw",
    ]


@pytest.mark.parametrize(
    "topic",
    [
        "/camera/depth/image_raw",
        "/camera/depth/image_raw/compressed",
        "/camera/depth_registered/image_raw",
        "/camera/aligned_depth_to_color/image_raw",
        "/camera/depth_image",
        "/camera/image_raw/compressedDepth",
        "/camera/image_raw/zstd",
    ],
)
def test_how_far_away_things_are_is_no_camera_s_picture(topic):
    assert cameras({topic: RAW}) == cameras({topic: PACKED}) == []


def test_a_depth_camera_has_colours_too():
    topics = {"/depth_camera/image_raw": RAW}
    assert cameras(topics) == ["/depth_camera/image_raw"]


def test_pictures_with_other_names_come_last_by_their_type_alone():
    assert cameras(
        {
            "/color/video": RAW,
            "/unity/image_compressed": PACKED,
            "/thermal/jpeg": PACKED,
            "/webcam/image_raw": RAW,
            "/front/image_raw/compressed": PACKED,
        }
    ) == [
        "/front/image_raw/compressed",
        "/webcam/image_raw",
        "/thermal/jpeg",
        "/unity/image_compressed",
        "/color/video",
    ]


def test_two_robots_of_one_last_name_have_their_whole_namespaces_for_names():
    topics = {"/hall/bob/odom": ODOM, "/yard/bob/odom": ODOM}
    assert names(topics) == ["hall/bob", "yard/bob"]


def test_who_publishes_is_said_to_be_unknown():
    assert "does not show which nodes publish" in discover({"/odom": ODOM}).notes[0]


@pytest.mark.parametrize("topics", [{}, {"/rosout": "rosgraph_msgs/Log"}])
def test_nothing_found_is_said(topics):
    found = discover(topics)
    assert found.robots == ()
    assert len(found.notes) == 1


@pytest.mark.parametrize("file", sorted(CAPTURED.rglob("*rosapi_topics.*json")))
def test_captured_systems_have_their_two_robots(file):
    values = json.loads(file.read_text())["values"]
    found = discover(dict(zip(values["topics"], values["types"], strict=True)))
    assert [robot.name for robot in found.robots] == ["robot_0", "robot_1"]
    for robot in found.robots:
        for role in ("odometry", "pose", "velocity", "scan", "battery", "plan", "goal"):
            assert robot.topic(role).startswith(robot.namespace)
        assert robot.topic("map") == "/map"
        assert robot.tf_namespace == ""


@pytest.mark.parametrize(
    ("url", "name"),
    [
        ("ws://bob.local:9090", "bob"),
        ("ws://localhost:9090", "robot"),
        ("ws://192.168.1.7:9090", "robot"),
        ("ws://[fe80::1]:9090", "robot"),
    ],
)
def test_a_host_has_a_short_name(url, name):
    assert host_name(url) == name


def test_a_thousand_robots_are_found_in_a_moment():
    kinds = {"odom": ODOM, "cmd_vel": TWIST, "scan": SCAN, "x": "std_msgs/String"}
    topics = {
        f"/fleet/robot_{n}/{name}": type
        for n in range(1000)
        for name, type in kinds.items()
    }
    began = time.process_time()
    assert len(discover(topics).robots) == 1000
    assert time.process_time() - began < 10.0, "0.3 s; minutes if it were quadratic"


TYPES = st.sampled_from([ODOM, TWIST, STAMPED, SCAN, POSE, "", "x", "std_msgs/String"])
WORDS = st.sampled_from(["odom", "cmd_vel", "a", "b", "scan", "base", "map", "\n", ""])
TOPICS = st.lists(WORDS, min_size=1, max_size=4).map(
    lambda parts: "/" + "/".join(parts)
)


@given(st.dictionaries(TOPICS, TYPES, max_size=12))
def test_whatever_there_is_no_topic_moves_two_robots(topics):
    found = discover(topics)
    assert len({robot.name for robot in found.robots}) == len(found.robots)
    for role in ("odometry", "velocity"):
        used = [robot.topic(role) for robot in found.robots if robot.topic(role)]
        assert len(used) == len(set(used))
    for robot in found.robots:
        assert set(robot.guesses) <= set(ROLES)
        for guesses in robot.guesses.values():
            assert all(guess.topic in topics and guess.rule for guess in guesses)


def test_a_robot_without_a_namespace_is_called_as_its_frames_are():
    trees = Trees()
    trees.take("", "map", "odom")
    trees.take("", "odom", "base_link")
    plain = discover({"/odom": ODOM, "/cmd_vel": TWIST}, "robot", trees)
    assert [robot.name for robot in plain.robots] == ["robot"]
    trees = Trees()
    trees.take("", "map", "bob/odom")
    trees.take("", "bob/odom", "bob/base_link")
    framed = discover({"/odom": ODOM, "/cmd_vel": TWIST}, "robot", trees)
    assert [robot.name for robot in framed.robots] == ["bob"]
    trees.take("", "map", "eve/odom")
    trees.take("", "eve/odom", "eve/base_link")
    several = discover({"/odom": ODOM, "/cmd_vel": TWIST}, "robot", trees)
    assert [robot.name for robot in several.robots] == ["robot", "bob", "eve"]
