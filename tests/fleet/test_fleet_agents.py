"""Fleet files with robots of agents, which the agents describe themselves."""

import asyncio
import socket
import sys
from types import SimpleNamespace as Namespace

import msgspec
import pytest

from webmap import Robot
from webmap.agents.announcements import (
    DEEPEST,
    MOST_OF_ROBOT,
    MOST_ROBOTS,
    About,
)
from webmap.base.errors import ConfigError
from webmap.base.lifecycle import Lifecycle
from webmap.console import Console
from webmap.core.motion import id_at_agent
from webmap.core.pictures import pictures
from webmap.fleet import agent_robots, remote_robots
from webmap.fleet.agent_robots import open_addresses
from webmap.fleet.fleet_file import prepare

AGENTS = '[bridges]\nyard = "zenoh://hall:7447"\n'


def written(folder, text):
    file = folder / "fleet.toml"
    file.write_text(text)
    return file


def test_a_file_with_agents_needs_no_robots(tmp_path):
    ready = prepare(written(tmp_path, AGENTS))
    assert (ready.agents, ready.bridges, ready.robots) == (["zenoh://hall"], {}, [])


def test_robots_without_a_bridge_are_behind_the_only_rosbridge(tmp_path):
    text = f'{AGENTS}hall = "ws://hall:9090"\n[[robots]]\nname = "Bob"\n'
    ready = prepare(written(tmp_path, f'{text}odometry = "/odom"\n'))
    (robot,) = ready.robots
    assert robot.feed.bridge is ready.bridges["hall"]
    robot.destroy()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            f'{AGENTS}[[robots]]\nname = "Bob"\nbridge = "yard"\nodometry = "/odom"',
            "yard is for agents, whose own fleet files have their robots",
        ),
        (
            '[bridges]\nyard = {url = "zenoh://hall", alignment = [1.0, 2.0, 0.0]}',
            "the fleet file of each agent has the alignment of its robots",
        ),
        ('[bridges]\nhall = "ws://hall:9090"', "robots: got nothing"),
    ],
)
def test_what_an_agent_describes_itself_is_refused(tmp_path, text, words):
    with pytest.raises(ConfigError, match=words):
        prepare(written(tmp_path, text))


@pytest.mark.skipif(sys.platform != "linux", reason="/proc lists the sockets")
def test_a_rosbridge_on_loopback_is_reached_by_this_computer_alone():
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        assert open_addresses(f"ws://127.0.0.1:{port}") == []


def test_an_agent_knows_where_other_computers_reach_its_rosbridge(monkeypatch):
    places = ["127.0.0.1", "0.0.0.0", "192.0.2.7"]
    monkeypatch.setattr(agent_robots, "listening_addresses", lambda _: places)
    assert open_addresses("ws://127.0.0.1:9090") == ["0.0.0.0", "192.0.2.7"]


def test_a_rosbridge_on_another_computer_is_reached_by_others():
    assert open_addresses("ws://192.0.2.7:9090") == ["192.0.2.7"]


class FakePeer:
    """The sessions with a router whose agents send these answers."""

    trouble = None

    def __init__(self):
        self.answers = {}

    def listen(self, key, fn, *, gate=False):
        return 0

    def ask(self, key, patience=0.0, most=0):
        return self.answers.get(key)


@pytest.fixture
def shown(monkeypatch):
    """A display that knows the agent bay3, and the display's messages to users."""
    peer, notices = FakePeer(), []
    monkeypatch.setattr(remote_robots, "peer_of", lambda router: peer)
    monkeypatch.setattr(remote_robots, "lifecycle", Lifecycle())
    monkeypatch.setattr(remote_robots, "PICTURE_AGAIN", 0.0)
    monkeypatch.setattr(remote_robots.runtime, "notice", notices.append)
    agents, console = remote_robots.RemoteAgents("zenoh://hall/bay3"), Console()

    async def apply(agent, answer, beside):
        task = beside and asyncio.create_task(beside)
        await agents._apply(agent, answer, console)
        if task:
            task.cancel()

    def show(*robots, beside=None):
        agent = agents._known["bay3"]
        configs = [{"bridge": "b", "odometry": "/odom", **each} for each in robots]
        described = [msgspec.Raw(msgspec.json.encode(each)) for each in configs]
        answer = msgspec.json.encode(About(["b"], described, []))
        asyncio.run(apply(agent, answer, beside))
        if remote_robots._undrawn(agent):
            asyncio.run(agents._draw(agent))
        return {robot.name: robot for robot in console.robots}

    show.agents = agents
    yield show, peer, notices
    for robot in list(console.robots):
        robot.destroy()


def pictured(name):
    return {"picture": {"file": name, "width": 1.0, "height": 0.5}}


def hrefs(robot):
    images = [each for each in robot.svg.walk() if getattr(each, "tag", "") == "image"]
    return [each.get("href") for each in images]


def test_a_robot_gets_its_picture_when_it_comes_and_its_usual_body_without(shown):
    show, peer, notices = shown
    one, other = "1" * 32 + ".svg", "2" * 32 + ".svg"
    bob = show({"name": "Bob", **pictured(one)})["Bob (bay3)"]
    assert hrefs(bob) == []
    for name in (one, other):
        peer.answers[f"webmap/bay3/about/{name}"] = b"<svg>%s</svg>" % name.encode()
        assert show({"name": "Bob", **pictured(name)}) == {"Bob (bay3)": bob}
        (url,) = hrefs(bob)
        image = pictures.get(url.rpartition("/")[2])
        assert (image.data, image.media_type) == (
            peer.answers[f"webmap/bay3/about/{name}"],
            "image/svg+xml; charset=utf-8",
        )
    show({"name": "Bob"})
    assert (hrefs(bob), notices) == ([], [])


def test_what_is_no_picture_is_reported_and_asked_for_once(shown):
    show, peer, notices = shown
    name = "1" * 32 + ".png"
    peer.answers[f"webmap/bay3/about/{name}"] = b"<script>"
    for _ in range(2):
        assert hrefs(show({"name": "Bob", **pictured(name)})["Bob (bay3)"]) == []
    (notice,) = notices
    assert notice.startswith("A picture of the agent bay3 is not shown: ")
    assert "expected a complete picture in the format of its suffix .png" in notice


def test_a_robot_that_cannot_be_shown_leaves_the_others(shown):
    show, _, notices = shown
    elsewhere = {"odometry": {"topic": "/odom", "bridge": "ws://elsewhere"}}
    robots = show({"name": "Ann", **elsewhere}, {"name": "Bob"})
    assert list(robots) == ["Bob (bay3)"]
    assert notices == [
        "Ann of the agent bay3 is not shown: 'ws://elsewhere' is not the rosbridge of "
        "the agent."
    ]


def test_an_agent_with_other_robots_each_time_adds_two_per_second(shown, monkeypatch):
    show, _, _ = shown
    now, threads = [0.0], asyncio.to_thread

    async def sleep(seconds):
        now[0] += seconds

    monkeypatch.setattr(remote_robots, "time", Namespace(monotonic=lambda: now[0]))
    fake = Namespace(sleep=sleep, to_thread=threads)
    monkeypatch.setattr(remote_robots, "asyncio", fake)
    names = [f"r{number}" for number in range(MOST_ROBOTS + 40)]
    show(*({"name": name} for name in names[:MOST_ROBOTS]))
    assert now[0] == 0.0
    robots = show(*({"name": name} for name in names[MOST_ROBOTS:]))
    assert len(robots) == 40
    assert now[0] == pytest.approx(20.0, rel=0.1)


def test_every_display_has_the_same_name_for_a_robot(shown):
    show, _, _ = shown
    assert list(show({"name": "Bob"}, {"name": "Bay3"})) == ["Bob (bay3)", "Bay3"]


def test_the_identifier_of_an_agents_robot_contains_its_agent_and_is_not_sent(shown):
    show, _, notices = shown
    other = Robot("Victim")
    (bob,) = show({"name": "Bob"}, {"name": "Eve", "id": other.id}).values()
    assert bob.id == id_at_agent("bay3", "Bob")
    assert bob.id.startswith("bay3/")
    (notice,) = notices
    assert notice.startswith("Agent bay3: robot 2 is not shown: ")
    other.destroy()


def test_of_two_robots_of_an_agent_with_one_name_the_first_is_shown(shown):
    show, _, notices = shown
    (bob,) = show({"name": "Bob", "tags": "first"}, {"name": "Bob"}).values()
    assert bob.tags == ("first",)
    assert notices == [
        "Agent bay3: robot 2 is not shown: a second robot has the name 'Bob'."
    ]
    assert list(show({"name": "Bob"}).values()) == [bob]
    assert show() == {}
    (again,) = show({"name": "Bob"}).values()
    assert again.id == bob.id


def test_a_description_is_refused_beyond_its_limits_before_anything_is_built(shown):
    show, _, notices = shown
    deep = {"tag": "g"}
    for _ in range(DEEPEST):
        deep = {"tag": "g", "children": [deep]}
    names = [{"name": f"Bob {number}"} for number in range(MOST_ROBOTS)]
    assert len(show(*names, {"name": "Eve"})) == MOST_ROBOTS
    long = {"name": "Eve", "classes": ["a" * MOST_OF_ROBOT]}
    assert show(long, {"name": "Eve", "model": deep}) == {}
    assert notices == [
        "Agent bay3: only the first robots are shown: got 201 robots, expected 200 at "
        "most.",
        "Agent bay3: robot 1 is not shown: got 65597 bytes, expected 65536 at most.",
        "Agent bay3: robot 2 is not shown: got values nested deeper than 32 levels.",
    ]


def test_an_agent_that_changes_all_the_time_is_asked_a_few_times(shown):
    show, _, _ = shown
    agent = show.agents._known["bay3"]
    asked = [agent.may_be_asked(0.5 * number) for number in range(130)]
    assert asked.count(True) == 30


def test_other_work_goes_on_while_many_robots_are_built(shown):
    show, _, _ = shown
    turns = []

    async def work():
        while True:
            turns.append(None)
            await asyncio.sleep(0)

    show(*({"name": f"Bob {number}"} for number in range(50)), beside=work())
    assert len(turns) > 50
