"""A button must not publish to a topic that moves a robot."""

import pytest

import webmap
from webmap.config.buttons import ButtonConfig
from webmap.features.buttons.robot_button import declared_motion

HALL = "ws://core-buttons:9090"


def ways():
    """Yield a method that sets a topic, its arguments, the topic and its content."""
    hook = {"topic": "bob/lock", "type": "std_msgs/Bool"}
    yield "set_twist_topic", ["/bob/wheels"], {}, "/bob/wheels", "a velocity"
    yield (
        "set_twist_topic",
        ["/bob/wheels"],
        {"stop_hooks": [hook]},
        "/bob/lock",
        "the STOP",
    )
    move = {"cancel_topic": "/bob/halt/", "action": "bob//walk"}
    for topic, carried in (
        ("/bob/there", "a goal"),
        ("/bob/halt", "the end of a goal"),
        ("/bob/walk/goal", "a goal"),
        ("/bob/walk/cancel", "the end of a goal"),
    ):
        yield "set_move_topic", ["/bob/there"], move, topic, carried
    yield "set_initial_pose_topic", ["/bob/here"], {}, "/bob/here", "an initial pose"


@pytest.mark.parametrize(
    ("setter", "args", "options", "topic", "carried"), list(ways())
)
def test_a_button_cannot_publish_to_a_topic_that_only_the_gate_publishes(
    setter, args, options, topic, carried
):
    bridge = webmap.Bridge(HALL)
    spec = ButtonConfig(label="Go", topic=topic, type="std_msgs/Bool")
    assert declared_motion(spec, HALL) is None, "no robot has the topic yet"
    robot = webmap.Robot("Bob")
    try:
        getattr(robot, setter)(bridge, *args, **options)
        reason = declared_motion(spec, HALL)
        assert reason is not None
        assert reason.startswith(f"{topic} carries {carried}, which only the gate")
        assert declared_motion(spec, "ws://another:9090") is None
    finally:
        robot.destroy()
    assert declared_motion(spec, HALL) is None, "the robot does not exist any more"


def test_adding_a_button_that_publishes_an_initial_pose_is_refused():
    bridge = webmap.Bridge(HALL)
    robot = webmap.Robot("Bob")
    try:
        robot.set_initial_pose_topic(bridge, "/bob/here")
        button = {"label": "Here", "topic": "bob/here", "type": "std_msgs/Bool"}
        with pytest.raises(webmap.base.errors.ConfigError) as refused:
            robot.add_module("Buttons", bridge, [button])
        assert str(refused.value) == (
            "button 'Here': /bob/here carries an initial pose, which only the gate "
            "publishes: remove this button"
        )
    finally:
        robot.destroy()
