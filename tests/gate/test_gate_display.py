"""The display's end of the pipe, with a fake gate that sends messages of the test."""

import json
import math
import threading

import msgspec
import pytest

from equipment.gate_harness import Bench, spec
from equipment.waiting import wait_for
from webmap.base.errors import ConfigError, MotionError, NoLease
from webmap.base.geometry import Twist
from webmap.gate import commands, protocol
from webmap.gate.display import supervisor
from webmap.gate.display.client import GateClient
from webmap.gate.display.program import ProgramCommands
from webmap.gate.protocol import PROGRAM, Holder


class FakeGateProcess:
    """A gate process that records the messages that it receives."""

    pid = 4711
    end_reason = "ended by SIGKILL"
    made: list["FakeGateProcess"] = []

    def __init__(self, receive, ended):
        self._receive, self._ended = receive, ended
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

    def deliver(self, *messages):
        for message in messages:
            self._receive(self, message)

    def die(self):
        self._ended(self)

    def of(self, type):
        return [message for message in self.received if isinstance(message, type)]


@pytest.fixture
def made(monkeypatch):
    monkeypatch.setattr(FakeGateProcess, "made", [])
    monkeypatch.setattr(supervisor, "GateProcess", FakeGateProcess)
    return FakeGateProcess.made


def test_a_robot_that_cannot_be_encoded_is_refused_and_not_kept():
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
    gate = wait_for(lambda: client.pid and made[0], "a gate")
    gate.deliver(protocol.Ready(1), protocol.Tick(7, {}))
    return gate


def report(holder=None, epoch=None):
    bench = Bench().begin()
    changed = {"holder": holder, "epoch": epoch}
    return msgspec.structs.replace(bench.report(), **changed)


def held():
    return report(Holder(PROGRAM, PROGRAM), 3)


class TestProgramRate:
    """A program that sends velocities without a pause, which would delay each STOP."""

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

    def test_velocities_of_a_fast_program_are_sent_every_10_ms(self, road):
        for _ in range(1000):
            road.twist("r1", Twist(0.2))
            self.now += 0.0001
        assert len(self.received) == 10

    def test_a_zero_of_a_fast_program_is_sent_at_once(self, road):
        for speed in (0.2, 0.3, 0.0, 0.0, 0.2, 0.0):
            road.twist("r1", Twist(speed))
        assert self.speeds() == [0.2, 0.0]
        self.now += 0.01
        road.twist("r1", Twist(0.3))
        road.twist("r1", Twist())
        assert self.speeds() == [0.2, 0.0, 0.3, 0.0]

    def test_a_fast_program_is_refused_without_a_lease_or_with_nan(self, road):
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
        assert self.speeds() == [0.2, 0.4], "a new lease has no delay"


class TestProgramAtAnAgent:
    """A gate answers programs of several displays; each receives all messages."""

    @pytest.fixture
    def road(self):
        self.now, self.received = 100.0, []
        road = ProgramCommands(
            self.received.append,
            threading.RLock(),
            lambda: self.now,
            connection="ann.4f/program",
        )
        road.on_tick(7)
        return road

    def reply(self, connection, epoch=3):
        return protocol.TakeReply(1, "r1", epoch, None, connection)

    @pytest.mark.parametrize("other", [PROGRAM, "ben.5e/program"])
    def test_the_answer_to_another_program_is_not_its_own(self, road, other):
        future = road.take("r1", None)
        road.on_take_reply(self.reply(other))
        assert not future.done()
        with pytest.raises(NoLease):
            road.twist("r1", Twist(0.2))
        road.on_take_reply(self.reply("ann.4f/program"))
        assert future.result(1) == 3

    @pytest.mark.parametrize("other", [PROGRAM, "ben.5e/program", "ann.4f/c1.1"])
    def test_the_control_of_another_program_or_page_is_not_its_own(self, road, other):
        road.on_report(report(Holder(other, "Ben"), 4))
        with pytest.raises(NoLease):
            road.twist("r1", Twist(0.2))
        road.on_report(report(Holder("ann.4f/program", "Ann"), 4))
        road.twist("r1", Twist(0.2))

    def run(self, road, seconds):
        self.received.clear()
        for _ in range(round(seconds / 0.05)):
            self.now += 0.05
            road.on_tick(8)
        return len(self.received)

    def test_a_lost_request_is_sent_again_with_the_same_number(self, road):
        future = road.take("r1", None)
        asked = list(self.received)
        assert self.run(road, 0.45) == 0
        assert self.run(road, 0.1) == 1
        assert self.received == asked
        road.on_take_reply(self.reply("ann.4f/program"))
        assert future.result(1) == 3
        road.on_take_reply(self.reply("ann.4f/program", 4))  # to the first one
        assert self.run(road, 5.0) == 0

    def test_a_request_without_an_answer_fails_and_releases(self, road):
        future = road.take("r1", None)
        self.run(road, 1.0)
        later = road.take("r2", None)
        self.run(road, 2.1)
        with pytest.raises(NoLease, match="'r1': no answer"):
            future.result(1)
        assert not later.done()
        assert protocol.FromProgram(commands.Release("r1")) in self.received
        road.on_take_reply(self.reply("ann.4f/program"))
        with pytest.raises(NoLease):
            road.twist("r1", Twist(0.2))

    def test_a_release_is_sent_again_until_a_report_shows_it(self, road):
        held = report(Holder("ann.4f/program", "Ann"), 4)
        road.on_report(held)
        road.release("r1")
        road.on_report(held)
        with pytest.raises(NoLease):
            road.twist("r1", Twist(0.2))
        assert self.run(road, 1.2) == 2
        assert self.received[-1] == protocol.FromProgram(commands.Release("r1"))
        road.on_report(report())
        assert self.run(road, 5.0) == 0

    def test_a_release_that_nothing_answers_is_sent_for_3_s(self, road):
        road.release("r9")
        assert 4 <= self.run(road, 10.0) <= 6

    def test_a_robot_that_is_taken_again_is_not_released_late(self, road):
        road.release("r1")
        road.take("r1", None)
        self.run(road, 1.2)
        assert {type(each.command) for each in self.received} == {commands.Take}

    def test_a_release_ends_the_requests_for_its_robot(self, road):
        first, other = road.take("r1", None), road.take("r2", None)
        road.release("r1")
        with pytest.raises(NoLease, match="control was released"):
            first.result(1)
        assert not other.done()


class TestProgram:
    def test_a_program_requests_uses_and_releases_a_lease(self, client, gate):
        future = client.take("r1")
        (asked,) = gate.of(protocol.FromProgram)
        gate.deliver(protocol.TakeReply(asked.request, "r1", 3, None))
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

    def test_a_refused_lease_request_raises_an_error_with_the_reason(
        self, client, gate
    ):
        future = client.take("r1")
        (asked,) = gate.of(protocol.FromProgram)
        gate.deliver(protocol.TakeReply(asked.request, "r1", None, "Ann has control"))
        gate.deliver(protocol.TakeReply(99, "r1", None, "nobody asked"))
        with pytest.raises(NoLease, match="Ann has control"):
            future.result(1)

    def test_a_program_loses_its_lease_when_a_report_names_another_holder(
        self, client, gate
    ):
        gate.deliver(held())
        client.twist("r1", Twist(0.5))
        gate.deliver(report(Holder("c1", "Ann"), 4))
        with pytest.raises(NoLease):
            client.twist("r1", Twist(0.5))

    def test_numbers_that_are_not_finite_are_refused_by_the_client(self, client, gate):
        with pytest.raises(MotionError, match="finite"):
            client.twist("r1", Twist(math.nan))
        with pytest.raises(MotionError, match="finite"):
            client.move("r1", math.inf, 0.0, 0.0)
        with pytest.raises(MotionError, match="finite"):
            client.locate("r1", 0.0, 0.0, math.nan)

    def test_a_client_that_was_not_started_gives_no_lease_and_starts_no_gate(
        self, made
    ):
        client = GateClient()
        with pytest.raises(NoLease, match="is not running"):
            client.take("r1").result(1)
        client.reset("r1", "s1")
        client.stop()
        assert made == []

    def test_a_gate_that_dies_ends_leases_and_pending_requests(self, client, gate):
        gate.deliver(held())
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
    def received(self):
        return []

    @pytest.fixture
    def page(self, client, gate, received):
        page = client.connect("Ann", "operator", received.append, received.append)
        gate.deliver(held(), protocol.Hello(page.id))
        return page

    def ops(self, received):
        return [json.loads(text)["op"] for text in received]

    def test_a_new_page_receives_a_greeting_and_the_existing_robots(
        self, page, received
    ):
        assert self.ops(received) == ["hello", "robot"]

    def test_a_page_does_not_receive_messages_for_other_pages(
        self, page, gate, received
    ):
        del received[:]
        gate.deliver(
            protocol.Tick(8, {"c9": 1}),
            protocol.Tick(9, {page.id: 5}),
            protocol.Refused(page.id, "r1", "take", "Ben drives it"),
            protocol.Refused("c9", "r1", "take", "Ben drives it"),
            protocol.RobotGone("r1"),
            protocol.Hello("c9"),
        )
        assert self.ops(received) == ["tick", "refused", "gone"]
        gate.deliver(protocol.CloseConnection("c9", "x"))
        gate.deliver(protocol.CloseConnection(page.id, "too much"))
        assert received[-1] == "too much"

    def test_a_listener_gets_the_refusals_of_the_program_alone(
        self, client, page, gate
    ):
        reports = []
        client.on_report(reports.append)
        own = protocol.Refused(protocol.PROGRAM, "r1", "goal", "Ben has control")
        for_page = protocol.Refused(page.id, "r1", "move", "Ben has control")
        others = [
            protocol.Refused(page.id, "r1", "goal", "Ben has control"),
            protocol.Refused("ann.4f/c1", "r1", "move", "Ben has control"),
            protocol.Refused("ann.4f/program", "r1", "goal", "Ben has control"),
        ]
        gate.deliver(*others, own, for_page)
        assert reports == [own, for_page]

    def test_a_page_that_may_only_stop_gets_two_ticks_a_second(self, client, gate):
        texts = {"viewer": [], "operator": []}
        for role, received in texts.items():
            page = client.connect("Ann", role, received.append, received.append)
            gate.deliver(protocol.Hello(page.id))
            for tick in range(20):
                gate.deliver(protocol.Tick(tick, {page.id: -1}))
        ticks = {
            role: self.ops(received).count("tick") for role, received in texts.items()
        }
        assert ticks == {"viewer": 2, "operator": 20}
        for role, received in texts.items():
            assert json.loads(received[0])["ticks"] == ticks[role]

    def test_page_data_is_forwarded_and_closing_twice_disconnects_once(
        self, page, gate
    ):
        page.receive('{"op": "take"}')
        page.receive(b"x" * 5000)
        assert [len(m.text) for m in gate.of(protocol.FromPage)] == [14, 2048]
        page.set_speeds(0.5, 1.0)
        assert gate.received[-1] == protocol.Speeds(page.id, 0.5, 1.0)
        page.close()
        page.close()
        assert gate.of(protocol.Disconnect) == [protocol.Disconnect(page.id)]

    def test_a_goal_in_the_name_of_a_page_has_the_newest_tick(self, page, gate):
        gate.deliver(protocol.Tick(9, {page.id: -1}))
        page.move("r1", 1.0, 2.0, 0.5)
        command = commands.MoveFor("r1", page.id, 9, 1.0, 2.0, 0.5)
        assert gate.received[-1] == protocol.FromProgram(command)

    def test_no_goal_in_the_name_of_a_page_is_sent_without_a_gate(self, page, client):
        client.gone(protocol.GateDown("it was killed"))
        with pytest.raises(MotionError, match="the gate is not running"):
            page.move("r1", 1.0, 2.0, 0.5)

    def test_a_failing_page_callback_is_logged(self, client, gate, caplog):
        def fail(text):
            raise RuntimeError("the page is gone")

        page = client.connect("Ann", "operator", fail, fail)
        gate.deliver(protocol.Hello(page.id), held())
        assert "a callback failed" in caplog.text

    def test_pages_with_equal_speed_limits_receive_equal_reports(self, client, gate):
        ann, ben, eve = [], [], []
        for received in (ann, ben, eve):
            page = client.connect("Ann", "operator", received.append, print)
            page.set_speeds(0.2 if received is eve else 0.5, 1.0)
            gate.deliver(protocol.Hello(page.id))
        gate.deliver(report())
        assert ann[-1] == ben[-1] != eve[-1]

    def test_an_unknown_role_is_refused(self, client):
        with pytest.raises(ConfigError, match="role 'king' is none of"):
            client.connect("Ann", "king", print, print)

    def test_a_stop_command_is_kept_as_pending_but_a_stop_test_is_not(
        self, page, client, gate
    ):
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
    def test_a_malformed_stop_is_kept_for_its_robot_or_for_all_robots(
        self, page, client, made, gate, text, robot
    ):
        page.receive(text)
        assert list(client._pending_stops) == [(page.id, robot)]
        gate.die()
        second = wait_for(lambda: client.pid and made[1], "a second gate")
        wait_for(lambda: second.of(protocol.FromPage), "the STOP")
        (again,) = second.of(protocol.FromPage)
        assert json.loads(again.text) == {"op": "stop", "robot": robot or "*"}

    def test_a_stop_of_a_removed_robot_is_not_sent_to_the_next_gate(
        self, page, client, made, gate
    ):
        page.receive('{"op":"stop","robot":"r1"}')
        client.forget("r1")
        gate.die()
        second = wait_for(lambda: client.pid and made[1], "a second gate")
        assert second.of(protocol.FromPage) == []


class TestLifecycle:
    def test_a_new_gate_receives_all_robots_pages_and_pending_stops(
        self, client, gate, made
    ):
        client.declare(spec(id="r2", twist_topic="/r2/cmd_vel"))
        page = client.connect("Ann", "operator", print, print)
        page.set_speeds(0.5, 1.0)
        client.stop_robot("r1")
        client.forget("r2")
        client.forget("r2")
        assert len(gate.of(protocol.Forget)) == 1
        gate.die()
        second = wait_for(lambda: client.pid and made[1], "a second gate")
        assert [one.id for one in second.of(protocol.RobotSpec)] == ["r1"]
        assert second.of(protocol.Connect)
        assert second.of(protocol.Speeds)
        stops = second.of(protocol.FromProgram)
        assert stops == [protocol.FromProgram(commands.Stop("r1"))]
        gate.deliver(protocol.Ready(1))  # this gate has ended, so the client ignores it
        assert not client.ready

    def test_a_reset_names_its_stop_and_keeps_stops_not_yet_confirmed_by_the_gate(
        self, client, gate
    ):
        client.stop_robot("r1")
        client.reset("r1", "s1")
        assert gate.received[-1] == protocol.FromProgram(commands.Reset("r1", "s1"))
        assert list(client._pending_stops) == [(None, "r1")]

    def test_the_node_names_of_other_programs_are_sent_to_the_gate(self, client, gate):
        client.name_writers("r1", ("/teleop",))
        assert gate.received[-1] == protocol.WriterNodes("r1", ("/teleop",))

    def test_a_gate_that_sends_nothing_is_killed(self, client, gate, monkeypatch):
        monkeypatch.setattr(supervisor, "HUNG", 2)
        wait_for(lambda: gate.killed, "the kill of the gate")
        assert gate.killed[0] == "it does not respond"

    def test_a_listener_receives_reports_until_removed(self, client, gate, caplog):
        reports = []

        def fail(report):
            raise RuntimeError("a listener of somebody")

        client.on_report(fail)
        removal = client.on_report(reports.append)
        sent = protocol.SentTwist("r1", 0.5, 0.0, 0.0, None)
        gate.deliver(sent, protocol.Tick(8, {}))
        removal.remove()
        gate.deliver(sent)
        assert reports == [sent]
        assert "a listener to the gate failed" in caplog.text

    def test_the_client_has_a_process_id_only_while_the_gate_runs(self, client, gate):
        assert client.pid == 4711
        client.stop()
        assert client.pid is None
        assert gate.stopped

    def test_ending_a_heartbeat_that_never_started_raises_no_error(self):
        GateClient()._supervisor.end_heartbeat()


def test_a_page_learns_who_it_is_and_its_new_name(client, gate):
    who, texts = protocol.Identity("91c2", "0b7e"), []
    page = client.connect("Ann", "operator", texts.append, print, identity=who)
    gate.deliver(protocol.Hello(page.id))
    page.rename("\u05e8")
    page.rename("\u05e8")
    assert gate.of(protocol.Rename) == [protocol.Rename(page.id, "\u05e8")]
    hello, *you = map(json.loads, texts)
    assert hello["op"] == "hello"
    names = ["Ann", "\u2068\u05e8\u2069"]
    expected = {"op": "you", "person": "91c2", "page": "0b7e"}
    assert you == [expected | {"name": name} for name in names]
