"""The log lines of the nodes of a robot."""

import pytest
from module_fakes import header

from webmap.base.scope import Scope
from webmap.scene import html

ROS1 = {"debug": 1, "info": 2, "warn": 4, "error": 8, "fatal": 16}
ROS2 = {"debug": 10, "info": 20, "warn": 30, "error": 40, "fatal": 50}


def log(level, text, name="/planner", *, ros2=False) -> dict:
    known = {"name": name, "msg": text, "file": "a.cpp", "function": "f", "line": 7}
    if ros2:
        stamp = {"sec": 3, "nanosec": 500_000_000}
        return {"stamp": stamp, "level": ROS2.get(level, level), **known}
    return {
        "header": header(""),
        "level": ROS1.get(level, level),
        "topics": [],
        **known,
    }


@pytest.mark.parametrize("ros2", [False, True])
def test_ros_1_and_ros_2_log_levels_map_to_the_same_names(link, robot, ros2):
    module = robot.add_module("Rosout", link, level="debug")
    for level in ROS1:
        link.publish("/rosout", log(level, f"it is {level}", ros2=ros2))
    assert [line.level for line in module.lines] == list(ROS1)
    assert module.lines[0].text == "it is debug"
    assert module.lines[0].stamp == pytest.approx(3.5 if ros2 else 3, abs=1e-6)
    assert link.types["/rosout"] is None, "the bridge finds the type of its dialect"


@pytest.mark.parametrize(
    ("level", "name"), [(0, "debug"), (35, "warn"), (255, "fatal"), (-5, "debug")]
)
def test_an_unknown_log_level_is_replaced_by_a_known_one(link, robot, level, name):
    module = robot.add_module("Rosout", link, level="debug")
    link.publish("/rosout", log(level, "x", ros2=True))
    assert [line.level for line in module.lines] == [name]


def test_log_lines_are_filtered_by_level_and_node_prefix(link, robot):
    module = robot.add_module("Rosout", link, level="error", prefix="/bob/")
    link.publish("/rosout", log("warn", "slow", "/bob/planner"))
    link.publish("/rosout", log("error", "stuck", "/eve/planner"))
    link.publish("/rosout", log("error", "stuck", "/bob/planner"))
    link.publish("/rosout", log("fatal", "gone", "bob/driver"))
    assert [line.text for line in module.lines] == ["stuck", "gone"]


def test_a_page_shows_the_newest_lines_as_text_until_it_closes(link, robot):
    module = robot.add_module("Rosout", link, lines=3)
    link.publish("/rosout", log("warn", "before"))
    rows, page = html.ol(html.li("old")), Scope("page")
    with page.active():
        module.show_in(rows)
    for number in range(3):
        link.publish("/rosout", log("error", f"<b>{number}</b>", "/a"))
    assert [row.text for row in rows.children] == [
        "/a<b>0</b>",
        "/a<b>1</b>",
        "/a<b>2</b>",
    ]
    assert str(rows.children[0].classes) == "error"
    assert len(module.lines) == 3
    page.close()
    link.publish("/rosout", log("error", "after"))
    assert len(rows.children) == 3


def test_a_long_line_is_truncated_and_passed_to_other_modules(link, robot):
    received = []

    class Listener:
        def __init__(self, robot) -> None:
            pass

        def on_rosout(self, line):
            received.append(len(line.text))

    robot.add_module(Listener)
    robot.add_module("Rosout", link)
    link.publish("/rosout", log("error", "x" * 1_000_000))
    assert received == [2000]


@pytest.mark.parametrize("options", [{"level": "loud"}, {"lines": 0}])
def test_invalid_options_are_refused(link, robot, options):
    with pytest.raises(ValueError, match="got"):
        robot.add_module("Rosout", link, **options)
    assert link.listeners == {}
