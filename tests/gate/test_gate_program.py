"""The commands of a program: the display's own Python code."""

import math

import pytest

from equipment.gate_harness import ZERO, Bench, spec
from webmap.base.geometry import Twist
from webmap.gate import actions, commands, protocol
from webmap.gate.protocol import PROGRAM
from webmap.gate.rules.motion import DEADMAN


@pytest.fixture
def bench():
    return Bench().begin()


def take(bench):
    bench.handle(protocol.FromProgram(commands.Take("r1"), 7))
    return bench.of(protocol.TakeReply)[-1]


def twist(bench, *velocity, epoch=None, tick=None):
    epoch = bench.report().epoch or 0 if epoch is None else epoch
    tick = bench.tick if tick is None else tick
    bench.handle(
        protocol.FromProgram(commands.SetVelocity("r1", epoch, tick, velocity))
    )


def test_a_program_takes_control_and_gets_a_reply(bench):
    reply = take(bench)
    assert (reply.request, reply.robot, reply.why) == (7, "r1", None)
    assert reply.epoch == bench.report().epoch
    assert bench.report().holder == protocol.Holder(PROGRAM, PROGRAM)
    assert take(bench).epoch == reply.epoch


def test_a_program_cannot_take_a_robot_from_an_operator(bench):
    bench.take("a")
    assert take(bench).epoch is None
    assert take(bench).why == "A has control"


def test_an_operator_takes_a_robot_from_a_program_after_standstill(bench):
    epoch = take(bench).epoch
    twist(bench, 0.5, 0.0, 0.0)
    assert bench.take("a") is None  # not before standstill
    assert bench.written[-1].twist == ZERO
    assert bench.take("a") is None
    bench.run(1.1)
    assert bench.report().holder.connection == "a"
    twist(bench, 0.5, 0.0, 0.0, epoch=epoch)
    assert bench.written[-1].twist == ZERO
    assert bench.refusals(PROGRAM)[-1].why == "A has control"


def test_a_velocity_of_a_program_is_sent_once_and_within_the_limits(bench):
    take(bench)
    twist(bench, 9.0, 1.0, -0.5)
    bench.run(0.15)
    assert [w.twist for w in bench.written] == [Twist(1.0, 0.0, -0.5)]
    assert bench.written[0].by == PROGRAM


def test_a_program_without_new_commands_is_stopped_but_keeps_its_lease(bench):
    take(bench)
    at = bench.now
    twist(bench, 0.5, 0.0, 0.0)
    bench.run(1.0)
    assert DEADMAN <= bench.written[1].at - at <= DEADMAN + 0.0101
    assert bench.state == "held"
    at = bench.now
    twist(bench, 0.5, 0.0, 0.0)
    assert bench.moving_since(at)


@pytest.mark.parametrize(
    "bad",
    [
        {"epoch": 99},
        {"tick": 1},
        {"velocity": (math.nan, 0.0, 0.0)},
        {"velocity": (math.inf, 0.0, 0.0)},
    ],
)
def test_an_invalid_velocity_of_a_program_is_refused(bench, bad):
    take(bench)
    velocity = bad.pop("velocity", (0.5, 0.0, 0.0))
    twist(bench, *velocity, **bad)
    assert bench.written == []
    assert bench.refusals(PROGRAM)


def test_velocities_and_goals_of_a_program_without_a_lease_are_not_sent(bench):
    twist(bench, 0.5, 0.0, 0.0)
    bench.handle(
        protocol.FromProgram(commands.Goal("r1", 0, 0, bench.tick, 1.0, 2.0, 0.0))
    )
    assert bench.written == []
    assert not bench.did(actions.SendGoal)


def test_a_lost_link_ends_the_lease_of_a_driving_program(bench):
    take(bench)
    twist(bench, 0.5, 0.0, 0.0)
    bench.break_links()
    assert bench.report().holder is None
    lost = bench.refusals(PROGRAM)[-1]
    assert (lost.what, "no connection" in lost.why) == ("lease", True)


def test_a_velocity_that_arrives_after_the_display_timeout_ends_the_lease(bench):
    take(bench)
    bench.run(0.04)
    twist(bench, 0.5, 0.0, 0.0)
    bench.beating = False
    bench.now += 0.251  # the loop was late
    twist(bench, 0.5, 0.0, 0.0)
    assert bench.written[-1].twist == ZERO
    assert bench.report().holder is None


def test_a_program_cannot_drive_with_its_old_lease_after_the_display_paused(bench):
    """The dead-man expires before the display counts as silent, as with SIGSTOP."""
    take(bench)
    epoch = bench.report().epoch
    twist(bench, 0.5, 0.0, 0.0)
    bench.beating = False
    bench.run(10.0)
    at = bench.now
    bench.beating = True
    bench.run(0.1)
    bench.run(1.0, lambda: twist(bench, 0.5, 0.0, 0.0, epoch=epoch))
    assert bench.moving_since(at) == []
    assert bench.report().holder is None


def test_an_idle_program_keeps_its_lease_when_the_bridge_does_not_answer(bench):
    take(bench)
    bench.answering = False
    bench.run(0.4)
    twist(bench, 0.5, 0.0, 0.0)
    assert bench.written == []
    assert "no answer from" in bench.refusals(PROGRAM)[-1].why
    assert bench.report().holder is not None


class TestTakeAnswer:
    def ask(self, bench):
        bench.answering = False
        bench.run(0.4)
        bench.handle(protocol.FromProgram(commands.Take("r1"), 7))
        assert not bench.of(protocol.TakeReply)

    def test_the_reply_comes_as_soon_as_the_robot_can_move(self, bench):
        self.ask(bench)
        bench.answering = True
        bench.run(0.02)
        assert bench.of(protocol.TakeReply)[-1].epoch

    def test_the_reply_comes_after_a_timeout_even_without_odometry(self):
        bench = Bench().begin(spec(odometry_topic="/odom"))
        bench.handle(protocol.FromProgram(commands.Take("r1"), 7))
        bench.run(1.4)
        assert not bench.of(protocol.TakeReply)
        bench.run(0.2)
        assert bench.of(protocol.TakeReply)[-1].epoch

    def test_the_reply_is_a_refusal_if_an_operator_took_the_robot_meanwhile(
        self, bench
    ):
        self.ask(bench)
        bench.send("a", op="take", robot="r1")
        bench.run(0.02)
        assert "no operator has control" in bench.of(protocol.TakeReply)[-1].why

    def test_the_reply_comes_at_once_for_a_robot_without_a_velocity_topic(self):
        bench = Bench().begin(spec(twist_topic=None))
        assert take(bench).epoch


def test_a_program_releases_its_lease(bench):
    take(bench)
    twist(bench, 0.5, 0.0, 0.0)
    bench.handle(protocol.FromProgram(commands.Release("r1")))
    assert bench.written[-1].twist == ZERO
    assert bench.report().holder is None
    bench.handle(protocol.FromProgram(commands.Release("r1")))
    bench.handle(protocol.FromProgram(commands.Release("r9")))


def test_a_program_with_a_lease_sends_and_cancels_goals(bench):
    epoch = take(bench).epoch
    bench.handle(
        protocol.FromProgram(commands.Goal("r1", epoch, 0, bench.tick, 1.0, 2.0, 0.5))
    )
    assert bench.of(protocol.SentGoal) == [
        protocol.SentGoal("r1", 1.0, 2.0, 0.5, PROGRAM)
    ]
    bench.handle(
        protocol.FromProgram(
            commands.Goal("r1", epoch, 0, bench.tick, math.nan, 2.0, 0.5)
        )
    )
    assert len(bench.did(actions.SendGoal)) == 1
    bench.handle(protocol.FromProgram(commands.Cancel("r1")))
    assert len(bench.did(actions.CancelGoals)) == 1
    bench.handle(protocol.FromProgram(commands.Cancel("r9")))


def test_a_zero_velocity_of_a_program_stops_the_robot(bench):
    take(bench)
    twist(bench, 0.5, 0.0, 0.0)
    twist(bench, 0.0, 0.0, 0.0)
    assert bench.written[-1].twist == ZERO
    assert bench.state == "stopping"


ANN, BEN = "ann.4f/program", "ben.5e/program"


class TestProgramsOfOtherDisplays:
    """The gate of an agent has several programs, each with a connection of its own."""

    @pytest.fixture
    def bench(self):
        bench = Bench().begin()
        for who in (ANN, BEN):
            self.join(bench, who)
        return bench

    def join(self, bench, who, role="operator"):
        bench.handle(protocol.Connect(who, f"the program of {who[:3]}", role, True))

    def send(self, bench, command, who=ANN, request=0):
        bench.handle(protocol.FromProgram(command, request, who))

    def take(self, bench, who=ANN, request=7):
        self.send(bench, commands.Take("r1"), who, request)
        return bench.of(protocol.TakeReply)[-1]

    def twist(self, bench, who=ANN, epoch=None, tick=None, x=0.5):
        command = commands.SetVelocity(
            "r1",
            bench.report().epoch or 0 if epoch is None else epoch,
            bench.tick if tick is None else tick,
            (x, 0.0, 0.0, 0.0, 0.0, 0.0),
        )
        self.send(bench, command, who)

    def test_it_takes_and_drives_within_the_limits(self, bench):
        reply = self.take(bench)
        epoch = bench.report().epoch
        assert reply == protocol.TakeReply(7, "r1", epoch, None, ANN)
        assert bench.report().holder == protocol.Holder(ANN, "the program of ann")
        self.twist(bench, x=9.0)
        (written,) = bench.written
        assert (written.twist, written.by) == (Twist(1.0), ANN)

    def test_it_is_stopped_by_the_dead_man(self, bench):
        self.take(bench)
        at = bench.now
        self.twist(bench)
        bench.run(1.0)
        assert DEADMAN <= bench.written[1].at - at <= DEADMAN + 0.0101
        assert bench.written[1].twist == ZERO
        assert bench.report().holder.connection == ANN

    def test_a_velocity_with_an_old_tick_stops_the_robot(self, bench):
        self.take(bench)
        old = bench.tick
        bench.run(0.31)
        self.twist(bench)
        self.twist(bench, tick=old)
        assert bench.written[-1].twist == ZERO
        assert "too old" in bench.refusals(ANN)[-1].why

    def test_its_loss_stops_the_robot_and_ends_its_control(self, bench):
        epoch = self.take(bench).epoch
        self.twist(bench)
        bench.handle(protocol.Disconnect(ANN))
        assert bench.written[-1].twist == ZERO
        assert bench.report().holder is None
        bench.run(0.01)
        at = bench.now
        self.twist(bench, epoch=epoch)
        self.join(bench, ANN)
        self.twist(bench, epoch=epoch)
        bench.run(0.1)
        assert bench.moving_since(at) == []

    def test_a_new_introduction_ends_its_control_too(self, bench):
        self.take(bench)
        self.twist(bench)
        self.join(bench, ANN)
        assert bench.written[-1].twist == ZERO
        assert bench.report().holder is None

    def test_a_goal_of_a_lost_program_is_cancelled_where_the_robot_asks_for_it(self):
        bench = Bench().begin(spec(on_operator_loss="cancel"))
        self.join(bench, ANN)
        epoch = self.take(bench).epoch
        goal = commands.Goal("r1", epoch, 0, bench.tick, 1.0, 2.0, 0.5)
        self.send(bench, goal)
        assert bench.of(protocol.SentGoal)[-1].by == ANN
        bench.handle(protocol.Disconnect(BEN))
        assert not bench.did(actions.CancelGoals)
        bench.handle(protocol.Disconnect(ANN))
        assert len(bench.did(actions.CancelGoals)) == 1

    @pytest.mark.parametrize("other", [PROGRAM, BEN])
    def test_a_program_takes_no_robot_from_another(self, bench, other):
        epoch = self.take(bench).epoch
        refused = self.take(bench, other)
        assert refused == protocol.TakeReply(
            7, "r1", None, "the program of ann has control", other
        )
        self.twist(bench, other, epoch=epoch)
        self.send(bench, commands.Release("r1"), other)
        assert bench.written == []
        assert bench.report().holder.connection == ANN

    def test_an_operator_takes_its_robot(self, bench):
        epoch = self.take(bench).epoch
        self.twist(bench)
        bench.send("a", op="take", robot="r1")
        assert bench.written[-1].twist == ZERO
        bench.run(1.1)
        assert bench.report().holder.connection == "a"
        self.twist(bench, epoch=epoch)
        assert bench.written[-1].twist == ZERO

    def test_that_of_a_viewer_takes_nothing_and_can_stop(self, bench):
        self.join(bench, BEN, "viewer")
        assert "viewers can only look" in self.take(bench, BEN).why
        bench.send(BEN, op="stop", robot="r1")
        assert bench.report().stop.by == "the program of ben"

    @pytest.mark.parametrize("who", ["cat.6d/program", "a"])
    def test_one_that_is_unknown_or_a_page_can_only_stop(self, bench, who):
        self.send(bench, commands.Take("r1"), who)
        assert bench.report().holder is None
        bench.take("a")
        bench.hold(0.3)
        self.twist(bench, who)
        assert bench.written == []
        self.send(bench, commands.Stop("r1"), who)
        assert bench.state == "stopped"

    def test_it_cannot_send_what_needs_control_as_a_page_does(self, bench):
        self.take(bench)
        for _ in range(8):
            bench.drive(ANN)
            bench.run(0.05)
        bench.drive(ANN, x=1.0)
        bench.goal(ANN)
        bench.send(BEN, op="ask", robot="r1")
        assert bench.written == []
        assert not bench.did(actions.SendGoal)
        assert bench.report().asker is None
        assert "as a page does" in bench.refusals(ANN)[-1].why

    def test_it_sends_what_needs_no_control_as_a_page_does(self, bench):
        bench.send(ANN, op="cancel", robot="r1")
        assert len(bench.did(actions.CancelGoals)) == 1
        bench.send(ANN, op="stop", robot="nobody")  # for all robots, as from a page
        assert bench.state == "stopped"
        bench.send(ANN, op="reset", robot="r1")
        assert not bench.report().latched

    def test_requests_for_a_robot_that_cannot_move_yet_are_bounded(self, bench):
        bench.answering = False
        bench.run(0.4)
        for request in range(30):
            self.send(bench, commands.Take("r1"), ANN, request)
        refused = bench.of(protocol.TakeReply)
        assert [each.request for each in refused] == list(range(20, 30))
        assert "waits for the robot already" in refused[0].why
        assert "has control" in self.take(bench, BEN).why
        bench.answering = True
        bench.run(0.02)
        assert len(bench.of(protocol.TakeReply)) == 31

    def test_one_that_is_lost_while_it_waits_gets_no_robot(self, bench):
        bench.answering = False
        bench.run(0.4)
        self.send(bench, commands.Take("r1"))
        bench.handle(protocol.Disconnect(ANN))
        bench.answering = True
        bench.run(0.02)
        assert bench.of(protocol.TakeReply)[-1].epoch is None
        assert bench.report().holder is None
