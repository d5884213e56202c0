"""The activity of a robot that the gate reports, in terms of an operator."""

import pytest

from equipment.gate_harness import KEY, Bench, spec
from webmap.base.geometry import Twist
from webmap.gate import events
from webmap.gate.rules.goals import BRAKES
from webmap.gate.rules.obedience import EXPECTED_FOR

OTHERS = Twist(0.1, 0.0, -0.2)


@pytest.fixture
def bench():
    return Bench().begin(spec(odometry_topic="/odom", action="/navigate_to_pose"))


def run(bench, seconds, speed=0.0, x=None, turn=0.0):
    """Let time pass with odometry, and with commands if ``x`` is given."""

    def each():
        bench.handle(events.OdometryReceived(KEY, Twist(speed, 0.0, turn)))
        if x is not None:
            bench.drive(x=x)

    bench.run(seconds, each)
    return bench.report().doing


def drive_off(bench):
    bench.take("a")
    run(bench, 0.4, x=0.0)
    assert run(bench, 0.3, 0.5, x=0.5) == "driven"


def test_a_free_robot_without_a_link_is_reported_as_down(bench):
    assert run(bench, 0.2) == "free"
    bench.break_links()
    bench.run(0.1)
    assert bench.report().doing == "down"


def test_a_robot_locked_by_another_webmap_is_reported_as_barred():
    bench = Bench(lock_held=False).begin(spec())
    bench.run(0.1)
    assert bench.report().doing == "barred"


def test_the_reported_activity_follows_control_driving_and_stop(bench):
    bench.take("a")
    assert bench.report().doing == "barred_held", "before there is odometry"
    assert run(bench, 0.4, x=0.0) == "held"
    assert run(bench, 0.3, 0.5, x=0.5) == "driven"
    assert run(bench, 0.1, 0.4, x=0.0) == "stopping"
    assert run(bench, 2.0, 0.0, x=0.0) == "held"
    bench.send("b", op="stop", robot="r1")
    assert run(bench, 0.1) == "stopped"
    assert run(bench, 2.5) == "stopped"
    assert bench.report().stop.confirmed
    assert run(bench, 0.2, 0.3) == "unconfirmed", "it moves again"


def test_motion_after_driving_is_settling_and_after_standstill_is_moving(bench):
    drive_off(bench)
    assert run(bench, 0.6, 0.2, x=0.0) == "settling"
    assert run(bench, 0.6, 0.0, x=0.0) == "held"
    assert run(bench, 0.3, 0.2, x=0.0) == "moving"


def test_a_driven_robot_that_does_not_move_for_a_second_is_blocked(bench):
    drive_off(bench)
    assert run(bench, 0.9, 0.0, x=0.5) == "driven"
    assert run(bench, 0.3, 0.0, x=0.5) == "blocked"
    assert run(bench, 0.1, 0.3, x=0.5) == "driven"
    assert run(bench, 1.2, 0.0, x=0.5) == "blocked"
    assert run(bench, 0.6, 0.0, x=0.0) == "held"


@pytest.mark.parametrize(
    ("sent", "measured", "doing"),
    [
        (0.1, 0.019, "blocked"),
        (0.1, 0.02, "driven"),
        (0.09, 0.0, "driven"),
    ],
)
def test_a_robot_is_blocked_from_0_1_m_s_sent_and_below_0_02_m_s_measured(
    bench, sent, measured, doing
):
    drive_off(bench)
    assert run(bench, 1.3, measured, x=sent) == doing


def test_a_robot_without_odometry_is_not_reported_as_blocked(bench):
    drive_off(bench)
    assert run(bench, 1.2, 0.0, x=0.5) == "blocked"
    bench.run(0.9, lambda: bench.drive(x=0.5))
    assert bench.report().state == "driving"
    bench.run(0.3, lambda: bench.drive(x=0.5))
    assert bench.report().doing != "blocked"


def test_a_granted_request_for_control_is_reported_as_changing(bench):
    drive_off(bench)
    bench.send("b", op="ask", robot="r1")
    bench.send("a", op="grant", robot="r1")
    assert run(bench, 0.1, 0.4) == "changing"


def test_a_free_robot_that_another_program_drives_is_reported_as_other(bench):
    bench.run(EXPECTED_FOR)
    bench.run(0.5, lambda: bench.handle(events.EchoReceived(KEY, OTHERS)))
    assert bench.report().doing == "other"
    bench.take("a")
    assert run(bench, 0.1) == "held"


@pytest.mark.parametrize("released", [False, True])
def test_a_robot_with_a_goal_is_navigating_until_the_goal_ends(bench, released):
    bench.take("a")
    run(bench, 0.3, x=0.0)
    bench.goal("a")
    held = "navigating" if released else "navigating_held"
    if released:
        bench.send("a", op="release", robot="r1")
    assert run(bench, 0.3, 0.5) == held
    assert run(bench, 0.3, 0.0) == held, "it may wait for a free path"
    id = bench.report().goal.id
    bench.handle(events.GoalEnded("r1", id, "reached", ""))
    rest = "free" if released else "held"
    assert run(bench, 0.1, 0.0) == rest
    if not released:  # else the gate does not use odometry
        assert run(bench, BRAKES - 0.5, 0.3) == "settling"
        assert run(bench, 0.6, 0.3) == "moving"


def test_a_robot_with_a_goal_on_a_topic_is_navigating_only_while_moving():
    bench = Bench().begin(spec(odometry_topic="/odom"))
    bench.take("a")
    run(bench, 0.3, x=0.0)
    bench.goal("a")
    assert run(bench, 0.2, 0.0) == "held"
    assert run(bench, 0.2, 0.5) == "navigating_held"
    assert run(bench, 0.2, 0.0) == "held"
