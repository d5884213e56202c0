"""A recording that is played: what those who listen get, and what nobody can do."""

import asyncio
import json
import threading
import time
from contextlib import asynccontextmanager

import pytest

from bag_making import BEGIN, FRAMES, GRID, ODOMETRY, TWIST
from webmap.bags import player as player_module
from webmap.bags.player import Player
from webmap.bags.recording import Recording
from webmap.bags.replay import REFUSED, STATUS
from webmap.bags.times import SECOND
from webmap.base.errors import ConfigError
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.quirks import POLITE
from webmap.ros.rosbridge.server.session import Session

pytestmark = pytest.mark.slow

NOW = 1_800_000_000 * SECOND


class Client:
    """One client of a replay, without a socket."""

    def __init__(self, player):
        graph = player.replay.graph
        encoder = Encoder(graph.schema, POLITE)
        self.session = Session(graph, encoder, clock=lambda: 0.0, wake=lambda: None)
        self.received = []

    def send(self, **operation):
        self.session.receive(json.dumps(operation))

    def listen(self, *topics):
        for topic in topics:
            self.send(op="subscribe", topic=topic)
        return self

    def operations(self):
        while frames := self.session.next_frames():
            self.received += [json.loads(frame) for frame in frames]
        return self.received

    def messages(self, topic):
        return [one["msg"] for one in self.operations() if one.get("topic") == topic]

    def call(self, service, **args):
        self.send(op="call_service", service=service, args=args)
        return self.operations()[-1]["values"]


@asynccontextmanager
async def played(bag, **options):
    """Play a bag to its end in no time, and give the player."""
    recording = Recording([bag])
    player = Player(recording, rate=1000.0, now=lambda: NOW, **options)
    player.replay.start()
    task = asyncio.create_task(player.run())
    try:
        yield player
    finally:
        task.cancel()
        await asyncio.wait([task])
        recording.close()


async def until(found):
    async with asyncio.timeout(10):
        while not (value := found()):
            await asyncio.sleep(0.001)
    return value


def xs(client):
    return [
        message["pose"]["pose"]["position"]["x"] for message in client.messages("/odom")
    ]


@pytest.fixture(scope="module")
def bag(made, tmp_path_factory):
    """A map and two static frames at first, then a pose each second."""
    return made.bag(
        tmp_path_factory.mktemp(made.dialect) / "office",
        ("/map", GRID, 0.0, made.grid([0, 100])),
        ("/tf_static", FRAMES, 0.0, made.frame("laser")),
        ("/tf_static", FRAMES, 0.0, made.frame("camera")),
        ("/cmd_vel", TWIST, 0.5, made.message(TWIST, linear={"x": 0.3})),
        *(("/odom", ODOMETRY, at, made.odometry(at, float(at))) for at in range(1, 5)),
    )


def test_a_subscriber_receives_every_message_in_order(bag):
    async def story():
        async with played(bag) as player:
            client = Client(player).listen("/odom")
            await until(lambda: len(xs(client)) == 4)
            assert xs(client) == [1.0, 2.0, 3.0, 4.0]

    asyncio.run(story())


def test_stamps_are_moved_to_the_time_of_playing(made, bag):
    async def story():
        recording = Recording([bag])
        player = Player(recording, now=lambda: NOW + SECOND)
        player.replay.start()
        client = Client(player).listen("/odom")
        first = next(m for m in recording.messages(BEGIN) if m.topic == "/odom")
        player.replay.publish(first, player._pace)
        (message,) = client.messages("/odom")
        whole, rest = made.time(0)
        # It was said, and came, a second after the begin.
        moved = NOW // SECOND + 2
        assert message["header"]["stamp"] == {whole: moved, rest: 0}
        recording.close()

    asyncio.run(story())


def test_a_late_subscriber_receives_the_map_and_all_static_frames(bag):
    async def story():
        async with played(bag) as player:
            early = Client(player).listen("/odom")
            await until(lambda: len(xs(early)) == 4)
            late = Client(player).listen("/map", "/tf_static")
            assert [grid["data"] for grid in late.messages("/map")] == [[0, 100]]
            (frames,) = late.messages("/tf_static")
            children = [one["child_frame_id"] for one in frames["transforms"]]
            assert children == ["laser", "camera"]

    asyncio.run(story())


def test_playing_from_a_start_time_publishes_the_earlier_map(bag):
    async def story():
        async with played(bag, start=2.5) as player:
            client = Client(player).listen("/odom", "/map")
            await until(lambda: len(xs(client)) == 2)
            assert xs(client) == [3.0, 4.0]
            assert len(client.messages("/map")) == 1

    asyncio.run(story())


def test_playing_ends_without_loop_and_restarts_with_loop(bag):
    async def story():
        async with played(bag, loop=True) as player:
            client = Client(player).listen("/odom")
            await until(lambda: len(xs(client)) >= 9)
            assert xs(client)[:9] == [1.0, 2.0, 3.0, 4.0] * 2 + [1.0]
        async with played(bag) as player:
            client = Client(player).listen("/odom")
            await until(lambda: "ended after 4.0 s" in player.status)
            assert len(xs(client)) == 4

    asyncio.run(story())


def test_a_short_recording_is_played_at_most_once_a_second(made, tmp_path, monkeypatch):
    monkeypatch.setattr(player_module, "ROUND", 0.1)
    short = made.bag(
        tmp_path / "short", ("/odom", ODOMETRY, 0.0, made.odometry(0.0, 1.0))
    )

    async def story():
        async with played(short, loop=True) as player:
            began = time.monotonic()
            client = Client(player).listen("/odom")
            await until(lambda: len(xs(client)) >= 4)
            assert time.monotonic() - began > 0.25

    asyncio.run(story())


def test_latched_messages_before_the_start_are_read_once_in_another_thread(
    bag, monkeypatch
):
    whole, threads = Recording.kept_until, []

    def noted(self, *arguments):
        threads.append(threading.current_thread())
        return whole(self, *arguments)

    monkeypatch.setattr(Recording, "kept_until", noted)
    monkeypatch.setattr(player_module, "ROUND", 0.01)

    async def story():
        async with played(bag, start=2.5, loop=True) as player:
            client = Client(player).listen("/odom")
            await until(lambda: len(xs(client)) >= 5)

    asyncio.run(story())
    (thread,) = threads
    assert thread is not threading.main_thread()


def test_an_ended_replay_can_be_restarted(bag):
    async def story():
        async with played(bag) as player:
            client = Client(player).listen("/odom")
            await until(lambda: "ended" in player.status)
            player.begin_anew()
            await until(lambda: len(xs(client)) == 8)

    asyncio.run(story())


def test_playing_starts_only_after_the_first_subscription(bag):
    async def story():
        async with played(bag) as player:
            for _ in range(50):
                await asyncio.sleep(0)
            late = Client(player).listen("/odom")
            await until(lambda: len(xs(late)) == 4)

    asyncio.run(story())


def test_the_replay_publishes_its_status(bag):
    async def story():
        async with played(bag, start=1.0) as player:
            client = Client(player).listen(STATUS)
            (said, *_) = await until(lambda: client.messages(STATUS))
            name = player._recording.name
            assert said["data"].startswith(f"Recording {name}: ")

    asyncio.run(story())


def test_the_status_names_the_position_the_length_and_the_speed(bag):
    recording = Recording([bag])
    player = Player(recording, rate=2.0, start=1.0, now=lambda: NOW)
    assert player.status == (
        f"Recording {recording.name}: 1.0 of 4.0 s, 2 times as fast"
    )
    recording.close()


def test_rosapi_lists_the_topics_of_the_recording_with_types_of_its_dialect(made, bag):
    async def story():
        async with played(bag) as player:
            topics = Client(player).call("/rosapi/topics")
            types = dict(zip(topics["topics"], topics["types"], strict=True))
            spell = made.schema.dialect.spell
            assert types["/odom"] == spell(ODOMETRY)
            assert types["/cmd_vel"] == spell(TWIST)
            assert set(types) == {"/odom", "/cmd_vel", "/map", "/tf_static", STATUS}

    asyncio.run(story())


@pytest.mark.parametrize(
    "operation",
    [
        {"op": "publish", "topic": "/cmd_vel", "msg": {}},
        {"op": "advertise", "topic": "/cmd_vel", "type": TWIST},
        {"op": "advertise", "topic": "/new", "type": TWIST},
        {"op": "advertise_service", "service": "/stop", "type": "std_srvs/Trigger"},
    ],
)
def test_the_replay_refuses_publications_and_services_of_clients(bag, operation):
    async def story():
        async with played(bag) as player:
            other = Client(player).listen("/cmd_vel")
            await until(lambda: "ended" in player.status)
            received = len(other.messages("/cmd_vel"))
            client = Client(player)
            client.send(**operation)
            assert [one["msg"] for one in client.operations()] == [REFUSED]
            assert len(other.messages("/cmd_vel")) == received == 1

    asyncio.run(story())


def test_the_replay_refuses_goals(bag):
    async def story():
        async with played(bag) as player:
            client = Client(player)
            client.send(
                op="send_action_goal",
                action="/navigate_to_pose",
                action_type="nav2_msgs/action/NavigateToPose",
                args={},
            )
            (answer,) = client.operations()
            assert not answer["result"]

    asyncio.run(story())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"start": 4.5}, "is 4.0 s long, so it cannot be played from 4.5 s on"),
        ({"rate": 0.0}, "a rate is a number from 0.001 to 1000, got 0"),
        ({"rate": float("nan")}, "a rate is a number from 0.001 to 1000, got nan"),
        ({"rate": 1e9}, "a rate is a number from 0.001 to 1000, got 1e"),
    ],
)
def test_an_invalid_start_or_rate_is_refused(bag, options, words):
    recording = Recording([bag])
    with pytest.raises(ConfigError, match=words):
        Player(recording, **options)
    recording.close()


def test_a_damaged_recording_is_played_up_to_the_damage(bag, monkeypatch, caplog):
    whole = Recording.messages

    def damaged(self, start):
        yield from list(whole(self, start))[:-2]
        raise ConfigError("office cannot be read as a recording: it is cut off")

    monkeypatch.setattr(Recording, "messages", damaged)

    async def story():
        async with played(bag) as player:
            client = Client(player).listen("/odom")
            await until(lambda: "ended" in player.status)
            assert xs(client) == [1.0, 2.0]

    asyncio.run(story())
    assert "the rest of the recording is not played" in caplog.text
