"""Text with a single surrogate, which a bridge sends for bytes that are not UTF-8."""

import asyncio
import json
from typing import Any

import pytest

from equipment.fake_rosbridge import bridged
from equipment.waiting import until
from webmap.base.errors import ProtocolError, ServiceError
from webmap.discovery import discover
from webmap.ros.decoding import decode_json
from webmap.ros.rosbridge.protocol import Protocol


@pytest.mark.parametrize(
    ("text", "value"),
    [
        (rb'"/bad\ud800"', "/bad�"),
        (rb'"\udcff\udc80"', "��"),
        (rb'["a\uDBFF", NaN]', None),
        (rb'{"\ud800": [{"x": "\udfff"}]}', {"�": [{"x": "�"}]}),
        (rb'"\ud83d\ude00"', "\N{GRINNING FACE}"),
        (rb'"\\ud800"', "\\ud800"),
        (rb'["\\ud800", "\ud800"]', ["\\ud800", "�"]),
    ],
)
def test_only_lone_surrogates_are_replaced(text, value):
    decoded = decode_json(text, Any)
    if value is None:
        assert decoded[0] == "a�"
    else:
        assert decoded == value
    json.dumps(decoded).encode()


@pytest.mark.parametrize("text", [rb'"\ud800', rb'{"a": \ud800}', rb"[" * 9999])
def test_invalid_json_is_still_refused(text):
    with pytest.raises(ProtocolError):
        decode_json(text, Any)


def test_a_topic_with_a_lone_surrogate_does_not_hide_other_topics():
    async def scenario():
        names = {"topics": ["/odom", "/bad\udc80"], "types": ["nav_msgs/Odometry", "x"]}
        async with bridged(topics=names) as (_, bridge):
            found = await bridge.topics()
            assert found == {"/odom": "nav_msgs/Odometry", "/bad�": "x"}
            assert [robot.name for robot in discover(found, "bob").robots] == ["bob"]

    asyncio.run(scenario())


def test_a_message_with_a_lone_surrogate_is_decoded():
    event = Protocol().receive(
        rb'{"op": "publish", "topic": "/a", "msg": {"data": "x\ud800"}}', 0.0
    )
    assert event.decode() == {"data": "x�"}


def test_an_unreadable_service_response_is_not_reported_as_missing():
    async def scenario():
        async with bridged(topics=None) as (server, bridge):
            call = asyncio.create_task(
                bridge.call_service("/rosapi/topics", timeout=0.5)
            )
            await until(lambda: server.ops("call_service"))
            await server.send('{"op": "service_response", "values": ')
            with pytest.raises(ServiceError, match="no readable answer") as why:
                await call
            assert "did not answer" not in str(why.value)

    asyncio.run(scenario())
