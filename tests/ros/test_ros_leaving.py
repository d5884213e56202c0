"""The display leaves a bridge that hangs if a client's queue is not empty."""

import asyncio

import pytest

from equipment.fake_rosbridge import bridged
from equipment.hanging_bridge import hanging_bridge
from equipment.waiting import until
from webmap.ros.bridge import Bridge

TYPES = {
    "/text": "std_msgs/String",
    "/tf": "tf2_msgs/TFMessage",
    "/map": "nav_msgs/OccupancyGrid",
}


async def by_stopping(server, bridge, listeners):
    await bridge.stop()
    await until(lambda: not server.clients)


async def by_a_reset(server, bridge, listeners):
    links = bridge.stats.links
    server.reset_all()
    await until(lambda: bridge.stats.links > links or server.server.hangs)


async def by_unsubscribing(server, bridge, listeners):
    for listener in listeners:
        listener.remove()
    # The bridge answers this after the earlier requests, if it answers.
    await asyncio.sleep(0.1)


async def by_asking_for_less(server, bridge, listeners):
    for topic, type in TYPES.items():
        bridge.subscribe(topic, print, type, throttle=500)
    await by_unsubscribing(server, bridge, listeners)


@pytest.mark.parametrize(
    "leave", [by_stopping, by_a_reset, by_unsubscribing, by_asking_for_less]
)
def test_the_bridge_accepts_clients_after_the_display_leaves_the_data_lane(leave):
    async def scenario():
        async with hanging_bridge("ros2", TYPES) as server:
            bridge, received = Bridge(server.url), set()
            listeners = [
                bridge.subscribe(
                    topic, lambda _, topic=topic: received.add(topic), type
                )
                for topic, type in TYPES.items()
            ]
            bridge.start(asyncio.get_running_loop())
            try:
                await until(lambda: received == TYPES.keys())
                await leave(server, bridge, listeners)
                assert await server.accepts_client()
            finally:
                await bridge.stop()

    asyncio.run(scenario())


def test_the_bridge_accepts_clients_after_a_reset_of_the_calls_lane():
    async def scenario():
        async with hanging_bridge("ros2", TYPES) as server:
            bridge = Bridge(server.url)
            bridge.start(asyncio.get_running_loop())
            try:
                await until(lambda: bridge.state == "open")
                await bridge.call_service("/rosapi/get_time")
                server.reset_all()
                await until(lambda: bridge.stats.links == 2)
                await bridge.call_service("/rosapi/get_time")
                assert await server.accepts_client()
            finally:
                await bridge.stop()

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("type", "compression"),
    [
        ("nav_msgs/Path", "cbor"),
        ("geometry_msgs/msg/PoseArray", "cbor"),
        ("visualization_msgs/MarkerArray", "cbor"),
        ("sensor_msgs/PointCloud2", "cbor"),
        ("nav_msgs/Odometry", None),  # no bridge sends its array in CBOR
        ("std_msgs/String", None),
    ],
)
def test_types_that_are_slow_to_encode_are_subscribed_in_cbor(type, compression):
    async def scenario():
        async with bridged() as (server, bridge):
            bridge.subscribe("/a", print, type)
            (asked,) = await server.wait_for("subscribe")
            assert asked.get("compression") == compression

    asyncio.run(scenario())
