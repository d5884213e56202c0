"""Topics that are subscribed before a node publishes them."""

import asyncio
from itertools import pairwise

import pytest

from equipment.fake_rosbridge import bridged
from equipment.waiting import until
from webmap.ros.rosbridge import wire_subscription
from webmap.ros.rosbridge.wire_subscription import (
    AGAIN,
    FIRST,
    LONGEST,
    UNANSWERED,
    TopicSilence,
)

TYPE = "nav_msgs/OccupancyGrid"


def looks(answers, until):
    """The times at which a silent topic is checked, and when it is renewed."""
    silence = TopicSilence(0.0)
    asked, renewed = [], []
    for tenth in range(int(until * 10)):
        now = tenth / 10
        if silence.due(now):
            asked.append(now)
            if silence.answered(answers(now), now):
                renewed.append(now)
    return asked, renewed


def test_a_silent_topic_is_subscribed_again_when_a_publisher_appears():
    asked, renewed = looks(lambda now: now >= 20, 25)
    assert asked[0] == FIRST
    (at,) = renewed
    assert 20 <= at <= 20 + LONGEST


def test_a_silent_topic_with_a_publisher_is_subscribed_again_periodically():
    _, renewed = looks(lambda _now: True, 300)
    assert renewed[0] == FIRST
    gaps = [b - a for a, b in pairwise(renewed)]
    assert gaps
    assert all(AGAIN <= gap <= AGAIN + LONGEST for gap in gaps)


def test_a_topic_without_a_publisher_is_not_subscribed_again():
    asked, renewed = looks(lambda _now: False, 300)
    assert renewed == []
    assert len(asked) < 300 / LONGEST + 4


def test_a_topic_with_unknown_publishers_is_subscribed_again_periodically():
    _, renewed = looks(lambda _now: None, 300)
    assert 300 / (AGAIN + LONGEST) - 1 <= len(renewed) <= 300 / AGAIN


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(wire_subscription, "PERIOD", 0.01)
    monkeypatch.setattr(wire_subscription, "FIRST", 0.02)
    monkeypatch.setattr(wire_subscription, "LONGEST", 0.05)


def test_the_old_subscription_ends_before_the_new_one_begins(quick):
    async def scenario():
        got = []
        async with bridged(publishers={"publishers": []}) as (server, bridge):
            bridge.subscribe("/map", got.append, TYPE)
            bridge.subscribe("/heard", got.append, "std_msgs/String")
            (first,) = await server.wait_for("subscribe", topic="/map")
            await server.publish("/heard", {"data": "I am here"})
            await server.wait_for("call_service", count=3, service="/rosapi/publishers")
            assert len(server.ops("subscribe", topic="/map")) == 1
            server.answer["/rosapi/publishers"] = {"publishers": ["/map_server"]}
            await server.wait_for("subscribe", count=2, topic="/map")
            about = [m for m in server.received if m.get("topic") == "/map"]
            assert [m["op"] for m in about] == ["subscribe", "unsubscribe", "subscribe"]
            assert about[1]["id"] == first["id"] != about[2]["id"]
            await server.publish("/map", {"info": {}})
            await until(lambda: len(got) == 2)
            asked = server.ops("call_service", service="/rosapi/publishers")
            later = [m for m in asked if m["args"]["topic"] == "/heard"]
            assert len(later) <= 1
            assert len(server.ops("subscribe", topic="/heard")) == 1

    asyncio.run(scenario())


def test_a_bridge_without_rosapi_is_asked_for_publishers_only_a_few_times(
    quick, monkeypatch
):
    monkeypatch.setattr(wire_subscription, "AGAIN", 0.3)

    async def scenario():
        errors = []
        async with bridged() as (server, bridge):
            bridge.on_error(errors.append)
            bridge.subscribe("/map", print, TYPE)
            # The topic is requested again sometimes, as its publishers are unknown.
            await server.wait_for("subscribe", count=3, topic="/map")
            asked = server.ops("call_service", service="/rosapi/publishers")
            assert len(asked) == UNANSWERED
            assert errors == []

    asyncio.run(scenario())
