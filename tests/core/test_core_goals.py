"""Topics for goals and the initial pose: what the gate receives and refuses."""

import pytest

from webmap import Robot
from webmap.base.errors import ConfigError
from webmap.gate.specs import checked

MOVE_BASE = "move_base_msgs/MoveBaseAction"
SURE = (0.25, 0.25, 0.068)


class Link:
    """A bridge with only the methods that goals need."""

    lag = 0.0

    def __init__(self, url="ws://test:9090"):
        self.url = url
        self.protected = {}

    def protect(self, topic, carries):
        self.protected[topic] = carries


def spec_of(set_up):
    robot = Robot("Bob")
    set_up(robot)
    spec = robot.motion.spec()
    robot.destroy()
    return checked(spec)


def test_the_spec_for_the_gate_contains_the_action_and_the_goal_topic():
    def set_up(robot):
        robot.set_move_topic(Link(), "/goal_pose", action="/navigate_to_pose")

    spec = spec_of(set_up)
    assert (spec.navigation.topic, spec.navigation.action) == (
        "/goal_pose",
        "/navigate_to_pose",
    )
    assert spec.goal_type("PoseStamped") == "geometry_msgs/msg/PoseStamped"
    assert spec.initial_pose is None


def test_a_robot_can_have_an_action_without_a_goal_topic():
    def set_up(robot):
        robot.set_move_topic(Link(), action="/move_base", action_type=MOVE_BASE)

    spec = spec_of(set_up)
    assert (spec.navigation.topic, spec.navigation.action_type) == ("", MOVE_BASE)
    assert spec.goal_type("PoseStamped") == "geometry_msgs/PoseStamped"


def test_a_robot_can_have_an_initial_pose_topic_without_goals():
    spec = spec_of(lambda robot: robot.set_initial_pose_topic(Link()))
    assert (spec.initial_pose.topic, spec.initial_pose.covariance) == (
        "/initialpose",
        SURE,
    )
    assert (
        spec.goal_type("PoseWithCovarianceStamped")
        == "geometry_msgs/PoseWithCovarianceStamped"
    )


def test_the_initial_pose_of_a_robot_without_goals_uses_its_own_frame_option():
    spec = spec_of(lambda robot: robot.set_initial_pose_topic(Link(), frame="tb1/map"))
    assert spec.goal_frame == "tb1/map"


def test_the_initial_pose_uses_the_type_spelling_and_the_frame_of_the_goals():
    def set_up(robot):
        robot.set_move_topic(link, action="/navigate_to_pose", frame="hall")
        robot.set_initial_pose_topic(link, "/here", covariance=[1, 2, 3], frame="x")

    link = Link()
    spec = spec_of(set_up)
    assert (
        spec.goal_type("PoseWithCovarianceStamped")
        == "geometry_msgs/msg/PoseWithCovarianceStamped"
    )
    assert (spec.goal_frame, spec.initial_pose.covariance) == ("hall", (1, 2, 3))


def test_the_topics_of_goals_and_the_initial_pose_are_protected_on_the_bridge():
    def set_up(robot):
        robot.set_move_topic(link, "/goal", action="/move_base", action_type=MOVE_BASE)
        robot.set_initial_pose_topic(link)

    link = Link()
    spec_of(set_up)
    assert link.protected == {
        "/goal": "a goal",
        "/move_base/goal": "a goal",
        "/move_base/cancel": "the end of a goal",
        "/initialpose": "an initial pose",
    }


def test_set_move_topic_without_a_topic_or_an_action_is_refused():
    with pytest.raises(ConfigError, match="neither is given"):
        Robot("Bob").set_move_topic(Link())


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (
            {"on_operator_loss": "cancle"},
            '"cancle", expected "continue" or "cancel"; did',
        ),
        ({"action": "/go", "action_type": "a/Fibonacci"}, 'got the text "a/Fibonacci"'),
        ({"action_type": "a/Fibonacci"}, 'got the text "a/Fibonacci"'),
        ({"cancel_topic": "can cel"}, '"can cel", expected the name of a topic, such'),
    ],
)
def test_invalid_options_of_set_move_topic_are_refused(options, expected):
    robot = Robot("Bob")
    with pytest.raises(ConfigError) as error:
        robot.set_move_topic(Link(), "/goal", **options)
    assert expected in str(error.value)
    assert robot.motion.config.move is None


@pytest.mark.parametrize("policy", ["continue", "cancel"])
def test_the_spec_for_the_gate_contains_on_operator_loss(policy):
    def set_up(robot):
        robot.set_move_topic(Link(), "/goal", on_operator_loss=policy)

    assert spec_of(set_up).navigation.on_operator_loss == policy


def test_an_invalid_on_operator_loss_in_plain_data_is_refused():
    move = {"bridge": "ws://robot:9090", "topic": "/goal", "on_operator_loss": "cancle"}
    with pytest.raises(ConfigError, match='"cancle", expected "continue" or "cancel"'):
        Robot.from_dict({"name": "Bob", "move": move})


@pytest.mark.parametrize(
    "covariance", [(1, 2), (1, 2, -3), (1, 2, float("nan")), (1, 2, "3"), "abc"]
)
def test_an_invalid_covariance_is_refused(covariance):
    with pytest.raises(ConfigError, match="three numbers from 0 on"):
        Robot("Bob").set_initial_pose_topic(Link(), covariance=covariance)


def test_goals_and_the_initial_pose_must_use_the_same_bridge():
    one, other = Link(), Link("ws://other:9090")
    robot = Robot("Bob")
    robot.set_move_topic(one, "/goal")
    with pytest.raises(ConfigError, match="expected one bridge for both"):
        robot.set_initial_pose_topic(other)
    assert robot.motion.config.initial_pose is None
    robot.set_initial_pose_topic(one)
    with pytest.raises(ConfigError, match="expected one bridge for both"):
        robot.set_move_topic(other, "/goal")
    assert robot.motion.bridge("move") is one


def test_goals_and_the_initial_pose_are_restored_from_plain_data():
    link = Link()
    robot = Robot("Bob")
    robot.set_move_topic(link, action="/navigate_to_pose")
    robot.set_initial_pose_topic(link, "/here", covariance=(1, 2, 3), frame="hall")
    data = robot.to_dict()
    assert data["move"] == {"bridge": link.url, "action": "/navigate_to_pose"}
    assert data["initial_pose"]["covariance"] == (1, 2, 3)
    assert data["initial_pose"]["frame"] == "hall"
    assert Robot.from_dict(data, {link.url: link}).to_dict() == data
