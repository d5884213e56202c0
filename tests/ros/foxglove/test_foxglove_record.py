"""Recordings of Foxglove bridges: the bag has the bytes of the robot's nodes."""

import asyncio

import pytest
from rosbags.highlevel import AnyReader

from equipment.foxglove_server import TOPICS, old_server, sdk_server
from equipment.waiting import until
from webmap.bags.record import record_to


@pytest.mark.parametrize("kind", ["sdk", "old"])
def test_the_bag_has_the_bytes_that_the_robot_sent(kind, tmp_path):
    async def record(server, out):
        sent = {}
        recording = asyncio.ensure_future(
            record_to(server.url, out, only=[], stated=None, wait=5, duration=6.0)
        )
        await until(lambda: set(TOPICS) <= set(server.subscribed))
        for topic, (_, make, _period) in TOPICS.items():
            if make is not None:
                sent[topic] = make(server.robot)
                await server.publish(topic, sent[topic])
        assert not await recording
        return sent

    async def scenario():
        if kind == "sdk":
            with sdk_server() as server:
                return await record(server, tmp_path / "bag")
        async with old_server() as server:
            return await record(server, tmp_path / "bag.bag")

    sent = asyncio.run(scenario())
    with AnyReader([tmp_path / ("bag" if kind == "sdk" else "bag.bag")]) as bag:
        found = {link.topic: bytes(data) for link, _, data in bag.messages()}
    assert found == sent
