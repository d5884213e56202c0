"""Buttons in a fleet file are read strictly; each mistake is reported with its line."""

import pytest

from webmap.base.errors import ConfigError
from webmap.fleet.fleet_file import prepare

HEAD = """\
[bridges]
hall = "ws://hall:9090"

[[robots]]
name = "Bob"
twist = "/bob/wheels"

[[robots.buttons]]
label = "Dock"
service = "/bob/dock"
type = "std_srvs/Trigger"
confirm = "Is the dock free?"
timeout = 60
"""


def prepared(tmp_path, text):
    file = tmp_path / "fleet.toml"
    file.write_text(HEAD + text)
    return prepare(file)


def test_a_robot_gets_its_buttons_from_the_fleet_file(tmp_path):
    more = """
[[robots.buttons]]
label = "Slow"
node = "/bob/controller"
parameter = "max_vel"
value = 0.2
"""
    (robot,) = prepared(tmp_path, more).robots
    try:
        (module,) = [each for each in robot.modules if hasattr(each, "buttons")]
        dock, slow = (button.spec for button in module.buttons)
        assert (dock.name, dock.confirm, dock.timeout) == (
            "/bob/dock",
            "Is the dock free?",
            60.0,
        )
        assert (slow.kind, slow.node, slow.value) == (
            "parameter",
            "/bob/controller",
            0.2,
        )
    finally:
        robot.destroy()


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (
            'label = "Go"\ntopic = "/go"\ntype = "geometry_msgs/Twist"',
            "fleet.toml:17: robots[0].buttons[1].topic: /go of type geometry_msgs/Twist"
            " carries a velocity, which only the gate sends, by driving, by a goal or "
            "by STOP: remove this button",
        ),
        (
            'label = "Go"\nservice = "/go"\nconfrim = true',
            'fleet.toml:18: robots[0].buttons[1].confrim: there is no key "confrim" ',
        ),
        (
            'label = "H"\ntopic = "/h"\ntype = "std_msgs/UInt8"\nmessage.data = 256',
            "fleet.toml:19: robots[0].buttons[1].message.data: got 256, expected a"
            " whole number from 0 to 255",
        ),
        (
            'label = "Dock"\nservice = "/again"',
            "fleet.toml:16: robots[0].buttons[1].label: got \"Dock\", expected a label",
        ),
        (
            'label = "Go"\ntopic = "bob//wheels"\ntype = "std_msgs/Bool"',
            "fleet.toml:8: robots[0].buttons: button 'Go': /bob/wheels carries a",
        ),
    ],
)  # fmt: skip
def test_an_invalid_button_is_reported_with_its_line(tmp_path, line, expected):
    with pytest.raises(ConfigError) as error:
        prepared(tmp_path, f"\n[[robots.buttons]]\n{line}\n")
    assert expected in str(error.value)


def test_buttons_that_are_not_tables_are_refused(tmp_path):
    file = tmp_path / "fleet.toml"
    text = HEAD.partition("[[robots.buttons]]")[0]
    file.write_text(f"{text}buttons = 3\n")
    with pytest.raises(ConfigError, match=r"expected a table \[\[robots.buttons\]\]"):
        prepare(file)
