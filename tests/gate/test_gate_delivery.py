"""Driving through Foxglove: the proof that velocities arrive, and what is needed."""

import pytest

from equipment.gate_harness import Bench, spec
from webmap.base.geometry import Twist
from webmap.gate import actions, events, protocol
from webmap.gate.events import Key
from webmap.gate.rules.authority import NO_TIMEOUT
from webmap.gate.rules.health import PROOF_LIMIT, STALL_LIMIT
from webmap.gate.rules.stop_test import CREEP

URL = "foxglove://robot:9999"
KEY = Key(URL, "/cmd_vel")
ZERO = Twist()


@pytest.fixture(autouse=True)
def address(monkeypatch):
    monkeypatch.setattr("equipment.gate_harness.URL", URL)


class OldBench(Bench):
    """A bench with a bridge that answers pings in a thread of its own."""

    echoing = True
    """Whether each velocity comes back at once."""
    only_zeros = False
    """Whether only zeros do, as those of another program."""

    def _report(self, results):
        back = [result for result in results if result.done and self.echoing]
        super()._report(results)
        for result in back:
            if result.twist.is_zero or not self.only_zeros:
                self.echo(result.twist)

    def echo(self, twist, times=1):
        for _ in range(times):
            self.handle(events.EchoReceived(KEY, twist))

    def connect_links(self):
        self.up = True
        self.handle(events.LinkUp(URL, "control", only_echoes=True))
        self.handle(events.LinkUp(URL, "tasks", only_echoes=True))

    def odometry(self, speed=0.0, seconds=0.5):
        """Let odometry show a speed for a while."""
        for _ in range(round(seconds / 0.05)):
            self.run(0.05)
            self.handle(events.OdometryReceived(KEY, Twist(speed)))


def declared(**changes):
    return spec(bridge_url=URL, stops_within=0.5, drive_without_proof=True, **changes)


@pytest.fixture
def old():
    return OldBench().begin(declared())


def drive(bench, x):
    """Send an input for a while, with odometry that shows standstill."""

    def each():
        bench.handle(events.OdometryReceived(KEY, ZERO))
        bench.drive(x=x)

    bench.run(0.4, each)


class TestKnownTimeout:
    @pytest.fixture
    def bench(self):
        robot = spec(bridge_url=URL, stops_within=None, odometry_topic="/odom")
        bench = Bench().begin(robot)
        bench.take()
        return bench

    def test_a_base_without_a_known_timeout_is_not_driven(self, bench):
        drive(bench, 0.0)
        drive(bench, 1.0)
        assert bench.written == []
        assert bench.refusals()[-1].why == NO_TIMEOUT
        assert bench.report().reason == NO_TIMEOUT

    def test_a_stated_timeout_is_enough(self):
        bench = Bench().begin(spec(bridge_url=URL, stops_within=0.5))
        bench.drive_off()
        assert bench.written[-1].twist == Twist(1.0)

    def test_the_stop_test_drives_and_its_result_is_enough(self, bench):
        drive(bench, 0.0)
        bench.send("a", op="stop-test", robot="r1")
        drive(bench, 0.0)
        assert bench.written[-1].twist == CREEP
        bench.drive(x=1.0)  # ends the test
        bench.handle(events.StopTestSaved(KEY, events.StopRecord(0.3, "2026-11-29")))
        drive(bench, 0.0)
        drive(bench, 1.0)
        assert bench.written[-1].twist == Twist(1.0)

    def test_an_answered_ping_proves_the_zero(self, bench):
        bench.send("a", op="stop", robot="r1")
        bench.run(1.0)
        assert actions.MarkDriven(KEY, False) in bench.done


class TestWithoutProof:
    def test_a_robot_behind_an_old_bridge_cannot_be_taken_without_the_option(self):
        bench = OldBench().begin(spec(bridge_url=URL))
        assert bench.take() is None
        assert "set drive_without_proof" in bench.refusals()[-1].why
        bench.send("a", op="stop", robot="r1")
        assert bench.written[-1].twist == ZERO

    def test_each_robot_of_the_machine_must_have_the_option(self):
        other = spec(bridge_url=URL, id="r2", stops_within=0.5)
        assert OldBench().begin(declared(), other).take() is None

    def test_a_goal_needs_the_option_too(self):
        goals = spec(bridge_url=URL, twist_topic=None)
        bench = OldBench().begin(goals)
        bench.take()
        bench.goal()
        assert "set drive_without_proof" in bench.refusals()[-1].why
        assert bench.did(actions.SendGoal) == []

    def test_control_begins_with_zeros_that_must_come_back(self, old):
        old.echoing = False
        old.drive_off()
        assert {w.twist for w in old.written} == {ZERO}
        assert "has sent no velocity of /cmd_vel back" in old.refusals()[-1].why
        old.send("a", op="release", robot="r1")
        old.echoing = True
        old.drive_off()
        assert old.written[-1].twist == Twist(1.0)


class TestEchoes:
    def test_the_age_of_the_loop_has_the_time_until_the_echo(self, old):
        old.drive_off()
        assert old.report().age < 60
        old.echoing = False
        begun = len(old.written)
        old.hold(0.2, x=0.5)
        old.echo(Twist(0.5))
        old.hold(0.05, x=0.5)
        assert len(old.written) > begun
        assert old.report().age >= 200

    def test_only_echoes_of_motion_allow_more_of_it(self, old):
        old.drive_off()
        old.only_zeros = True
        at = old.now
        old.hold(0.6, x=0.5)
        moving = old.moving_since(at)
        assert moving[-1].at - moving[0].at <= PROOF_LIMIT + 0.06
        assert old.written[-1].twist == ZERO
        assert "velocities do not come back" in old.report().reason

    def test_after_a_stall_the_inputs_must_be_released(self, old):
        old.drive_off()
        old.echoing = False
        old.hold(0.5, x=0.5)
        assert old.written[-1].twist == ZERO
        old.echoing = True
        old.echo(Twist(0.5), times=10)
        at = old.now
        old.hold(0.3, x=0.5)
        assert old.moving_since(at) == []
        old.hold(0.3)
        old.hold(0.1, x=0.5)
        assert old.written[-1].twist.vx > 0  # slowly, as the echoes were late

    def test_a_velocity_of_another_program_is_no_echo(self, old):
        old.drive_off()
        old.echoing = False
        old.hold(0.2, x=0.5)
        old.echo(Twist(0.75))
        old.hold(0.3, x=0.5)
        assert "velocities do not come back" in old.report().reason

    def test_a_long_stall_cuts_the_link_and_the_next_one_begins_anew(self, old):
        old.drive_off()
        old.echoing = False
        old.hold(STALL_LIMIT + 0.2, x=0.5)
        assert old.did(actions.CutLink) == [actions.CutLink(URL)]
        old.echoing = True
        old.connect_links()
        old.hold(0.3)
        old.hold(0.2, x=0.5)
        assert old.written[-1].twist == Twist(0.5)
        assert len(old.did(actions.CutLink)) == 1

    def test_a_link_whose_pings_are_not_answered_gets_nothing_but_zero(self, old):
        old.drive_off()
        old.answering = False
        old.hold(0.5, x=0.5)
        assert old.report().reason == f"no answer from {URL}"


class TestStandstill:
    @pytest.fixture
    def driven(self):
        """A bench whose operator drives, and a function that continues for a while."""
        robot = declared(odometry_topic="/odom", odometry_type="nav_msgs/Odometry")
        bench = OldBench().begin(robot)
        bench.take()
        bench.run(0.1)

        def each():
            bench.handle(events.OdometryReceived(KEY, ZERO))
            bench.drive(x=0.5 if bench.report().armed else 0.0)

        bench.run(0.6, each)
        assert bench.written[-1].twist == Twist(0.5)
        return bench, lambda seconds: bench.run(seconds, each)

    def test_a_stop_is_confirmed_only_when_no_velocity_waits(self, driven):
        bench, drive_on = driven
        bench.echoing = False
        drive_on(0.1)
        bench.send("a", op="stop", robot="r1")
        bench.odometry(seconds=0.6)
        assert not bench.report().stop.confirmed
        bench.echo(Twist(0.5), times=10)
        bench.odometry()
        assert bench.report().stop.confirmed

    def test_a_new_connection_alone_does_not_confirm_a_stop(self, driven):
        """The bridge greets clients while its other thread still holds velocities."""
        bench, drive_on = driven
        bench.echoing = False
        drive_on(STALL_LIMIT + 0.2)
        assert len(bench.did(actions.CutLink)) == 1
        bench.connect_links()
        bench.send("a", op="stop", robot="r1")
        bench.odometry(seconds=STALL_LIMIT + 0.5)
        assert not bench.report().stop.confirmed
        assert len(bench.did(actions.CutLink)) == 1
        bench.echoing = True
        bench.odometry()
        assert bench.report().stop.confirmed

    def test_a_newer_bridge_holds_no_velocity_of_the_older_one(self, driven):
        bench, drive_on = driven
        bench.echoing = False
        drive_on(0.1)
        bench.handle(events.LinkDown(URL, "control"))
        bench.handle(events.LinkUp(URL, "control"))
        bench.send("a", op="stop", robot="r1")
        bench.odometry(seconds=0.6)
        assert bench.report().stop.confirmed

    def test_a_zero_is_owed_until_no_velocity_waits(self, old):
        old.drive_off()
        old.echoing = False
        old.hold(0.1, x=0.5)
        old.drive(x=0.0)
        old.run(0.7)
        assert old.did(actions.MarkDriven)[-1] == actions.MarkDriven(KEY, True)
        old.echo(Twist(0.5), times=10)
        old.run(0.1)
        assert old.did(actions.MarkDriven)[-1] == actions.MarkDriven(KEY, False)


class TestActions:
    GO = "/navigate_to_pose"

    def offered(self, bench, *names):
        bench.handle(events.ActionsOffered(URL, frozenset(names)))

    def test_goals_are_sent_to_an_action_only_where_the_bridge_offers_it(self):
        bench = Bench().begin(spec(bridge_url=URL, goal_topic=None, action=self.GO))
        bench.take()
        bench.goal()
        why = bench.refusals()[-1].why
        assert "does not offer /navigate_to_pose as an action" in why
        assert "include_hidden:=true" in why
        assert bench.report().method is None
        self.offered(bench, "/other")
        assert bench.report().method is None
        self.offered(bench, "/other", self.GO)
        assert bench.report().method == "navigate_to_pose"
        bench.goal()
        (sent,) = bench.did(actions.SendGoal)
        assert sent.method == "navigate_to_pose"
        assert bench.report().goal.method == "navigate_to_pose"
        bench.handle(events.GoalProgress("r1", sent.id, active=False))
        assert bench.report().goal.state == "accepted"

    def test_a_lost_link_is_the_reason_before_an_action_that_is_not_offered(self):
        bench = Bench().begin(spec(bridge_url=URL, goal_topic=None, action=self.GO))
        bench.take()
        bench.handle(events.LinkDown(URL, "tasks"))
        bench.goal()
        assert "no connection" in bench.refusals()[-1].why

    def test_goals_go_to_a_topic_while_the_action_is_not_offered(self):
        bench = Bench().begin(spec(bridge_url=URL, action=self.GO))
        assert bench.report().method == "topic"
        self.offered(bench, self.GO)
        assert bench.report().method == "navigate_to_pose"
        self.offered(bench)
        assert bench.report().method == "topic"

    def test_a_robot_without_a_velocity_topic_names_what_its_bridge_lacks(self):
        robot = spec(bridge_url=URL, twist_topic=None, goal_topic=None, action=self.GO)
        bench = Bench().begin(robot)
        assert "include_hidden" in bench.report().reason
        self.offered(bench, self.GO)
        assert bench.report().reason is None


def test_echoes_change_nothing_where_a_ping_proves_more():
    bench = Bench().begin(spec(bridge_url=URL, stops_within=0.5))
    bench.drive_off()
    bench.handle(events.EchoReceived(KEY, Twist(1.0)))
    bench.hold(0.2, x=1.0)
    assert bench.written[-1].twist == Twist(1.0)


def test_a_velocity_of_a_robot_that_is_gone_is_no_error():
    bench = Bench().begin(spec(bridge_url=URL))
    bench.handle(protocol.Forget("r1"))
    bench.handle(events.EchoReceived(KEY, Twist(1.0)))
