"""Robots as they are declared, changed, shared and forgotten."""

import math

import pytest

from equipment.gate_harness import KEY, URL, ZERO, Bench, spec
from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.config.motion import ScanAssistConfig, StopHook
from webmap.gate import actions, events, protocol
from webmap.gate.events import Key
from webmap.gate.specs import checked, key_of


class TestSpecs:
    def test_urls_and_topic_names_are_normalized(self):
        one = checked(spec(bridge_url="ws://ROBOT:9090/", twist_topic="cmd_vel"))
        assert key_of(one) == key_of(checked(spec())) == KEY
        assert one.goal_url == one.odometry_url == URL

    def test_separate_bridges_for_goals_and_odometry_are_kept(self):
        one = checked(spec(goal_url="ws://g:1/", odometry_url="ws://o:1/"))
        assert (one.goal_url, one.odometry_url) == ("ws://g:1", "ws://o:1")

    def test_a_robot_without_a_velocity_topic_has_its_goal_topic_or_id_as_key(self):
        goal_only = checked(spec(twist_topic=None, goal_url="ws://g:1"))
        assert key_of(goal_only) == Key("ws://g:1", "goal /goal")
        pose = spec(twist_topic=None, goal_topic=None, pose_topic="/initialpose")
        assert key_of(pose) == Key(URL, "goal robot r1")

    @pytest.mark.parametrize(
        "changes",
        [
            {"id": ""},
            {"twist_topic": None, "goal_topic": None},
            {"id": "*"},
            {"id": "r" * 65},
            {"id": "r\n"},
            {"bridge_url": "http://robot"},
            {"twist_topic": "not a topic"},
            {"twist_type": "std_msgs/String"},
            {"odometry_type": "Odometry"},
            {"v_max": math.nan},
            {"v_max": -1.0},
            {"w_max": math.inf},
            {"a_max": 0.0},
            {"z_max": 0.0},
            {"stops_within": -0.1},
        ],
    )
    def test_an_invalid_robot_spec_raises_config_error(self, changes):
        with pytest.raises(ConfigError):
            checked(spec(**changes))

    def test_the_gate_logs_and_ignores_an_invalid_robot_spec(self, caplog):
        bench = Bench()
        bench.handle(spec(v_max=math.nan))
        assert bench.done == []
        assert "v_max" in caplog.text


class TestDeclaration:
    def test_a_repeated_declaration_changes_nothing(self):
        bench = Bench().begin()
        epoch = bench.drive_off()
        done = len(bench.done)
        bench.handle(spec())
        assert len(bench.done) == done
        assert bench.report().epoch == epoch

    def test_a_changed_declaration_ends_the_lease_and_sets_the_new_limits(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.handle(spec(v_max=0.5))
        assert bench.written[-1].twist == ZERO
        assert bench.report().holder is None
        assert bench.refusals()[-1].why == "the configuration of the robot was changed"
        bench.drive_off()
        assert bench.written[-1].twist == Twist(0.5)

    def test_a_robot_declared_with_another_velocity_topic_is_another_machine(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.handle(spec(twist_topic="/other"))
        assert bench.written[-1].twist == ZERO
        other = Key(URL, "/other")
        assert bench.did(actions.Lock) == [actions.Lock(KEY), actions.Lock(other)]
        assert bench.did(actions.Unlock) == []
        bench.run(1.0)
        assert bench.did(actions.Unlock) == [actions.Unlock(KEY)]
        assert bench.did(actions.Detach) == [actions.Detach(KEY, "r1")]
        bench.drive_off()
        assert bench.written[-1].key == other

    def test_a_removed_robot_gets_its_zeros_before_the_machine_is_detached(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.handle(protocol.Forget("r1"))
        assert bench.of(protocol.RobotGone) == [protocol.RobotGone("r1")]
        bench.send("b", op="take", robot="r1")
        assert "no robot" in bench.refusals("b")[-1].why
        at = bench.now
        assert bench.gate.busy
        assert bench.did(actions.Detach) == []
        bench.run(1.0)
        assert len([w for w in bench.written if w.at >= at]) >= 10
        assert bench.did(actions.Detach) == [actions.Detach(KEY, "r1")]
        bench.handle(protocol.Forget("r1"))
        assert not bench.gate.busy

    @pytest.mark.parametrize("later", [10.0, None])
    def test_a_removed_robot_without_a_link_waits_up_to_60_s_for_its_zero(self, later):
        bench = Bench().begin()
        bench.drive_off()
        bench.break_links()
        bench.handle(protocol.Forget("r1"))
        if later is None:  # the file on disk keeps the mark for the next gate
            bench.run(61.0, step=0.05)
            assert bench.did(actions.Detach) == [actions.Detach(KEY, "r1")]
            assert bench.did(actions.MarkDriven) == [actions.MarkDriven(KEY, True)]
            return
        bench.run(later)
        assert bench.did(actions.Detach) == []
        at = bench.now
        bench.connect_links()
        bench.run(4.0)
        assert next(w.twist for w in bench.written if w.at >= at) == ZERO
        assert bench.did(actions.Detach) == [actions.Detach(KEY, "r1")]
        assert bench.did(actions.MarkDriven)[-1] == actions.MarkDriven(KEY, False)

    def test_a_removed_robot_that_was_not_driven_is_detached_at_once(self):
        bench = Bench().begin()
        bench.handle(protocol.Forget("r1"))
        assert bench.did(actions.Detach)
        assert bench.did(actions.Unlock)

    def test_a_robot_declared_again_during_its_last_zeros_is_not_detached(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.handle(protocol.Forget("r1"))
        bench.handle(spec())
        bench.run(1.0)
        assert bench.did(actions.Detach) == []
        bench.drive_off()
        assert bench.written[-1].twist == Twist(1.0)


class TestSharedMachine:
    """Two robots of the display that share one machine."""

    @pytest.fixture
    def bench(self):
        return Bench().begin(spec(), spec(id="r2", name="Bob again", v_max=0.4))

    def test_two_robots_on_one_machine_share_one_lease(self, bench):
        assert bench.take("a", "r1")
        assert bench.take("b", "r2") is None
        assert bench.report("r2").holder.connection == "a"

    def test_the_lowest_speed_limit_of_the_two_robots_applies(self, bench):
        bench.drive_off(robot="r1")
        assert bench.written[-1].twist == Twist(0.4)
        assert {s.robot for s in bench.of(protocol.SentTwist)} == {"r1", "r2"}

    def test_removing_the_robot_with_the_lower_limit_stops_the_machine_first(
        self, bench
    ):
        bench.drive_off(robot="r1")
        bench.handle(protocol.Forget("r2"))
        assert bench.did(actions.Detach) == [actions.Detach(KEY, "r2")]
        at = bench.now
        assert bench.written[-1].twist == ZERO
        assert "was removed" in bench.refusals()[-1].why
        bench.hold(0.5, x=1.0)
        assert bench.moving_since(at) == []
        bench.drive_off(robot="r1")
        assert bench.written[-1].twist == Twist(1.0)

    @pytest.mark.parametrize(
        "more",
        [
            {"stop_hooks": (StopHook(topic="/lock", type="std_msgs/Bool"),)},
            {
                "assist": ScanAssistConfig(
                    topic="/scan", footprint=((1, 1), (-1, 1), (0, -1))
                )
            },
            {"odometry_topic": "/odom"},
            {"stops_within": None},
            {"a_max": 0.5},
        ],
    )
    def test_removing_a_robot_with_settings_of_its_own_ends_the_lease(self, more):
        bench = Bench().begin(spec(), spec(id="r2", **more))
        assert bench.take("a", "r1")
        bench.handle(protocol.Forget("r2"))
        assert bench.report().holder is None

    def test_removing_one_of_two_equal_robots_does_not_stop_the_other(self):
        bench = Bench().begin(spec(), spec(id="r2", name="Bob again"))
        bench.drive_off(robot="r1")
        bench.handle(protocol.Forget("r2"))
        bench.hold(0.1, x=1.0)
        assert bench.written[-1].twist == Twist(1.0)
        assert bench.did(actions.Detach) == [actions.Detach(KEY, "r2")]

    def test_removing_both_robots_sends_zeros_before_they_are_detached(self, bench):
        bench.drive_off(robot="r1")
        bench.handle(protocol.Forget("r2"))
        bench.handle(protocol.Forget("r1"))
        assert bench.written[-1].twist == ZERO
        bench.run(1.0)
        assert len(bench.did(actions.Detach)) == 2

    def test_stop_all_sends_one_zero_to_a_shared_machine(self, bench):
        bench.send("b", op="stop", robot="*")
        assert len(bench.written) == 1


class TestTypes:
    """The type of velocities on a topic that two robots share."""

    STAMPED = "geometry_msgs/msg/TwistStamped"

    def test_the_first_of_two_types_of_one_topic_is_used_and_a_warning_is_logged(
        self, caplog
    ):
        bench = Bench().begin(spec(), spec(id="r2", name="Al", twist_type=self.STAMPED))
        sure = [not it.spec.twist_type_assumed for it in bench.did(actions.Attach)]
        assert sure == [True, False]
        assert (
            f"robot 'Al': got {self.STAMPED} for /cmd_vel, but robot 'Bob' uses "
            "geometry_msgs/Twist for this topic; WebMap uses that type for both"
        ) in caplog.text
        # The other settings of the second robot apply, also later.
        bench.handle(spec(id="r2", name="Al", twist_type=self.STAMPED, v_max=0.2))
        again = bench.did(actions.Attach)[-1].spec
        assert (again.base.v_max, again.twist_type_assumed) == (0.2, True)
        bench.send("b", op="stop", robot="r2")
        assert bench.report("r1").latched

    def test_two_robots_on_one_topic_can_both_change_to_another_type(self):
        bench = Bench().begin(spec(), spec(id="r2"))
        for robot in ("r1", "r2"):
            bench.handle(spec(id=robot, twist_type=self.STAMPED))
            received = bench.did(actions.Attach)[-1].spec
            assert (received.twist_type, received.twist_type_assumed) == (
                self.STAMPED,
                False,
            )

    def test_confirming_the_assumed_type_does_not_interrupt_driving(self):
        bench = Bench().begin(spec(twist_type_assumed=True))
        bench.drive_off()
        bench.handle(spec())
        bench.hold(0.1, x=1.0)
        assert bench.written[-1].twist == Twist(1.0)
        assert not bench.did(actions.Attach)[-1].spec.twist_type_assumed

    @pytest.mark.parametrize(
        ("one", "other"),
        [
            ({"twist_type": STAMPED}, {"twist_type_assumed": True}),
            ({"twist_type_assumed": True}, {"twist_type": STAMPED}),
            ({"twist_type": STAMPED}, {"twist_type": "geometry_msgs/TwistStamped"}),
            ({"twist_type": STAMPED}, {"twist_topic": "/other"}),
            ({"twist_type": STAMPED}, {"twist_topic": None}),
        ],
    )
    def test_assumed_equal_or_unrelated_types_log_no_warning(self, one, other, caplog):
        bench = Bench().begin(spec(**one), spec(id="r2", **other))
        assert len(bench.did(actions.Attach)) == 2
        assert caplog.text == ""

    def test_a_robot_can_be_declared_again_with_another_type(self):
        bench = Bench().begin(spec())
        bench.handle(spec(twist_type=self.STAMPED))
        assert bench.did(actions.Attach)[-1].spec.twist_type == self.STAMPED


class TestSeveralMachines:
    def test_a_stop_of_one_robot_does_not_stop_another_robot(self):
        bench = Bench().begin(spec(), spec(id="r2", twist_topic="/r2/cmd_vel"))
        bench.drive_off("b", robot="r2")
        bench.send("a", op="stop", robot="r1")
        assert bench.report("r2").state == "driving"
        bench.send("a", op="stop", robot="*")
        assert bench.report("r2").state == "stopped"

    def test_links_to_another_bridge_do_not_affect_driving(self):
        other = "ws://other:9090"
        bench = Bench().begin(spec(), spec(id="r2", bridge_url=other))
        bench.handle(events.LinkUp(other, "control"))
        bench.handle(events.LinkUp(other, "tasks"))
        bench.drive_off()
        bench.handle(events.LinkDown(other, "control"))
        assert bench.state == "driving"
        assert bench.report("r2").link == "down"
        bench.handle(protocol.Speeds("a", 0.5, 0.5))
        assert bench.report("r2").v == 1.0


class TestCrash:
    def test_a_machine_marked_as_driven_gets_zeros_on_the_first_link(self):
        bench = Bench(was_driven=True).begin()
        assert bench.written[0].twist == ZERO
        bench.run(5.0)
        assert len(bench.written) in (60, 61), "a bridge may find the robot late"
        assert bench.did(actions.MarkDriven)[-1] == actions.MarkDriven(KEY, False)

    def test_a_machine_marked_as_driven_gets_zero_when_the_gate_gets_its_lock(self):
        bench = Bench(lock_held=False).begin()
        bench.run(1.0)
        assert bench.written == []
        bench.handle(events.LockState(KEY, held=True, driven=True))
        assert bench.written[0].twist == ZERO

    def test_a_machine_not_marked_as_driven_gets_no_velocity(self):
        bench = Bench().begin()
        bench.run(2.0)
        assert bench.written == []
        assert bench.did(actions.MarkDriven) == []

    def test_the_driven_mark_is_set_before_motion_and_cleared_after_the_zeros(self):
        bench = Bench().begin()
        bench.drive_off()
        kept = (actions.MarkDriven, actions.WriteTwist)
        order = [a for a in bench.done if isinstance(a, kept)]
        assert order[0] == actions.MarkDriven(KEY, True)
        bench.run(1.0)
        assert bench.did(actions.MarkDriven) == [
            actions.MarkDriven(KEY, True),
            actions.MarkDriven(KEY, False),
        ]
        assert not bench.did(actions.WriteTwist)[-1].twist.vx

    def test_the_driven_mark_stays_after_a_broken_link_until_zeros_are_sent(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.break_links()
        bench.run(5.0)
        assert bench.did(actions.MarkDriven) == [actions.MarkDriven(KEY, True)]
        bench.connect_links()
        bench.run(4.0)
        assert len(bench.did(actions.MarkDriven)) == 2
