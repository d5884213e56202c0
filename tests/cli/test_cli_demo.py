"""``webmap demo``: its robots match the robots of the simulator."""

import asyncio
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from equipment.waiting import until
from webmap import Bridge
from webmap.base.errors import BridgeClosed, ConfigError
from webmap.cli import demo, demo_robots
from webmap.cli.demo import simulator
from webmap.cli.demo_robots import FREE, PauseErrands, demo_robot
from webmap.discovery import discover
from webmap.ros.temporary_bridge import ask_topics


def test_the_console_is_opened_while_the_simulator_starts(monkeypatch):
    done = []

    @contextmanager
    def starting(*options):
        def url():
            done.append("waited")
            raise ConfigError("that is enough")

        done.append("started")
        yield url

    monkeypatch.setattr(demo, "starting_simulator", starting)
    monkeypatch.setattr(demo, "_open_console", lambda *_, **__: done.append("opened"))
    with pytest.raises(ConfigError, match="enough"):
        demo.demo.main(["--no-browser"], standalone_mode=False)
    assert done == ["started", "opened", "waited"]


DIALECTS = pytest.mark.parametrize("dialect", ["ros1", "ros2"])


@DIALECTS
def test_a_demo_robot_uses_the_topics_of_the_simulator(dialect):
    with simulator("--port", 0, "--robots", 1, "--dialect", dialect) as url:
        topics = asyncio.run(ask_topics(url, wait=10.0, waiting=print))
        (found,) = discover(topics, "bob").robots
        robot = demo_robot(Bridge(url), 0, dialect)
    try:
        spec = robot.motion.spec()
        assert spec.base.topic == found.topic("velocity")
        assert (spec.navigation.action, spec.navigation.action_type) == found.action
        assert spec.navigation.topic == found.topic("goal")
        assert (spec.navigation.cancel_topic or "") == found.topic("cancel")
    finally:
        robot.destroy()


def on_maps(robot):
    """The name and the topic of each module that a robot adds to its maps."""
    modules = [m for m in robot.to_dict()["modules"] if m["name"] == "OnMaps"]
    return [(module["args"][0], module["args"][2]) for module in modules]


@DIALECTS
def test_the_topics_that_only_the_lively_demo_has_exist(dialect):
    count = FREE + 1
    options = ("--robots", count, "--errands", 1, "--dialect", dialect)
    with simulator("--port", 0, *options) as url:
        topics = asyncio.run(ask_topics(url, wait=10.0, waiting=print))
        robot = demo_robot(Bridge(url), FREE, dialect)
    try:
        shown = dict(on_maps(robot))
        assert set(shown) == {"OccupancyGrid", "Markers"}
        assert set(shown.values()) <= set(topics)
        assert robot.motion.spec().scan_assist.topic in topics
        (pause,) = [each for each in robot.modules if isinstance(each, PauseErrands)]
        assert pause.topic in topics
    finally:
        robot.destroy()


@pytest.mark.parametrize(("index", "quiet"), [(0, True), (FREE, True), (0, False)])
def test_a_quiet_robot_and_a_free_one_show_no_costmap_and_have_no_errands(index, quiet):
    robot = demo_robot(Bridge("ws://127.0.0.1:1"), index, quiet=quiet)
    try:
        assert not on_maps(robot)
        assert not [each for each in robot.modules if isinstance(each, PauseErrands)]
        assert (robot.motion.spec().scan_assist is None) == quiet
    finally:
        robot.destroy()


class Robot:
    report = SimpleNamespace(latched=False, changing=False, holder=None)


class FakeBridge:
    """Counts the messages that pause errands; the first finds a closed connection."""

    def __init__(self):
        self.sent = 0

    def publish(self, topic, message, type):
        assert (topic, message, type) == ("/pause", {}, "std_msgs/Empty")
        self.sent += 1
        if self.sent == 1:
            raise BridgeClosed("it is closed")


@pytest.mark.parametrize(
    "change", [{"latched": True}, {"changing": True}, {"holder": "Ann"}]
)
def test_errands_are_paused_again_and_again_while_webmap_has_the_robot(
    change, monkeypatch
):
    monkeypatch.setattr(demo_robots, "REPEAT", 0.01)

    async def scenario():
        robot, bridge = Robot(), FakeBridge()
        pause = PauseErrands(robot, bridge, "/pause")

        def report(**change):
            facts = {"latched": False, "changing": False, "holder": None, **change}
            robot.report = SimpleNamespace(**facts)
            pause.on_report(robot.report)

        report()
        await asyncio.sleep(0)
        assert bridge.sent == 0
        report(**change)
        report(**change)  # a second report does not start a second repetition
        await until(lambda: bridge.sent >= 4)
        report()
        await until(lambda: pause.is_idle)
        count = bridge.sent
        report(**change)
        await asyncio.sleep(0)
        assert bridge.sent == count + 1
        report()

    asyncio.run(scenario())
