"""Goals: who may send them, and when they are cancelled."""

import msgspec
import pytest

from equipment.gate_harness import KEY, URL, ZERO, Bench, spec
from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.gate import actions, commands, events, protocol
from webmap.gate.rules.goals import ANSWER, ELSEWHERE, IN_VAIN, NOT_STOPPED, UNANSWERED
from webmap.gate.rules.goals import MOVE_BASE as MOVE_BASE_TYPE
from webmap.gate.specs import checked


@pytest.fixture
def bench():
    bench = Bench().begin()
    # The first drive cancels goals that an earlier gate may have sent; not tested here.
    bench.send("a", op="cancel", robot="r1")
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
    assert bench.of(protocol.SentGoal) == [
        protocol.SentGoal("r1", 3.0, -1.0, 0.25, "a")
    ]


@pytest.mark.parametrize(
    ("changes", "why"),
    [({"epoch": 0}, "epoch"), ({"tick": 1}, "too old"), ({"seq": 0}, "seq")],
)
def test_a_goal_needs_the_lease_the_epoch_a_new_seq_and_a_recent_tick(
    bench, changes, why
):
    bench.goal()
    assert "take control first" in bench.refusals()[-1].why
    bench.take()
    bench.hold(0.1)
    bench.goal(**changes)
    assert why in bench.refusals()[-1].why
    bench.goal("b")
    assert goals(bench) == []


def move_for(bench, page="a", **changes):
    fields = {"robot": "r1", "page": page, "tick": bench.tick, "x": 3.0, "y": -1.0}
    bench.handle(
        protocol.FromProgram(commands.MoveFor(**fields | {"yaw": 0.25} | changes))
    )


def test_a_program_sends_a_goal_for_the_holder_who_keeps_control(bench):
    epoch = bench.take()
    move_for(bench)
    (goal,) = goals(bench)
    assert (goal.robot, goal.x, goal.y, goal.yaw) == ("r1", 3.0, -1.0, 0.25)
    report = bench.report()
    assert (report.holder.connection, report.epoch) == ("a", epoch)
    assert report.goal.by == "a"
    assert bench.refusals() == []


def test_a_goal_of_a_program_for_a_page_gives_the_page_control_of_a_free_robot(bench):
    move_for(bench)
    assert len(goals(bench)) == 1
    assert bench.report().holder.connection == "a"
    assert not bench.report().armed


def test_a_goal_for_a_page_takes_control_from_nobody(bench):
    epoch = bench.take("b")
    move_for(bench)
    assert bench.refusals()[-1].what == "move"
    assert bench.refusals()[-1].why == "B has control"
    assert (bench.report().holder.connection, bench.report().epoch) == ("b", epoch)
    bench.send("b", op="release", robot="r1")
    bench.handle(protocol.FromProgram(commands.Take("r1"), 1))
    move_for(bench)
    assert "has control" in bench.refusals()[-1].why
    assert bench.report().holder.connection == protocol.PROGRAM
    assert goals(bench) == []


def test_a_goal_for_a_viewer_is_refused(bench):
    bench.join("v", "viewer")
    move_for(bench, "v")
    assert "viewers" in bench.refusals("v")[-1].why
    assert bench.state == "free"


@pytest.mark.parametrize("page", ["nobody", protocol.PROGRAM])
def test_a_goal_for_a_page_that_is_not_there_is_not_sent(bench, page):
    move_for(bench, page)
    assert goals(bench) == []
    assert bench.state == "free"


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"tick": 1}, "too old"),
        ({"x": float("nan")}, "finite"),
        ({"robot": "r9"}, "'r9'"),
    ],
)
def test_a_goal_for_a_page_is_checked_like_that_of_a_page(bench, changes, why):
    bench.take()
    bench.hold(0.1)
    move_for(bench, **changes)
    assert why in bench.refusals()[-1].why
    assert goals(bench) == []


def test_no_goal_is_sent_for_a_page_while_a_stop_is_active(bench):
    bench.send("b", op="stop", robot="r1")
    move_for(bench)
    assert "STOP by B is active" in bench.refusals()[-1].why
    assert goals(bench) == []
    assert bench.report().holder is None


def test_a_goal_ends_driving_and_a_held_key_moves_nothing_afterwards(bench):
    bench.drive_off()
    bench.done.clear()
    bench.goal()
    at = bench.now
    assert bench.written[-1].twist == ZERO
    bench.hold(1.0, x=1.0)
    assert bench.moving_since(at) == []
    assert cancels(bench) == 0


def test_driving_cancels_the_goal_before_the_first_velocity(bench):
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


def test_the_first_drive_cancels_possible_goals_of_an_earlier_gate():
    bench = Bench().begin()
    bench.drive_off()
    assert cancels(bench) == 1
    bench.drive(x=0)
    bench.hold(1.0)
    bench.hold(0.3, x=1.0)
    assert cancels(bench) == 1


def test_driving_cancels_goals_of_other_programs_but_not_on_every_input(bench):
    bench.take()
    bench.goal()
    (goal,) = goals(bench)
    bench.handle(events.GoalEnded("r1", goal.id))
    bench.hold(0.3)
    bench.hold(0.1, x=1.0)
    assert cancels(bench) == 1, "RViz may have sent another goal since then"
    for _ in range(3):
        bench.hold(0.3)
        bench.hold(0.1, x=1.0)
    assert cancels(bench) == 1, "not again within a short time"
    bench.hold(2.0)
    bench.hold(0.1, x=1.0)
    assert cancels(bench) == 2


def test_the_end_of_an_old_goal_does_not_end_the_newer_goal(bench):
    bench.take()
    bench.goal()
    bench.goal()
    bench.handle(events.GoalEnded("r1", goals(bench)[0].id))
    bench.hold(0.3)
    bench.hold(0.1, x=1.0)
    assert cancels(bench) == 1


def test_an_operator_cancels_a_goal_without_a_lease_but_a_viewer_cannot(bench):
    bench.join("v", "viewer")
    bench.send("v", op="cancel", robot="r1")
    assert cancels(bench) == 0
    bench.send("b", op="cancel", robot="r1")
    assert cancels(bench) == 1


def test_stop_cancels_the_goal_and_sends_zero(bench):
    bench.take()
    bench.goal()
    bench.send("b", op="stop", robot="r1")
    assert cancels(bench) == 1
    assert bench.written[-1].twist == ZERO


def test_without_a_link_goals_are_refused_and_a_cancel_is_sent_later(bench):
    bench.take()
    bench.handle(events.LinkDown(URL, "tasks"))
    bench.goal()
    assert goals(bench) == []
    assert "no connection" in bench.refusals()[-1].why
    bench.send("a", op="cancel", robot="r1")
    assert cancels(bench) == 0
    bench.handle(events.LinkUp(URL, "tasks"))
    bench.handle(events.LinkUp(URL, "tasks"))
    assert cancels(bench) == 1


def test_an_action_is_cancelled_without_a_link_and_again_on_the_next_link():
    """The cancel service is called on a socket of its own, which may still connect."""
    bench = Bench().begin(spec(action="/go", cancel_topic=None))
    bench.take()
    bench.handle(events.LinkDown(URL, "tasks"))
    bench.send("a", op="cancel", robot="r1")
    assert cancels(bench) == 1
    bench.handle(events.LinkUp(URL, "tasks"))
    assert cancels(bench) == 2


def test_a_goal_is_not_sent_after_a_pause_of_the_gate(bench):
    bench.take()
    bench.held_up = 1.0
    bench.goal()
    assert "too slow" in bench.refusals()[-1].why
    assert bench.of(protocol.SentGoal) == []


def test_a_goal_that_could_not_be_sent_is_reported(bench):
    bench.take()
    bench.clear = False
    bench.goal()
    assert "too slow" in bench.refusals()[-1].why
    assert bench.of(protocol.SentGoal) == []
    bench.handle(protocol.Disconnect("a"))
    bench.handle(events.GoalWritten("r1", "g", 0, 0, 0, "a", False))


def test_a_robot_without_a_goal_topic_or_action_refuses_goals():
    bench = Bench().begin(spec(goal_topic=None, cancel_topic=None))
    bench.take()
    bench.goal()
    assert bench.refusals()[-1].why == "no goal topic and no action is set"
    bench.send("a", op="cancel", robot="r1")
    assert "no cancel topic" in bench.refusals()[-1].why
    bench.send("a", op="stop", robot="r1")
    bench.send("a", op="reset", robot="r1")
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
def test_the_loss_of_the_sender_cancels_a_goal_only_if_configured(loss, policy):
    bench = Bench().begin(spec(on_operator_loss=policy))
    bench.take()
    bench.goal()
    bench.handle(protocol.Disconnect("b"))  # not the sender
    assert cancels(bench) == 0
    if loss == "connection":
        bench.handle(protocol.Disconnect("a"))
    elif loss == "display":
        bench.beating = False
        bench.run(0.5)
    else:
        bench.handle(events.Shutdown("the end"))
    assert cancels(bench) == (1 if policy == "cancel" else 0)


def test_a_goal_without_a_cancel_topic_is_not_cancelled_on_operator_loss():
    only = spec(on_operator_loss="cancel", cancel_topic=None)
    bench = Bench().begin(only)
    bench.take()
    bench.goal()
    bench.handle(protocol.Disconnect("a"))
    assert cancels(bench) == 0


@pytest.mark.parametrize("policy", ["continue", "cancel"])
def test_removing_the_robot_cancels_a_goal_only_if_configured(policy):
    bench = Bench().begin(spec(on_operator_loss=policy))
    bench.take()
    bench.goal()
    bench.handle(protocol.Forget("r1"))
    kept = (actions.CancelGoals, actions.Detach)
    order = [type(a) for a in bench.done if isinstance(a, kept)]
    called_off = [actions.CancelGoals] if policy == "cancel" else []
    assert order == [*called_off, actions.Detach], "before the detach"


class TestNewSettings:
    """A goal whose robot is declared again with other topics or actions for goals."""

    def declare(self, before, after, **goal):
        bench = Bench().begin(spec(**before))
        bench.send("a", op="cancel", robot="r1")
        bench.take()
        bench.goal(**goal)
        bench.done.clear()
        bench.handle(spec(**after))
        return bench

    @pytest.mark.parametrize(
        ("before", "after"),
        [
            ({}, {"cancel_topic": "/other"}),
            ({}, {"cancel_topic": None}),
            ({}, {"goal_topic": "/other"}),
            ({}, {"goal_topic": None, "cancel_topic": None}),
            ({}, {"goal_url": "ws://other:9090"}),
            ({"action": "/go"}, {"action": "/come"}),
            ({"action": "/go"}, {}),
            ({"action": "/go"}, {"action": "/go", "action_type": MOVE_BASE_TYPE}),
        ],
    )
    def test_a_goal_is_cancelled_before_the_goal_or_cancel_settings_change(
        self, before, after
    ):
        bench = self.declare(before, after)
        kept = (actions.CancelGoals, actions.Attach)
        order = [type(a) for a in bench.done if isinstance(a, kept)]
        assert order == [actions.CancelGoals, actions.Attach]
        goal = bench.report().goal
        assert (goal.state, goal.why) == ("failed", ELSEWHERE)

    @pytest.mark.parametrize(
        "after",
        [
            {"v_max": 0.5},
            {"action": "/go"},
            {"pose_topic": "/initialpose"},
            {"on_operator_loss": "cancel"},
        ],
    )
    def test_a_goal_continues_if_the_new_settings_can_still_cancel_the_goal(
        self, after
    ):
        bench = self.declare({}, after)
        assert cancels(bench) == 0
        assert bench.report().goal.state == "sent"
        bench.send("b", op="stop", robot="r1")
        assert cancels(bench) == 1

    def test_a_goal_is_also_cancelled_if_the_robot_becomes_another_machine(self):
        bench = self.declare({}, {"twist_topic": "/other", "cancel_topic": None})
        assert cancels(bench) == 1

    def test_a_goal_without_a_cancel_topic_reports_the_change_of_the_goal_topic(self):
        bench = self.declare({"cancel_topic": None}, {"goal_topic": "/other"})
        assert cancels(bench) == 0
        assert bench.report().goal.why == ELSEWHERE

    def test_a_goal_that_has_ended_is_not_changed_by_new_settings(self):
        bench = Bench().begin(spec(action="/go"))
        bench.take()
        bench.goal()
        bench.handle(events.GoalEnded("r1", goals(bench)[0].id, "reached"))
        bench.handle(spec(action="/come"))
        assert cancels(bench) == 0
        assert bench.report().goal.state == "reached"

    def test_a_pending_cancel_is_not_sent_to_a_new_cancel_topic(self):
        bench = Bench().begin()
        bench.handle(events.LinkDown(URL, "tasks"))
        bench.send("a", op="cancel", robot="r1")
        bench.handle(spec(cancel_topic="/other"))
        bench.handle(events.LinkUp(URL, "tasks"))
        assert cancels(bench) == 0


MOVE_BASE = {"action": "/move_base", "action_type": "move_base_msgs/MoveBaseAction"}


class TestMethod:
    @pytest.mark.parametrize(
        ("changes", "way"),
        [
            ({}, "topic"),
            ({"action": "/go"}, "navigate_to_pose"),
            ({"action": "/go", "goal_topic": None}, "navigate_to_pose"),
            (MOVE_BASE, "move_base"),
            ({"goal_topic": None}, None),
        ],
    )
    def test_a_goal_is_sent_by_the_topic_or_action_of_the_robot(self, changes, way):
        bench = Bench().begin(spec(**changes))
        assert bench.report().method == way
        bench.take()
        bench.goal()
        assert [goal.method for goal in goals(bench)] == [way][: way is not None]

    def test_after_a_bridge_without_actions_the_next_goal_uses_the_topic(self):
        bench = Bench().begin(spec(action="/go"))
        bench.take()
        bench.goal()
        (first,) = goals(bench)
        bench.handle(
            events.GoalEnded("r1", first.id, "failed", "too old", no_actions=True)
        )
        report = bench.report()
        assert report.goal.state == "failed"
        assert report.goal.why == "too old; the next goal goes to /goal"
        assert report.method == "topic"
        assert len(goals(bench)) == 1, "no goal is sent automatically"
        bench.goal()
        assert goals(bench)[-1].method == "topic"

    def test_without_a_goal_topic_goals_still_use_the_action(self):
        bench = Bench().begin(spec(action="/go", goal_topic=None))
        bench.take()
        bench.goal()
        (first,) = goals(bench)
        bench.handle(
            events.GoalEnded("r1", first.id, "failed", "too old", no_actions=True)
        )
        assert bench.report().goal.why == "too old"
        assert bench.report().method == "navigate_to_pose"


class TestProgress:
    @pytest.fixture
    def bench(self):
        bench = Bench().begin(spec(action="/go"))
        bench.send("a", op="cancel", robot="r1")
        bench.done.clear()
        bench.take()
        bench.goal()
        return bench

    def progress(self, bench, **values):
        bench.handle(events.GoalProgress("r1", goals(bench)[-1].id, **values))
        bench.run(0.2)
        return bench.report().goal

    def end(self, bench, *how):
        bench.handle(events.GoalEnded("r1", goals(bench)[-1].id, *how))
        return bench.report().goal

    def test_a_goal_is_reported_as_sent_accepted_under_way_and_reached(self, bench):
        goal = bench.report().goal
        assert (goal.x, goal.y, goal.yaw, goal.by) == (1.0, 2.0, 0.5, "a")
        assert (goal.state, goal.left) == ("sent", None)
        assert self.progress(bench, active=False).state == "accepted"
        goal = self.progress(
            bench, active=True, left=2.5, time=1.0, eta=4.0, recoveries=1
        )
        assert goal.state == "under way"
        assert (goal.left, goal.time, goal.eta, goal.recoveries) == (2.5, 1.0, 4.0, 1)
        goal = self.progress(bench, active=True)
        assert goal.left == 2.5, "a report without a value changes no value"
        goal = self.end(bench, "reached", "")
        assert (goal.state, goal.why) == ("reached", "")

    def test_goal_progress_is_reported_about_ten_times_a_second_at_most(self, bench):
        self.progress(bench, active=True, left=9.0)
        before = len(bench.of(protocol.RobotReport))
        id = goals(bench)[-1].id

        def report_progress():
            bench.handle(events.GoalProgress("r1", id, active=True, left=bench.now))

        bench.run(1.0, report_progress)
        assert len(bench.of(protocol.RobotReport)) - before <= 11

    def test_a_failed_goal_reports_the_reason_and_stays_failed(self, bench):
        goal = self.end(bench, "failed", "no path to the goal")
        assert (goal.state, goal.why) == ("failed", "no path to the goal")
        assert self.end(bench, "reached", "").state == "failed", "a goal ends only once"
        assert self.progress(bench, active=True).state == "failed"

    def test_a_failed_goal_without_a_reason_reports_the_missing_reason(self, bench):
        assert self.end(bench, "failed", "").why == "the robot gave no reason"

    def test_a_goal_is_cancelling_until_the_robot_confirms_the_cancel(self, bench):
        bench.send("b", op="cancel", robot="r1")
        assert bench.report().goal.state == "cancelling"
        goal = self.progress(bench, active=True, left=1.0)
        assert (goal.state, goal.left) == ("cancelling", 1.0)
        assert self.end(bench, "cancelled", "canceled").state == "cancelled"

    def test_a_goal_still_active_after_its_cancel_is_cancelled_again(self, bench):
        """They use different sockets: a cancel may arrive before its goal."""
        self.progress(bench, active=False)
        assert cancels(bench) == 0
        bench.send("b", op="cancel", robot="r1")
        assert cancels(bench) == 1
        for _ in range(8):
            self.progress(bench, active=True)
        assert cancels(bench) == 3, "at once, and then once a second"
        self.end(bench, "cancelled")
        self.progress(bench, active=True)
        assert cancels(bench) == 3

    def test_any_goal_that_is_active_during_a_stop_is_cancelled(self, bench):
        bench.send("b", op="stop", robot="r1")
        before = cancels(bench)
        bench.handle(events.GoalProgress("r1", "an earlier one", active=True))
        assert cancels(bench) == before + 1

    def test_an_active_goal_without_a_cancel_topic_is_not_cancelled_during_a_stop(self):
        bench = Bench().begin(spec(cancel_topic=None))
        bench.send("b", op="stop", robot="r1")
        bench.handle(events.GoalProgress("r1", "g", active=True))
        assert cancels(bench) == 0

    def test_a_goal_reached_before_the_cancel_is_reported_as_reached(self, bench):
        bench.send("b", op="cancel", robot="r1")
        assert self.end(bench, "reached").state == "reached"

    def test_a_goal_that_fails_because_of_its_cancel_is_reported_as_cancelled(
        self, bench
    ):
        bench.send("b", op="cancel", robot="r1")
        goal = self.end(bench, "failed", "superseded")
        assert (goal.state, goal.why) == ("cancelled", "by B")

    def test_a_goal_cancelled_by_another_program_reports_the_cause(self, bench):
        goal = self.end(bench, "cancelled", "")
        assert goal.why == "by the robot, or by another program"

    def test_a_goal_cancelled_by_an_operator_names_the_operator(self, bench):
        bench.send("b", op="cancel", robot="r1")
        goal = self.end(bench, "cancelled", "canceled")
        assert (goal.state, goal.why) == ("cancelled", "by B")

    @pytest.mark.parametrize(
        ("act", "why"),
        [
            (lambda bench: bench.send("b", op="stop", robot="r1"), "STOP"),
            (
                lambda bench: (bench.hold(0.3), bench.hold(0.1, x=1.0)),
                "the robot is being driven",
            ),
        ],
    )
    def test_a_goal_cancelled_by_stop_or_driving_reports_the_cause(
        self, bench, act, why
    ):
        act(bench)
        assert bench.report().goal.why == why
        assert self.end(bench, "cancelled", "canceled").why == why

    def test_a_lost_goal_is_unknown_until_new_progress_arrives(self, bench):
        id = goals(bench)[-1].id
        bench.handle(events.GoalLost("r1", id, "no link"))
        assert bench.report().goal.state == "unknown"
        assert bench.report().goal.why == "no link"
        assert self.progress(bench, active=True).state == "under way"
        self.end(bench, "reached")
        bench.handle(events.GoalLost("r1", id, "no link"))
        assert bench.report().goal.state == "reached"

    def test_a_goal_that_the_robot_never_answers_is_of_unknown_state_after_5_s(
        self, bench
    ):
        bench.run(ANSWER - 0.3)
        assert bench.report().goal.state == "sent"
        assert bench.report().doing == "navigating_held"
        bench.run(0.4)
        goal = bench.report().goal
        assert (goal.state, goal.why) == ("unknown", UNANSWERED)
        assert bench.report().doing == "held"
        bench.handle(events.EchoReceived(KEY, Twist(0.3)))
        bench.handle(events.EchoReceived(KEY, Twist(0.3)))
        assert bench.report().other_writer, "it may be another program that drives"
        assert self.progress(bench, active=True).state == "under way"

    def test_the_cancel_of_a_goal_that_was_never_answered_ends_after_5_s(self, bench):
        bench.run(ANSWER + 0.1)
        bench.send("b", op="cancel", robot="r1")
        assert bench.report().goal.state == "cancelling"
        bench.run(ANSWER + 0.1)
        goal = bench.report().goal
        assert goal.state == "cancelled"
        assert goal.why == f"by B; {NOT_STOPPED}"
        bench.done.clear()
        bench.handle(events.GoalProgress("r1", goal.id, active=True))
        assert cancels(bench) == 1, "a goal that runs nevertheless is cancelled again"

    def test_an_unanswered_cancel_of_a_running_goal_leaves_an_unknown_state(self):
        bench = Bench().begin(spec(action="/go", pose_topic="/initialpose"))
        bench.take()
        bench.goal()
        self.progress(bench, active=True)
        bench.send("b", op="cancel", robot="r1")
        bench.run(ANSWER - 0.3)
        self.progress(bench, active=True)
        bench.run(ANSWER - 0.3)
        assert bench.report().goal.state == "cancelling", "it still reports"
        bench.run(0.2)
        goal = bench.report().goal
        assert (goal.state, goal.why) == ("unknown", NOT_STOPPED)
        bench.hold(0.1)
        bench.goal(op="locate")
        assert bench.did(actions.SendPose), "the pose can be set again"
        bench.send("b", op="cancel", robot="r1")
        assert bench.report().goal.state == "cancelling"

    def test_a_lost_goal_whose_cancel_is_not_answered_is_of_unknown_state(self, bench):
        bench.handle(events.GoalLost("r1", goals(bench)[-1].id, "no link"))
        bench.send("b", op="cancel", robot="r1")
        bench.run(ANSWER + 0.1)
        assert bench.report().goal.state == "unknown"

    def test_a_cancel_sent_to_a_dead_link_is_sent_again_on_the_next_link(self, bench):
        """The link seemed open for some seconds, so the cancel seemed to be written."""
        id = goals(bench)[-1].id
        bench.handle(protocol.Disconnect("a"))
        bench.send("b", op="cancel", robot="r1")
        bench.run(4.0)
        assert cancels(bench) == 1
        bench.break_links()
        bench.done.clear()
        bench.handle(events.GoalLost("r1", id, "no link"))
        assert bench.report().goal.state == "cancelling"
        bench.done.clear()
        bench.connect_links()
        assert cancels(bench) == 1
        bench.connect_links()
        assert cancels(bench) == 1
        bench.handle(events.GoalProgress("r1", id, active=True))
        assert cancels(bench) == 2, "an active goal is cancelled again"

    def test_a_lost_goal_that_is_being_cancelled_is_cancelled_again(self, bench):
        """The socket of the goal is lost, the socket of cancels is not."""
        bench.send("b", op="cancel", robot="r1")
        bench.handle(events.GoalLost("r1", goals(bench)[-1].id, "given up"))
        assert cancels(bench) == 2
        assert bench.report().goal.state == "cancelling"
        bench.connect_links()
        assert cancels(bench) == 2

    @pytest.mark.parametrize("answer", [True, False])
    def test_a_cancel_is_sent_again_on_a_new_link_only_without_an_answer(
        self, bench, answer
    ):
        bench.send("b", op="cancel", robot="r1")
        if answer:
            self.end(bench, "cancelled")
        bench.break_links()
        bench.connect_links()
        assert cancels(bench) == (1 if answer else 2)

    def test_a_new_link_does_not_send_the_goal_again(self, bench):
        bench.break_links()
        bench.run(0.5)
        bench.connect_links()
        bench.run(1.0)
        assert len(goals(bench)) == 1

    def test_a_goal_is_cancelling_while_its_cancel_waits_for_a_link(self):
        bench = Bench().begin()
        bench.take()
        bench.goal()
        assert bench.report().goal.why == "this robot reports no progress"
        bench.handle(events.LinkDown(URL, "tasks"))
        bench.send("a", op="cancel", robot="r1")
        assert bench.report().goal.state == "cancelling"
        bench.handle(events.LinkUp(URL, "tasks"))
        assert bench.report().goal.state == "cancelled"

    @pytest.mark.parametrize("late", [False, True])
    def test_an_unanswered_cancel_is_sent_again_only_if_the_link_is_lost_soon(
        self, late
    ):
        bench = Bench().begin()
        bench.take()
        bench.goal()
        bench.send("b", op="cancel", robot="r1")
        bench.run((1.1 if late else 0.9) * IN_VAIN)
        bench.break_links()
        assert bench.report().goal.state == ("cancelled" if late else "cancelling")
        bench.connect_links()
        assert bench.report().goal.state == "cancelled"
        assert cancels(bench) == (1 if late else 2)

    def test_a_lost_link_does_not_repeat_a_cancel_older_than_the_goal(self):
        bench = Bench().begin()
        bench.send("a", op="cancel", robot="r1")
        bench.take()
        bench.goal()
        bench.break_links()
        bench.connect_links()
        assert cancels(bench) == 1

    def test_a_link_handed_over_to_a_goal_does_not_repeat_a_cancel(self):
        bench = Bench().begin()
        bench.send("a", op="cancel", robot="r1")
        bench.handle(events.LinkDown(URL, "tasks", spent=True))
        bench.handle(events.LinkUp(URL, "tasks"))
        assert cancels(bench) == 1

    def test_events_of_other_goals_and_other_robots_change_nothing(self, bench):
        before = bench.report()
        for event in (
            events.GoalProgress("r1", "x", active=True),
            events.GoalEnded("r1", "x", "failed", "no"),
            events.GoalLost("r1", "x", "no"),
            events.GoalProgress("r9", "x", active=True),
            events.GoalEnded("r9", "x"),
            events.GoalLost("r9", "x", "no"),
        ):
            bench.handle(event)
        assert bench.report() == before


class TestInitialPose:
    @pytest.fixture
    def bench(self):
        return Bench().begin(spec(pose_topic="/initialpose"))

    def locate(self, bench, who="a", **changes):
        bench.goal(who, **{"op": "locate", **changes})
        return bench.did(actions.SendPose)

    def why(self, bench, who="a"):
        return bench.refusals(who)[-1].why

    def test_the_operator_in_control_sets_the_pose_of_the_robot(self, bench):
        assert bench.report().locates
        bench.take()
        bench.hold(0.1)
        (received,) = self.locate(bench)
        assert (received.robot, received.x, received.y, received.yaw) == (
            "r1",
            1.0,
            2.0,
            0.5,
        )
        bench.handle(events.PoseWritten("r1", 1.0, 2.0, 0.5, "a", done=True))
        assert bench.of(protocol.SentPose) == [
            protocol.SentPose("r1", 1.0, 2.0, 0.5, "a")
        ]
        bench.handle(events.PoseWritten("r1", 1.0, 2.0, 0.5, "a", done=False))
        assert "too slow" in self.why(bench)

    @pytest.mark.parametrize(
        ("changes", "why"),
        [({"epoch": 0}, "epoch"), ({"tick": 1}, "too old"), ({"seq": 0}, "seq")],
    )
    def test_setting_the_pose_needs_lease_epoch_new_seq_and_recent_tick(
        self, bench, changes, why
    ):
        assert self.locate(bench) == []
        assert "take control first" in self.why(bench)
        bench.take()
        bench.hold(0.1)
        assert self.locate(bench, **changes) == []
        assert why in self.why(bench)
        assert self.locate(bench, "b") == []

    def test_setting_the_pose_is_refused_while_the_robot_navigates(self, bench):
        bench.take()
        bench.goal()
        assert self.locate(bench) == []
        assert "is navigating" in self.why(bench)
        bench.send("a", op="cancel", robot="r1")
        assert len(self.locate(bench)) == 1

    def test_setting_the_pose_is_refused_while_the_robot_is_driven_or_stopping(
        self, bench
    ):
        bench.drive_off()
        assert self.locate(bench) == []
        bench.drive()
        assert self.locate(bench) == []
        assert "is moving" in self.why(bench)
        bench.hold(1.0)
        assert len(self.locate(bench)) == 1

    def test_setting_the_pose_is_refused_during_a_stop_and_without_a_link(self, bench):
        bench.take()
        bench.handle(events.LinkDown(URL, "tasks"))
        assert self.locate(bench) == []
        assert "no connection" in self.why(bench)
        bench.handle(events.LinkUp(URL, "tasks"))
        bench.send("a", op="stop", robot="r1")
        assert self.locate(bench) == []

    def test_setting_the_pose_is_refused_while_the_display_is_silent(self, bench):
        bench.take()
        bench.beating = False
        bench.run(0.3)
        assert self.locate(bench) == []

    def test_setting_the_pose_is_refused_without_a_pose_topic(self):
        bench = Bench().begin()
        bench.take()
        assert not bench.report().locates
        assert self.locate(bench) == []
        assert "no topic for the initial pose" in self.why(bench)

    def test_a_goal_without_progress_reports_does_not_block_setting_the_pose(self):
        bench = Bench().begin(spec(pose_topic="/initialpose", cancel_topic=None))
        bench.take()
        bench.goal()
        assert len(self.locate(bench)) == 1

    def test_only_a_program_with_the_lease_sets_the_pose(self, bench):
        received = commands.Locate("r1", 0, 0, bench.tick, 1.0, 2.0, 0.5)
        bench.handle(protocol.FromProgram(received))
        assert bench.did(actions.SendPose) == []
        bench.handle(protocol.FromProgram(commands.Take("r1"), 1))
        bench.run(0.1)
        epoch = bench.report().epoch
        received = msgspec.structs.replace(received, epoch=epoch, tick=bench.tick)
        bench.handle(protocol.FromProgram(received))
        assert len(bench.did(actions.SendPose)) == 1

    @pytest.mark.parametrize(
        ("changes", "what"),
        [
            ({"pose_covariance": (-1.0, 0.0, 0.0)}, "from 0 on"),
            (
                {"action": "/go", "action_type": "a/Fib"},
                "one of the types nav2_msgs/",
            ),
        ],
    )
    def test_invalid_pose_and_action_settings_are_refused(self, changes, what):
        with pytest.raises(ConfigError, match=what):
            checked(spec(**{"pose_topic": "/initialpose", **changes}))


def test_the_assisted_teleop_action_is_refused():
    """AssistedTeleop repeats the last velocity, however old it is."""
    for type in ("nav2_msgs/AssistedTeleop", "nav2_msgs/action/AssistedTeleop"):
        with pytest.raises(ConfigError, match="AssistedTeleop"):
            checked(spec(action="/assisted_teleop", action_type=type))


class TestGoalsOnly:
    @pytest.fixture
    def bench(self):
        return Bench().begin(spec(twist_topic=None, action="/go", goal_topic=None))

    def test_a_robot_without_a_velocity_topic_accepts_goals_but_no_velocities(
        self, bench
    ):
        assert bench.take()
        assert bench.report().link == "up"
        bench.goal()
        assert len(goals(bench)) == 1
        bench.hold(0.3)
        bench.hold(0.3, x=1.0)
        assert bench.written == []
        assert bench.refusals()[-1].why == "the robot has no velocity topic"

    def test_stop_of_a_goals_only_robot_cancels_goals_and_sends_no_velocity(
        self, bench
    ):
        bench.send("b", op="stop", robot="*")
        bench.run(0.5)
        assert cancels(bench) == 1
        assert bench.written == bench.dropped == []

    def test_a_goals_only_robot_cannot_be_taken_without_its_link(self, bench):
        bench.handle(events.LinkDown(URL, "tasks"))
        assert bench.take() is None
        assert bench.report().link == "down"

    def test_a_robot_without_velocity_and_goal_topics_cannot_be_taken(self):
        bench = Bench().begin(
            spec(twist_topic=None, goal_topic=None, pose_topic="/initialpose")
        )
        assert bench.take() is None
        assert "no velocity topic and no goal topic" in bench.report().reason
