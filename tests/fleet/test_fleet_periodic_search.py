"""Discovery continues after a failed look and after a failed notice."""

import asyncio
import errno
import logging
import sys

import pytest

from webmap import Bridge
from webmap.base.errors import BridgeError, ConfigError
from webmap.base.lifecycle import Lifecycle
from webmap.console import Console
from webmap.discovery import discover
from webmap.discovery.newcomers import News
from webmap.fleet import periodic_search as looking
from webmap.fleet.periodic_search import (
    LayerSearch,
    PeriodicSearch,
    RobotSearch,
)
from webmap.fleet.view_robots import ViewRobots

URL = "ws://127.0.0.1:9"
TOPICS = {"/bob/odom": "nav_msgs/Odometry", "/ann/odom": "nav_msgs/Odometry"}


@pytest.fixture(autouse=True)
def own_process(monkeypatch):
    """Start only the objects that a test made."""
    monkeypatch.setattr(looking, "lifecycle", Lifecycle())


@pytest.fixture
def nobody_hears(monkeypatch):
    """Make standard error a broken pipe."""

    def broken(text):
        raise BrokenPipeError(errno.EPIPE, "Broken pipe")

    monkeypatch.setattr(sys.stderr, "write", broken)


class Open:
    """A bridge whose link is up."""

    url = URL
    state = "open"

    async def topics(self):
        return TOPICS


class Failing(PeriodicSearch):
    """A source that fails in the first looks."""

    period = 0.001

    def __init__(self, *errors):
        super().__init__(Open())
        self.errors = list(errors)
        self.done = asyncio.Event()

    async def take(self, topics):
        if self.errors:
            raise self.errors.pop(0)
        self.done.set()


@pytest.mark.parametrize(
    "error", [BridgeError("no rosapi"), OSError(errno.ENOSPC, "full"), KeyError("x")]
)
def test_looking_continues_after_a_look_that_fails(error, caplog):
    async def scenario():
        failing = Failing(error, error)
        failing.start(asyncio.get_running_loop())
        async with asyncio.timeout(10):
            await failing.done.wait()
        await failing.stop()

    with caplog.at_level(logging.ERROR, "webmap.cli"):
        asyncio.run(scenario())
    logged = [record.exc_info[1] for record in caplog.records]
    assert logged == ([] if isinstance(error, BridgeError) else [error, error])


def test_a_new_robot_that_cannot_be_shown_does_not_hide_other_new_robots(caplog):
    shown = []

    def came(news, bridge):
        if news.robot.namespace == "/ann":
            raise ValueError("no such thing")
        shown.append(news.robot.namespace)

    async def scenario():
        looks = RobotSearch(Bridge(URL), [], came)
        for _ in range(2):
            await looks.take(TOPICS)

    asyncio.run(scenario())
    assert shown == ["/bob"]
    assert f"{URL}: the new topics of ann are not shown" in caplog.text
    assert "no such thing" in caplog.text


def test_new_robots_are_shown_even_if_standard_error_is_broken(nobody_hears):
    bridge, late = Bridge(URL), ViewRobots(Console())
    ann, bob = discover(TOPICS, "host").robots
    came = late.show_news
    try:
        came(News(ann), bridge)
        came(News(bob), bridge)
        assert [robot.name for robot in late.robots] == ["ann", "bob"]
    finally:
        for robot in late.robots:
            robot.destroy()


def test_a_new_topic_that_fails_does_not_block_other_new_topics(caplog, capsys):
    bridge, late = Bridge(URL), ViewRobots(Console())
    odometry = {"/ann/odom": "nav_msgs/Odometry"}
    more = {
        "/ann/scan": "sensor_msgs/LaserScan",
        "/ann/battery_state": "sensor_msgs/BatteryState",
    }
    came = late.show_news
    came(News(discover(odometry, "host").robots[0]), bridge)
    (robot,) = late.robots

    def failing(name, *args, **options):
        if name == "LaserScanner":
            raise ValueError("no such thing")
        return add(name, *args, **options)

    add, robot.add_module = robot.add_module, failing
    try:
        whole = discover(odometry | more, "host").robots[0]
        came(News(whole, ("scan", "battery")), bridge)
    finally:
        robot.destroy()
    assert "ann: its scan is not used" in caplog.text
    assert "ann has new topics: battery /ann/battery_state\n" in capsys.readouterr().err


def test_a_layer_that_fails_is_logged_once_and_does_not_block_other_layers(caplog):
    bridge, late = Bridge(URL), ViewRobots(Console())
    topics = {
        "/ann/odom": "nav_msgs/Odometry",
        "/ann/points": "sensor_msgs/PointCloud2",
        "/ann/sonar": "sensor_msgs/Range",
    }
    late.show_news(News(discover(topics, "host").robots[0]), bridge)
    (robot,) = late.robots

    def failing(name, *args, **options):
        if name == "PointCloud":
            raise ConfigError("no such thing")
        return add(name, *args, **options)

    add, robot.add_module = robot.add_module, failing
    looking = LayerSearch(bridge, late)
    try:
        for _ in range(2):
            asyncio.run(looking.take(topics))
        drawn = [type(module).__name__ for module in robot.modules]
    finally:
        robot.destroy()
    assert caplog.text.count("ann: /ann/points is not drawn: PointCloud: no such") == 1
    assert (drawn.count("Range"), drawn.count("Trail")) == (1, 1)


def test_layers_are_drawn_even_if_the_notice_about_left_out_topics_fails(nobody_hears):
    many = {f"/ann/cloud{n}": "sensor_msgs/PointCloud2" for n in range(40)}
    late = ViewRobots(Console())
    bridge = Bridge(URL)
    topics = {"/ann/odom": "nav_msgs/Odometry", **many}
    (ann,) = discover(topics, "host").robots
    late.show_news(News(ann), bridge)
    try:
        drawn = LayerSearch(bridge, late)
        asyncio.run(drawn.take(topics))
        assert any("cloud" in topic for topic in bridge._topics)
    finally:
        late.robots[0].destroy()
