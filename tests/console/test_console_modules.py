"""The modules that the console adds to maps, without their browser parts."""

from pathlib import Path

import pytest

from webmap import Map, Robot
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.features.goals.goals import GoalTool
from webmap.features.stop.stop_button import StopButton
from webmap.features.view.view import Follow, PointerReadout, ScaleBar
from webmap.scene.wire.session import SceneSession

PACKAGE = Path(__file__).parents[2] / "src" / "webmap"


class TriggerRecorder:
    """Records the arguments of the goal tool's triggers."""

    def __init__(self, map: Map) -> None:
        self.received: list[tuple] = []

    def on_goal_sent(self, *received) -> None:
        self.received.append(("sent", *received))

    def on_goal_canceled(self, *received) -> None:
        self.received.append(("canceled", *received))


@pytest.fixture
def map():
    entry = PageEntry("/", lambda page: None, None, Path(), "test")
    session = SceneSession()
    session.attached = []
    attach = session.attach
    session.attach = lambda *args, **kw: (session.attached.append(args), attach(*args))
    page = Page(entry, session, Viewer("v1", "Ann"), None, {"map": (800.0, 600.0)})
    with page.scope.active():
        yield Map(page.element("map"))
    page.close()


@pytest.mark.parametrize(
    "factory", [Follow, GoalTool, PointerReadout, ScaleBar, StopButton]
)
def test_the_script_and_the_style_file_of_a_module_exist(map, factory):
    map.add_module(factory)
    _, _, script, _, style = map.page.channel.attached[0]
    assert (PACKAGE / script).is_file()
    assert (PACKAGE / style).is_file()


@pytest.mark.parametrize(
    ("factory", "options"),
    [
        (ScaleBar, {"width": 5}),
        (PointerReadout, {"digits": -1}),
        (PointerReadout, {"digits": 9}),
        (GoalTool, {"key": "gg"}),
        (GoalTool, {"key": ""}),
    ],
)
def test_an_invalid_option_of_a_module_is_refused(map, factory, options):
    with pytest.raises(ValueError, match=factory.__name__):
        map.add_module(factory, **options)


def test_a_goal_and_a_cancel_of_the_page_fire_triggers(map):
    robot = Robot("Bob")
    map.add_robot(robot)
    tool, recorder = map.add_module(GoalTool), map.add_module(TriggerRecorder)
    tool.on_message({"goal": {"robot": robot.id, "x": 1, "y": 2.0, "yaw": 0.5}})
    tool.on_message({"cancel": robot.id})
    assert recorder.received == [("sent", robot, 1, 2.0, 0.5), ("canceled", robot)]
    robot.destroy()


@pytest.mark.parametrize(
    "message",
    [
        {},
        {"goal": None},
        {"goal": {"robot": "r999", "x": 1, "y": 2, "yaw": 0}},
        {"goal": {"robot": "r999"}},
        {"cancel": 5},
        {"cancel": "r999"},
    ],
)
def test_an_invalid_message_of_a_page_fires_no_trigger(map, message):
    tool, recorder = map.add_module(GoalTool), map.add_module(TriggerRecorder)
    tool.on_message(message)
    assert recorder.received == []


def test_a_view_follows_only_a_robot_of_its_map(map):
    robot, stranger = Robot("Bob"), Robot("Ann")
    map.add_robot(robot)
    followed = []
    map.follow = followed.append
    follow = map.add_module(Follow)
    for id in (robot.id, stranger.id, None):
        follow.on_message({"follow": id})
    assert followed == [robot, None, None]
    for one in (robot, stranger):
        one.destroy()
