"""Faults between an operator and a robot behind a bridge of Foxglove.

::

    operator ─ display ─ gate ── proxy ── bridge ── robot, which notes each velocity
                                 other clients ──┘
"""

import signal
import time
from contextlib import ExitStack, suppress

import psutil
import pytest
from safety_agent_bench import FarDriver
from safety_bench import pass_time

from equipment.foxglove_robots import OldRobot, OtherClient, SdkRobot
from equipment.waiting import wait_for
from webmap.gate.lanes.control import MOST
from webmap.testing import FaultProxy, Sentinel

pytestmark = [pytest.mark.safety, pytest.mark.serial]

STALL = 1.0
"""Seconds for which other clients of the bridge stall it."""

CLIENTS = {SdkRobot: 4, OldRobot: 1}
"""How many other clients it takes."""


class FoxgloveBench:
    """All processes between the operator and the robot."""

    def __init__(self, kind, folder):
        self._kind, self._folder = kind, folder
        self._open = ExitStack()

    def __enter__(self):
        enter = self._open.enter_context
        self.robot = enter(self._kind())
        self.hop = enter(FaultProxy(self.robot.port))
        self.sentinel = enter(Sentinel())
        self.start_display()
        self._open.callback(lambda: self.driver.end())
        return self

    def __exit__(self, *exception):
        self._open.close()

    def start_display(self):
        url = f"foxglove://127.0.0.1:{self.hop.port}"
        self.driver = FarDriver(url, "r1", self._folder)
        wait_for(lambda: self.driver.now.get("link") == "up", "the link", 30)

    @property
    def gate(self):
        for child in psutil.Process(self.driver.popen.pid).children(recursive=True):
            with suppress(psutil.Error):
                if "webmap.gate" in child.cmdline():
                    return child
        return None

    def drive_off(self, within=20.0):
        """Take control and drive until the robot moves steadily."""
        driver, deadline = self.driver, time.monotonic() + within
        while time.monotonic() < deadline:
            driver.order("x 0")
            wait_for(
                lambda: driver.now.get("armable"), f"a free robot: {driver.now}", within
            )
            driver.order("take")
            try:
                wait_for(lambda: driver.now.get("mine"), "control of the robot", 3.0)
            except AssertionError:
                continue
            pass_time(0.5)
            driver.order("x 1")
            pass_time(0.8)
            recent = self.since(time.monotonic() - 0.4)
            if len(recent) >= 6 and all(vx for _, vx in recent):
                return
        raise AssertionError(f"no steady motion: {driver.now}, {driver.refused[-3:]}")

    def since(self, at):
        return [(t, vx) for t, vx in list(self.robot.velocities) if t > at]

    def zero_after(self, at, within):
        """Check that the robot gets a zero in time, and return the zero's own time.

        A busy machine may add the time for which threads waited for a processor.
        """
        zero = wait_for(
            lambda: next((t for t, vx in self.since(at) if not vx), None), "a zero"
        )
        waited = self.sentinel.stolen(at - 0.1, zero)
        print(
            f"zero after {1000 * (zero - at):.0f} ms, {1000 * waited:.0f} ms of waiting"
        )
        assert zero - at <= within + waited
        return zero

    def check_nothing_moves(self, at, seconds=0.5):
        pass_time(seconds)
        assert [vx for _, vx in self.since(at) if vx] == []

    def end_stop(self):
        wait_for(lambda: self.driver.now.get("latched"), "the STOP")
        self.driver.order("x 0")
        self.driver.order("reset")
        wait_for(lambda: not self.driver.now["latched"], "the end of STOP")

    def finish(self):
        self.driver.order("x 0")
        pass_time(0.6)


@pytest.fixture(scope="module", params=[SdkRobot, OldRobot])
def bench(request, tmp_path_factory):
    with FoxgloveBench(request.param, tmp_path_factory.mktemp("foxglove")) as bench:
        yield bench


@pytest.fixture
def stalled(bench):
    """Other clients that stall the bridge when they are told to."""
    with ExitStack() as opened:
        others = [
            opened.enter_context(OtherClient(bench.robot))
            for _ in range(CLIENTS[type(bench.robot)])
        ]

        def stall():
            for other in others:
                other.stall(STALL)
            pass_time(0.05)

        yield stall


def test_letting_go_stops_the_robot_through_foxglove(bench):
    bench.drive_off()
    at = time.monotonic()
    bench.driver.order("x 0")
    bench.check_nothing_moves(bench.zero_after(at, 0.15) + 0.1)


def test_a_stop_through_foxglove_stays_active_when_the_gate_is_killed(bench):
    bench.drive_off()
    at = time.monotonic()
    bench.driver.order("stop")
    zero = bench.zero_after(at, 0.15)
    wait_for(lambda: (bench.driver.now["stop"] or {}).get("confirmed"), "confirmation")
    pass_time(2.2)  # the display sends a STOP again that is younger than 2 s
    bench.gate.kill()
    killed = time.monotonic()
    wait_for(lambda: bench.since(killed + 0.1), "zeros of the next gate")
    bench.check_nothing_moves(zero + 0.1)
    bench.end_stop()


def test_a_killed_gate_sends_nothing_more_and_the_next_one_sends_zero(bench):
    bench.drive_off()
    bench.gate.kill()
    at = time.monotonic()
    bench.zero_after(at + 0.05, 10)
    bench.check_nothing_moves(at + 0.05, 1.0)  # although the key is still held
    bench.finish()


def test_a_killed_display_stops_the_robot_through_foxglove(bench):
    bench.drive_off()
    at = time.monotonic()
    bench.driver.popen.kill()
    bench.zero_after(at, 0.3)
    bench.check_nothing_moves(at + 0.4)
    bench.driver.end()
    bench.start_display()


def test_a_stalled_link_to_foxglove_delivers_few_velocities_and_then_zero(bench):
    bench.drive_off()
    bench.hop.hold()
    at = time.monotonic()
    pass_time(0.8)
    released = time.monotonic()
    bench.hop.release()
    bench.zero_after(released, 10)
    pass_time(0.5)
    late = bench.since(at + 0.05)
    assert len([vx for _, vx in late if vx]) <= MOST
    assert late[-1][1] == 0.0
    bench.finish()


@pytest.mark.parametrize("order", ["x 0", "stop"])
def test_zero_is_late_while_other_clients_stall_the_bridge(bench, stalled, order):
    bench.drive_off()
    stalled()
    at = time.monotonic()
    bench.driver.order(order)
    zero = bench.zero_after(at, STALL * CLIENTS[type(bench.robot)] + 0.15)
    bench.check_nothing_moves(zero + 0.1)
    if order == "stop":
        bench.end_stop()


def test_few_velocities_wait_in_a_stalled_bridge(bench, stalled):
    bench.drive_off()
    before = time.monotonic()
    stalled()
    pass_time(STALL + 1.0)
    gap = max(
        (b - a, a)
        for (a, _), (b, _) in zip(
            bench.since(before - 0.2), bench.since(before - 0.2)[1:], strict=False
        )
    )
    if gap[0] > 0.35:  # the stall reached this client
        late = [vx for t, vx in bench.since(gap[1]) if vx]
        assert len(late) <= MOST
        assert bench.since(gap[1])[-1][1] == 0.0
    else:
        assert type(bench.robot) is SdkRobot
    bench.finish()


def test_the_gate_ends_with_zero(bench):
    bench.drive_off()
    at = time.monotonic()
    bench.gate.send_signal(signal.SIGTERM)
    bench.zero_after(at, 0.3)
    bench.check_nothing_moves(at + 0.4)
    bench.finish()
