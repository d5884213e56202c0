"""Data for lists of robots: tags, the battery, and a failed goal."""

import asyncio
from types import SimpleNamespace

import pytest

from webmap import Robot, RobotConfig
from webmap.base.errors import ConfigError
from webmap.core.robot import apply_config
from webmap.core.robot_state import EVERY


@pytest.fixture
def robot():
    robot = Robot("Bob")
    yield robot
    robot.destroy()


def test_tags_and_the_limit_of_the_battery_are_set_in_python_and_in_plain_data(robot):
    robot.set_tags(["bay 3", "new"])
    robot.set_battery_low(0.3)
    data = robot.to_dict()
    assert (data["tags"], data["battery_low"]) == (["bay 3", "new"], 0.3)
    other = Robot.from_dict({"name": "Ann", "tags": "bay 3", "battery_low": 1})
    assert (other.tags, other.battery_low) == (("bay 3",), 1.0)
    other.destroy()


def test_a_new_configuration_changes_tags_and_the_limit_of_the_battery(robot):
    old = RobotConfig(name="Bob")
    new = RobotConfig(name="Bob", tags=["bay 3"], battery_low=0.5)
    assert apply_config(robot, old, new).count == 0
    assert (robot.tags, robot.battery_low) == (("bay 3",), 0.5)
    apply_config(robot, new, old)
    assert (robot.tags, robot.battery_low) == ((), 0.2)


@pytest.mark.parametrize("tags", [[""], ["two\nlines"], ["x" * 101], [3], 3])
def test_a_tag_that_is_no_short_line_is_refused(robot, tags):
    with pytest.raises(ConfigError, match="robot 'Bob': tags"):
        robot.set_tags(tags)
    assert robot.tags == ()


@pytest.mark.parametrize("charge", [-0.1, 20, float("nan"), "0.2", None])
def test_a_limit_of_the_battery_that_is_no_charge_is_refused(robot, charge):
    with pytest.raises(ConfigError, match="expected a charge from 0 to 1"):
        robot.set_battery_low(charge)
    assert robot.battery_low == 0.2


def test_the_charge_of_a_robot_is_that_of_its_emptiest_battery(robot):
    assert robot.charge is None
    for charge in (0.5, None, 0.15, "full"):
        robot.add_module(lambda owner, charge=charge: SimpleNamespace(charge=charge))
    assert robot.charge == 0.15
    assert robot.state.name == "battery_low"


def report(state="free", goal=None, id="g1"):
    goal = None if goal is None else SimpleNamespace(id=id, state=goal)
    return SimpleNamespace(
        state=state,
        doing=state,
        goal=goal,
        holder=None,
        measured=None,
        alarm=None,
        link="up",
        other_writer=None,
    )


def test_a_failed_goal_is_shown_until_someone_drives_the_robot_or_sends_another(robot):
    def after(*reports):
        for each in reports:
            robot._note_failure(each)
        return robot.goal_failed

    assert not after(report(goal="under way"))
    assert after(report(goal="failed"))
    assert after(report("held", "failed"))
    assert not after(report("driving", "failed"))
    assert not after(report("free", "failed")), "driving clears the failed goal"
    assert after(report("free", "failed", "g2"))
    assert not after(report("stopped", "failed", "g2"))
    assert after(report("free", "failed", "g3"))
    assert not after(report("free", "under way", "g4"))


def test_modules_are_notified_of_a_changed_state_once(robot):
    found = []
    module = SimpleNamespace(on_state=lambda state: found.append(state.name))
    robot.add_module(lambda owner: module)
    robot.report = report(goal="failed")
    robot.goal_failed = True
    robot._show_state()
    robot._show_state()
    assert found == ["goal_failed"]


def test_the_shown_state_is_updated_regularly_also_after_another_start(robot):
    async def scenario(failed):
        robot._look_regularly()
        robot.goal_failed = failed
        await asyncio.sleep(2 * EVERY)
        return robot.shown_state.name

    assert asyncio.run(scenario(True)) == "goal_failed"
    assert asyncio.run(scenario(False)) == "watched"
