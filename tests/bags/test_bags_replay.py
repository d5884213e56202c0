"""Playing a recording: what subscribers receive, and which requests are refused."""

import asyncio
import threading
import time

import msgspec
import pytest
from played_bag import NOW, Client, played, xs

from equipment.bag_files import BEGIN, FRAMES, GRID, ODOMETRY, TWIST
from equipment.waiting import until
from webmap.bags import player as player_module
from webmap.bags.playback import MARKS, STATUS
from webmap.bags.player import REFUSED, Player
from webmap.bags.recording import Recording
from webmap.bags.times import SECOND
from webmap.base.errors import ConfigError

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def bag(made, tmp_path_factory):
    """First a map and two static frames, then a pose each second."""
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
            await until(lambda: len(xs(client)) >= 4)
            assert xs(client)[:4] == [1.0, 2.0, 3.0, 4.0]

    asyncio.run(story())


def test_stamps_are_moved_to_the_time_of_playing(made, bag):
    async def story():
        recording = Recording([bag])
        player = Player(recording, now=lambda: NOW + SECOND)
        player.replay.start()
        client = Client(player).listen("/odom")
        first = next(m for m in recording.messages(BEGIN) if m.topic == "/odom")
        player.replay.publish(first, player._playback.pace(NOW + SECOND))
        (message,) = client.messages("/odom")
        whole, rest = made.time(0)
        # It was published, and arrived, one second after the begin.
        moved = NOW // SECOND + 2
        assert message["header"]["stamp"] == {whole: moved, rest: 0}
        recording.close()

    asyncio.run(story())


def test_a_late_subscriber_receives_the_map_and_all_static_frames(bag):
    async def story():
        async with played(bag) as player:
            early = Client(player).listen("/odom")
            await until(lambda: len(xs(early)) >= 4)
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
            await until(lambda: len(xs(client)) >= 3)
            assert xs(client)[:3] == [2.0, 3.0, 4.0]
            # At the end, the map comes once more.
            topics = [one["topic"] for one in client.operations() if "topic" in one]
            assert topics[:2] == ["/map", "/odom"]

    asyncio.run(story())


def test_playing_ends_without_loop_and_restarts_with_loop(bag):
    async def story():
        async with played(bag, loop=True) as player:
            client = Client(player).listen("/odom")
            await until(lambda: len(xs(client)) >= 9)
            assert xs(client)[:9] == [1.0, 2.0, 3.0, 4.0] * 2 + [1.0]
        async with played(bag) as player:
            client = Client(player).listen("/odom")
            await until(lambda: player.status.ended)
            assert xs(client)[:4] == [1.0, 2.0, 3.0, 4.0]

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


def test_the_state_at_a_position_is_read_in_another_thread(bag, monkeypatch):
    whole, threads = Recording.state_at, []

    def noted(self, *arguments):
        threads.append(threading.current_thread())
        return whole(self, *arguments)

    monkeypatch.setattr(Recording, "state_at", noted)

    async def story():
        async with played(bag, start=2.5) as player:
            client = Client(player).listen("/odom")
            await until(lambda: xs(client))

    asyncio.run(story())
    assert threading.main_thread() not in threads


def test_playing_starts_only_after_the_first_subscription(bag):
    async def story():
        async with played(bag) as player:
            for _ in range(50):
                await asyncio.sleep(0)
            late = Client(player).listen("/odom")
            await until(lambda: len(xs(late)) >= 4)

    asyncio.run(story())


def test_the_status_has_the_name_the_position_the_length_and_the_speed(bag):
    async def story():
        async with played(bag, start=1.0) as player:
            client = Client(player).listen(STATUS)
            (text, *_) = await until(lambda: client.messages(STATUS))
            assert msgspec.json.decode(text["data"]) == {
                "name": player._recording.name,
                "at": 1.0,
                "seconds": 4.0,
                "rate": 1000.0,
                "playing": True,
                "ended": False,
                "jumps": 0,
                "problem": "",
            }

    asyncio.run(story())


def test_rosapi_lists_the_topics_of_the_recording_with_types_of_its_dialect(made, bag):
    async def story():
        async with played(bag) as player:
            topics = Client(player).call("/rosapi/topics")
            types = dict(zip(topics["topics"], topics["types"], strict=True))
            spell = made.schema.dialect.spell
            assert types["/odom"] == spell(ODOMETRY)
            assert types["/cmd_vel"] == spell(TWIST)
            own = {STATUS, MARKS}
            assert set(types) == {"/odom", "/cmd_vel", "/map", "/tf_static"} | own

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
            await until(lambda: player.status.ended)
            client = Client(player)
            client.send(**operation)
            assert [one["msg"] for one in client.operations()] == [REFUSED]
            speeds = {one["linear"]["x"] for one in other.messages("/cmd_vel")}
            assert speeds == {0.3}

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
            await until(lambda: player.status.ended)
            assert set(xs(client)) == {1.0, 2.0}

    asyncio.run(story())
    assert "the rest of the recording is not played" in caplog.text
