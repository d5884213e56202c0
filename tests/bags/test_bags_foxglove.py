"""A recording that is served to Foxglove: what its client gets, and may do."""

import asyncio
import json
from contextlib import asynccontextmanager

import pytest
from foxglove_client import connected
from played_bag import Client, xs

from equipment.bag_files import BEGIN, FRAMES, GRID, ODOMETRY, Made, types_of
from equipment.mcap_files import definition, odometry, write
from equipment.waiting import until
from webmap.bags.foxglove_server import FoxgloveServer
from webmap.bags.player import Player
from webmap.bags.recording import Recording
from webmap.bags.times import SECOND
from webmap.base.errors import ConfigError

pytestmark = pytest.mark.slow

SCENE = ("/scene", ("protobuf", "protobuf"), "foxglove.Scene", b"\x0a\x01x")


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A file of three seconds with odometry, a map, and a topic in Protobuf."""
    made = Made("ros2")
    version = next(types_of("ros2").versions(GRID))
    text = version.store.generate_msgdef(version.type_name, ros_version=2)[0].encode()
    encodings = "cdr", "ros2msg"
    grid = version.bytes_of(made.grid([0, 100]))
    return write(
        tmp_path_factory.mktemp("foxglove") / "office.mcap",
        ("/map", encodings, version.type_name, text, 0.0, grid),
        (*SCENE, 0.5, b"\x00\xff"),
        *(odometry(float(second), float(second)) for second in range(1, 4)),
    )


@asynccontextmanager
async def served(path, rate=1000.0, **options):
    """Play a recording for a client of rosbridge and one of Foxglove."""
    recording = Recording([path], undecoded=True)
    player = Player(recording, rate=rate, **options)
    player.replay.start()
    player.foxglove = FoxgloveServer(
        recording, "127.0.0.1", 0, player.obey, lambda: player.status
    )
    task = asyncio.create_task(player.run())
    page = Client(player).listen("/odom")
    try:
        async with connected(player.foxglove.url) as client:
            reading = asyncio.create_task(client.read())
            yield player, page, client
            reading.cancel()
            await asyncio.wait([reading])
    finally:
        task.cancel()
        await asyncio.wait([task])
        player.foxglove.stop()
        recording.close()


def test_bytes_definitions_and_times_are_those_of_the_recording(file):
    async def story():
        async with served(file) as (_, page, client):
            await client.subscribe("/odom", "/scene", "/map")
            await until(lambda: len(client.received("/odom")) >= 3)
            assert client.received("/odom")[-1] == (
                BEGIN + 3 * SECOND,
                odometry(3.0, 3.0)[-1],
            )
            assert (BEGIN + SECOND // 2, b"\x00\xff") in client.received("/scene")
            odom = client.channels["/odom"]
            assert (odom["encoding"], odom["schemaEncoding"]) == ("cdr", "ros2msg")
            assert odom["schemaName"] == "nav_msgs/msg/Odometry"
            assert odom["schema"] == definition("ros2").decode()
            scene = client.channels["/scene"]
            assert (scene["encoding"], scene["schemaName"]) == (
                "protobuf",
                "foxglove.Scene",
            )
            await until(lambda: xs(page)[-1:] == [3.0])

    asyncio.run(story())


def test_the_server_has_the_times_of_the_recording_and_accepts_no_commands(file):
    async def story():
        async with served(file) as (_, __, client):
            assert sorted(client.info["capabilities"]) == ["playbackControl", "time"]
            seconds = BEGIN // SECOND
            assert client.info["dataStartTime"] == {"sec": seconds, "nsec": 0}
            assert client.info["dataEndTime"] == {"sec": seconds + 3, "nsec": 1}
            channel = {"id": 1, "topic": "/cmd_vel", "encoding": "json"}
            channel |= {"schemaName": "geometry_msgs/msg/Twist"}
            advertised = {"op": "advertise", "channels": [channel]}
            await client.socket.send(json.dumps(advertised))
            await until(lambda: client.status)
            assert "does not support clientPublish" in client.status[0]

    asyncio.run(story())


def test_foxglove_pauses_seeks_and_changes_the_speed_for_the_page_too(file):
    async def story():
        async with served(file, rate=0.001) as (player, page, client):
            await client.subscribe("/odom", "/map", "/scene")
            seek = BEGIN + 2 * SECOND
            await client.control(play=False, speed=2.0, seek=seek, request="one")
            await until(lambda: client.states and client.states[-1][-1] == "one")
            assert client.states[-1] == ("paused", seek, 2.0, True, "one")
            assert not player.status.playing
            assert (player.status.at, player.status.rate) == (2.0, 2.0)
            await until(lambda: xs(page)[-1:] == [2.0])
            await until(lambda: client.received("/odom"))
            assert client.received("/odom")[-1][0] == seek
            assert client.received("/map")[-1][0] == BEGIN
            assert client.received("/scene")[-1] == (BEGIN + SECOND // 2, b"\x00\xff")
            await client.control(play=True, speed=1000.0, request="two")
            await until(lambda: player.status.ended)
            await until(lambda: client.states[-1][0] == "ended")
            assert ("playing", seek, 1000.0, False, "two") in client.states
            assert client.times[-1] == BEGIN + 3 * SECOND

    asyncio.run(story())


def test_a_seek_of_the_page_is_shown_to_foxglove(file):
    async def story():
        async with served(file) as (player, _, client):
            await client.subscribe("/odom")
            await until(lambda: player.status.jumps == 1 and player.status.ended)
            player.obey("seek 1.5")
            state = "paused", BEGIN + SECOND * 3 // 2, 1000.0, True, ""
            await until(lambda: state in client.states)
            pose = BEGIN + SECOND, odometry(1.0, 1.0)[-1]
            await until(lambda: client.received("/odom")[-1:] == [pose])

    asyncio.run(story())


def test_a_map_that_was_played_before_is_sent_to_a_later_subscriber(file):
    async def story():
        async with served(file) as (player, _, client):
            await client.subscribe("/odom")
            await until(lambda: player.status.jumps == 1 and player.status.ended)
            await client.subscribe("/map")
            await until(lambda: client.received("/map"))
            assert [time for time, _ in client.received("/map")] == [BEGIN]

    asyncio.run(story())


def test_the_first_client_sees_the_recording_from_its_beginning(file):
    async def story():
        async with served(file) as (player, _, client):
            await until(lambda: player.status.ended)
            await client.subscribe("/odom")
            await until(lambda: len(client.received("/odom")) == 3)
            assert player.status.jumps == 1
            player.obey("pause")
            await client.control(play=False, request="end")
            await until(lambda: client.states[-1][-1] == "end")
            assert len(client.received("/odom")) == 3

    asyncio.run(story())


def test_a_wrong_speed_changes_nothing(file):
    async def story():
        async with served(file, rate=0.01) as (player, _, client):
            for speed in (float("nan"), float("inf"), -1.0, 0.0):
                await client.control(play=True, speed=speed, request=str(speed))
                await until(lambda: client.states[-1:] and client.states[-1][-1])
                assert player.status.rate == 0.01
                client.states.clear()

    asyncio.run(story())


def test_bags_of_both_versions_of_ros_are_served(made, tmp_path):
    bag = made.bag(
        tmp_path / "office",
        ("/tf_static", FRAMES, 0.0, made.frame("laser")),
        ("/odom", ODOMETRY, 1.0, made.odometry(1.0, 4.0)),
    )

    async def story():
        async with served(bag) as (_, __, client):
            await client.subscribe("/odom")
            await until(lambda: client.received("/odom"))
            version = next(types_of(made.dialect).versions(ODOMETRY))
            data = version.bytes_of(made.odometry(1.0, 4.0))
            assert client.received("/odom")[0] == (BEGIN + SECOND, data)
            odom = client.channels["/odom"]
            expected = {
                "ros1": ("ros1", "ros1msg", "nav_msgs/Odometry"),
                "ros2": ("cdr", "ros2msg", "nav_msgs/msg/Odometry"),
            }
            keys = "encoding", "schemaEncoding", "schemaName"
            assert tuple(odom[key] for key in keys) == expected[made.dialect]
            assert "geometry_msgs/PoseWithCovariance pose" in odom["schema"]

    asyncio.run(story())


def test_a_topic_without_a_definition_gets_the_usual_one_or_none(tmp_path):
    bare = ("cdr", "")
    data = odometry(1.0, 1.0)[-1]
    path = write(
        tmp_path / "bare.mcap",
        ("/odom", bare, "nav_msgs/msg/Odometry", b"", 0.0, data),
        ("/arm", bare, "acme_msgs/msg/Arm", b"", 0.0, b"\0\1\0\0\0"),
    )

    async def story():
        async with served(path) as (_, __, client):
            await client.subscribe("/odom", "/arm")
            assert client.channels["/arm"]["schema"] == ""
            schema = client.channels["/odom"]["schema"]
            assert "geometry_msgs/PoseWithCovariance pose" in schema
            await until(lambda: client.received("/arm"))

    asyncio.run(story())


def test_a_port_in_use_is_a_clear_error(file):
    async def story():
        async with served(file) as (player, _, __):
            port = int(player.foxglove.url.rpartition(":")[2])
            recording = Recording([file])
            with pytest.raises(ConfigError, match="Address already in use"):
                FoxgloveServer(recording, "127.0.0.1", port, print, lambda: None)
            recording.close()

    asyncio.run(story())
