"""Topics for goals and the initial pose in a fleet file."""

import pytest

from webmap.base.errors import ConfigError
from webmap.fleet.fleet_file import prepare

HEAD = """
[bridges]
hall = "ws://hall:9090"

[[robots]]
name = "Bob"
"""


def ready(tmp_path, text):
    file = tmp_path / "fleet.toml"
    file.write_text(HEAD + text)
    return prepare(file).robots[0]


def test_a_robot_gets_its_action_and_initial_pose_from_the_fleet_file(tmp_path):
    robot = ready(
        tmp_path,
        'move.action = "/move_base"\n'
        'move.action_type = "move_base_msgs/MoveBaseAction"\n'
        'initial_pose = { topic = "/here", covariance = [0.1, 0.2, 0] }\n',
    )
    spec = robot.motion.spec()
    assert (spec.navigation.action, spec.navigation.topic) == ("/move_base", "")
    assert spec.navigation.action_type == "move_base_msgs/MoveBaseAction"
    pose = spec.initial_pose
    assert (pose.topic, pose.covariance) == ("/here", (0.1, 0.2, 0.0))
    robot.destroy()


def test_a_robot_without_goals_uses_the_initial_pose_frame_of_the_fleet_file(tmp_path):
    text = 'initial_pose = { topic = "/here", frame = "tb1/map" }\n'
    robot = ready(tmp_path, text)
    assert robot.motion.spec().goal_frame == "tb1/map"
    robot.destroy()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('move.frame = "map"', 'the key "topic" is missing'),
        ('move = { action = "/go", action_type = "a/Fibonacci" }', "NavigateToPose"),
        ('twist = { action = "/go" }', 'there is no key "action" here'),
        ('initial_pose = { topic = "/here", covariance = [1, 2] }', "three numbers"),
        ('initial_pose = { topic = "/a", covariance = [1, 2, -1] }', "three numbers"),
        ("initial_pose = { covariance = [1, 2, 3] }", 'the key "topic" is missing'),
    ],
)
def test_the_error_for_an_invalid_goal_or_initial_pose_explains_the_mistake(
    tmp_path, text, expected
):
    with pytest.raises(ConfigError, match=expected):
        ready(tmp_path, text)
