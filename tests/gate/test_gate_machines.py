"""Robots as they are declared, changed, shared and forgotten."""

import math

import pytest
from gate_harness import KEY, URL, ZERO, Bench, spec

from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.gate import actions, events, protocol
from webmap.gate.events import Key
from webmap.gate.protocol import AssistSpec
from webmap.gate.specs import checked, key_of


class TestSpecs:
    def test_names_are_brought_into_one_spelling(self):
        one = checked(spec(bridge_url="ws://ROBOT:9090/", twist_topic="cmd_vel"))
        assert key_of(one) == key_of(checked(spec())) == KEY
        assert one.goal_url == one.odometry_url == URL

    def test_other_bridges_for_other_things_are_kept(self):
        one = checked(spec(goal_url="ws://g:1/", odometry_url="ws://o:1/"))
        assert (one.goal_url, one.odometry_url) == ("ws://g:1", "ws://o:1")

    def test_a_robot_without_velocity_is_known_by_its_goals(self):
        goal_only = checked(spec(twist_topic=None, goal_url="ws://g:1"))
        assert key_of(goal_only) == Key("ws://g:1", "goal /goal")
        nothing = spec(twist_topic=None, goal_topic=None)
        assert key_of(nothing) == Key(URL, "goal robot r1")

    @pytest.mark.parametrize(
        "changes",
        [
            {"id": ""},
            {"id": "*"},
            {"id": "r" * 65},
            {"id": "r\n"},
            {"bridge_url": "http://robot"},
            {"twist_topic": "not a topic"},
            {"twist_type": "std_msgs/String"},
            {"goal_type": "geometry_msgs/Pose"},
            {"odometry_type": "Odometry"},
            {"v_max": math.nan},
            {"v_max": -1.0},
            {"w_max": math.inf},
            {"a_max": 0.0},
            {"z_max": 0.0},
            {"stops_within": -0.1},
        ],
    )
    def test_what_cannot_be_meant_is_refused(self, changes):
        with pytest.raises(ConfigError):
            checked(spec(**changes))

    def test_a_robot_that_cannot_be_meant_is_not_there(self, caplog):
        bench = Bench()
        bench.tell(spec(v_max=math.nan))
        assert bench.done == []
        assert "v_max" in caplog.text


class TestDeclaring:
    def test_the_same_again_changes_nothing(self):
        bench = Bench().begin()
        epoch = bench.drive_off()
        done = len(bench.done)
        bench.tell(spec())
        assert len(bench.done) == done
        assert bench.report().epoch == epoch

    def test_a_change_ends_the_lease_and_counts_from_then_on(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.tell(spec(v_max=0.5))
        assert bench.written[-1].twist == ZERO
        assert bench.report().holder is None
        assert bench.refusals()[-1].why == "the robot was declared again"
        bench.drive_off()
        assert bench.written[-1].twist == Twist(0.5)

    def test_another_topic_makes_it_another_machine(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.tell(spec(twist_topic="/other"))
        assert bench.written[-1].twist == ZERO
        other = Key(URL, "/other")
        assert bench.did(actions.Lock) == [actions.Lock(KEY), actions.Lock(other)]
        assert bench.did(actions.Unlock) == []
        bench.run(1.0)
        assert bench.did(actions.Unlock) == [actions.Unlock(KEY)]
        assert bench.did(actions.Detach) == [actions.Detach(KEY, "r1")]
        bench.drive_off()
        assert bench.written[-1].key == other

    def test_a_forgotten_robot_is_stopped_before_it_is_dropped(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.tell(protocol.Forget("r1"))
        assert bench.of(protocol.RobotGone) == [protocol.RobotGone("r1")]
        bench.say("b", op="take", robot="r1")
        assert "no robot" in bench.refusals("b")[-1].why
        at = bench.now
        assert bench.gate.busy
        assert bench.did(actions.Detach) == []
        bench.run(1.0)
        assert len([w for w in bench.written if w.at >= at]) >= 10
        assert bench.did(actions.Detach) == [actions.Detach(KEY, "r1")]
        bench.tell(protocol.Forget("r1"))
        assert not bench.gate.busy

    @pytest.mark.parametrize("later", [10.0, None])
    def test_one_that_is_owed_a_zero_is_kept_for_it_a_while(self, later):
        bench = Bench().begin()
        bench.drive_off()
        bench.break_links()
        bench.tell(protocol.Forget("r1"))
        if later is None:  # the file on disk still says so, for the next gate
            bench.run(61.0)
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

    def test_one_that_stands_is_dropped_at_once(self):
        bench = Bench().begin()
        bench.tell(protocol.Forget("r1"))
        assert bench.did(actions.Detach)
        assert bench.did(actions.Unlock)

    def test_one_that_comes_back_while_it_is_being_stopped_stays(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.tell(protocol.Forget("r1"))
        bench.tell(spec())
        bench.run(1.0)
        assert bench.did(actions.Detach) == []
        bench.drive_off()
        assert bench.written[-1].twist == Twist(1.0)


class TestSharing:
    """Two robots of the display that are one machine."""

    @pytest.fixture
    def bench(self):
        return Bench().begin(spec(), spec(id="r2", name="Bob again", v_max=0.4))

    def test_they_share_one_lease(self, bench):
        assert bench.take("a", "r1")
        assert bench.take("b", "r2") is None
        assert bench.report("r2").holder.connection == "a"

    def test_the_lower_limits_count(self, bench):
        bench.drive_off(robot="r1")
        assert bench.written[-1].twist == Twist(0.4)
        assert {s.robot for s in bench.of(protocol.SentTwist)} == {"r1", "r2"}

    def test_forgetting_one_that_holds_the_machine_back_stops_it_first(self, bench):
        bench.drive_off(robot="r1")
        bench.tell(protocol.Forget("r2"))
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
            {"stop_hooks": ({"topic": "/lock", "type": "std_msgs/Bool"},)},
            {"assist": AssistSpec(topic="/scan", footprint=((1, 1), (-1, 1), (0, -1)))},
            {"odometry_topic": "/odom"},
            {"stops_within": None},
            {"a_max": 0.5},
        ],
    )
    def test_whatever_held_for_the_machine_by_the_one_that_leaves_ends_the_lease(
        self, more
    ):
        bench = Bench().begin(spec(), spec(id="r2", **more))
        assert bench.take("a", "r1")
        bench.tell(protocol.Forget("r2"))
        assert bench.report().holder is None

    def test_forgetting_one_of_two_that_are_alike_leaves_the_other_driving(self):
        bench = Bench().begin(spec(), spec(id="r2", name="Bob again"))
        bench.drive_off(robot="r1")
        bench.tell(protocol.Forget("r2"))
        bench.hold(0.1, x=1.0)
        assert bench.written[-1].twist == Twist(1.0)
        assert bench.did(actions.Detach) == [actions.Detach(KEY, "r2")]

    def test_forgetting_both_stops_the_machine_first(self, bench):
        bench.drive_off(robot="r1")
        bench.tell(protocol.Forget("r2"))
        bench.tell(protocol.Forget("r1"))
        assert bench.written[-1].twist == ZERO
        bench.run(1.0)
        assert len(bench.did(actions.Detach)) == 2

    def test_stopping_all_stops_it_once(self, bench):
        bench.say("b", op="stop", robot="*")
        assert len(bench.written) == 1


class TestTypes:
    """The type that velocity has on a topic which two robots share."""

    STAMPED = "geometry_msgs/msg/TwistStamped"

    def test_of_two_types_of_one_topic_the_first_counts_and_that_is_said(self, caplog):
        bench = Bench().begin(spec(), spec(id="r2", name="Al", twist_type=self.STAMPED))
        sure = [not it.spec.twist_type_assumed for it in bench.did(actions.Attach)]
        assert sure == [True, False]
        assert (
            f"robot 'Al': /cmd_vel carries {self.STAMPED}, but robot 'Bob' has "
            "geometry_msgs/Twist there"
        ) in caplog.text
        # All else that it says holds for it, then and later.
        bench.tell(spec(id="r2", name="Al", twist_type=self.STAMPED, v_max=0.2))
        again = bench.did(actions.Attach)[-1].spec
        assert (again.v_max, again.twist_type_assumed) == (0.2, True)
        bench.say("b", op="stop", robot="r2")
        assert bench.report("r1").latched

    def test_two_robots_whose_base_comes_back_with_another_type_change_theirs(self):
        bench = Bench().begin(spec(), spec(id="r2"))
        for robot in ("r1", "r2"):
            bench.tell(spec(id=robot, twist_type=self.STAMPED))
            received = bench.did(actions.Attach)[-1].spec
            assert (received.twist_type, received.twist_type_assumed) == (
                self.STAMPED,
                False,
            )

    def test_who_drives_goes_on_when_the_assumed_type_proves_true(self):
        bench = Bench().begin(spec(twist_type_assumed=True))
        bench.drive_off()
        bench.tell(spec())
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
    def test_what_is_assumed_or_the_same_or_elsewhere_is_not(self, one, other, caplog):
        bench = Bench().begin(spec(**one), spec(id="r2", **other))
        assert len(bench.did(actions.Attach)) == 2
        assert caplog.text == ""

    def test_a_robot_may_be_declared_anew_with_another_type(self):
        bench = Bench().begin(spec())
        bench.tell(spec(twist_type=self.STAMPED))
        assert bench.did(actions.Attach)[-1].spec.twist_type == self.STAMPED


class TestSeveral:
    def test_one_robots_stop_leaves_the_other_alone(self):
        bench = Bench().begin(spec(), spec(id="r2", twist_topic="/r2/cmd_vel"))
        bench.drive_off("b", robot="r2")
        bench.say("a", op="stop", robot="r1")
        assert bench.report("r2").state == "driving"
        bench.say("a", op="stop", robot="*")
        assert bench.report("r2").state == "stopped"

    def test_links_of_other_bridges_do_not_matter(self):
        other = "ws://other:9090"
        bench = Bench().begin(spec(), spec(id="r2", bridge_url=other))
        bench.tell(events.LinkUp(other, "control"))
        bench.tell(events.LinkUp(other, "tasks"))
        bench.drive_off()
        bench.tell(events.LinkDown(other, "control"))
        assert bench.state == "driving"
        assert bench.report("r2").link == "down"
        bench.tell(protocol.Speeds("a", 0.5, 0.5))
        assert bench.report("r2").v == 1.0


class TestAfterACrash:
    def test_a_machine_that_was_driven_gets_zeros_on_first_contact(self):
        bench = Bench(was_driven=True).begin()
        assert bench.written[0].twist == ZERO
        bench.run(5.0)
        assert len(bench.written) in (60, 61), "a bridge may find the robot late"
        assert bench.did(actions.MarkDriven)[-1] == actions.MarkDriven(KEY, False)

    def test_also_if_the_link_was_there_before_the_lock(self):
        bench = Bench(lock_held=False).begin()
        bench.run(1.0)
        assert bench.written == []
        bench.tell(events.LockState(KEY, held=True, driven=True))
        assert bench.written[0].twist == ZERO

    def test_a_machine_that_stood_hears_nothing(self):
        bench = Bench().begin()
        bench.run(2.0)
        assert bench.written == []
        assert bench.did(actions.MarkDriven) == []

    def test_driving_is_marked_before_anything_moves_and_unmarked_after_zeros(self):
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

    def test_a_machine_whose_link_broke_stays_marked_until_it_is_stopped(self):
        bench = Bench().begin()
        bench.drive_off()
        bench.break_links()
        bench.run(5.0)
        assert bench.did(actions.MarkDriven) == [actions.MarkDriven(KEY, True)]
        bench.connect_links()
        bench.run(4.0)
        assert len(bench.did(actions.MarkDriven)) == 2
