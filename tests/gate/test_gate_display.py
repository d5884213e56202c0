"""The display's end of the pipe, with a gate that says what a test has it say."""

import json
import math
import threading

import msgspec
import pytest
from gate_harness import Bench, spec
from gate_robot import eventually

from webmap.base.errors import ConfigError, MotionError, NoLease
from webmap.base.geometry import Twist
from webmap.gate import commands, protocol
from webmap.gate.display import supervisor
from webmap.gate.display.client import GateClient
from webmap.gate.display.program import ProgramCommands
from webmap.gate.protocol import PROGRAM, Holder


class FakeGateProcess:
    """A gate's process that notes what it is told."""

    pid = 4711
    end_reason = "ended by SIGKILL"
    made: list["FakeGateProcess"] = []

    def __init__(self, hear, ended):
        self._hear, self._ended = hear, ended
        self.received, self.killed, self.stopped = [], [], False
        self.made.append(self)

    def start(self):
        pass

    def send(self, *received):
        self.received.extend(received)

    def kill(self, why):
        self.killed.append(why)

    def stop(self, timeout):
        self.stopped = True

    def say(self, *said):
        for message in said:
            self._hear(self, message)

    def die(self):
        self._ended(self)

    def of(self, type):
        return [message for message in self.received if isinstance(message, type)]


@pytest.fixture
def made(monkeypatch):
    monkeypatch.setattr(FakeGateProcess, "made", [])
    monkeypatch.setattr(supervisor, "GateProcess", FakeGateProcess)
    return FakeGateProcess.made


def test_what_cannot_be_said_to_a_gate_is_refused_and_not_kept_for_the_next():
    client = GateClient()
    with pytest.raises(ConfigError, match=r"robot 'Bob'.*object is unsupported"):
        client.declare(spec(name="Bob", holonomic=object()))
    assert client.introduction() == []


@pytest.fixture
def client(made):
    client = GateClient()
    client.declare(spec())
    client.start()
    client.start()
    yield client
    client.stop()


@pytest.fixture
def gate(client, made):
    gate = eventually(lambda: client.pid and made[0], "a gate")
    gate.say(protocol.Ready(1), protocol.Tick(7, {}))
    return gate


def report(holder=None, epoch=None):
    bench = Bench().begin()
    changed = {"holder": holder, "epoch": epoch}
    return msgspec.structs.replace(bench.report(), **changed)


def held():
    return report(Holder(PROGRAM, PROGRAM), 3)


class TestQuickProgram:
    """One that gives velocities without a pause: each STOP would go behind them."""

    @pytest.fixture
    def road(self):
        self.now, self.received = 100.0, []
        road = ProgramCommands(
            self.received.append, threading.RLock(), lambda: self.now
        )
        road.on_tick(7)
        road.on_report(held())
        return road

    def speeds(self):
        return [received.command.velocity[0] for received in self.received]

    def test_is_heard_every_10_ms(self, road):
        for _ in range(1000):
            road.twist("r1", Twist(0.2))
            self.now += 0.0001
        assert len(self.received) == 10

    def test_gets_its_zero_through_at_once(self, road):
        for speed in (0.2, 0.3, 0.0, 0.0, 0.2, 0.0):
            road.twist("r1", Twist(speed))
        assert self.speeds() == [0.2, 0.0]
        self.now += 0.01
        road.twist("r1", Twist(0.3))
        road.twist("r1", Twist())
        assert self.speeds() == [0.2, 0.0, 0.3, 0.0]

    def test_is_refused_as_any_other(self, road):
        road.twist("r1", Twist(0.2))
        with pytest.raises(MotionError):
            road.twist("r1", Twist(math.nan))
        with pytest.raises(NoLease):
            road.twist("r2", Twist(0.2))
        road.on_report(report())
        with pytest.raises(NoLease):
            road.twist("r1", Twist(0.2))
        road.on_report(held())
        road.twist("r1", Twist(0.4))
        assert self.speeds() == [0.2, 0.4], "with another lease it begins anew"


class TestProgram:
    def test_a_lease_is_asked_for_and_given(self, client, gate):
        future = client.take("r1")
        (asked,) = gate.of(protocol.FromProgram)
        gate.say(protocol.TakeReply(asked.request, "r1", 3, None))
        assert future.result(1) == 3
        client.twist("r1", Twist(0.5))
        assert gate.received[-1] == protocol.FromProgram(
            commands.SetVelocity("r1", 3, 7, Twist(0.5).numbers)
        )
        client.move("r1", 1.0, 2.0, 0.5)
        assert gate.received[-1] == protocol.FromProgram(
            commands.Goal("r1", 3, 0, 7, 1.0, 2.0, 0.5)
        )
        client.locate("r1", 1.0, 2.0, 0.5)
        assert gate.received[-1] == protocol.FromProgram(
            commands.Locate("r1", 3, 0, 7, 1.0, 2.0, 0.5)
        )
        client.cancel("r1")
        assert gate.received[-1] == protocol.FromProgram(commands.Cancel("r1"))
        client.release("r1")
        assert gate.received[-1] == protocol.FromProgram(commands.Release("r1"))
        with pytest.raises(NoLease):
            client.twist("r1", Twist(0.5))

    def test_a_lease_is_asked_for_and_refused(self, client, gate):
        future = client.take("r1")
        (asked,) = gate.of(protocol.FromProgram)
        gate.say(protocol.TakeReply(asked.request, "r1", None, "Ann has control"))
        gate.say(protocol.TakeReply(99, "r1", None, "nobody asked"))
        with pytest.raises(NoLease, match="Ann has control"):
            future.result(1)

    def test_whose_a_robot_is_the_reports_tell(self, client, gate):
        gate.say(held())
        client.twist("r1", Twist(0.5))
        gate.say(report(Holder("c1", "Ann"), 4))
        with pytest.raises(NoLease):
            client.twist("r1", Twist(0.5))

    def test_what_is_not_finite_is_refused_here(self, client, gate):
        with pytest.raises(MotionError, match="finite"):
            client.twist("r1", Twist(math.nan))
        with pytest.raises(MotionError, match="finite"):
            client.move("r1", math.inf, 0.0, 0.0)
        with pytest.raises(MotionError, match="finite"):
            client.locate("r1", 0.0, 0.0, math.nan)

    def test_before_the_gate_runs_nothing_is_had(self, made):
        client = GateClient()
        with pytest.raises(NoLease, match="is not running"):
            client.take("r1").result(1)
        client.reset("r1", "s1")
        client.stop()
        assert made == []

    def test_a_gate_that_dies_takes_leases_and_questions_with_it(self, client, gate):
        gate.say(held())
        future = client.take("r1")
        gate.die()
        gate.die()
        assert gate.stopped
        with pytest.raises(NoLease, match="has ended: ended by SIGKILL"):
            future.result(1)
        with pytest.raises(NoLease):
            client.twist("r1", Twist(0.5))


class TestPages:
    @pytest.fixture
    def said(self):
        return []

    @pytest.fixture
    def page(self, client, gate, said):
        page = client.connect("Ann", "operator", said.append, said.append)
        gate.say(held(), protocol.Hello(page.id))
        return page

    def ops(self, said):
        return [json.loads(text)["op"] for text in said]

    def test_a_page_is_greeted_and_told_what_there_is(self, page, said):
        assert self.ops(said) == ["hello", "robot"]

    def test_a_page_hears_what_is_meant_for_it(self, page, gate, said):
        del said[:]
        gate.say(
            protocol.Tick(8, {"c9": 1}),
            protocol.Tick(9, {page.id: 5}),
            protocol.Refused(page.id, "r1", "take", "Ben drives it"),
            protocol.Refused("c9", "r1", "take", "Ben drives it"),
            protocol.RobotGone("r1"),
            protocol.Hello("c9"),
        )
        assert self.ops(said) == ["tick", "refused", "gone"]
        gate.say(protocol.CloseConnection("c9", "x"))
        gate.say(protocol.CloseConnection(page.id, "too much"))
        assert said[-1] == "too much"

    def test_what_it_says_is_handed_on_and_no_more_after_its_end(self, page, gate):
        page.receive('{"op": "take"}')
        page.receive(b"x" * 5000)
        assert [len(m.text) for m in gate.of(protocol.FromPage)] == [14, 2048]
        page.set_speeds(0.5, 1.0)
        assert gate.received[-1] == protocol.Speeds(page.id, 0.5, 1.0)
        page.close()
        page.close()
        assert gate.of(protocol.Disconnect) == [protocol.Disconnect(page.id)]

    def test_a_page_whose_callback_fails_is_no_others_matter(
        self, client, gate, caplog
    ):
        def fail(text):
            raise RuntimeError("the page is gone")

        page = client.connect("Ann", "operator", fail, fail)
        gate.say(protocol.Hello(page.id), held())
        assert "a callback failed" in caplog.text

    def test_pages_that_ask_for_the_same_are_told_the_same(self, client, gate):
        ann, ben, eve = [], [], []
        for said in (ann, ben, eve):
            page = client.connect("Ann", "operator", said.append, print)
            page.set_speeds(0.2 if said is eve else 0.5, 1.0)
            gate.say(protocol.Hello(page.id))
        gate.say(report())
        assert ann[-1] == ben[-1] != eve[-1]

    def test_there_are_no_other_roles(self, client):
        with pytest.raises(ConfigError, match="role 'king' is none of"):
            client.connect("Ann", "king", print, print)

    def test_a_stop_is_kept_and_what_looks_like_one_is_not(self, page, client, gate):
        page.receive('{"op": "stop-test", "robot": "r1"}')
        page.receive('{"op": "stop-test"')
        assert list(client._pending_stops) == []
        page.receive('{"op": "stop", "robot": "*"}')
        assert list(client._pending_stops) == [(page.id, None)]

    @pytest.mark.parametrize(
        ("text", "robot"),
        [
            ('{"op":"stop","robot":"r1"}', "r1"),
            ('{"op":"stop","robot":"r1"', "r1"),
            ('{"op":"stop","robot":"r9"}', None),
            ('{"op":"stop","robot":"r9"', None),
            ('{"op":"stop"', None),
            (b'{"op":"stop"\xff', None),
        ],
    )
    def test_a_malformed_stop_is_kept_for_what_it_stops(
        self, page, client, made, gate, text, robot
    ):
        page.receive(text)
        assert list(client._pending_stops) == [(page.id, robot)]
        gate.die()
        second = eventually(lambda: client.pid and made[1], "a second gate")
        (again,) = second.of(protocol.FromPage)
        assert json.loads(again.text) == {"op": "stop", "robot": robot or "*"}

    def test_a_stop_of_a_robot_that_is_gone_is_not_said_to_the_next_gate(
        self, page, client, made, gate
    ):
        page.receive('{"op":"stop","robot":"r1"}')
        client.forget("r1")
        gate.die()
        second = eventually(lambda: client.pid and made[1], "a second gate")
        assert second.of(protocol.FromPage) == []


class TestLife:
    def test_every_new_gate_hears_of_robots_pages_and_stops(self, client, gate, made):
        client.declare(spec(id="r2", twist_topic="/r2/cmd_vel"))
        page = client.connect("Ann", "operator", print, print)
        page.set_speeds(0.5, 1.0)
        client.stop_robot("r1")
        client.forget("r2")
        client.forget("r2")
        assert len(gate.of(protocol.Forget)) == 1
        gate.die()
        second = eventually(lambda: client.pid and made[1], "a second gate")
        assert [one.id for one in second.of(protocol.RobotSpec)] == ["r1"]
        assert second.of(protocol.Connect)
        assert second.of(protocol.Speeds)
        stops = second.of(protocol.FromProgram)
        assert stops == [protocol.FromProgram(commands.Stop("r1"))]
        gate.say(protocol.Ready(1))  # it is dead, and counts no more
        assert not client.ready

    def test_a_reset_names_a_stop_and_forgets_none_that_was_not_heard(
        self, client, gate
    ):
        client.stop_robot("r1")
        client.reset("r1", "s1")
        assert gate.received[-1] == protocol.FromProgram(commands.Reset("r1", "s1"))
        assert list(client._pending_stops) == [(None, "r1")]

    def test_the_nodes_of_other_programs_are_told(self, client, gate):
        client.name_writers("r1", ("/teleop",))
        assert gate.received[-1] == protocol.WriterNodes("r1", ("/teleop",))

    def test_a_gate_that_says_nothing_is_killed(self, client, gate, monkeypatch):
        monkeypatch.setattr(supervisor, "HUNG", 2)
        eventually(lambda: gate.killed, "its end")
        assert gate.killed[0] == "it does not respond"

    def test_reports_come_until_they_are_no_longer_wanted(self, client, gate, caplog):
        reports = []

        def fail(report):
            raise RuntimeError("a listener of somebody")

        client.on_report(fail)
        removal = client.on_report(reports.append)
        sent = protocol.SentTwist("r1", 0.5, 0.0, 0.0, None)
        gate.say(sent, protocol.Tick(8, {}))
        removal.remove()
        gate.say(sent)
        assert reports == [sent]
        assert "a listener to the gate failed" in caplog.text

    def test_it_has_a_number_while_it_runs(self, client, gate):
        assert client.pid == 4711
        client.stop()
        assert client.pid is None
        assert gate.stopped

    def test_a_heart_that_never_beat_is_ended_without_a_word(self):
        GateClient()._supervisor.end_heartbeat()
