"""Robots are found from the names and types of topics."""

import json
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from equipment.captured_frames import CAPTURED
from webmap.discovery import discover
from webmap.discovery.findings import ROLES
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


def test_a_robot_without_namespace_is_named_after_the_host():
    robot = only({"/odom": ODOM, "/cmd_vel": TWIST, "/scan": SCAN}, "bob")
    assert (robot.name, robot.namespace) == ("bob", "")
    assert robot.topic("odometry") == "/odom"
    assert robot.topic("velocity") == "/cmd_vel"
    assert robot.topic("scan") == "/scan"


@pytest.mark.parametrize("kind", ["", "msg/"])
def test_each_namespace_is_a_robot_in_ros_1_and_ros_2(kind):
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


def test_a_velocity_topic_keeps_the_type_from_the_bridge():
    robot = only({"/odom": ODOM, "/cmd_vel": STAMPED})
    assert robot.first("velocity").type == STAMPED


def test_filtered_odometry_is_preferred_and_plain_odometry_is_noted():
    robot = only({"/odom": ODOM, "/odometry/filtered": ODOM, "/cmd_vel": TWIST})
    assert robot.topic("odometry") == "/odometry/filtered"
    assert any("/odom is odometry too" in note for note in robot.notes)


def test_the_ground_truth_of_a_simulator_is_used_last():
    robot = only({"/base_pose_ground_truth": ODOM, "/odom": ODOM})
    assert robot.topic("odometry") == "/odom"


def test_odometry_is_used_and_the_amcl_pose_is_noted():
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
def test_a_pose_topic_without_a_header_makes_a_robot(topic, type):
    robot = only({topic: type})
    assert robot.namespace == topic.rpartition("/")[0]
    assert (robot.first("pose").topic, robot.first("pose").type) == (topic, type)


def test_a_pose_with_a_frame_is_preferred_to_a_pose_without_a_frame():
    bare = {"/robot_pose": "geometry_msgs/Pose", "/pose2D": "geometry_msgs/Pose2D"}
    assert only({**bare, "/amcl_pose": POSE}).topic("pose") == "/amcl_pose"


def test_the_namespace_of_a_controller_is_not_a_robot():
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


def test_the_velocity_input_of_the_base_is_used_if_there_is_no_cmd_vel():
    robot = only({"/odom": ODOM, "/mobile_base/commands/velocity": TWIST})
    assert robot.topic("velocity") == "/mobile_base/commands/velocity"


def test_a_velocity_topic_for_webmap_is_preferred_to_cmd_vel():
    robot = only({"/odom": ODOM, "/cmd_vel": TWIST, "/webmap/cmd_vel": TWIST})
    assert robot.topic("velocity") == "/webmap/cmd_vel"


def test_cmd_vel_is_preferred_and_cmd_vel_nav_is_noted():
    robot = only({"/odom": ODOM, "/cmd_vel": TWIST, "/cmd_vel_nav": TWIST})
    assert robot.topic("velocity") == "/cmd_vel"
    assert any("/cmd_vel_nav" in note for note in robot.notes)


def test_a_twist_topic_with_an_unusual_name_is_not_used_for_velocities():
    robot = only({"/odom": ODOM, "/cmd_vel_smoothed": TWIST})
    assert robot.first("velocity") is None
    assert any("Its velocity topic is unknown" in note for note in robot.notes)


def test_a_camera_with_its_own_odometry_is_part_of_the_robot():
    robot = only({"/odom": ODOM, "/cmd_vel": TWIST, "/t265/odom/sample": ODOM})
    assert robot.topic("odometry") == "/odom"


def test_a_robot_with_many_velocity_inputs_is_one_robot():
    robot = only(
        {
            "/odom": ODOM,
            "/cmd_vel": TWIST,
            "/pad/cmd_vel": TWIST,
            "/phone/cmd_vel": TWIST,
        }
    )
    assert robot.topic("velocity") == "/cmd_vel"


def test_a_velocity_topic_for_all_robots_does_not_merge_the_robots_of_a_fleet():
    topics = {"/cmd_vel": TWIST, "/a/odom": ODOM, "/a/cmd_vel": TWIST}
    topics |= {"/b/odom": ODOM, "/b/cmd_vel": TWIST}
    assert names(topics) == ["robot", "a", "b"]


def test_a_scan_outside_the_namespace_of_the_only_robot_belongs_to_this_robot():
    robot = only({"/bob/odom": ODOM, "/bob/cmd_vel": TWIST, "/scan": SCAN})
    assert robot.name == "bob"
    assert robot.topic("scan") == "/scan"
    assert "shared" in robot.first("scan").rule


def test_all_robots_share_a_map_without_namespace_but_not_a_scan():
    topics = {"/a/odom": ODOM, "/b/odom": ODOM, "/scan": SCAN}
    found = discover(topics | {"/map": "nav_msgs/OccupancyGrid"})
    assert [robot.topic("map") for robot in found.robots] == ["/map", "/map"]
    assert [robot.topic("scan") for robot in found.robots] == ["", ""]


def test_all_robots_share_tf_except_a_robot_with_its_own_tf():
    frames = "tf2_msgs/msg/TFMessage"
    topics = {"/a/odom": ODOM, "/b/odom": ODOM, "/tf": frames, "/a/tf": frames}
    found = discover(topics | {"/tf_static": frames})
    assert [robot.tf_namespace for robot in found.robots] == ["/a", ""]
    assert only({"/odom": ODOM}).tf_namespace is None


def test_the_map_of_a_robot_is_preferred_to_the_shared_map():
    grid = "nav_msgs/OccupancyGrid"
    robot = only({"/a/odom": ODOM, "/a/map": grid, "/map": grid})
    assert robot.topic("map") == "/a/map"


def test_costmaps_are_not_used_as_maps():
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


def test_goal_topics_of_move_base_and_nav2_are_found():
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


def test_a_camera_counts_once_and_compressed_images_are_listed_first():
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
def test_a_depth_image_is_not_used_as_camera(topic):
    assert cameras({topic: RAW}) == cameras({topic: PACKED}) == []


def test_the_colour_image_of_a_depth_camera_is_used_as_camera():
    topics = {"/depth_camera/image_raw": RAW}
    assert cameras(topics) == ["/depth_camera/image_raw"]


def test_images_with_unusual_names_are_found_by_type_and_listed_last():
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


def test_robots_with_equal_last_names_are_named_by_their_full_namespaces():
    topics = {"/hall/bob/odom": ODOM, "/yard/bob/odom": ODOM}
    assert names(topics) == ["hall/bob", "yard/bob"]


def test_a_note_says_that_the_publishers_are_unknown():
    assert "does not show which nodes publish" in discover({"/odom": ODOM}).notes[0]


@pytest.mark.parametrize("topics", [{}, {"/rosout": "rosgraph_msgs/Log"}])
def test_a_note_says_that_no_robot_was_found(topics):
    found = discover(topics)
    assert found.robots == ()
    assert len(found.notes) == 1


@pytest.mark.parametrize("file", sorted(CAPTURED.rglob("*rosapi_topics.*json")))
def test_both_robots_are_found_in_captured_systems(file):
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
def test_the_host_gives_the_robot_name_except_ip_addresses_and_localhost(url, name):
    assert host_name(url) == name


def test_a_thousand_robots_are_found_within_seconds():
    kinds = {"odom": ODOM, "cmd_vel": TWIST, "scan": SCAN, "x": "std_msgs/String"}
    topics = {
        f"/fleet/robot_{n}/{name}": type
        for n in range(1000)
        for name, type in kinds.items()
    }
    began = time.process_time()
    assert len(discover(topics).robots) == 1000
    assert time.process_time() - began < 10.0, (
        "linear work takes 0.3 s, quadratic work minutes"
    )


TYPES = st.sampled_from([ODOM, TWIST, STAMPED, SCAN, POSE, "", "x", "std_msgs/String"])
WORDS = st.sampled_from(["odom", "cmd_vel", "a", "b", "scan", "base", "map", "\n", ""])
TOPICS = st.lists(WORDS, min_size=1, max_size=4).map(
    lambda parts: "/" + "/".join(parts)
)


@given(st.dictionaries(TOPICS, TYPES, max_size=12))
def test_no_two_robots_share_a_name_a_velocity_topic_or_an_odometry_topic(topics):
    found = discover(topics)
    assert len({robot.name for robot in found.robots}) == len(found.robots)
    for role in ("odometry", "velocity"):
        used = [robot.topic(role) for robot in found.robots if robot.topic(role)]
        assert len(used) == len(set(used))
    for robot in found.robots:
        assert set(robot.guesses) <= set(ROLES)
        for guesses in robot.guesses.values():
            assert all(guess.topic in topics and guess.rule for guess in guesses)


def test_a_robot_without_namespace_is_named_after_its_frame_prefix():
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
