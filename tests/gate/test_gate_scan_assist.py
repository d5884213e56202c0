"""Scan assist within the gate: it reduces velocities and reports the reason."""

import itertools
import math

import msgspec
import pytest

from equipment.gate_harness import KEY, ZERO, Bench, spec
from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.config.motion import ScanAssistConfig
from webmap.gate import events
from webmap.gate.events import Scan
from webmap.gate.rules.assist import free_way, points_of
from webmap.gate.specs import checked

BOX = ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))
ASSIST = ScanAssistConfig(topic="/scan", footprint=BOX)


@pytest.fixture
def bench():
    return Bench().begin(spec(assist=ASSIST))


def scan(bench, reach, frame=""):
    step = math.tau / 72
    ranges = [reach] * 72
    sweep = Scan(-math.pi, step, 0.05, 8.0, ranges, bench.now, frame=frame)
    bench.handle(events.ScanReceived(KEY, "/scan", sweep))


def hold_seeing(bench, reach, seconds, **axes):
    def each():
        scan(bench, reach)
        bench.drive(**axes)

    bench.run(seconds, each)


def speeds(bench, at):
    return [w.twist.vx for w in bench.since(at)]


def under_way(bench):
    """Take the robot, send released inputs, then drive, without obstacles."""
    bench.take()
    hold_seeing(bench, math.inf, 0.3)
    hold_seeing(bench, math.inf, 0.3, x=1.0)
    assert bench.state == "driving"


def test_a_robot_without_obstacles_drives_at_full_speed(bench):
    under_way(bench)
    assert speeds(bench, 0)[-1] == 1.0
    assert bench.report().why == ("limit of the robot",)


def test_a_robot_slows_down_before_a_wall_and_reports_the_reason(bench):
    under_way(bench)
    hold_seeing(bench, 0.9, 0.3, x=1.0)
    slower = speeds(bench, 0)[-1]
    assert 0 < slower < 0.8
    assert any("scan assist" in why for why in bench.report().why)
    hold_seeing(bench, 0.4, 0.3, x=1.0)
    assert speeds(bench, 0)[-1] == 0.0
    hold_seeing(bench, math.inf, 0.2, x=1.0)
    assert speeds(bench, 0)[-1] == 1.0
    assert bench.report().why == ("limit of the robot",)


def test_scan_assist_checks_the_ramped_velocity_and_not_the_command():
    """The robot would pass the point on the commanded arc, not on the ramped arc."""
    tail = ((0.3, 0.3), (-0.9, 0.3), (-0.9, -0.3), (0.3, -0.3))
    point = (-0.91, 0.23)
    about = ScanAssistConfig(topic="/scan", footprint=tail)
    bench = Bench().begin(spec(assist=about, v_max=0.5, w_max=1.0, a_max=0.5))
    ranges = [math.hypot(*point)] + [math.inf] * 719
    bearing = math.atan2(point[1], point[0])
    sweep = Scan(bearing, math.tau / 720, 0.05, 8.0, ranges, 0.0)

    def each(**axes):
        seen = msgspec.structs.replace(sweep, arrived=bench.now)
        bench.handle(events.ScanReceived(KEY, "/scan", seen))
        bench.drive(**axes)

    bench.take()
    bench.run(0.3, each)
    bench.run(0.05, lambda: each(x=1.0, turn=1.0))
    points = points_of(about, sweep)
    assert free_way(tail, points, Twist(0.5, 0.0, 1.0)) > 1.0
    assert free_way(tail, points, Twist(0.05, 0.0, 1.0)) < 0.1
    assert [written.twist for written in bench.written] == [ZERO]
    assert "scan assist" in bench.report().why[-1]


def test_a_robot_without_a_scan_does_not_move(bench):
    bench.take()
    bench.hold(0.3)
    bench.hold(0.3, x=1.0)
    assert not bench.moving_since(0)
    assert "scan assist: no scan yet" in bench.report().why


def test_a_robot_stops_when_its_scans_end(bench):
    under_way(bench)
    since = bench.now
    bench.hold(1.0, x=1.0)
    assert max(w.at for w in bench.moving_since(since)) <= since + 0.31
    assert any("s old" in why for why in bench.report().why)


def test_a_scan_from_before_taking_control_does_not_allow_motion(bench):
    under_way(bench)
    bench.send("a", op="release", robot="r1")
    bench.run(1.0)
    scan(bench, math.inf)  # the machine is not watched
    bench.take()
    bench.hold(0.3)
    since = bench.now
    bench.hold(0.1, x=1.0)
    assert not bench.moving_since(since)


def see_frames(bench, frames, seconds, x=1.0):
    """Let scans with these frames arrive in turn, one with each command."""
    start, names = bench.now, itertools.cycle(frames)

    def each():
        scan(bench, math.inf, next(names))
        bench.drive(x=x)

    bench.run(seconds, each)
    return bench.moving_since(start + 0.1 * seconds)


@pytest.mark.parametrize("frames", ["fr", "ffffffffffffffrrr"], ids=["turns", "runs"])
def test_scans_with_two_frames_on_one_topic_stop_the_robot(bench, frames):
    under_way(bench)
    see_frames(bench, frames, 1.0)
    assert see_frames(bench, frames, 4.0) == []
    assert "scan assist: the scans have two different frames" in bench.report().why


def test_scans_with_a_new_frame_are_accepted_after_2_s(bench):
    under_way(bench)
    assert see_frames(bench, ["rear"], 1.9) == []
    see_frames(bench, ["rear"], 0.3, x=0.0)
    assert see_frames(bench, ["rear"], 0.5) != []


def test_a_scan_with_another_frame_than_configured_stops_the_robot():
    assist = msgspec.structs.replace(ASSIST, frame="laser")
    bench = Bench().begin(spec(assist=assist))
    bench.take()
    bench.run(0.3, lambda: (scan(bench, math.inf, "laser"), bench.drive()))
    start = bench.now
    bench.run(0.3, lambda: (scan(bench, math.inf, "laser"), bench.drive(x=1.0)))
    assert bench.moving_since(start)
    start = bench.now
    bench.run(0.3, lambda: (scan(bench, math.inf, "camera"), bench.drive(x=1.0)))
    assert bench.moving_since(start + 0.05) == []
    why = "scan assist: the scan has frame 'camera', expected 'laser'"
    assert why in bench.report().why
    bench.run(0.3, lambda: (scan(bench, math.inf, ""), bench.drive(x=1.0)))
    why = "scan assist: the scan has no frame, expected 'laser'"
    assert why in bench.report().why


def test_a_scan_for_an_unknown_machine_is_ignored(bench):
    key = events.Key("ws://other:9090", "/cmd_vel")
    bench.handle(
        events.ScanReceived(key, "/scan", Scan(0.0, 0.1, 0.1, 8.0, [], bench.now))
    )


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"footprint": ((0.0, 0.0), (1.0, 0.0))}, "or 3 corners of its outline"),
        ({"footprint": (BOX[0], BOX[2], BOX[1], BOX[3])}, "meets the edge"),
        ({"footprint": ((math.nan, 0.0), *BOX)}, "3 corners of its outline"),
        ({"brake": 0.0}, "above 0"),
        ({"stop_distance": -1.0}, "from 0 on"),
        ({"creep": math.nan}, "from 0 on"),
        ({"blind": "hope"}, 'got the text "hope", expected "stop" or "creep"'),
        ({"x": math.inf}, "a number of metres"),
    ],
)
def test_an_invalid_scan_assist_configuration_raises_config_error(changed, why):
    about = {"topic": "/scan", "footprint": BOX, **changed}
    with pytest.raises(ConfigError, match=why):
        checked(spec(assist=ScanAssistConfig(**about)))


def test_the_scan_topic_gets_a_leading_slash():
    checked_spec = checked(spec(assist=ScanAssistConfig(topic="scan", footprint=BOX)))
    assert checked_spec.scan_assist.topic == "/scan"
