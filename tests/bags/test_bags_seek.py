"""What subscribers receive after a seek, a pause and a new speed."""

import asyncio

import msgspec
import pytest
from played_bag import Client, played, xs

from equipment.bag_files import BEGIN, FRAMES, GRID, ODOMETRY
from equipment.waiting import until
from webmap.bags import player as player_module
from webmap.bags.playback import MARKS, STATUS
from webmap.bags.recording import Recording
from webmap.base.errors import ConfigError

pytestmark = pytest.mark.slow

LOG = {"ros1": "rosgraph_msgs/Log", "ros2": "rcl_interfaces/Log"}


@pytest.fixture(scope="module")
def bag(made, tmp_path_factory):
    """A bag with two maps, frames of two nodes, a pose each second, and a log error."""
    log = LOG[made.dialect]
    error = made.message(log, level=40, name="/base", msg="stuck")
    return made.bag(
        tmp_path_factory.mktemp(made.dialect) / "office",
        ("/map", GRID, 0.0, made.grid([0, 100])),
        ("/tf_static", FRAMES, 0.0, made.frame("laser")),
        ("/tf", FRAMES, 3.9, made.frame("base", 3.9)),
        ("/tf", FRAMES, 3.95, made.frame("odom", 3.95)),
        ("/map", GRID, 5.0, made.grid([100, 100])),
        ("/tf_static", FRAMES, 5.0, made.frame("camera")),
        ("/rosout", log, 5.5, error),
        *(("/odom", ODOMETRY, at, made.odometry(at, float(at))) for at in range(1, 9)),
    )


def grids(client):
    return [message["data"] for message in client.messages("/map")]


def children(client, topic):
    messages = client.messages(topic)
    return [[one["child_frame_id"] for one in each["transforms"]] for each in messages]


def statuses(client):
    return [msgspec.json.decode(one["data"]) for one in client.messages(STATUS)]


def test_a_seek_back_while_paused_shows_the_state_of_that_position(bag):
    async def story():
        async with played(bag) as player:
            client = Client(player).listen(
                "/odom", "/map", "/tf_static", "/tf", "/rosout"
            )
            await until(lambda: player.status.ended)
            assert grids(client)[-1] == [100, 100]
            logged = len(client.messages("/rosout"))
            player.obey("seek 3.97")
            await until(lambda: grids(client)[-1] == [0, 100])
            await until(lambda: xs(client)[-1] == 3.0)
            assert children(client, "/tf_static")[-1] == ["laser"]
            assert children(client, "/tf")[-1] == ["base", "odom"]
            assert len(client.messages("/rosout")) == logged
            assert not player.status.playing

    asyncio.run(story())


def test_after_a_seek_back_a_late_subscriber_gets_no_later_map(bag):
    async def story():
        async with played(bag) as player:
            early = Client(player).listen("/odom")
            await until(lambda: player.status.ended)
            player.obey("seek 2.5")
            await until(lambda: xs(early)[-1] == 2.0)
            late = Client(player).listen("/map", "/tf_static")
            assert grids(late) == [[0, 100]]
            assert children(late, "/tf_static") == [["laser"]]

    asyncio.run(story())


def test_a_seek_forward_shows_the_newest_map_before_the_position(bag):
    async def story():
        async with played(bag) as player:
            client = Client(player).listen("/odom", "/map")
            player.obey("pause")
            player.obey("seek 7.5")
            await until(lambda: xs(client))
            assert xs(client)[0] == 7.0
            assert grids(client) == [[100, 100]]

    asyncio.run(story())


def test_after_a_seek_while_playing_the_following_messages_come(bag):
    async def story():
        async with played(bag) as player:
            client = Client(player).listen("/odom")
            player.obey("seek 6.5")
            await until(lambda: player.status.ended)
            assert xs(client)[:3] == [6.0, 7.0, 8.0]

    asyncio.run(story())


def test_only_the_newest_of_several_seeks_is_carried_out(bag):
    async def story():
        async with played(bag) as player:
            client = Client(player).listen("/odom")
            for at in (7, 1, 3.5):
                player.obey(f"seek {at}")
            await until(lambda: xs(client))
            assert xs(client)[0] == 3.0

    asyncio.run(story())


def test_the_state_is_repeated_while_the_position_is_held(bag, monkeypatch):
    monkeypatch.setattr(player_module, "HOLD", 0.01)

    async def story():
        async with played(bag) as player:
            client = Client(player).listen("/odom", "/map")
            player.obey("pause")
            player.obey("seek 4.5")
            await until(lambda: len(xs(client)) > 5)
            assert set(xs(client)) == {4.0}
            assert len(grids(client)) == 1

    asyncio.run(story())


def test_each_command_is_shown_in_the_status_at_once(bag, monkeypatch):
    monkeypatch.setattr(player_module, "STATUS_PERIOD", 1000)

    async def story():
        async with played(bag) as player:
            client = Client(player).listen(STATUS)
            await until(lambda: player.status.ended)
            for line, key, value in (
                ("rate 2", "rate", 2.0),
                ("seek 3", "at", 3.0),
                ("play", "playing", True),
            ):
                player.obey(line)
                await until(lambda k=key, v=value: statuses(client)[-1][k] == v)

    asyncio.run(story())


@pytest.mark.parametrize("line", ["", "stop", "seek", "seek x", "rate nan", "rate -1"])
def test_an_invalid_command_is_logged_and_changes_nothing(bag, caplog, line):
    async def story():
        async with played(bag) as player:
            before = player.status
            player.obey(line)
            assert player.status == before

    asyncio.run(story())
    assert "got" in caplog.text


def test_the_marks_are_published_after_the_first_picture(bag):
    async def story():
        async with played(bag) as player:
            client = Client(player).listen("/odom", MARKS)
            found = await until(
                lambda: [
                    marks
                    for one in client.messages(MARKS)
                    if (marks := msgspec.json.decode(one["data"]))["read"] == 1
                ]
            )
            assert [mark["text"] for mark in found[0]["marks"]] == ["/base: stuck"]

    asyncio.run(story())


def test_a_damaged_recording_names_the_damage_and_can_be_played_again(bag, monkeypatch):
    whole = Recording.messages

    def damaged(self, start):
        for recorded in whole(self, start):
            if recorded.time > BEGIN + 3.5e9:
                raise ConfigError("office cannot be read as a recording: it is damaged")
            yield recorded

    monkeypatch.setattr(Recording, "messages", damaged)

    async def story():
        async with played(bag) as player:
            Client(player).listen("/odom")
            await until(lambda: player.status.ended)
            assert player.status.problem.endswith("it is damaged")
            player.obey("play")
            await until(lambda: player.status.jumps == 1 and player.status.ended)
            assert player.status.problem.endswith("it is damaged")

    asyncio.run(story())


def test_a_state_that_cannot_be_read_is_a_problem_and_ends_nothing(bag, monkeypatch):
    def damaged(self, time, go_on):
        raise ConfigError("office cannot be read as a recording: it is damaged")

    monkeypatch.setattr(Recording, "state_at", damaged)

    async def story():
        async with played(bag) as player:
            client = Client(player).listen("/odom")
            await until(lambda: len(xs(client)) >= 8)
            assert player.status.problem.endswith("it is damaged")

    asyncio.run(story())


def test_the_state_looks_back_further_for_rare_topics(made, tmp_path):
    bag = made.bag(
        tmp_path / "rare",
        ("/map", GRID, 0.0, made.grid([0])),
        ("/old", ODOMETRY, 1.0, made.odometry(1.0, 1.0)),
        ("/rare", ODOMETRY, 170.0, made.odometry(170.0, 2.0)),
        ("/odom", ODOMETRY, 199.0, made.odometry(199.0, 3.0)),
        ("/odom", ODOMETRY, 300.0, made.odometry(300.0, 4.0)),
    )
    recording = Recording([bag])
    state = recording.state_at(BEGIN + 200 * 10**9)
    assert [one.topic for one in state] == ["/map", "/rare", "/odom"]
    recording.close()
