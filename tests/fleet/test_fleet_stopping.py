"""Stop hooks and scan assist in a fleet file."""

import math

import pytest

from webmap.base.errors import ConfigError
from webmap.config.motion import StopHook
from webmap.fleet.fleet_file import prepare

HEAD = """[bridges]
hall = "ws://hall:9090"
[[robots]]
name = "Bob"
"""
DRIVEN = HEAD + 'twist = "/cmd_vel"\n'


def check(tmp_path, text):
    file = tmp_path / "fleet.toml"
    file.write_text(text)
    return prepare(file)


def spec(ready):
    (robot,) = ready.robots
    found = robot.motion.spec()
    robot.destroy()
    return found


def test_stop_hooks_of_the_fleet_file_reach_the_gate(tmp_path):
    ready = check(
        tmp_path,
        HEAD
        + 'twist = { topic = "/cmd_vel", stop_hooks = [{ topic = "lock" }, '
        + '{ service = "/e_stop", type = "std_srvs/srv/Trigger" }] }\n',
    )
    assert spec(ready).base.stop_hooks == [
        StopHook(topic="/lock", type="std_msgs/Bool"),
        StopHook(service="/e_stop", type="std_srvs/srv/Trigger"),
    ]


def test_scan_assist_settings_of_the_fleet_file_reach_the_gate(tmp_path):
    ready = check(
        tmp_path,
        DRIVEN
        + '[robots.scan_assist]\ntopic = "/scan"\n'
        + "footprint = [[0.3, 0.2], [-0.3, 0], [0.3, -0.2]]\n"
        + 'x = 0.25\nangle = 180\nupside_down = true\nframe = "l"\n'
        + 'blind = "creep"\ncreep = 0\n',
    )
    assist = spec(ready).scan_assist
    assert assist.topic == "/scan"
    assert assist.corners == ((0.3, 0.2), (-0.3, 0.0), (0.3, -0.2))
    assert assist.sensor == pytest.approx((0.25, 0.0, math.pi))
    assert (assist.blind, assist.creep) == ("creep", 0.0)
    assert assist.upside_down
    assert assist.frame == "l"


def test_a_footprint_may_be_a_radius(tmp_path):
    text = 'scan_assist = { topic = "/scan", footprint = 0.2 }\n'
    corners = spec(check(tmp_path, DRIVEN + text)).scan_assist.corners
    assert len(corners) > 3


@pytest.mark.parametrize(
    ("hooks", "expected"),
    [
        ('"/lock"', r"stop_hooks: got the text \"/lock\", expected an array such as"),
        ("[5]", r"stop_hooks\[0\]: got the whole number 5, expected a table such as"),
        ("[{}]", r'stop_hooks\[0\]: expected the key "topic" or the key "service"'),
        ('[{ topic = "/a", service = "/b" }]', r"stop_hooks\[0\]: expected the key"),
        ('[{ topic = "/a" }, { topic = 5 }]', r"stop_hooks\[1\]\.topic: got the whole"),
        ('[{ topic = "/a", type = "std_msgs/String" }]', r"expected .* std_msgs/Bool"),
        ('[{ service = "/a", typ = "x" }]', r'no key "typ" here; did you mean "type"'),
        (
            '[{ topic = "/cmd_vel" }]',
            r"stop_hooks\[0\]: /cmd_vel is the velocity ",
        ),
    ],
)
def test_an_invalid_stop_hook_is_reported_with_its_line(tmp_path, hooks, expected):
    twist = f'[robots.twist]\ntopic = "/cmd_vel"\nstop_hooks = {hooks}\n'
    with pytest.raises(ConfigError, match=expected) as caught:
        check(tmp_path, HEAD + twist)
    assert "fleet.toml:7: robots[0].twist" in str(caught.value) or (
        "fleet.toml:5: robots[0].twist: " in str(caught.value)
    )


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ('footprint = "round"', r"footprint: got the text .*radius in metres"),
        ("footprint = 0", "footprint: got the whole number 0, expected the robot's"),
        ("footprint = [[0, 1], [1, 0]]", "3 corners of its outline or more"),
        ("footprint = [[0, 1], [1, 0], [1]]", "3 corners"),
        ("footprint = [[0, 1], [1, 0], [1, true]]", "3 corners"),
        ("footprint = nan", "radius in metres"),
        ("x = inf", "x: got the number inf, expected a number of metres"),
        ('angle = "left"', "expected a number of degrees"),
        ("upside_down = 1", "expected true or false"),
        ("stop_distance = -1", "expected a number of metres from 0 on"),
        ("creep = true", "expected a number of metres per second from 0 on"),
        ("brake = 0", "expected a number of metres per second squared above 0"),
        ('blind = "go"', 'expected "stop" or "creep"'),
        ("foot = 1", 'there is no key "foot" here; did you mean "footprint"'),
    ],
)
def test_an_invalid_scan_assist_setting_is_reported_with_its_line(
    tmp_path, line, expected
):
    text = f'{DRIVEN}[robots.scan_assist]\ntopic = "/scan"\n{line}\n'
    if not line.startswith("footprint"):
        text += "footprint = 0.2\n"
    with pytest.raises(ConfigError, match=expected) as caught:
        check(tmp_path, text)
    assert "fleet.toml:8: robots[0].scan_assist." in str(caught.value)


@pytest.mark.parametrize(
    ("footprint", "expected"),
    [
        ("[[0.3, 0.2], [-0.3, -0.2], [0.3, -0.2], [-0.3, 0.2]]", "corner 1 meets the"),
        ("[[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, 0.2]]", "corners 1 and 4 are"),
        ("[[0.3, 0], [0.1, 0], [-0.3, 0]]", "meets the edge"),
        ("[[1e-3, 0], [0, 1e-3], [-1e-3, 0]]", "has an area of 1e-06 m²; expected"),
    ],
)
def test_a_footprint_with_an_invalid_outline_is_refused(tmp_path, footprint, expected):
    text = f'{DRIVEN}scan_assist = {{ topic = "/scan", footprint = {footprint} }}\n'
    with pytest.raises(ConfigError, match=expected) as caught:
        check(tmp_path, text)
    assert "robots[0].scan_assist.footprint: " in str(caught.value)


def test_scan_assist_needs_a_topic_a_footprint_and_a_velocity_topic(tmp_path):
    with pytest.raises(ConfigError) as caught:
        check(tmp_path, HEAD + "scan_assist = {}\n")
    for missing in ("twist", "topic", "footprint"):
        assert f'the key "{missing}" is missing' in str(caught.value)
