"""Subscriptions to topics that are only shown, while no page is open."""

import asyncio

import pytest

from equipment.fake_rosbridge import bridged
from equipment.waiting import until
from webmap.base.audience import audience
from webmap.base.errors import ConfigError
from webmap.ros.bridge import Bridge
from webmap.ros.subscriptions import Throttle

TYPE = "std_msgs/String"


@pytest.fixture(autouse=True)
def somebody_looks():
    yield
    audience._set(True)


def asked(server, topic):
    """Return the throttles of the subscriptions to a topic, in milliseconds."""
    ops = [m for m in server.received if m.get("topic") == topic]
    open_ids = {}
    for each in ops:
        if each["op"] == "subscribe":
            open_ids[each["id"]] = each["throttle_rate"]
        elif each["op"] == "unsubscribe":
            open_ids.pop(each["id"])
    return list(open_ids.values())


def test_what_is_only_shown_comes_rarely_while_nobody_looks_and_else_as_before():
    async def scenario():
        async with bridged() as (server, bridge):
            bridge.subscribe("/a", print, TYPE, throttle=100, unwatched=5000)
            bridge.subscribe("/b", print, TYPE, throttle=100)
            bridge.subscribe("/c", print, TYPE, unwatched=5000)
            bridge.subscribe("/d", print, TYPE, throttle=9000, unwatched=5000)
            await until(lambda: len(server.ops("subscribe")) == 4)
            audience._set(False)
            await until(lambda: asked(server, "/a") == [5000])
            audience._set(True)
            await until(lambda: asked(server, "/a") == [100])
            assert [asked(server, topic) for topic in ("/b", "/c", "/d")] == [
                [100],
                [1],
                [9000],
            ]
            assert len(server.ops("subscribe")) == 6

    asyncio.run(scenario())


def test_a_listener_of_the_user_gets_all_messages_beside_one_that_only_shows():
    async def scenario():
        async with bridged() as (server, bridge):
            mine, shown = [], []
            bridge.subscribe("/a", shown.append, TYPE, throttle=20, unwatched=5000)
            bridge.subscribe("/a", mine.append, TYPE, throttle=20)
            await until(lambda: server.ops("subscribe"))
            audience._set(False)
            for number in range(3):
                await server.publish("/a", {"data": str(number)})
                await until(lambda number=number: len(mine) == number + 1)
                await asyncio.sleep(0.03)
            assert asked(server, "/a") == [20]
            assert [message["data"] for message in shown] == ["0"]
            audience._set(True)  # the waiting message arrives at once
            await until(lambda: len(shown) == 2)
            assert shown[1]["data"] == "2"
            await server.publish("/a", {"data": "3"})
            await until(lambda: len(shown) == 3)

    asyncio.run(scenario())


def test_a_subscription_of_a_closed_bridge_is_asked_for_as_often_as_somebody_looks():
    async def scenario():
        async with bridged() as (server, bridge):
            bridge.subscribe("/a", print, TYPE, throttle=100, unwatched=5000)
            await until(lambda: asked(server, "/a") == [100])
            server.received.clear()
            server.drop()
            await until(lambda: bridge.state != "open")
            audience._set(False)
            await until(lambda: asked(server, "/a") == [5000])

    asyncio.run(scenario())


def test_a_listener_may_begin_to_need_all_messages():
    async def scenario():
        async with bridged() as (server, bridge):
            listener = bridge.subscribe("/a", print, TYPE, throttle=100, unwatched=5000)
            audience._set(False)
            await until(lambda: asked(server, "/a") == [5000])
            listener.set_pace(100, 0)
            await until(lambda: asked(server, "/a") == [100])

    asyncio.run(scenario())


def test_a_throttle_that_gets_shorter_releases_what_waits():
    throttle = Throttle(5.0)
    assert throttle.offer("first", 10.0) == "first"
    assert throttle.offer("second", 11.0) is None
    throttle.change(0.1, 12.0)
    assert throttle.due == 12.0
    assert throttle.take(12.0) == "second"
    throttle.change(5.0, 13.0)
    assert throttle.offer("third", 13.0) == "third"
    assert throttle.offer("fourth", 14.0) is None


def test_the_time_between_messages_while_nobody_looks_is_checked():
    with pytest.raises(ConfigError, match="unwatched is a whole number"):
        Bridge("ws://robot:9090").subscribe("/a", print, unwatched=-1)
