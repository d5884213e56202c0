"""Faults of the two links while an operator holds W."""

import time

import pytest
from safety_bench import ROBOT_TIMEOUT, SLOW
from safety_run import LONG

from equipment.waiting import wait_for
from webmap.testing import Shape

pytestmark = [
    pytest.mark.safety,
    pytest.mark.browser,
    pytest.mark.serial,
]

PROMISED = 0.3
"""Seconds from the fault to the first zero at the robot (S1)."""

GATE_OF_LATENCY = 0.55
"""The same for a link that does not end but slowly becomes too slow."""

LATE = 6
"""The number of velocities that a stalled link may have stored (S11)."""

VELOCITY_SIZE = 160
"""Bytes of a velocity and its ping on the network."""

BY_ITSELF = ROBOT_TIMEOUT + 0.05
"""Seconds until a robot stops without a zero: its command timeout and its braking."""


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
"""Bytes a second of a narrow link."""

DEGRADED = {
    "becomes narrow, 1.5 kB/s": Shape(bandwidth=NARROW),
    "is cut into slices of 40 bytes": Shape(slice_size=40, slice_gap=0.1),
    "gets irregular latency": Shape(latency=0.16, jitter=0.3),
}
"""Other faults of links: the link still works, but is too bad to drive a robot."""


def smooth(bench, hop):
    """Remove the fault of a link after a second."""
    bench.linger(1.0)
    hop.shape(Shape())


HOW = [pytest.param(how, marks=[] if "irregular" in how else LONG) for how in DEGRADED]


@pytest.mark.parametrize("how", HOW)
def test_a_degraded_link_between_browser_and_display_stops_the_robot(bench, how):
    # Commands below the age limit still count, and then the dead-man timeout follows.
    bench.prove(
        f"the browser's link {how}",
        lambda: bench.web_hop.shape(DEGRADED[how]),
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
    # The gate notices the latency after 300 ms. The robot receives the velocities
    # from before that time for another 400 ms.
    bench.prove(
        "the robot's link gets 400 ms of latency each way",
        lambda: bench.robot_hop.shape(SLOW),
        within=0.3 + SLOW.latency + 0.1,
        back=lambda: smooth(bench, bench.robot_hop),
        watch=1.0,
    )


@pytest.mark.parametrize("how", HOW)
def test_a_degraded_link_between_gate_and_robot_stops_the_robot(bench, how):
    # The gate notices the fault after 300 ms. Earlier velocities are still in transit:
    # on a narrow link, six of them with their pings, and then the zero.
    narrow = DEGRADED[how].bandwidth is not None
    under_way = (LATE + 1) * VELOCITY_SIZE / NARROW if narrow else 0.5
    bench.prove(
        f"the robot's link {how}",
        lambda: bench.robot_hop.shape(DEGRADED[how]),
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
