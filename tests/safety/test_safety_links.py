"""Everything that can happen to the two links while a person holds W."""

import time

import pytest
from safety_bench import ROBOT_TIMEOUT, SLOW, wait_for
from safety_run import FULL

from webmap.testing import Shape

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

PROMISED = 0.3
"""Seconds from the fault to the first zero at the robot (S1)."""

LONG = pytest.mark.skipif(not FULL, reason="takes long: WEBMAP_SAFETY_TRIALS=50")

GATE_OF_LATENCY = 0.55
"""The same where a link is not gone but becomes too slow by and by."""

LATE = 6
"""Velocities that a stalled link may have taken (S11)."""

WORD = 160
"""Bytes of a velocity on the wire, and of the ping that goes with it."""

BY_ITSELF = ROBOT_TIMEOUT + 0.05
"""Seconds until a robot stands that no zero reaches: its own timeout and its brakes."""


@pytest.mark.parametrize(
    "way", [pytest.param("up", marks=LONG), pytest.param("down", marks=LONG), "both"]
)
def test_a_stall_between_browser_and_display_stops_the_robot(bench, way):
    def back():
        bench.linger(2.0)
        bench.web_hop.release()

    names = {"up": "to the display", "down": "to the browser", "both": "both ways"}
    bench.prove(
        f"the browser's link stalls for 2 s, {names[way]}",
        lambda: bench.web_hop.hold(way),
        within=PROMISED,
        back=back,
    )


@LONG
@pytest.mark.parametrize("seconds", [0.5, 10.0])
def test_a_short_or_long_stall_between_browser_and_display_stops_the_robot(
    bench, seconds
):
    def back():
        bench.linger(seconds)
        bench.web_hop.release()

    bench.prove(
        f"the browser's link stalls for {seconds:g} s, both ways",
        lambda: bench.web_hop.hold("both"),
        within=PROMISED,
        back=back,
    )


def test_a_connection_reset_between_browser_and_display_stops_the_robot(bench):
    bench.prove(
        "the browser's link is reset",
        bench.web_hop.reset,
        within=PROMISED,
        watch=1.5,
    )


def test_a_half_close_by_the_browser_stops_the_robot(bench):
    bench.prove(
        "half of the browser's link is closed",
        lambda: bench.web_hop.half_close("up"),
        within=PROMISED,
        watch=1.5,
    )


def test_latency_of_400_ms_between_browser_and_display_stops_the_robot(bench):
    bench.prove(
        "the browser's link gets 400 ms of latency each way",
        lambda: bench.web_hop.shape(SLOW),
        within=PROMISED,
        back=lambda: smooth(bench, bench.web_hop),
    )


NARROW = 1500
"""Bytes a second that a narrow link carries."""

SPOILT = {
    "becomes narrow, 1.5 kB/s": Shape(bandwidth=NARROW),
    "is cut into slices of 40 bytes": Shape(slice_size=40, slice_gap=0.1),
    "gets irregular latency": Shape(latency=0.16, jitter=0.3),
}
"""What else networks do to a link; none of them is cut, and nobody can drive by any."""


def smooth(bench, hop):
    """Let a spoilt link be as it was, a second after the fault."""
    bench.linger(1.0)
    hop.shape(Shape())


HOW = [pytest.param(how, marks=[] if "irregular" in how else LONG) for how in SPOILT]


@pytest.mark.parametrize("how", HOW)
def test_a_degraded_link_between_browser_and_display_stops_the_robot(bench, how):
    # What is late by less than the limit may still count, and then the dead-man does.
    bench.prove(
        f"the browser's link {how}",
        lambda: bench.web_hop.shape(SPOILT[how]),
        within=GATE_OF_LATENCY,
        back=lambda: smooth(bench, bench.web_hop),
    )


@pytest.mark.parametrize(
    "seconds", [1.5, *(pytest.param(each, marks=LONG) for each in (0.7, 3.0, 10.0))]
)
def test_a_stalled_robot_link_delivers_few_late_velocities_and_a_zero(bench, seconds):
    released = []

    def back():
        wait_for(lambda: time.monotonic() > bench.fault_at + seconds, "the stall")
        released.append(time.monotonic())
        bench.robot_hop.release()

    bench.prove(
        f"the robot's link stalls for {seconds:g} s",
        bench.robot_hop.hold,
        within=BY_ITSELF,
        back=back,
        stops_by="itself",
        few_late=LATE,
        watch=1.0,
    )


def test_a_connection_reset_between_gate_and_robot_stops_the_robot(bench):
    bench.prove(
        "the robot's link is reset",
        bench.robot_hop.reset,
        within=BY_ITSELF,
        stops_by="itself",
        watch=1.5,
    )


def test_a_half_close_by_the_gate_stops_the_robot(bench):
    bench.prove(
        "half of the robot's link is closed",
        lambda: bench.robot_hop.half_close("up"),
        within=BY_ITSELF,
        stops_by="itself",
        watch=1.5,
    )


def test_latency_of_400_ms_between_gate_and_robot_stops_the_robot(bench):
    # What was written before the doubt, 300 ms, is still on its way for 400 ms.
    bench.prove(
        "the robot's link gets 400 ms of latency each way",
        lambda: bench.robot_hop.shape(SLOW),
        within=0.3 + SLOW.latency + 0.1,
        back=lambda: smooth(bench, bench.robot_hop),
        watch=1.0,
    )


@pytest.mark.parametrize("how", HOW)
def test_a_degraded_link_between_gate_and_robot_stops_the_robot(bench, how):
    # The doubt comes after 300 ms; what was written before it is still on its way: on a
    # narrow link that is the time for six velocities, and for pings and the zero.
    narrow = SPOILT[how].bandwidth is not None
    under_way = (LATE + 1) * WORD / NARROW if narrow else 0.5
    bench.prove(
        f"the robot's link {how}",
        lambda: bench.robot_hop.shape(SPOILT[how]),
        within=0.3 + under_way + 0.1,
        back=lambda: smooth(bench, bench.robot_hop),
        few_late=LATE,
        watch=1.0,
        new_link=True,
    )


def test_a_killed_rosbridge_stops_the_robot_and_its_restart_moves_nothing(bench):
    def back():
        bench.linger(0.5)
        bench.robot.restart_bridge()

    bench.prove(
        "rosbridge is killed and started again",
        bench.robot.kill_bridge,
        within=BY_ITSELF,
        back=back,
        stops_by="itself",
        watch=2.0,
    )


def test_a_robot_whose_odometry_ends_is_stopped(bench):
    def fall_silent():
        bench.robot.sends_telemetry = False

    def back():
        bench.robot.sends_telemetry = True

    bench.prove(
        "odometry stops",
        fall_silent,
        within=1.0 + 0.05,
        back=back,
        watch=1.0,
    )
