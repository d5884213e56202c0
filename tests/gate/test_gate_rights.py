"""Rights for single robots: what reaches the gate of a person who may drive some."""

import json
from typing import get_args

import msgspec
import pytest

from equipment.gate_harness import Bench, spec
from webmap.base.errors import MotionError
from webmap.base.roles import NOT_YOURS
from webmap.gate import protocol
from webmap.gate.commands import PageCommand, Release, Stop, op_of, parse
from webmap.gate.display import pages as module
from webmap.gate.display.client import GateClient

COMMANDS = get_args(PageCommand)
VALUES = {int: 1, float: 0.5, str: "x", str | None: "x"}


class Link:
    """A gate that keeps what it gets."""

    ready, trouble, pid = True, None, 1

    def __init__(self, owner, lock):
        self.sent = []

    def send(self, message):
        self.sent.append(message)


@pytest.fixture
def client():
    client = GateClient(Link)
    for robot in ("mine", "other"):
        client.declare(spec(id=robot, name=robot))
    client.hear(protocol.Tick(7, {}))
    return client


def connect(client, may_drive):
    texts = []
    page = client.connect("Ann", "operator", texts.append, print, may_drive=may_drive)
    client.hear(protocol.Hello(page.id))
    texts.clear()
    return page, texts


def message(command, robot):
    """Return a valid message of a page, made from the fields of its command."""
    fields = {
        each.name: VALUES[each.type]
        for each in msgspec.structs.fields(command)
        if each.required
    }
    fields |= {"op": command.__struct_config__.tag, "robot": robot}
    data = json.dumps(fields).encode()
    assert isinstance(parse(data), command)
    return data


def passed_on(client):
    found = [m for m in client._supervisor.sent if isinstance(m, protocol.FromPage)]
    return [parse(each.text) for each in found]


def test_there_are_commands_to_test():
    assert len(COMMANDS) >= 13
    assert {Stop, Release} < {*COMMANDS}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("robot", ["mine", "other", "unknown"])
def test_a_command_reaches_the_gate_only_for_robots_of_the_person(
    client, command, robot
):
    page, texts = connect(client, lambda id: id == "mine")
    page.receive(message(command, robot))
    if robot == "mine" or command in (Stop, Release):
        assert [type(each) for each in passed_on(client)] == [command]
        assert texts == []
    else:
        assert passed_on(client) == []
        [refused] = map(json.loads, texts)
        what = op_of(parse(message(command, robot)))
        wanted = {"op": "refused", "robot": robot, "what": what, "why": NOT_YOURS}
        assert refused == wanted


def test_a_person_of_all_robots_is_not_asked_about(client):
    page, texts = connect(client, None)
    for command in COMMANDS:
        page.receive(message(command, "other"))
    assert len(passed_on(client)) == len(COMMANDS)
    assert texts == []


@pytest.mark.parametrize(
    "data",
    [
        b'{"op": "stop", "robot": "*"}',
        b'{"op": "stop", "robot": "other", "more": 1}',
        b'{"op": "take"}',
        b"no json",
        b'{"op": "take", "robot": "mine", "robot": "other"}',
    ],
)
def test_the_gate_itself_gets_stops_and_what_is_not_valid(client, data):
    page, texts = connect(client, lambda id: False)
    page.receive(data)
    sent = [m for m in client._supervisor.sent if isinstance(m, protocol.FromPage)]
    assert [each.text for each in sent] == [data]
    assert texts == []


def test_a_right_that_ends_counts_for_the_next_command(client):
    rights = {"mine"}
    page, _ = connect(client, rights.__contains__)
    take = message(COMMANDS[0], "mine")
    page.receive(take)
    rights.clear()
    page.receive(take)
    assert len(passed_on(client)) == 1


def test_a_program_sends_no_goal_for_a_person_who_may_not_drive_the_robot(client):
    page, _ = connect(client, lambda id: id == "mine")
    page.move("mine", 1.0, 2.0, 0.0)
    with pytest.raises(MotionError, match="Its own operators can drive it"):
        page.move("other", 1.0, 2.0, 0.0)
    sent = [m for m in client._supervisor.sent if isinstance(m, protocol.FromProgram)]
    assert [each.command.robot for each in sent] == ["mine"]


def test_a_report_states_that_the_person_only_looks(client):
    (mine, some), (all, every) = (
        connect(client, lambda id: False),
        connect(client, None),
    )
    report = Bench().begin().report()
    client.hear(report)
    client.show_again(mine)
    client.show_again(all)
    assert [json.loads(text).get("looks") for text in some] == [True, True]
    assert ["looks" in json.loads(text) for text in every] == [False, False]
    for each in map(json.loads, some):
        assert (each["method"], each["cancels"], each["locates"]) == (
            None,
            False,
            False,
        )


def test_refused_commands_are_counted_once_a_second_at_most(client, monkeypatch):
    counts, clock = [], [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: clock[0])
    client.on_report(counts.append)
    page, _ = connect(client, lambda id: False)
    take = message(COMMANDS[0], "other")
    for _ in range(5):
        page.receive(take)
    clock[0] += 1.0
    page.receive(take)
    last = f"take: {NOT_YOURS}"
    expected = [protocol.RefusedCount("Ann", n, last) for n in (1, 5)]
    assert [each for each in counts if each.__class__ is protocol.RefusedCount] == (
        expected
    )
