"""The panel of log lines: shared, counted, and subscribed only while it is open."""

import asyncio

import msgspec
import pytest
from module_fakes import header

from webmap.base.errors import ConfigError
from webmap.features.log.rosout import LONGEST, MOST, BridgeLog, log_of

ROS1, ROS2 = {"info": 2, "error": 8}, {"info": 20, "error": 40}


class LogLink:
    """A bridge that has subscribers and publishes log lines."""

    def __init__(self, name):
        self.name, self.url, self.state = name, f"ws://{name}:9090", "open"
        self.listeners = []

    def subscribe(self, topic, callback, type=None, *, decode, queue_length):
        assert (topic, type) == ("/rosout", None)
        received = (callback, decode)
        self.listeners.append(received)
        link = self

        class Subscription:
            def remove(self):
                link.listeners.remove(received)

        return Subscription()

    def publish(self, level, text, name="/planner", *, ros2=False):
        where = {"stamp": {"sec": 3, "nanosec": 0}} if ros2 else {"header": header("")}
        number = (ROS2 if ros2 else ROS1)[level]
        plain = {**where, "level": number, "name": name, "msg": text}
        for callback, decode in self.listeners:
            callback(msgspec.convert(plain, decode))


@pytest.fixture
def said(monkeypatch):
    sent = []
    monkeypatch.setattr(
        "webmap.core.world_view.BrowserPart.send",
        lambda self, message: sent.append(message),
    )
    return sent


def test_the_log_panel_receives_ros_1_and_ros_2_lines_only_while_open(map, page, said):
    old, new = LogLink("old"), LogLink("new")

    async def scenario():
        panel = map.add_module("RosoutPanel", [old, new])
        assert old.listeners == [], "a closed panel subscribes to nothing"
        panel.on_message({"open": True})
        old.publish("error", "stuck")
        new.publish("info", "on my way", "nav", ros2=True)
        panel.send_new_lines()
        first, second = said
        assert (first["bridge"], first["total"], first["state"]) == (0, 1, "open")
        assert first["lines"][0][1:5] == ["error", "/planner", "stuck", 1]
        assert second["lines"][0][1:5] == ["info", "nav", "on my way", 1]
        said.clear()
        panel.send_new_lines()
        assert said == [], "old lines are not sent again"
        old.publish("error", "stuck")
        old.state = "closed"
        panel.send_new_lines()
        assert said[0]["lines"][0][4] == 2, "a repeated line is counted"
        assert said[0]["state"] == "closed"
        panel.on_message({"open": False})
        assert old.listeners == new.listeners == []
        panel.on_message({"open": "please"})
        panel.on_message({})
        assert old.listeners == []
        panel.on_message({"open": True})
        page.close()
        assert old.listeners == [], "a closed page has no subscription"

    asyncio.run(scenario())


def test_a_bridge_that_comes_while_the_log_panel_is_open_is_followed(map, page, said):
    old, new = LogLink("old"), LogLink("new")
    bridges = [old]

    async def scenario():
        panel = map.add_module("RosoutPanel", bridges)
        panel.on_message({"open": True})
        panel.send_new_lines()
        assert [(each["bridge"], each["name"]) for each in said] == [(0, "old")]
        said.clear()
        bridges.append(new)
        while not new.listeners:
            await asyncio.sleep(0)
        await asyncio.sleep(0)
        new.publish("error", "stuck")
        panel.send_new_lines()
        assert {(each["bridge"], each["name"]) for each in said} == {(1, "new")}
        assert said[-1]["lines"][0][1:5] == ["error", "/planner", "stuck", 1]
        page.close()
        assert old.listeners == new.listeners == []

    asyncio.run(scenario())


def test_pages_share_one_log_subscription_that_keeps_the_newest_lines():
    link = LogLink("shared")
    log = log_of(link)
    assert log_of(link) is log
    one, other = log.watch(), log.watch()
    assert len(link.listeners) == 1
    for number in range(MOST + 5):
        link.publish("info", f"{number}" + "x" * 2 * LONGEST)
    assert (len(log.lines), log.total) == (MOST, MOST + 5)
    assert len(log.lines[-1].text) == LONGEST
    assert [line.number for line in log.since(log.version - 2)] == [MOST + 4, MOST + 5]
    one.remove()
    one.remove()
    assert len(link.listeners) == 1, "the other page is still subscribed"
    other.remove()
    assert link.listeners == []
    log.watch()
    assert len(link.listeners) == 1


def test_a_log_keeps_no_lines_from_a_time_without_viewers():
    link = LogLink("quiet")
    log = BridgeLog(link)
    link.publish("error", "before")
    log.watch().remove()
    link.publish("error", "after")
    assert list(log.lines) == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"level": "loud"}, "level is one of debug, info, warn, error, fatal"),
        ({"lines": 0}, "lines must be 1 to 200, got 0"),
    ],
)
def test_invalid_options_of_the_log_panel_are_refused(map, options, words):
    with pytest.raises(ConfigError, match=words):
        map.add_module("RosoutPanel", [], **options)
