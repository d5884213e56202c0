"""The control lane: sent velocities, echoes and pings."""

import asyncio
import json

import pytest
from link_bench import PONG, frame, in_loop, noting_bridge, raw_bridge

from equipment.waiting import until
from webmap.base.geometry import Twist
from webmap.gate.clock import now
from webmap.gate.events import EchoReceived, Key, LinkDown, LinkUp, PingAnswered
from webmap.gate.lanes import control
from webmap.gate.lanes.control import BUSY_PING, ECHO, IDLE_PING, MOST, ControlLane

ZERO, SLOW = Twist(), Twist(0.1)


class Noting:
    """A control lane with one machine, and its events."""

    def __init__(self, url):
        self.events = []
        self.control = ControlLane(url, self.events.append)
        self.control.attach("/cmd_vel", "geometry_msgs/Twist")

    async def __aenter__(self):
        return self

    async def __aexit__(self, *_):
        self.control.lane.close()

    def of(self, type):
        return [event for event in self.events if isinstance(event, type)]

    async def up(self):
        await until(lambda: self.of(LinkUp), "the link")
        return self.control


def velocities(bridge):
    return [t.message["msg"]["linear"]["x"] for t in bridge.of("publish", "/cmd_vel")]


@in_loop
async def test_an_echo_reports_the_sent_velocity_but_proves_no_live_link(
    monkeypatch,
):
    monkeypatch.setattr(control, "IDLE_PING", 60.0)
    monkeypatch.setattr(control, "BUSY_PING", 60.0)
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        lane = await noting.up()
        assert noting.of(LinkUp) == [LinkUp(bridge.url, "control")]
        lane.listen("/cmd_vel")
        await until(lambda: noting.of(PingAnswered), "the answer to the only ping")
        noting.events.clear()
        assert lane.write("/cmd_vel", SLOW)
        echo = EchoReceived(Key(bridge.url, "/cmd_vel"), SLOW)
        await until(lambda: echo in noting.events, "the echo")
        assert noting.events == [echo]


@in_loop
async def test_a_ping_answer_carries_the_time_of_the_ping_not_of_the_answer():
    go_on = asyncio.Event()

    async def talk(link):
        await link.accept()
        await go_on.wait()
        link.send(frame(PONG, (1).to_bytes(8, "big")))
        await asyncio.Event().wait()

    before = now()
    async with raw_bridge(talk) as url, Noting(url) as noting:
        lane = await noting.up()
        await until(lambda: lane.lane._pings, "a ping")
        asked_by = now()
        await until(lambda: now() > asked_by, "a later time")
        go_on.set()
        (alive,) = await until(lambda: noting.of(PingAnswered), "the answer")
        assert before < alive.asked_at <= asked_by


@in_loop
async def test_a_velocity_of_another_program_is_reported_but_proves_no_live_link(
    monkeypatch,
):
    monkeypatch.setattr(control, "IDLE_PING", 60.0)
    monkeypatch.setattr(control, "BUSY_PING", 60.0)
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        lane = await noting.up()
        lane.listen("/cmd_vel")
        await until(lambda: bridge.of("subscribe"), "the subscription")
        await until(lambda: noting.of(PingAnswered), "the answer to the only ping")
        noting.events.clear()
        foreign = {"linear": {"x": 3.0, "y": 0.0}, "angular": {"z": 0.0}}
        await bridge.publish("/cmd_vel", foreign)
        received = [EchoReceived(Key(bridge.url, "/cmd_vel"), Twist(3.0))]
        await until(lambda: noting.events == received, "only the received velocity")


@in_loop
async def test_echoes_are_received_from_the_start_with_a_throttled_subscription():
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        lane = await noting.up()
        await until(lambda: bridge.of("advertise"), "the first operations")
        first = [
            received for received in bridge.received if received.topic == "/cmd_vel"
        ]
        # A bridge of ROS 2 adapts its subscription to the publishers, also to itself.
        assert [received.op for received in first] == ["subscribe", "advertise"]
        assert first[0].message["throttle_rate"] == ECHO
        foreign = {"linear": {"x": 3.0, "y": 0.0}, "angular": {"z": 0.0}}
        await bridge.publish("/cmd_vel", foreign)
        received = [EchoReceived(Key(bridge.url, "/cmd_vel"), Twist(3.0))]
        await until(
            lambda: noting.of(EchoReceived) == received, "the received velocity"
        )
        assert lane.lane.ping_period == IDLE_PING
        lane.listen("/cmd_vel")
        lane.ignore("/cmd_vel")
        lane.detach("/cmd_vel", "geometry_msgs/Twist")
        await until(lambda: bridge.of("unsubscribe"), "the end of the subscription")
        assert len(bridge.of("subscribe")) == 1


@in_loop
async def test_messages_that_are_no_velocity_for_a_machine_of_the_lane_are_ignored():
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        lane = await noting.up()
        lane.listen("/cmd_vel")
        await until(lambda: bridge.of("subscribe"), "the subscription")
        zero = {"linear": {"x": 0.0, "y": 0.0}, "angular": {"z": 0.0}}
        unknown = {**zero, "linear": {"x": 0.0, "y": 0.0, "z": None}}
        for text in (
            "rubbish",
            json.dumps({"op": "publish", "topic": "/other", "msg": zero}),
            json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": {"data": 1}}),
            json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": unknown}),
            json.dumps({"op": "publish", "topic": "/cmd_vel", "msg": zero}),
        ):
            await bridge.send(1, text)
        await until(lambda: noting.of(EchoReceived), "the last message")
        assert noting.of(EchoReceived) == [
            EchoReceived(Key(bridge.url, "/cmd_vel"), ZERO)
        ]


@in_loop
async def test_pings_are_more_frequent_while_the_lane_listens_to_a_topic():
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        lane = await noting.up()
        assert lane.lane.ping_period == IDLE_PING
        lane.attach("/other", "geometry_msgs/Twist")
        lane.listen("/cmd_vel")
        lane.listen("/other")
        assert lane.lane.ping_period == BUSY_PING
        lane.ignore("/other")
        assert lane.lane.ping_period == BUSY_PING
        lane.ignore("/cmd_vel")
        assert lane.lane.ping_period == IDLE_PING
        lane.detach("/other", "geometry_msgs/Twist")
        assert lane.lane.wanted
        lane.detach("/cmd_vel", "geometry_msgs/Twist")
        assert not lane.lane.wanted
        await until(
            lambda: len(bridge.of("unadvertise")) == 2, "the end of both topics"
        )
        assert {t.topic for t in bridge.of("unsubscribe")} == {"/cmd_vel", "/other"}


STAMPED = "geometry_msgs/msg/TwistStamped"


@in_loop
@pytest.mark.parametrize("stated_first", [True, False])
async def test_a_known_type_replaces_an_assumed_type_of_the_same_topic(stated_first):
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        lane = await noting.up()
        both = [(STAMPED, False), ("geometry_msgs/Twist", True)]
        for type, assumed in both if stated_first else both[::-1]:
            lane.attach("/base", type, assumed)
        assert lane.write("/base", ZERO)
        (received,) = await until(lambda: bridge.of("publish", "/base"), "the zero")
        assert "twist" in received.message["msg"]
        lane.detach("/base", STAMPED, False)
        assert lane.write("/base", ZERO)
        await until(lambda: len(bridge.of("publish", "/base")) == 2, "the other zero")
        assert "linear" in bridge.of("publish", "/base")[1].message["msg"]
        operations = [
            (t.op, t.message["type"] if t.op == "advertise" else "")
            for t in bridge.received
            if t.topic == "/base" and t.op in ("advertise", "unadvertise")
        ]
        alone = ("advertise", "geometry_msgs/Twist")
        known = [("advertise", STAMPED), ("unadvertise", ""), alone]
        assert operations == (
            known if stated_first else [alone, ("unadvertise", ""), *known]
        )


@in_loop
async def test_no_velocity_is_written_to_a_detached_topic():
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        lane = await noting.up()
        lane.attach("/base", STAMPED)
        lane.detach("/base", STAMPED)
        assert not lane.write("/base", ZERO)
        assert lane.write("/cmd_vel", ZERO)
        await until(lambda: bridge.of("publish", "/cmd_vel"), "the other zero")
        assert bridge.of("publish", "/base") == []


@in_loop
async def test_the_number_of_unanswered_velocities_is_limited_except_for_zero():
    async def talk(link):
        await link.accept()
        link.writer.transport.pause_reading()

    async with raw_bridge(talk) as url, Noting(url) as noting:
        lane = await noting.up()
        went = [lane.write("/cmd_vel", SLOW) for _ in range(MOST + 3)]
        assert went == [True] * MOST + [False] * 3
        assert lane.write("/cmd_vel", ZERO)


@in_loop
async def test_a_ping_answer_or_a_new_link_allows_further_velocities():
    async with noting_bridge() as bridge, Noting(bridge.url) as noting:
        lane = await noting.up()
        while lane.write("/cmd_vel", SLOW):
            pass
        lane.lane.ping_every(0.01)
        await until(lambda: lane.write("/cmd_vel", SLOW), "room for one more")
        lane.lane.cut("no longer used")
        assert noting.events[-1] == LinkDown(bridge.url, "control")
        assert not lane.write("/cmd_vel", SLOW), "there is no link"
        await until(lambda: len(noting.of(LinkUp)) == 2, "another link")
        assert [lane.write("/cmd_vel", SLOW) for _ in range(MOST)] == [True] * MOST
        await until(lambda: len(velocities(bridge)) >= MOST + 1, "the velocities")
