"""Data that a link has delayed counts as old as it can be (S16)."""

import json
import time

import cbor2
import pytest
from link_bench import in_loop, noting_bridge

from equipment.gate_harness import KEY, Bench, spec
from equipment.waiting import until
from webmap.base.geometry import Twist
from webmap.gate.clock import now
from webmap.gate.events import LinkUp, OdometryReceived, ScanReceived
from webmap.gate.lanes.odometry import OdometryLane
from webmap.testing import FaultProxy, Shape

NOT_MOVING, CREEPING = Twist(), Twist(0.1)


@pytest.fixture
def bench():
    return Bench().begin(spec(odometry_topic="/odom"))


def lagging(bench, seconds, lag, twist=CREEPING, x=None):
    """Let odometry arrive at 20 Hz that was sent at most ``lag`` seconds before."""

    def each():
        bench.handle(OdometryReceived(KEY, twist, bench.now - lag))
        if x is not None:
            bench.drive(x=x)

    bench.run(seconds, each)


def under_way(bench, lag):
    bench.take()
    lagging(bench, 0.4, lag, x=0.0)
    at = bench.now
    lagging(bench, 0.5, lag, x=1.0)
    return bench.moving_since(at)


class TestDriving:
    def test_odometry_less_than_one_second_late_allows_driving(self, bench):
        assert under_way(bench, lag=0.9)

    def test_odometry_more_than_one_second_late_prevents_driving_with_a_reason(
        self, bench
    ):
        assert not under_way(bench, lag=1.1)
        assert bench.report().reason == "odometry is more than 1 s late"

    def test_a_robot_is_stopped_when_its_odometry_falls_one_second_behind(self, bench):
        assert under_way(bench, lag=0.0)
        at = bench.now

        def each():
            bench.handle(OdometryReceived(KEY, CREEPING, at))
            bench.drive(x=1.0)

        bench.run(2.0, each)
        assert 0.9 < bench.moving_since(at)[-1].at - at < 1.1

    def test_a_send_time_in_the_future_does_not_make_odometry_newer(self, bench):
        assert under_way(bench, lag=-5.0)
        at = bench.now
        bench.hold(2.0, x=1.0)
        assert bench.moving_since(at)[-1].at - at < 1.1


class TestStandstill:
    def test_odometry_sent_before_a_stop_does_not_confirm_the_stop(self, bench):
        bench.send("b", op="stop", robot="r1")
        at = bench.now
        bench.run(
            1.0, lambda: bench.handle(OdometryReceived(KEY, NOT_MOVING, at - 0.01))
        )
        assert bench.report().stop.confirmed is None
        lagging(bench, 0.5, 0.1, NOT_MOVING)
        assert bench.report().stop.confirmed is True

    def test_motion_in_late_odometry_revokes_the_confirmation_of_a_stop(self, bench):
        bench.send("b", op="stop", robot="r1")
        lagging(bench, 0.6, 0.1, NOT_MOVING)
        assert bench.report().stop.confirmed is True
        lagging(bench, 0.2, 5.0, CREEPING)
        assert bench.report().stop.confirmed is not True

    def test_odometry_sent_before_the_zero_does_not_complete_a_hand_over(self, bench):
        bench.take("a")
        lagging(bench, 0.3, 0.0, NOT_MOVING)
        bench.send("b", op="ask", robot="r1")
        bench.send("a", op="grant", robot="r1")
        at = bench.now
        bench.run(
            0.6, lambda: bench.handle(OdometryReceived(KEY, NOT_MOVING, at - 0.01))
        )
        assert bench.report().holder is None
        lagging(bench, 0.4, 0.0, NOT_MOVING)
        assert bench.report().holder.connection == "b"


ODOMETRY = json.dumps(
    {
        "op": "publish",
        "topic": "/odom",
        "msg": {"twist": {"twist": {"linear": {"x": 0.1}, "angular": {"z": 0.0}}}},
    }
)
SCAN = {
    "angle_min": -0.1,
    "angle_increment": 0.1,
    "range_min": 0.05,
    "range_max": 10.0,
    "ranges": [1.0, 2.0, 3.0],
}


@in_loop
async def test_a_slow_link_does_not_make_odometry_and_scans_look_newer():
    events = []

    def of(type):
        return [event for event in events if isinstance(event, type)]

    async with noting_bridge() as bridge:
        with FaultProxy(bridge.port) as proxy:
            witness = OdometryLane(f"ws://127.0.0.1:{proxy.port}", events.append)
            try:
                witness.watch("/odom", None, KEY)
                witness.watch_scan("/scan", KEY)
                await until(lambda: bridge.of("subscribe", "/scan"), "the subscription")
                assert of(LinkUp)
                watched = now()
                await until(lambda: witness._sent_after > watched, "an answer")
                (link,) = bridge.links
                await bridge.send(link, ODOMETRY)
                await until(lambda: of(OdometryReceived), "odometry at once")
                assert of(OdometryReceived)[-1].sent_after > watched

                proxy.shape(Shape(bandwidth=4000), "down")
                frame = {"op": "publish", "topic": "/scan", "msg": SCAN}
                for _ in range(60):
                    await bridge.send(link, ODOMETRY)
                await bridge.send(link, cbor2.dumps(frame))
                sent_at, at = now(), time.monotonic()
                await until(
                    lambda: of(ScanReceived), "a scan after sixty odometry messages"
                )
                assert time.monotonic() - at > 1.0, "the link was slow"
                assert all(one.sent_after <= sent_at for one in of(OdometryReceived))
                assert of(ScanReceived)[0].sweep.arrived <= sent_at + 0.05
            finally:
                witness.lane.close()
