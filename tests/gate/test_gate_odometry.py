"""The witness lane: odometry and scans for the machines that are watched."""

import cbor2
from link_bench import in_loop, noting_bridge

from equipment.waiting import until
from webmap.base.geometry import Twist
from webmap.gate.events import Key, LinkDown, LinkUp, OdometryReceived, ScanReceived
from webmap.gate.lanes.odometry import OdometryLane

ANN, BEN = Key("ws://a", "/cmd_vel"), Key("ws://b", "/cmd_vel")
MOVING = {"twist": {"twist": {"linear": {"x": 0.5, "y": 0.0}, "angular": {"z": 0.0}}}}
SCAN = {
    "header": {"stamp": {"sec": 5, "nanosec": 0}, "frame_id": "laser"},
    "angle_min": -0.1,
    "angle_max": 0.1,
    "angle_increment": 0.1,
    "range_min": 0.05,
    "range_max": 10.0,
    "ranges": [1.0, 2.0, 3.0],
}


class Noting:
    def __init__(self, url):
        self.events = []
        self.witness = OdometryLane(url, self.events.append)

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        self.witness.lane.close()

    def of(self, type):
        return [event for event in self.events if isinstance(event, type)]


def scan_of(topic, message=SCAN):
    return cbor2.dumps({"op": "publish", "topic": topic, "msg": message})


@in_loop
async def test_odometry_is_reported_for_every_machine_that_uses_the_topic():
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        noting.witness.watch("/odom", "nav_msgs/Odometry", ANN)
        noting.witness.watch("/odom", "nav_msgs/Odometry", BEN)
        await until(lambda: bridge.of("subscribe", "/odom"), "the subscription")
        assert noting.events == [LinkUp(bridge.url, "odometry")]
        assert bridge.of("subscribe")[0].message["throttle_rate"] == 50
        await bridge.publish("/odom", MOVING)
        await until(lambda: noting.of(OdometryReceived), "odometry")
        assert [(m.key, m.twist) for m in noting.of(OdometryReceived)] == [
            (ANN, Twist(0.5)),
            (BEN, Twist(0.5)),
        ]
        noting.witness.unwatch("/odom", ANN)
        assert not bridge.of("unsubscribe"), "the other machine still watches"
        noting.witness.unwatch("/odom", BEN)
        await until(
            lambda: bridge.of("unsubscribe", "/odom"), "the end of the subscription"
        )
        assert not noting.witness.lane.wanted
        bridge.transport_of(1).abort()
        await until(lambda: noting.of(LinkDown), "the loss of the link")


@in_loop
async def test_messages_that_are_not_odometry_are_ignored():
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        noting.witness.watch("/odom", None, ANN)
        await until(lambda: bridge.of("subscribe"), "the subscription")
        for data in (
            "rubbish",
            '{"op": "status", "topic": "/odom"}',
            '{"op": "publish"}',
            '{"op": "publish", "topic": "/other", "msg": {}}',
            '{"op": "publish", "topic": "/odom", "msg": {"data": 1}}',
        ):
            await bridge.send(1, data)
        await until(lambda: noting.of(OdometryReceived), "the last message")
        assert [(m.key, m.twist) for m in noting.of(OdometryReceived)] == [
            (ANN, None)
        ], "a message without a velocity"


@in_loop
async def test_a_scan_is_reported_for_every_machine_that_uses_the_topic():
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        noting.witness.watch("/odom", None, ANN)
        noting.witness.watch_scan("/scan", ANN)
        noting.witness.watch_scan("/scan", BEN)
        await until(lambda: bridge.of("subscribe", "/scan"), "the subscription")
        assert bridge.of("subscribe", "/scan")[0].message["compression"] == "cbor"
        for data in (
            scan_of("/elsewhere"),
            scan_of("/scan", {"ranges": "none"}),
            scan_of("/scan"),
        ):
            await bridge.send(1, data)
        await until(lambda: len(noting.of(ScanReceived)) == 2, "the scan")
        assert [(s.key, s.topic) for s in noting.of(ScanReceived)] == [
            (ANN, "/scan"),
            (BEN, "/scan"),
        ]
        await bridge.publish("/odom", MOVING)
        await until(lambda: noting.of(OdometryReceived), "odometry as well")
        noting.witness.unwatch_scan("/scan", ANN)
        assert not bridge.of("unsubscribe")
        noting.witness.unwatch_scan("/scan", BEN)
        await until(
            lambda: bridge.of("unsubscribe", "/scan"), "the end of the subscription"
        )
