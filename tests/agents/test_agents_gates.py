"""A page's socket at the gates of agents and at the gate of its own computer."""

import json

import pytest

from equipment.declarations import declared
from webmap.agents.gates import Gates
from webmap.base.errors import ConfigError
from webmap.gate.display.client import GateClient
from webmap.gate.protocol import FromPage, FromProgram, Tick

AGENT = "zenoh://127.0.0.1:7447/bay3"

THERE = "bay3/r1"
"""A robot of the agent."""


class Link:
    """A link to a gate; keeps the frames that are sent."""

    ready, trouble, pid = True, None, None

    def __init__(self, owner, lock):
        self.owner, self.texts, self.moved_for = owner, [], []

    def send(self, message):
        if isinstance(message, FromPage):
            self.texts.append(message.text)
        elif isinstance(message, FromProgram):
            self.moved_for.append(message.command.page)


def spec(robot, url):
    return declared(
        id=robot,
        name=robot,
        bridge_url=url,
        twist_topic="/cmd_vel",
        stops_within=1e-9,
        v_max=1.0,
        w_max=1.5,
    )


class Page:
    """A page of a display with a robot of its own and one of an agent."""

    def __init__(self, may_drive=None):
        self.links = []
        gates = Gates()
        gates.own = GateClient(self._link)
        gates.remote[AGENT] = GateClient(self._link, "bay3", "ann.4f/")
        self.own, self.far = self.links
        for robot, url in (("here", "ws://127.0.0.1:9090"), (THERE, AGENT)):
            gates.declare(spec(robot, url))
        self.gates = gates
        self._socket = gates.connect(
            "Ann", "operator", print, print, may_drive=may_drive
        )

    def _link(self, owner, lock):
        self.links.append(Link(owner, lock))
        return self.links[-1]

    def send(self, text):
        """Send a frame; return whether the own gate and the agent's gate got it."""
        for link in self.links:
            link.texts.clear()
        self._socket.receive(text)
        data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
        for link in self.links:
            # Long frames are cut.
            assert all(data.startswith(text) for text in link.texts)
        return tuple(bool(link.texts) for link in self.links)


@pytest.fixture
def page():
    return Page()


def test_a_command_reaches_the_gate_of_its_robot_alone(page):
    for op in ("take", "stop", "cancel"):
        for robot, expected in (("here", (True, False)), (THERE, (False, True))):
            assert page.send(json.dumps({"op": op, "robot": robot})) == expected


@pytest.mark.parametrize(
    ("mine", "reached"), [("here", (True, False)), (THERE, (False, True))]
)
def test_commands_for_robots_of_others_reach_no_gate(mine, reached):
    page = Page(lambda robot: robot == mine)
    for robot in ("here", THERE):
        expected = reached if robot == mine else (False, False)
        for op in ("take", "ask", "cancel", "stop-test"):
            assert page.send(json.dumps({"op": op, "robot": robot})) == expected
        stopped = (True, False) if robot == "here" else (False, True)
        assert page.send(json.dumps({"op": "stop", "robot": robot})) == stopped
    assert page.send('{"op":"stop","robot":"*"}') == (True, True)


def test_a_goal_in_the_name_of_a_page_reaches_the_gate_of_its_robot(page):
    for link in page.links:
        link.owner.hear(Tick(5, {}))
    for robot in ("here", THERE):
        page._socket.move(robot, 1.0, 2.0, 0.5)
    assert (page.own.moved_for, page.far.moved_for) == (["c1"], ["ann.4f/c1.1"])


@pytest.mark.parametrize(
    "text",
    [
        '{"op":"stop","robot":"*"}',
        '{"robot":"*","op":"stop"}',
        '{"op":"stop","robot":"unknown"}',
        '{"op":"stop"',
    ],
)
def test_a_stop_for_no_known_robot_reaches_every_gate(page, text):
    assert page.send(text) == (True, True)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "5",
        "null",
        '"robot"',
        "[5]",
        "[[1,2,3]]",
        "[" * 5000,
        "\ud800",
        b"\xff",
        "{",
    ],
)
def test_a_frame_that_is_no_command_is_refused_by_the_own_gate(page, text):
    assert page.send(text) == (True, False)


@pytest.mark.parametrize(
    ("robot", "url"),
    [
        ("here", AGENT),
        ("bay4/r1", AGENT),
        (THERE, "ws://127.0.0.1:9090"),
        (THERE, "zenoh://elsewhere:7447/bay3"),
    ],
)
def test_a_robot_with_the_identifier_of_another_gate_is_refused(page, robot, url):
    with pytest.raises(
        ConfigError, match=r"robot of another gate|has an agent bay3 already"
    ):
        page.gates.declare(spec(robot, url))
    for own, expected in (("here", (True, False)), (THERE, (False, True))):
        assert page.send(json.dumps({"op": "stop", "robot": own})) == expected
    assert page.send('{"op":"stop","robot":"*"}') == (True, True)
