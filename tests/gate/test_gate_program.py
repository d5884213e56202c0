"""The road of the display's own Python code."""

import math

import pytest
from gate_harness import ZERO, Bench, spec

from webmap.base.geometry import Twist
from webmap.gate import actions, commands, protocol
from webmap.gate.protocol import PROGRAM


@pytest.fixture
def bench():
    return Bench().begin()


def take(bench):
    bench.tell(protocol.FromProgram(commands.Take("r1"), 7))
    return bench.of(protocol.TakeReply)[-1]


def twist(bench, *velocity, epoch=None, tick=None):
    epoch = bench.report().epoch or 0 if epoch is None else epoch
    tick = bench.tick if tick is None else tick
    bench.tell(protocol.FromProgram(commands.SetVelocity("r1", epoch, tick, velocity)))


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
    assert bench.take("a") is None  # not before it stands
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
    assert 0.2 <= bench.written[1].at - at <= 0.2101
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
    bench.tell(
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
    """Its dead-man ends before the silence of the display shows, as by SIGSTOP."""
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
        bench.tell(protocol.FromProgram(commands.Take("r1"), 7))
        assert not bench.of(protocol.TakeReply)

    def test_the_reply_comes_as_soon_as_the_robot_can_move(self, bench):
        self.ask(bench)
        bench.answering = True
        bench.run(0.02)
        assert bench.of(protocol.TakeReply)[-1].epoch

    def test_the_reply_comes_after_a_timeout_even_without_odometry(self):
        bench = Bench().begin(spec(odometry_topic="/odom"))
        bench.tell(protocol.FromProgram(commands.Take("r1"), 7))
        bench.run(1.4)
        assert not bench.of(protocol.TakeReply)
        bench.run(0.2)
        assert bench.of(protocol.TakeReply)[-1].epoch

    def test_the_reply_is_a_refusal_if_an_operator_took_the_robot_meanwhile(
        self, bench
    ):
        self.ask(bench)
        bench.say("a", op="take", robot="r1")
        bench.run(0.02)
        assert "no operator has control" in bench.of(protocol.TakeReply)[-1].why

    def test_the_reply_comes_at_once_for_a_robot_without_a_velocity_topic(self):
        bench = Bench().begin(spec(twist_topic=None))
        assert take(bench).epoch


def test_a_program_releases_its_lease(bench):
    take(bench)
    twist(bench, 0.5, 0.0, 0.0)
    bench.tell(protocol.FromProgram(commands.Release("r1")))
    assert bench.written[-1].twist == ZERO
    assert bench.report().holder is None
    bench.tell(protocol.FromProgram(commands.Release("r1")))
    bench.tell(protocol.FromProgram(commands.Release("r9")))


def test_a_program_with_a_lease_sends_and_cancels_goals(bench):
    epoch = take(bench).epoch
    bench.tell(
        protocol.FromProgram(commands.Goal("r1", epoch, 0, bench.tick, 1.0, 2.0, 0.5))
    )
    assert bench.of(protocol.SentGoal) == [
        protocol.SentGoal("r1", 1.0, 2.0, 0.5, PROGRAM)
    ]
    bench.tell(
        protocol.FromProgram(
            commands.Goal("r1", epoch, 0, bench.tick, math.nan, 2.0, 0.5)
        )
    )
    assert len(bench.did(actions.SendGoal)) == 1
    bench.tell(protocol.FromProgram(commands.Cancel("r1")))
    assert len(bench.did(actions.CancelGoals)) == 1
    bench.tell(protocol.FromProgram(commands.Cancel("r9")))


def test_a_zero_velocity_of_a_program_stops_the_robot(bench):
    take(bench)
    twist(bench, 0.5, 0.0, 0.0)
    twist(bench, 0.0, 0.0, 0.0)
    assert bench.written[-1].twist == ZERO
    assert bench.state == "stopping"
