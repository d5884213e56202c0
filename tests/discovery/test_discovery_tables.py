"""The found robots as a table for users and as a file."""

import re
import tomllib
from pathlib import Path

from webmap.config.checks import same_name
from webmap.discovery import discover, rules
from webmap.discovery.findings import unique_names
from webmap.discovery.fleet_toml import fleet_toml
from webmap.discovery.tables import report, summary_line
from webmap.modules.declaration import declarations

ODOM = "nav_msgs/Odometry"
TOPICS = {
    "/odom": ODOM,
    "/cmd_vel": "geometry_msgs/Twist",
    "/scan": "sensor_msgs/LaserScan",
    "/rear/scan": "sensor_msgs/LaserScan",
    "/move_base_simple/goal": "geometry_msgs/PoseStamped",
    "/move_base/cancel": "actionlib_msgs/GoalID",
    "/plan": "nav_msgs/Path",
}


def test_the_report_names_each_topic_with_its_rule():
    text = report("ws://bob:9090", discover(TOPICS, "bob"))
    assert text.startswith("ws://bob:9090: ROS 1, 1 robot\n\nbob (without a namespace)")
    line = next(line for line in text.splitlines() if "/cmd_vel" in line)
    assert line.split() == [
        "velocity", "/cmd_vel", "geometry_msgs/Twist", "the", "usual", "name",
    ]  # fmt: skip
    missing = "pose, battery, action, initialpose, map, costmap, camera, cloud, tf"
    assert f"not found: {missing}" in text
    assert "--robot NAME:ODOM:CMD_VEL:SCAN" in text
    assert "--set ROBOT.ROLE=TOPIC" in text


def test_the_report_of_a_robot_with_an_action_does_not_miss_the_cancel_topic():
    action = {
        "/navigate_to_pose/_action/feedback": "nav2_msgs/NavigateToPose_FeedbackMessage"
    }
    (robot,) = discover(TOPICS | action, "bob").robots
    assert robot.action is not None
    missing = next(
        line
        for line in report("ws://bob:9090", discover(action | {"/odom": ODOM})).split(
            "\n"
        )
        if "not found" in line
    )
    assert "cancel" not in missing
    assert "velocity" in missing


def test_the_note_about_the_pose_topic_names_the_odometry_that_is_used():
    pose = {"/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped"}
    text = report("ws://bob:9090", discover(TOPICS | pose, "bob"))
    assert "/odom is used, in its own frame." in text
    assert "the usual name of Nav2" not in text


def test_the_report_removes_control_characters_from_types():
    odd = {"/odom": "nav_msgs/Odometry\n", "/scan": "sensor_msgs/Laser\x1b[2JScan"}
    text = report("ws://bob:9090", discover(TOPICS | odd))
    assert "\x1b" not in text


def test_the_summary_line_lists_the_topics_in_use():
    (robot,) = discover(TOPICS, "bob").robots
    assert summary_line(robot) == (
        "bob: odometry /odom, velocity /cmd_vel, scan /scan, "
        "goal /move_base_simple/goal, plan /plan"
    )


def test_the_report_names_each_drawn_topic_with_its_rule_and_each_topic_left_out():
    more = {"/other/odom": "nav_msgs/Odometry", "/trajectory": "nav_msgs/Path"}
    more |= {f"/cloud_{n}": "sensor_msgs/PointCloud2" for n in range(3)}
    report_text = report("ws://bob:9090", discover(TOPICS | more, "bob"))
    lines = [" ".join(line.split()) for line in report_text.splitlines()]
    assert "/rear/scan LaserScanner the usual name" in lines
    assert "/trajectory Path named like a path" in lines
    assert "/cloud_1 PointCloud named points or a cloud" in lines
    left = "not drawn, beyond the limit for their kind: /cloud_2"
    assert left in lines


def test_the_report_marks_the_used_one_of_several_topics_for_a_role():
    more = {"/odometry/filtered": "nav_msgs/Odometry"}
    report_text = report("ws://bob:9090", discover(TOPICS | more, "bob"))
    lines = [" ".join(line.split()) for line in report_text.splitlines()]
    used = "odometry /odometry/filtered nav_msgs/Odometry a filter's estimate, used"
    assert used in lines
    assert "/odom nav_msgs/Odometry the usual name, not used" in lines
    assert not any("/cmd_vel" in line and line.endswith("used") for line in lines)


PAGE = Path(__file__).parents[2] / "docs/reference/discovery.md"


def rows_of_the_documentation() -> list[str]:
    return [line for line in PAGE.read_text().splitlines() if line.startswith("|")]


def test_every_topic_rule_is_in_the_documentation():
    rows = {row.split("|")[1].strip(): row for row in rows_of_the_documentation()}
    for rule in rules.RULES:
        for type in rule.types:
            assert type.partition("/")[2] in rows[rule.role], rule
        if re.fullmatch(r"[\w/]+", rule.tail):
            assert f"`{rule.tail}`" in rows[rule.role], rule


def test_every_layer_rule_is_in_the_documentation():
    page = PAGE.with_name("layers.md")
    rows = [line for line in page.read_text().splitlines() if line.startswith("| `")]
    declared_kinds = [(each, kind) for each in declarations() for kind in each.kinds]
    for declared, kind in declared_kinds:
        named = f"`{kind.types[0]}`", f"`{declared.name}`"
        found = [row for row in rows if all(name in row for name in named)]
        assert any(row.endswith(f"| {kind.most} |") for row in found), kind
        for name in kind.names:
            assert any(name.replace("|", "\\|") in row for row in found), kind


def test_the_fleet_file_is_toml_with_every_topic_in_use():
    text = fleet_toml([("bob", "ws://bob:9090", discover(TOPICS, "bob"))])
    data = tomllib.loads(text)
    assert data["bridges"] == {"bob": "ws://bob:9090"}
    (robot,) = data["robots"]
    assert robot["odometry"] == {"topic": "/odom", "type": "nav_msgs/Odometry"}
    assert robot["twist"] == {"topic": "/cmd_vel", "type": "geometry_msgs/Twist"}
    assert robot["scan"] == ["/scan", "/rear/scan"]
    assert robot["move"]["cancel_topic"] == "/move_base/cancel"
    assert robot["modules"] == [
        {"name": "Trail", "options": {"length": 10.0}},
        {"name": "Path", "args": [{"bridge": "bob"}, "/plan"]},
        {
            "name": "PoseStamped",
            "args": [{"bridge": "bob"}, "/move_base_simple/goal"],
            "options": {"name": "goal"},
        },
    ]
    assert "map" not in data


def test_the_fleet_file_contains_maps_costmaps_and_cameras():
    more = {"/map": "nav_msgs/OccupancyGrid", "/costmap": "nav_msgs/OccupancyGrid"}
    more |= {"/cam/image_raw/compressed": "sensor_msgs/CompressedImage"}
    found = discover(TOPICS | more, "bob")
    text = fleet_toml([("al", "ws://al", discover({})), ("bob", "ws://bob", found)])
    data = tomllib.loads(text)
    assert data["map"] == [{"bridge": "bob", "topic": "/map"}]
    (costmap,) = [m for m in data["robots"][0]["modules"] if m["name"] == "OnMaps"]
    assert costmap["args"] == ["OccupancyGrid", {"bridge": "bob"}, "/costmap"]
    assert data["robots"][0]["cameras"] == ["/cam/image_raw/compressed"]


def test_an_ipv6_address_as_bridge_name_is_a_quoted_toml_key():
    text = fleet_toml([("fe80::1", "ws://[fe80::1]:9090", discover(TOPICS, "é"))])
    assert tomllib.loads(text)["bridges"] == {"fe80::1": "ws://[fe80::1]:9090"}


def test_robots_with_one_name_on_two_bridges_get_the_host_in_their_names():
    found = discover(TOPICS, "Bob")
    named = unique_names([("hall", found), ("yard", discover(TOPICS, "bob"))])
    assert [one.robots[0].name for one in named] == ["Bob (hall)", "bob (yard)"]


def test_the_same_bridge_listed_twice_still_gives_unique_robot_names():
    found = discover(TOPICS, "bob")
    named = unique_names([("hall", found), ("hall", found)])
    assert [one.robots[0].name for one in named] == ["bob (hall)", "bob (hall) 2"]


def test_names_that_differ_only_in_case_or_unicode_form_are_equal():
    assert same_name("BOB") == same_name("bob ")
    assert same_name("é") == same_name("e\u0301")
    assert same_name("bob") != same_name("rob")


def test_the_report_names_the_layers_that_are_off_at_first():
    topics = {
        **TOPICS,
        "/map": "nav_msgs/OccupancyGrid",
        "/move_base/local_costmap/costmap": "nav_msgs/OccupancyGrid",
    }
    lines = report("ws://bob:9090", discover(topics, "bob")).splitlines()
    drawn = lines[lines.index("  drawn by webmap view:") + 1 :]
    (off,) = (line.split()[0] for line in drawn if "; off under Layers" in line)
    assert off == "/move_base/local_costmap/costmap"
