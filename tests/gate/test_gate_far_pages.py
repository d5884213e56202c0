"""A page at the gate of an agent: its messages, and its id at the agent."""

import json
import threading

import msgspec
import pytest

from equipment.gate_reports import robot_report
from webmap.gate.display.client import GateClient
from webmap.gate.protocol import (
    AskerReport,
    Connect,
    Disconnect,
    FromPage,
    GateDown,
    Hello,
    Holder,
    Identity,
    LeaseEnded,
    PageAsked,
    Ready,
    Refused,
    Rename,
    RobotGone,
    Speeds,
    StopReport,
    TakeReply,
    Tick,
)

PREFIX = "ann.4f/"

REPORT = robot_report(state="held", doing="held")


class Link:
    """A link to a gate; keeps the messages that are sent."""

    ready, trouble, pid = True, None, None

    def __init__(self, owner, lock):
        self.sent = []

    def start(self):
        pass

    def stop(self):
        pass

    def send(self, message):
        self.sent.append(message)


class Bench:
    def __init__(self):
        self.client = GateClient(self.make, "bay3", PREFIX)
        self.messages = []
        self.page = self.connect()
        self.id = f"{PREFIX}c7.1"

    def make(self, owner, lock):
        assert isinstance(lock, type(threading.RLock()))
        self.link = Link(owner, lock)
        return self.link

    def connect(self):
        def note(text):
            self.messages.append(json.loads(text))

        return self.client.connect("Ann", "operator", note, print, "c7")

    def receive(self, message):
        self.messages.clear()
        self.client.hear(message)
        return list(self.messages)


@pytest.fixture
def bench():
    return Bench()


def test_the_page_has_its_own_id_behind_the_name_of_the_display(bench):
    assert bench.page.id == bench.id
    assert bench.link.sent == [Connect(bench.id, "Ann", "operator")]
    bench.page.receive('{"op":"x"}')
    bench.page.set_speeds(1.0, 2.0)
    bench.page.close()
    assert bench.link.sent[1:] == [
        FromPage(bench.id, b'{"op":"x"}'),
        Speeds(bench.id, 1.0, 2.0),
        Disconnect(bench.id),
    ]


def test_a_page_that_connects_again_has_another_id(bench):
    assert bench.connect().id == f"{PREFIX}c7.2"


def test_a_tick_names_the_agent(bench):
    (tick,) = bench.receive(Tick(5, {bench.id: 3}))
    assert tick == {"op": "tick", "tick": 5, "ack": 3, "gate": "bay3"}


def test_a_report_names_the_agent_and_this_page_by_its_own_id(bench):
    held = msgspec.structs.replace(
        REPORT,
        holder=Holder(bench.id, "Ann"),
        asker=AskerReport("ben.5e/c1.1", "Ben", 5.0),
    )
    (message,) = bench.receive(held)
    assert (message["gate"], message["mine"]) == ("bay3", True)
    assert message["holder"]["connection"] == "c7"
    assert message["asker"]["connection"] == "ben.5e/c1.1"


def test_a_person_is_recognized_in_a_report_of_an_agent(bench):
    held = msgspec.structs.replace(
        REPORT,
        holder=Holder(bench.id, "Ann", Identity(f"{PREFIX}91c2", "p1")),
        asker=AskerReport("ben.5e/c1.1", "Ben", 5.0, Identity("ben.5e/91c2", "p2")),
        stop=StopReport("\u05e8", True, "", "s1", Identity(f"{PREFIX}91c2", "p1")),
    )
    (message,) = bench.receive(held)
    assert message["holder"]["identity"] == {"person": "91c2", "page": "p1"}
    assert message["asker"]["identity"]["person"] == "ben.5e/91c2"
    assert message["stop"]["identity"]["person"] == "91c2"
    assert message["stop"]["by"] == "\u2068\u05e8\u2069"


def test_the_agent_gets_a_new_name_once(bench):
    bench.page.rename("Eva")
    bench.page.rename("Eva")
    assert bench.link.sent[1:] == [Rename(bench.id, "Eva")]


def test_the_hello_of_an_agent_is_not_for_the_page_but_its_robots_are(bench):
    bench.receive(REPORT)
    (message,) = bench.receive(Hello(bench.id))
    assert (message["op"], message["robot"]) == ("robot", "r1")
    bench.messages.clear()
    bench.client.show_again(bench.page)
    assert [message["op"] for message in bench.messages] == ["robot"]


def test_a_page_that_connects_later_is_told_of_the_robots_at_once(bench):
    bench.receive(REPORT)
    bench.messages.clear()
    bench.connect()
    assert [message["op"] for message in bench.messages] == ["robot"]


def test_the_robots_of_a_lost_agent_stay_on_the_page(bench):
    bench.receive(REPORT)
    bench.client.gone(GateDown("no connection"))
    bench.messages.clear()
    bench.client.show_again(bench.page)
    assert [message["op"] for message in bench.messages] == ["robot"]
    assert bench.receive(RobotGone("r1")) == [{"op": "gone", "robot": "r1"}]
    assert bench.receive(Ready(0)) == []
    assert bench.client._pages.latest == []


def test_the_program_knows_its_replies_by_its_name_at_the_agent(bench):
    taken = bench.client.take("r1")
    for other in ("program", "ben.5e/program"):
        bench.receive(TakeReply(1, "r1", 3, None, other))
    assert not taken.done()
    bench.receive(TakeReply(1, "r1", 4, None, f"{PREFIX}program"))
    assert taken.result(1) == 4


def test_listeners_learn_who_asks_to_end_a_stop_and_why_control_ended(bench):
    heard = []
    bench.client.on_report(heard.append)
    bench.page.receive('{"op":"reset","robot":"r1","stop":"5f0c"}')
    bench.page.receive('{"op":"cancel","robot":"r1"}')
    bench.page.receive('{"op":"reset","robot":7}')
    bench.page.receive('{"op":"take","robot":"reset"}')
    bench.receive(Refused(bench.id, "r1", "reset", "only an operator may"))
    bench.receive(Refused(bench.id, "r1", "lease", "the page was closed"))
    bench.page.close()
    bench.page.receive('{"op":"cancel","robot":"r1"}')
    assert heard == [
        PageAsked("r1", "reset", "Ann", None),
        PageAsked("r1", "cancel", "Ann", None),
        PageAsked("r1", "reset", "", None),
        LeaseEnded("r1", "the page was closed"),
        PageAsked("r1", "cancel", "", None),
    ]
    assert len(bench.link.sent) == 7  # each command went to the gate all the same
