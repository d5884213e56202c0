"""Goals and the initial pose in a fleet file."""

import pytest

from webmap.base.errors import ConfigError
from webmap.fleet.made import prepare

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


def test_a_robot_of_a_file_has_its_action_and_its_initial_pose(tmp_path):
    robot = ready(
        tmp_path,
        'move.action = "/move_base"\n'
        'move.action_type = "move_base_msgs/MoveBaseAction"\n'
        'initial_pose = { topic = "/here", covariance = [0.1, 0.2, 0] }\n',
    )
    spec = robot.motion.spec()
    assert (spec.action, spec.goal_topic) == ("/move_base", None)
    assert spec.action_type == "move_base_msgs/MoveBaseAction"
    assert (spec.pose_topic, spec.pose_covariance) == ("/here", (0.1, 0.2, 0.0))
    robot.destroy()


def test_a_robot_of_a_file_without_goals_is_told_its_place_in_its_own_map(tmp_path):
    text = 'initial_pose = { topic = "/here", frame = "tb1/map" }\n'
    robot = ready(tmp_path, text)
    assert robot.motion.spec().goal_frame == "tb1/map"
    robot.destroy()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('move.frame = "map"', 'the key "topic" is missing'),
        ('move = { action = "/go", action_type = "a/Fibonacci" }', "NavigateToPose"),
        ('twist = { action = "/go" }', 'there is no key "action" here'),
        ('initial_pose = { topic = "/here", covariance = [1, 2] }', "three numbers"),
        ('initial_pose = { topic = "/a", covariance = [1, 2, -1] }', "three numbers"),
        ("initial_pose = { covariance = [1, 2, 3] }", 'the key "topic" is missing'),
    ],
)
def test_a_mistake_says_what_was_expected(tmp_path, text, said):
    with pytest.raises(ConfigError, match=said):
        ready(tmp_path, text)
