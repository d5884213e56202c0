"""The diagnostics of the parts of a robot."""

import base64

import pytest
from module_fakes import header

from webmap import Robot
from webmap.base.errors import ConfigError
from webmap.base.scope import Scope
from webmap.features.layers import diagnostics as room
from webmap.scene import html


def status(name, level, message="", **values) -> dict:
    return {
        "name": name,
        "level": level,
        "message": message,
        "hardware_id": "rosbot",
        "values": [{"key": key, "value": value} for key, value in values.items()],
    }


def array(*parts, ros2=False) -> dict:
    return {"header": header("", ros2=ros2), "status": list(parts)}


@pytest.fixture
def module(robot, link):
    return robot.add_module("Diagnostics", link)


def levels(module) -> dict[str, str]:
    return {part.name: part.level for part in module.parts}


@pytest.mark.parametrize("ros2", [False, True])
def test_parts_are_kept_by_name_with_the_worst_level_first(link, module, ros2):
    assert module.level is None
    link.publish(
        "/diagnostics", array(status("motors", 0), status("lidar", 1), ros2=ros2)
    )
    link.publish("/diagnostics", array(status("battery", 2, "low", volts="21.5")))
    assert [part.name for part in module.parts] == ["battery", "lidar", "motors"]
    assert module.level == "error"
    assert module.parts[0].values == {"volts": "21.5"}
    assert set(module.svg.classes) == {"diagnostics", "error"}
    assert module.svg.text == "battery: low"
    link.publish("/diagnostics", array(status("battery", 0)))
    assert module.level == "warn"


@pytest.mark.parametrize(
    "write", [chr, lambda n: base64.b64encode(bytes([n])).decode()]
)
def test_a_level_may_be_a_character_or_base64(link, module, write):
    parts = [status(name, write(level)) for level, name in enumerate("abcd")]
    link.publish("/diagnostics", array(*parts))
    assert levels(module) == {"a": "ok", "b": "warn", "c": "error", "d": "stale"}


@pytest.mark.parametrize("level", [4, -1, 48, "0", "error", "AAA=", ""])
def test_an_unknown_level_is_a_problem_and_the_other_parts_are_kept(
    link, module, robot, level
):
    link.publish("/diagnostics", array(status("one", 1)))
    link.publish("/diagnostics", array(status("one", level), status("two", 0)))
    assert levels(module) == {"one": "warn", "two": "ok"}
    (problem,) = robot.problems.values()
    assert problem == f"/diagnostics: 'one': a level is 0 to 3, got {level!r}"
    link.publish("/diagnostics", array(status("one", 0)))
    assert robot.problems == {}


def test_a_part_without_new_data_is_stale(link, module, monkeypatch):
    now = room.time.monotonic()
    monkeypatch.setattr(room.time, "monotonic", lambda: now)
    link.publish("/diagnostics", array(status("one", 0), status("two", 0)))
    monkeypatch.setattr(room.time, "monotonic", lambda: now + 12)
    link.publish("/diagnostics", array(status("two", 0)))
    assert levels(module) == {"one": "stale", "two": "ok"}
    assert module.parts[0].message == "no data for 12 s"


def test_a_prefix_selects_the_parts_of_the_robot(link, robot):
    module = robot.add_module("Diagnostics", link, prefix="bob: ")
    link.publish("/diagnostics", array(status("bob: arm", 0), status("eve: arm", 2)))
    assert levels(module) == {"bob: arm": "ok"}


@pytest.mark.parametrize("given", ["robot_0/", "/robot_0/"])
@pytest.mark.parametrize("name", ["robot_0/base: Motors", "/robot_0/base: Motors"])
def test_a_leading_slash_in_a_prefix_or_name_is_ignored(link, robot, given, name):
    module = robot.add_module("Diagnostics", link, prefix=given)
    link.publish("/diagnostics", array(status(name, 2), status("/robot_01/arm: a", 1)))
    assert levels(module) == {name: "error"}


@pytest.mark.parametrize("name", ["base: Motors", "/Power/base", "a/base: Motors"])
def test_the_only_robot_of_a_topic_has_all_parts_with_any_name(link, robot, name):
    module = robot.add_module("Diagnostics", link, namespace="/robot_0")
    link.publish("/diagnostics", array(status(name, 0)))
    assert (levels(module), module.level) == ({name: "ok"}, "ok")
    assert set(module.svg.classes) == {"diagnostics", "ok"}


@pytest.fixture
def two(link):
    """The diagnostics of two robots that share a topic."""
    robots = [Robot("A"), Robot("B")]
    yield [
        robot.add_module("Diagnostics", link, namespace=space)
        for robot, space in zip(robots, ["/a", "/b"], strict=True)
    ]
    for robot in robots:
        robot.destroy()


def test_robots_that_share_a_topic_have_the_parts_of_their_namespace(link, two):
    names = ["a/base: Motors", "/b/laser: Frequency", "/a/Power/battery"]
    link.publish("/diagnostics", array(*(status(name, 0) for name in names)))
    assert [set(levels(module)) for module in two] == [
        {"a/base: Motors", "/a/Power/battery"},
        {"/b/laser: Frequency"},
    ]
    assert [module.level for module in two] == ["ok", "ok"]


def test_an_error_of_a_part_without_a_namespace_is_shown_on_every_robot(link, two):
    link.publish("/diagnostics", array(status("a/base: Motors", 0)))
    link.publish("/diagnostics", array(status("base: Motors", 2, "hot")))
    assert [module.level for module in two] == ["error", "error"]
    assert [module.svg.text for module in two] == ["base: Motors: hot"] * 2
    assert [part.shared for part in two[0].parts] == [True, False]


def test_an_ok_part_without_a_namespace_does_not_count_for_a_robot(link, two):
    link.publish("/diagnostics", array(status("b/x: y", 0), status("base: Motors", 0)))
    a, b = two
    assert (a.level, b.level) == (None, "ok")
    assert set(a.svg.classes) == {"diagnostics", "unheard"}
    assert a.svg.text == "no diagnostics of this robot received"


def test_a_robot_without_matching_parts_has_no_level(link, robot):
    module = robot.add_module("Diagnostics", link, prefix="robot_0/")
    assert set(module.svg.classes) == {"diagnostics", "unheard"}
    link.publish("/diagnostics", array(status("base: Motors", 0)))
    assert module.level is None
    assert set(module.svg.classes) == {"diagnostics", "unheard"}


def test_a_second_robot_removes_its_parts_from_the_first_robot(link, robot):
    first = robot.add_module("Diagnostics", link, namespace="/a")
    link.publish(
        "/diagnostics", array(status("b/base: Motors", 2), status("base: x", 0))
    )
    assert first.level == "error"
    later = Robot("B")
    later.add_module("Diagnostics", link, namespace="/b")
    assert (levels(first), first.level) == ({"base: x": "ok"}, None)
    later.destroy()
    assert first.level == "error", "the robot is the only one again"


def test_an_ok_part_does_not_hide_an_error_part_with_the_same_name(
    link, two, monkeypatch
):
    now = room.time.monotonic()
    link.publish("/diagnostics", array(status("base: Motors", 2, "hot")))
    link.publish("/diagnostics", array(status("base: Motors", 0)))
    assert two[0].level == "error"
    monkeypatch.setattr(room.time, "monotonic", lambda: now + 12)
    link.publish("/diagnostics", array(status("base: Motors", 0)))
    assert two[0].level is None, "no message reports the error any more"


def test_parts_with_one_name_on_different_hardware_give_the_worse_level(link, module):
    bad, good = status("motor: Driver", 2), status("motor: Driver", 0)
    link.publish("/diagnostics", array({**bad, "hardware_id": "left"}))
    link.publish("/diagnostics", array({**good, "hardware_id": "right"}))
    assert module.level == "error"
    link.publish("/diagnostics", array({**good, "hardware_id": "left"}))
    assert module.level == "ok"


def test_a_namespace_together_with_a_prefix_is_refused(link, robot):
    with pytest.raises(ConfigError, match="or a prefix, not both, got '/a' and 'b/'"):
        robot.add_module("Diagnostics", link, namespace="/a", prefix="b/")


def test_a_page_lists_each_part_in_a_row_until_the_page_closes(link, module):
    rows, page = html.ul(), Scope("page")
    with page.active():
        module.show_in(rows)
    link.publish("/diagnostics", array(status("a", 0, "<b>fine</b>"), status("b", 2)))
    first, second = rows.children
    assert (str(first.classes), str(second.classes)) == ("error", "ok")
    assert second.text == "a<b>fine</b>"
    link.publish("/diagnostics", array(status("b", 2)))
    assert rows.children == (first, second), "unchanged rows are kept"
    page.close()
    link.publish("/diagnostics", array(status("c", 2)))
    assert len(rows.children) == 2


def test_the_number_of_parts_is_limited(link, module, robot, monkeypatch):
    monkeypatch.setattr(room, "MAX_PARTS", 3)
    link.publish("/diagnostics", array(*(status(f"p{i}", 0) for i in range(5))))
    assert len(module.parts) == 3
    assert "the limit is 3 parts" in next(iter(robot.problems.values()))


def test_an_update_triggers_other_modules_and_removal_removes_the_badge(
    link, robot, module
):
    received = []

    class Listener:
        def __init__(self, robot) -> None:
            pass

        def on_diagnostics_update(self, diagnostics):
            received.append(diagnostics.level)

    robot.add_module(Listener)
    link.publish("/diagnostics", array(status("a", 1)))
    assert received == ["warn"]
    robot.remove_module(module)
    assert module.svg.parent is None
    assert link.listeners == {}


def test_a_hold_time_of_zero_is_refused(link, robot):
    with pytest.raises(ValueError, match="hold must be seconds above 0, got 0"):
        robot.add_module("Diagnostics", link, hold=0)


def test_long_texts_of_diagnostics_are_truncated(link, module):
    long = "x" * 100_000
    part = {**status(long, 2, long), "hardware_id": long}
    part["values"] = [{"key": f"{i}{long}", "value": long} for i in range(200)]
    link.publish("/diagnostics", array(part))
    (kept,) = module.parts
    assert (len(kept.name), len(kept.message), len(kept.hardware_id)) == (
        256,
        1000,
        256,
    )
    assert len(kept.values) == 100
    assert all(len(k) == 256 and len(v) == 1000 for k, v in kept.values.items())
