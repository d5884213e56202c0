"""The configuration of one robot: read from plain values, checked, and back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap import Bridge, Robot, RobotConfig
from webmap.base.errors import ConfigError
from webmap.config.checks import Mistakes
from webmap.config.motion import TwistConfig
from webmap.config.reading import read
from webmap.config.robot import CameraConfig, ModuleConfig
from webmap.core.robot import apply_config
from webmap.gate.specs import checked

URL = "ws://robot:9090"
WHOLE = {
    "name": "Bob",
    "bridge": URL,
    "base_link": "base",
    "odometry": {"topic": "/odom", "throttle": 50},
    "tf": {"quiet": True, "namespace": "/bob"},
    "alignment": (1.0, 2.0, 3.0),
    "scan": ["/front", "/rear"],
    "battery": "/battery",
    "battery_low": 0.3,
    "tags": ["bay 3", "new"],
    "cameras": [{"topic": "/camera"}, {"url": "http://bob/", "throttle": 200}],
    "twist": {
        "topic": "/cmd_vel",
        "stops_within": 0.25,
        "stop_hooks": [{"topic": "/lock", "type": "std_msgs/Bool"}],
    },
    "move": {"action": "/navigate_to_pose", "frame": "hall"},
    "initial_pose": {"topic": "/initialpose"},
    "scan_assist": {"topic": "/front", "footprint": 0.3},
    "buttons": [{"label": "Dock", "service": "/dock"}],
    "modules": [{"name": "Trail", "options": {"length": 3.0}}],
    "classes": ["fast"],
    "model": {"tag": "circle", "attributes": {"r": 1}},
}


PICTURE = {"file": "bob.png", "width": 1.0, "height": 0.5}


def test_to_dict_returns_the_dictionary_given_to_from_dict():
    config = RobotConfig.from_dict(WHOLE)
    assert config.motion.twist.stops_within == 0.25
    assert config.to_dict() == WHOLE
    shown = {**WHOLE, "picture": PICTURE}
    del shown["model"]
    assert RobotConfig.from_dict(shown).to_dict() == shown


def test_a_robot_with_both_a_picture_and_a_model_is_refused():
    with pytest.raises(ConfigError, match='picture: a robot has a "picture" or a "mod'):
        RobotConfig.from_dict({**WHOLE, "picture": PICTURE})


def test_mistakes_in_the_model_and_in_modules_are_reported_together():
    bad = {"name": "Bob", "model": {"tag": "script"}, "classes": ["fast"]}
    bad["modules"] = [{"name": "Trial"}]
    with pytest.raises(ConfigError) as error:
        Robot.from_dict(bad)
    assert "model: svg tag 'script'" in str(error.value)
    assert "modules[0].name" in str(error.value)


@pytest.mark.parametrize("name", ["", "a b", "selected", 5])
def test_an_invalid_or_reserved_class_name_is_refused(name):
    with pytest.raises(ConfigError, match=r"classes\[0\]: got .*expected a"):
        RobotConfig.from_dict({"name": "Bob", "classes": [name]})


def test_classes_that_are_not_an_array_are_refused():
    with pytest.raises(ConfigError, match="expected an array of texts"):
        RobotConfig.from_dict({"name": "Bob", "classes": "fast"})


def test_all_mistakes_in_buttons_and_other_keys_are_reported_together():
    buttons = [{"label": "Dock"}, 5, {"label": "A", "service": "/a"}, {"lable": "A"}]
    with pytest.raises(ConfigError) as error:
        RobotConfig.from_dict({"name": "Bob", "buttons": buttons, "battery": 5})
    lines = str(error.value).splitlines()
    assert len(lines) == 5, "the last button has a wrong key, and no label"
    for index in (0, 1, 3):
        assert any(f"buttons[{index}]" in line for line in lines)


@pytest.mark.parametrize("robot", ["", "two\nlines", "x" * 101])
def test_a_robot_created_by_a_program_may_have_any_name(robot):
    made = Robot(robot, base_link="")
    try:
        assert RobotConfig.from_dict(made.to_dict()).name == robot
    finally:
        made.destroy()


def test_goals_and_the_initial_pose_move_to_another_bridge_together():
    other = "ws://other:9090"
    bridges = {URL: Bridge(URL), other: Bridge(other)}
    parts = {"move": {"topic": "/goal"}, "initial_pose": {"topic": "/initialpose"}}
    old = RobotConfig.from_dict({"name": "Bob", "bridge": URL, **parts})
    new = RobotConfig.from_dict({"name": "Bob", "bridge": other, **parts})
    robot = Robot.from_config(old, bridges)
    try:
        assert apply_config(robot, old, new, bridges).found == []
        motion = robot.motion.config
        assert (motion.move.bridge, motion.initial_pose.bridge) == (other, other)
    finally:
        robot.destroy()


def test_classes_that_a_new_configuration_leaves_out_are_removed():
    old = RobotConfig(name="Bob", classes=["slow", "red"])
    robot = Robot.from_config(old)
    robot.svg.classes.add("mine")
    try:
        apply_config(robot, old, RobotConfig(name="Bob", classes=["red"]))
        assert {"red", "mine"} <= set(robot.svg.classes)
        assert "slow" not in robot.svg.classes
    finally:
        robot.destroy()


@pytest.mark.parametrize("key", ["odometry", "tf", "twist", "move", "initial_pose"])
def test_configuring_a_part_without_a_bridge_is_refused(key):
    robot = Robot("Bob")
    try:
        with pytest.raises(ConfigError, match=f"{key}: a bridge is missing"):
            robot.configure(key, {"topic": "/odom"} if key != "tf" else {})
        with pytest.raises(ConfigError, match='there is no key "nonsense"'):
            robot.configure("nonsense", None)
    finally:
        robot.destroy()


def test_a_plain_topic_is_short_for_a_table_with_a_topic():
    short = {"name": "Bob", "odometry": "odom", "scan": "/scan", "tf": True}
    config = RobotConfig.from_dict({**short, "cameras": "http://bob/", "twist": "c"})
    assert config.to_dict() == {
        "name": "Bob",
        "odometry": {"topic": "/odom"},
        "tf": {},
        "scan": ["/scan"],
        "cameras": [{"url": "http://bob/"}],
        "twist": {"topic": "/c"},
    }
    assert RobotConfig.from_dict({"name": "Bob", "tf": False}).tf is None


def test_all_mistakes_are_reported_at_once_with_their_keys():
    wrong = {
        "nmae": "Bob",
        "odometry": {"topic": "/a b", "throtle": 5},
        "twist": {"v_max": "0.5", "stop_hooks": [{"topic": "/a"}, {}]},
        "cameras": [{"topic": "/a", "name": "Arm"}, {"topic": "/b", "name": "ARM"}],
        "modules": {"name": "Trail"},
    }
    with pytest.raises(ConfigError) as refused:
        RobotConfig.from_dict(wrong)
    errors = [
        line.removeprefix("robot '?': ") for line in str(refused.value).split("\n")
    ]
    begun = [
        'nmae: there is no key "nmae" here; did you mean "name"?',
        'odometry.topic: got the text "/a b", expected the name of a topic',
        'odometry.throtle: there is no key "throtle" here; did you mean "throttle"?',
        'twist.v_max: got the text "0.5", expected a number of metres per second',
        'twist.stop_hooks[1]: expected the key "topic" or the key "service"',
        'twist: the key "topic" is missing',
        "modules: got the table",
        'the key "name" is missing',
        'cameras[1]: a second camera is called "ARM"',
    ]
    assert len(errors) == len(begun)
    for line, start in zip(errors, begun, strict=True):
        assert line.startswith(start)


def test_the_error_for_a_too_large_number_names_the_maximum():
    with pytest.raises(ConfigError, match="from 0 on, at most 1e\\+06"):
        RobotConfig.from_dict({"name": "Bob", "twist": {"topic": "/c", "v_max": 1e9}})


def test_topics_without_a_bridge_are_refused():
    with pytest.raises(ConfigError) as refused:
        Robot.from_dict({"name": "Bob", "twist": "/cmd_vel", "scan": "/scan"})
    assert str(refused.value).split("\n") == [
        "robot 'Bob': twist: the key \"bridge\" is missing",
        "robot 'Bob': scan[0]: the key \"bridge\" is missing",
    ]


NUMBERS = st.floats(allow_nan=True) | st.integers() | st.sampled_from(["1", True])
LIMITS = ("stops_within", "v_max", "w_max")


@given(st.dictionaries(st.sampled_from(LIMITS), NUMBERS))
def test_limits_accepted_by_the_configuration_are_accepted_by_the_gate(limits):
    mistakes = Mistakes()
    twist = read(TwistConfig, {"topic": "/c", **limits}, (), mistakes)
    if mistakes.found:
        return
    robot = Robot.from_config(RobotConfig(name="Bob", bridge=URL, twist=twist))
    try:
        spec = checked(robot.motion.spec())
        assert {name: getattr(spec.base, name) for name in limits} == limits
    finally:
        robot.destroy()


@pytest.fixture
def bridges():
    return {URL: Bridge(URL)}


def modules_of(robot):
    return [(name, args[1:]) for name, args, _ in robot.module_arguments()]


def test_applying_a_configuration_changes_only_different_parts(bridges):
    old = RobotConfig(
        name="Bob",
        bridge=URL,
        scan=["/front"],
        battery="/battery",
        cameras=[CameraConfig(topic="/a", name="A")],
        twist=TwistConfig(topic="/cmd_vel"),
    )
    robot = Robot.from_config(old, bridges)
    try:
        kept = robot.modules[0]
        robot.add_module("Trail")  # as a program writes it
        new = RobotConfig(
            name="Bob",
            bridge=URL,
            scan=["/front"],
            cameras=[CameraConfig(topic="/b", name="B")],
            modules=[ModuleConfig(name="Path", args=[{"bridge": URL}, "/plan"])],
        )
        assert apply_config(robot, old, new, bridges).found == []
        assert robot.modules[0] is kept
        assert modules_of(robot) == [
            ("LaserScanner", ("/front",)),
            ("Trail", ()),
            ("Camera", ("/b", "B")),
            ("Path", ("/plan",)),
        ]
        assert robot.motion.spec() is None
    finally:
        robot.destroy()


def test_a_refused_part_does_not_block_changes_of_other_parts(bridges):
    old = RobotConfig(name="Bob", bridge=URL)
    robot = Robot.from_config(old, bridges)
    try:
        new = RobotConfig.from_dict({**old.to_dict(), "battery": "/b", "tf": True})
        broken = new.with_part("twist", TwistConfig(topic="/a b"))
        mistakes = apply_config(robot, old, broken, bridges)
        ((way, words),) = mistakes.found
        assert (way, words.partition(":")[0]) == (
            ("twist",),
            "'/a b' is not the name of a topic",
        )
        assert robot.tf is not None
        assert modules_of(robot) == [("Battery", ("/b",))]
    finally:
        robot.destroy()


def test_a_picture_without_the_console_is_refused():
    picture = {"file": "bob.png", "width": 1, "height": 1}
    with pytest.raises(ConfigError, match="picture: only the console shows a picture"):
        Robot.from_dict({"name": "Bob", "picture": picture})
