"""Robots from every source: command lines, plain data, lists of topics."""

import json
from pathlib import Path

CAPTURED = Path(__file__).parents[1] / "captured"
FLEETS = Path(__file__).with_name("fleets")

NOWHERE = "ws://127.0.0.1:9"
"""The address of a bridge that does not answer."""


def captured(file):
    """Return the types by topic from a real rosapi."""
    values = json.loads((CAPTURED / file).read_text("utf-8"))["values"]
    return dict(zip(values["topics"], values["types"], strict=True))


OF_A_ROBOT = {
    "odom": "nav_msgs/Odometry",
    "cmd_vel": "geometry_msgs/TwistStamped",
    "front/scan": "sensor_msgs/LaserScan",
    "rear/scan": "sensor_msgs/LaserScan",
    "battery_state": "sensor_msgs/BatteryState",
    "camera/image_raw/compressed": "sensor_msgs/CompressedImage",
    "points": "sensor_msgs/PointCloud2",
    "map": "nav_msgs/OccupancyGrid",
    "local_costmap/costmap": "nav_msgs/OccupancyGrid",
    "plan": "nav_msgs/Path",
    "particlecloud": "geometry_msgs/PoseArray",
    "amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
    "initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    "local_costmap/footprint": "geometry_msgs/PolygonStamped",
    "move_base_simple/goal": "geometry_msgs/PoseStamped",
    "move_base/goal": "move_base_msgs/MoveBaseActionGoal",
    "move_base/cancel": "actionlib_msgs/GoalID",
    "sonar": "sensor_msgs/Range",
    "markers": "visualization_msgs/MarkerArray",
    "fix": "sensor_msgs/NavSatFix",
}
SHARED = {
    "/map": "nav_msgs/OccupancyGrid",
    "/tf": "tf2_msgs/TFMessage",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
}


def rich(*spaces):
    """Return topics of robots that have nearly everything, of ROS 1."""
    own = {
        f"{space}/{name}": OF_A_ROBOT[name] for space in spaces for name in OF_A_ROBOT
    }
    return SHARED | own


def nav2(space=""):
    """Return topics of a robot with Nav2."""
    named = {
        "odom": "nav_msgs/msg/Odometry",
        "cmd_vel": "geometry_msgs/msg/TwistStamped",
        "cmd_vel_nav": "geometry_msgs/msg/Twist",
        "navigate_to_pose/_action/feedback": (
            "nav2_msgs/action/NavigateToPose_FeedbackMessage"
        ),
        "goal_pose": "geometry_msgs/msg/PoseStamped",
        "initialpose": "geometry_msgs/msg/PoseWithCovarianceStamped",
        "scan": "sensor_msgs/msg/LaserScan",
        "tf": "tf2_msgs/msg/TFMessage",
    }
    return {f"{space}/{name}": type for name, type in named.items()}


GRAPHS = {
    "captured_ros1": captured("ros1/service_response_rosapi_topics.stdlib.json"),
    "captured_ros2": captured("ros2/service_response_rosapi_topics.ros2.json"),
    "captured_rs": captured("rs/service_response_rosapi_topics.ros2.json"),
    "rich_two": rich("/a", "/b"),
    "rich_bare": rich(""),
    "nav2_bare": nav2(),
    "nav2_named": nav2("/tb1"),
    "poses_alone": {
        "/one/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
        "/two/robot_pose": "geometry_msgs/Pose",
        "/three/cmd_vel": "geometry_msgs/Twist",
    },
    "nothing": {"/rosout": "rosgraph_msgs/Log"},
}
"""Topics with their types, as discovery receives them."""


def listed(topics):
    """Return a list of topics as a user writes one."""
    return "".join(f"{topic} {type}\n" for topic, type in topics.items())


LISTS = {
    "of_ros2": (
        "/cmd_vel [geometry_msgs/msg/TwistStamped, geometry_msgs/msg/Twist]\n"
        "/odom [nav_msgs/msg/Odometry]\n"
    ),
    "of_ros1": (
        "Published topics:\n * /odom [nav_msgs/Odometry] 1 publisher\n"
        "\nSubscribed topics:\n * /cmd_vel [geometry_msgs/Twist] 1 subscriber\n"
    ),
    "by_hand": (
        "# what the robot has\n/bob/odom  nav_msgs/Odometry # a filter's\n"
        "/bob/cmd_vel: geometry_msgs/Twist\n"
    ),
}
"""Lists of topics in each form."""

GIVEN = "Bob:/robot_0/odom:/robot_0/cmd_vel:/robot_0/base_scan"

VIEWS = {
    "plain": ("captured_ros1", ()),
    "of_ros2": ("captured_ros2", ("--stops-within", "0.3")),
    "rich": ("rich_bare", ()),
    "nav2": ("nav2_named", ()),
    "framed": ("nav2_bare", ()),
    "told": ("captured_ros1", ("--robot", GIVEN)),
    "told_alone": (
        "captured_ros1",
        (
            "--robot",
            GIVEN,
            "--robot",
            "Al:::/scan",
            "--only-given",
            "--stops-within",
            "1",
        ),
    ),
    "told_and_found": ("captured_ros1", ("--robot", GIVEN, "--discover")),
    "told_better": (
        "captured_ros1",
        (
            *("--robot", GIVEN, "--set", "Bob.battery=/robot_0/battery"),
            *("--set", "Bob.velocity_type=geometry_msgs/TwistStamped"),
            *("--set", "Bob.goal=/robot_0/goal", "--set", "Bob.cancel=/robot_0/cancel"),
            *("--set", "Bob.initialpose=/robot_0/initialpose"),
            *("--set", "Bob.camera=/robot_0/front,/robot_0/rear"),
            *("--set", "Bob.name=Robert", "--only-given"),
        ),
    ),
    "found_better": (
        "captured_ros2",
        (
            *("--set", "robot_0.name=Bob", "--set", "robot_0.scan=/robot_1/base_scan"),
            *("--set", "robot_0.base=base_footprint", "--set", "robot_0.battery="),
            *("--set", "robot_0.action=/robot_0/drive_to"),
            *("--set", "robot_1.velocity_type=geometry_msgs/msg/TwistStamped"),
            *("--set", "robot_1.velocity=/robot_1/drive", "--set", "robot_1.goal="),
            *("--set", "robot_1.initialpose=/robot_1/here", "--set", "robot_1.plan="),
            *("--set", "robot_1.camera=/a,/b", "--set", "robot_1.odometry="),
            *("--set", "robot_1.map=/robot_1/map", "--set", "robot_1.cancel=/c"),
        ),
    ),
    "listed": ("nothing", ("--topics", "by_hand.list")),
}
"""Command lines of ``webmap view`` for a bridge with a graph."""

TREE = ("world", "bob/map", "bob/odom", "bob/base_link")
"""A chain of frames, which the bridge of ``framed`` publishes."""

SHOWN = {
    "plain": ("captured_ros1", ()),
    "found_better": VIEWS["found_better"],
    "told": ("captured_ros1", ("--robot", GIVEN)),
}
"""Command lines of ``webmap view --show`` for a bridge with a graph."""

BRIDGE = "ws://robot:9090"
HERE = {"bridge": BRIDGE}

PLAIN = {
    "a_name": {"name": "Bob"},
    "velocity": {"name": "Bob", "twist": {**HERE, "topic": "cmd_vel"}},
    "everything": {
        "name": "Eve",
        "base_link": "base_footprint",
        "classes": ["blue", "large"],
        "model": {
            "tag": "g",
            "children": [{"tag": "circle", "attributes": {"r": "0.2"}}, "a text"],
        },
        "odometry": {
            **HERE,
            "topic": "/odom",
            "throttle": 20,
            "type": "nav_msgs/Odometry",
        },
        "tf": {
            **HERE,
            "map_frame": "world",
            "base_frame": "chassis",
            "namespace": "/eve",
            "quiet": True,
        },
        "alignment": [1.0, 2.0, 90.0],
        "twist": {
            **HERE,
            "topic": "/eve/cmd_vel",
            "type": "geometry_msgs/msg/TwistStamped",
            "stops_within": 0.4,
            "v_max": 1.25,
            "w_max": 2.5,
            "z_max": 0.5,
            "rx_max": 0.6,
            "ry_max": 0.7,
            "a_max": 0.75,
            "holonomic": True,
            "stop_hooks": [
                {"topic": "lock"},
                {"service": "/e_stop", "type": "std_srvs/srv/Trigger"},
            ],
        },
        "move": {
            "bridge": "ws://other:9090",
            "topic": "goal",
            "frame": "hall",
            "cancel_topic": "/cancel",
            "on_operator_loss": "cancel",
            "action": "/navigate_to_pose",
            "action_type": "nav2_msgs/action/NavigateToPose",
        },
        "initial_pose": {
            "bridge": "ws://other:9090",
            "topic": "/here",
            "covariance": [1, 2, 3],
            "frame": "unused",
        },
        "scan_assist": {
            "topic": "/scan",
            "footprint": [[0.3, 0.2], [-0.3, 0.2], [0.0, -0.3]],
            "x": 0.1,
            "y": 0.2,
            "angle": 30.0,
            "upside_down": True,
            "frame": "laser",
            "stop_distance": 0.25,
            "brake": 0.6,
            "blind": "creep",
            "creep": 0.05,
        },
        "modules": [
            {
                "name": "LaserScanner",
                "args": [{"bridge": BRIDGE}, "/scan", 0.2],
                "options": {"max_dots": {"none": True}, "name": "rear"},
            },
            {"name": "Battery", "args": [{"bridge": BRIDGE}, "/battery"]},
            {"name": "Trail", "options": {"length": 5.0}},
        ],
    },
    "goals_alone": {"name": "Gus", "move": {**HERE, "topic": "/goal"}},
    "move_base": {
        "name": "Mo",
        "move": {
            **HERE,
            "action": "/move_base",
            "action_type": "move_base_msgs/MoveBaseAction",
        },
        "initial_pose": {**HERE, "topic": "/initialpose"},
    },
    "place_alone": {
        "name": "Po",
        "initial_pose": {**HERE, "topic": "/initialpose", "frame": "tb1/map"},
    },
    "a_radius": {
        "name": "Ray",
        "twist": {**HERE, "topic": "/cmd_vel"},
        "scan_assist": {"topic": "/scan", "footprint": 0.3},
    },
    "bridges_by_name": {
        "name": "Bea",
        "odometry": {"bridge": "hall", "topic": "/odom"},
        "twist": {"bridge": "hall", "topic": "/cmd_vel"},
        "modules": [{"name": "Battery", "args": [{"bridge": "hall"}, "/battery"]}],
    },
}
"""Plain data of robots."""
