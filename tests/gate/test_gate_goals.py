"""Goals: who may send them, and when they are cancelled."""

import pytest
from gate_harness import URL, ZERO, Bench, spec

from webmap.gate import actions, events, messages
from webmap.geometry import Twist


@pytest.fixture
def bench():
    bench = Bench().begin()
    # The first drive cancels what an earlier gate may have sent; not of interest here.
    bench.say("a", op="cancel", robot="r1")
    bench.done.clear()
    return bench


def goals(bench):
    return bench.did(actions.SendGoal)


def cancels(bench):
    return len(bench.did(actions.CancelGoals))


def test_the_holder_of_the_lease_sends_a_goal(bench):
    bench.take()
    bench.goal(x=3.0, y=-1.0, yaw=0.25)
    (goal,) = goals(bench)
    assert (goal.robot, goal.x, goal.y, goal.yaw) == ("r1", 3.0, -1.0, 0.25)
    assert bench.of(messages.SentGoal) == [
        messages.SentGoal("r1", 3.0, -1.0, 0.25, "a")
    ]


@pytest.mark.parametrize(
    ("changes", "why"),
    [({"epoch": 0}, "epoch"), ({"tick": 1}, "tick"), ({"seq": 0}, "seq")],
)
def test_a_goal_needs_lease_epoch_and_a_fresh_tick(bench, changes, why):
    bench.goal()
    assert "take it first" in bench.refusals()[-1].why
    bench.take()
    bench.hold(0.1)
    bench.goal(**changes)
    assert why in bench.refusals()[-1].why
    bench.goal("b")
    assert goals(bench) == []


def test_a_goal_ends_driving_and_a_held_key_does_not_go_on_after_it(bench):
    bench.drive_off()
    bench.goal()
    at = bench.now
    assert bench.written[-1].twist == ZERO
    bench.hold(1.0, x=1.0)
    assert bench.moving_since(at) == []
    assert cancels(bench) == 0


def test_driving_off_cancels_the_goal_first(bench):
    bench.take()
    bench.goal()
    bench.hold(0.3)
    assert cancels(bench) == 0
    bench.hold(0.3, x=1.0)
    assert cancels(bench) == 1
    order = [
        type(a)
        for a in bench.done
        if isinstance(a, actions.CancelGoals | actions.WriteTwist)
    ]
    assert order[0] is actions.CancelGoals


def test_the_first_drive_cancels_what_an_earlier_gate_may_have_sent():
    bench = Bench().begin()
    bench.drive_off()
    assert cancels(bench) == 1
    bench.drive(x=0)
    bench.hold(1.0)
    bench.hold(0.3, x=1.0)
    assert cancels(bench) == 1


def test_a_goal_that_has_ended_is_not_cancelled(bench):
    bench.take()
    bench.goal()
    bench.goal()
    first, second = goals(bench)
    bench.tell(events.GoalEnded("r1", first.id))  # superseded: the second still runs
    bench.tell(events.GoalEnded("r1", second.id))
    bench.hold(0.3)
    bench.hold(0.1, x=1.0)
    assert cancels(bench) == 0


def test_a_superseded_goal_that_ends_says_nothing_of_the_newer(bench):
    bench.take()
    bench.goal()
    bench.goal()
    bench.tell(events.GoalEnded("r1", goals(bench)[0].id))
    bench.hold(0.3)
    bench.hold(0.1, x=1.0)
    assert cancels(bench) == 1


def test_an_operator_cancels_without_a_lease_and_a_viewer_does_not(bench):
    bench.join("v", "viewer")
    bench.say("v", op="cancel", robot="r1")
    assert cancels(bench) == 0
    bench.say("b", op="cancel", robot="r1")
    assert cancels(bench) == 1


def test_stop_cancels_every_goal(bench):
    bench.take()
    bench.goal()
    bench.say("b", op="stop", robot="r1")
    assert cancels(bench) == 1
    assert bench.written[-1].twist == ZERO


def test_without_a_link_goals_are_refused_and_the_cancel_is_kept(bench):
    bench.take()
    bench.tell(events.LinkDown(URL, "tasks"))
    bench.goal()
    assert goals(bench) == []
    assert "no link" in bench.refusals()[-1].why
    bench.say("a", op="cancel", robot="r1")
    assert cancels(bench) == 0
    bench.tell(events.LinkUp(URL, "tasks"))
    bench.tell(events.LinkUp(URL, "tasks"))
    assert cancels(bench) == 1


def test_a_goal_that_could_not_be_written_is_told(bench):
    bench.take()
    bench.clear = False
    bench.goal()
    assert "backed up" in bench.refusals()[-1].why
    assert bench.of(messages.SentGoal) == []
    bench.tell(messages.Disconnect("a"))
    bench.tell(events.WroteGoal("r1", "g", 0, 0, 0, "a", False))


def test_a_robot_without_ways_for_goals_says_so():
    bench = Bench().begin(spec(goal_topic=None, cancel_topic=None))
    bench.take()
    bench.goal()
    assert bench.refusals()[-1].why == "no goal topic is known"
    bench.say("a", op="cancel", robot="r1")
    assert "no cancel topic" in bench.refusals()[-1].why
    bench.say("a", op="stop", robot="r1")
    bench.say("a", op="reset", robot="r1")
    bench.drive_off()
    assert bench.written[-1].twist == Twist(1.0)


def test_a_goal_is_refused_while_the_display_is_silent(bench):
    bench.take()
    bench.beating = False
    bench.run(0.3)
    bench.goal()
    assert goals(bench) == []


@pytest.mark.parametrize("loss", ["connection", "display", "end"])
@pytest.mark.parametrize("policy", ["continue", "cancel"])
def test_when_its_sender_is_lost_a_goal_does_what_was_set(loss, policy):
    bench = Bench().begin(spec(on_operator_loss=policy))
    bench.take()
    bench.goal()
    bench.tell(messages.Disconnect("b"))  # somebody else
    assert cancels(bench) == 0
    if loss == "connection":
        bench.tell(messages.Disconnect("a"))
    elif loss == "display":
        bench.beating = False
        bench.run(0.5)
    else:
        bench.tell(events.Shutdown("the end"))
    assert cancels(bench) == (1 if policy == "cancel" else 0)


class TestGoalsOnly:
    @pytest.fixture
    def bench(self):
        return Bench().begin(spec(twist_topic=None, action="/go", goal_topic=None))

    def test_a_robot_that_takes_goals_only_is_held_for_goals(self, bench):
        assert bench.take()
        assert bench.report().link == "up"
        bench.goal()
        assert len(goals(bench)) == 1
        bench.hold(0.3)
        bench.hold(0.3, x=1.0)
        assert bench.written == []
        assert bench.refusals()[-1].why == "it has no velocity topic"

    def test_stop_cancels_and_writes_no_velocity(self, bench):
        bench.say("b", op="stop", robot="*")
        bench.run(0.5)
        assert cancels(bench) == 1
        assert bench.written == bench.dropped == []

    def test_it_needs_its_own_link(self, bench):
        bench.tell(events.LinkDown(URL, "tasks"))
        assert bench.take() is None
        assert bench.report().link == "down"

    def test_one_that_takes_nothing_cannot_be_had(self):
        bench = Bench().begin(spec(twist_topic=None, goal_topic=None))
        assert bench.take() is None
        assert "neither" in bench.report().reason
