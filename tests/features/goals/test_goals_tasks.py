"""The display's part of the tools for goals and initial poses."""

import asyncio
import math
from types import SimpleNamespace

import pytest
from module_fakes import Channel

from equipment.waiting import until
from webmap import Bridge, Map, Robot
from webmap.console.card_parts import GOALS, GoalLine, figures
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.gate.protocol import GoalReport


def goal(state="under way", **fields):
    about = {"id": "g", "x": 1.0, "y": 2.0, "yaw": 0.0, "by": "c1", "method": "topic"}
    return GoalReport(state=state, **{**about, **fields})


class GoalListener:
    def __init__(self, map):
        self.received = []

    def on_pose_told(self, *seen):
        self.received.append(seen)

    def on_mark(self):
        self.received.append("mark")


class TestGoalMark:
    @pytest.fixture
    def robots(self, map):
        robots = [Robot(name) for name in ("Ann", "Bob", "Cid")]
        for robot in robots:
            map.add_robot(robot)
        yield robots
        for robot in robots:
            robot.destroy()

    def test_robots_are_marked_in_addition_to_the_selected_robot(self, map, robots):
        ann, bob, cid = robots
        listener = map.add_module(GoalListener)
        map.toggle_marked(ann)
        assert map.selected is ann, "the first robot is selected"
        map.toggle_marked(bob)
        map.set_marked(cid, True)
        assert map.marked == [bob, cid]
        assert map.selected is ann, "a driven robot stays selected"
        map.toggle_marked(bob)
        assert map.marked == [cid]
        assert listener.received == ["mark"] * 3

    def test_the_selected_robot_cannot_be_marked(self, map, robots):
        map.set_selected(robots[0])
        map.toggle_marked(robots[0])
        assert map.marked == []

    def test_selecting_a_robot_or_none_clears_all_marks(self, map, robots):
        ann, bob, cid = robots
        for robot in robots:
            map.toggle_marked(robot)
        map.set_selected(bob)
        assert (map.selected, map.marked) == (bob, [])
        map.toggle_marked(cid)
        map.set_selected(bob)
        assert map.marked == []
        map.toggle_marked(ann)
        map.set_selected(None)
        assert map.marked == []

    def test_a_removed_robot_is_no_longer_marked(self, map, robots):
        for robot in robots[:2]:
            map.toggle_marked(robot)
        map.remove_robot(robots[1])
        assert map.marked == []
        with pytest.raises(ValueError, match="not on this map"):
            map.set_marked(robots[1], True)

    def test_a_mark_command_of_the_page_marks_the_robot(self, map, robots):
        tool = map.add_module("GoalTool", spacing=2)
        map.set_selected(robots[0])
        tool.on_message({"mark": robots[1].id})
        tool.on_message({"mark": "r999999"})
        assert map.marked == [robots[1]]


class Cells:
    """A module that has one cell everywhere."""

    def __init__(self, map, cell):
        self.layer = SimpleNamespace(cell_at=lambda x, y: cell)


class TestGround:
    @pytest.mark.parametrize(
        ("cells", "word"),
        [
            ([], None),
            ([None], None),
            ([-1], "unknown"),
            ([24], "free"),
            ([25], "unknown"),
            ([64], "unknown"),
            ([65], "wall"),
            ([-1, 0, None], "free"),
            ([0, 100, -1], "wall"),
        ],
    )
    def test_the_page_gets_what_the_maps_have_at_a_place(self, map, cells, word):
        tool = map.add_module("GoalTool")
        sent = []
        tool.browser_part.send = sent.append
        for cell in cells:
            map.add_module(Cells, cell)
        tool.on_message({"ground": {"x": 1, "y": 2.5}})
        assert sent == [{"ground": {"x": 1, "y": 2.5, "word": word}}]

    @pytest.mark.parametrize(
        "place", [None, {}, [1, 2], {"x": 1}, {"x": "1", "y": 2}, {"x": 1, "y": 1e999}]
    )
    def test_an_invalid_place_has_no_answer(self, map, place):
        tool = map.add_module("GoalTool")
        sent = []
        tool.browser_part.send = sent.append
        tool.on_message({"ground": place})
        assert sent == []


@pytest.mark.parametrize("spacing", [0.1, 21, float("nan")])
def test_an_invalid_spacing_is_refused(map, spacing):
    with pytest.raises(ValueError, match=r"0\.3 to 20 m"):
        map.add_module("GoalTool", spacing=spacing)


class TestInitialPose:
    def test_only_a_valid_pose_of_the_page_triggers_on_pose_told(self, map, robot):
        map.add_robot(robot)
        tool, listener = map.add_module("InitialPoseTool"), map.add_module(GoalListener)
        tool.on_message({"pose": {"robot": robot.id, "x": 1, "y": 2.0, "yaw": 0.5}})
        for broken in (
            {"pose": {"robot": robot.id, "x": 1, "y": 2}},
            {"pose": {"robot": "r999", "x": 1, "y": 2, "yaw": 0}},
            {"pose": {"robot": robot.id, "x": 10**400, "y": 2, "yaw": 0}},
            {"pose": {"robot": robot.id, "x": 1, "y": math.nan, "yaw": 0}},
            {"told": None},
            {},
        ):
            tool.on_message(broken)
        assert listener.received == [(robot, 1, 2.0, 0.5)]
        tool.aim()

    def test_the_page_gets_the_covariance_of_the_initial_pose(
        self, map, robot, monkeypatch
    ):
        map.add_robot(robot)
        tool, sent_messages = map.add_module("InitialPoseTool"), []
        bridge = Bridge("ws://127.0.0.1:9")
        monkeypatch.setattr(tool.browser_part, "send", sent_messages.append)
        tool.on_message({"covariance": robot.id})
        robot.set_initial_pose_topic(bridge, "/initialpose", covariance=(1, 4, 0.25))
        robot.set_alignment(3, 0, 90)
        tool.on_message({"covariance": robot.id})
        tool.on_message({"covariance": "r999"})
        tool.on_message({"covariance": None})
        assert sent_messages.pop(1)["covariance"] == {
            "robot": robot.id,
            "x": 1,
            "y": 4,
            "yaw": 0.25,
            "turn": pytest.approx(math.pi / 2),
        }
        assert sent_messages == [{"covariance": None}] * 3

    def test_a_key_is_one_character(self, map):
        with pytest.raises(ValueError, match="one character"):
            map.add_module("InitialPoseTool", key="in")


class TestRoutes:
    @pytest.fixture
    def ask(self, tmp_path, monkeypatch):
        monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))

        def ask_(*messages, role="operator"):
            async def scenario():
                channel, viewer = Channel(), Viewer("v1", "Ann", role)
                entry = PageEntry("/", lambda page: None, None, tmp_path, "test")
                page = Page(entry, channel, viewer, None, {})
                tool = Map(page.element("map"), 700, 500).add_module("RouteTool")
                sent = []
                monkeypatch.setattr(tool.browser_part, "send", sent.append)
                for number, message in enumerate(messages):
                    tool.on_message(message)
                    await until(lambda n=number: len(sent) > n)
                page.close()
                return sent

            return asyncio.run(scenario())

        return ask_

    ROUTE = {"points": [{"x": 1.0, "y": 2.0, "yaw": 0.5}], "loop": True}

    def test_a_route_is_saved_loaded_and_deleted(self, ask):
        named = {"name": "Round"}
        saved, loaded, deleted, gone = ask(
            {"op": "save", **named, "route": self.ROUTE},
            {"op": "load", **named},
            {"op": "delete", **named},
            {"op": "load", **named},
        )
        assert saved == {"saved": "Round", "routes": ["Round"]}
        assert loaded["loaded"] == {"name": "Round", **self.ROUTE}
        assert deleted == {"routes": []}
        assert gone == {"problem": "there is no route 'Round'"}

    def test_a_viewer_may_load_routes_but_not_change_them(self, ask):
        ask({"op": "save", "name": "Round", "route": self.ROUTE})
        answers = ask(
            {"op": "load", "name": "Round"},
            {"op": "save", "name": "Round", "route": self.ROUTE},
            {"op": "delete", "name": "Round"},
            role="viewer",
        )
        assert "loaded" in answers[0]
        assert all("Only operators" in answer["problem"] for answer in answers[1:])

    def test_an_invalid_route_command_gets_a_problem_and_changes_nothing(self, ask):
        answers = ask(
            {"op": "save", "name": "", "route": self.ROUTE},
            {"op": "save", "name": "x", "route": {"points": []}},
            {"op": "load", "name": 7},
        )
        assert all("problem" in answer for answer in answers)
        assert ask({"op": "delete", "name": "x"}) == [{"routes": []}]


def with_goal(goal: object) -> SimpleNamespace:
    return SimpleNamespace(report=SimpleNamespace(goal=goal))


class TestCard:
    def test_progress_is_shown_only_for_goals_under_way_or_cancelling(self):
        for state in GOALS:
            seen = figures(with_goal(goal(state, left=2.0)))
            assert seen == (
                "2.0 m to go" if state in ("under way", "cancelling") else ""
            )

    def test_the_progress_of_a_goal_has_units(self):
        seen = goal(left=3.25, eta=12.4, time=4.6, recoveries=2)
        text = "3.2 m to go, about 12 s left, 5 s elapsed, 2 recoveries"
        assert figures(with_goal(seen)) == text
        assert figures(with_goal(goal(recoveries=1))) == "1 recovery"
        assert figures(with_goal(None)) == ""

    def test_the_goal_line_shows_the_elapsed_time_and_the_recoveries(self):
        line = GoalLine()
        seen = goal(left=3.25, eta=12.4, time=4.6, recoveries=2)
        report = SimpleNamespace(goal=seen)
        line.show(SimpleNamespace(report=report, goal_ended_at=None))
        _, words = line.element.children
        assert line.element.get("hidden") is None
        assert [each.text for each in words.children] == [
            "Navigating to goal",
            "3.2 m to go, about 12 s left, 5 s elapsed, 2 recoveries",
        ]

    def test_the_goal_line_of_a_robot_without_a_goal_keeps_its_place(self, robot):
        line = GoalLine()
        line.show(robot)
        assert line.element.get("hidden") is None
        assert line.element.get("data-tone") == "none"
