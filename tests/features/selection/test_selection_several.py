"""Several robots that a page selects at once."""

from pathlib import Path

import pytest

import webmap
from webmap import Robot
from webmap.features.selection.several_robots import MOST, SeveralRobots

PACKAGE = Path(webmap.__file__).parent


@pytest.fixture
def robots(map):
    robots = [Robot(f"Robot {number}") for number in range(4)]
    for robot in robots:
        map.add_robot(robot)
    yield robots
    for robot in robots:
        robot.destroy()


@pytest.fixture
def aimed():
    return []


@pytest.fixture
def several(map, aimed):
    several = map.add_module(SeveralRobots, lambda: aimed.append(True))
    several.sent = []
    several.browser_part.send = several.sent.append
    return several


def test_the_script_and_the_style_of_the_module_exist():
    for suffix in ("js", "css"):
        file = f"features/selection/several_robots.{suffix}"
        assert (PACKAGE / file).is_file()


def test_robots_are_selected_in_addition_to_the_selected_robot(map, robots, several):
    map.set_selected(robots[3])
    several.on_message({"mark": [robots[1].id, robots[0].id, robots[3].id]})
    assert map.selected is robots[3]
    assert map.marked == robots[:2]
    assert several.sent == [{"problem": ""}]


def test_the_first_robot_is_selected_if_none_was(map, robots, several):
    several.on_message({"mark": [robots[2].id, robots[1].id]})
    assert map.selected is robots[1]
    assert map.marked == [robots[2]]


def test_clear_leaves_the_selected_robot(map, robots, several):
    several.on_message({"mark": [robot.id for robot in robots]})
    several.on_message({"clear": True})
    assert map.selected is robots[0]
    assert map.marked == []


def test_the_page_can_aim_a_goal_for_the_selected_robots(several, aimed):
    several.on_message({"aim": True})
    assert aimed == [True]


def test_more_robots_than_the_limit_are_left_out_with_the_reason(map, several):
    robots = [Robot(f"R{number}") for number in range(MOST + 3)]
    for robot in robots:
        map.add_robot(robot)
    several.on_message({"mark": [robot.id for robot in robots]})
    assert len(map.marked) == MOST - 1
    assert several.sent == [{"problem": f"At most {MOST} robots: 3 not selected."}]
    several.on_message({"mark": [robot.id for robot in robots]})
    assert len(map.marked) == MOST - 1
    for robot in robots:
        robot.destroy()


@pytest.mark.parametrize(
    "message",
    [
        {},
        {"mark": None},
        {"mark": "r1"},
        {"mark": {"r1": 1}},
        {"mark": [1, None, ["r1"], {}, "r999"]},
        {"clear": 1},
        {"aim": "yes"},
    ],
)
def test_an_invalid_message_changes_nothing(map, robots, several, aimed, message):
    several.on_message(message)
    assert map.selected is None
    assert map.marked == []
    assert aimed == []
