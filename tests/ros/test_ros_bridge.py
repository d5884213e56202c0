import asyncio
import json
import logging
import math
import subprocess
import sys
import time

import msgspec
import pytest

from equipment.captured_frames import CAPTURED
from equipment.fake_rosbridge import FakeRosbridge, bridged
from equipment.waiting import until
from webmap.base import logs
from webmap.base.errors import (
    BridgeClosed,
    BridgeError,
    ConfigError,
    MotionRefused,
    ProtocolError,
    ServiceError,
)
from webmap.base.scope import Scope
from webmap.ros import backoff
from webmap.ros.bridge import Bridge
from webmap.ros.messages import LaserScanMsg, OdometryMsg
from webmap.ros.sockets import connection


class Text(msgspec.Struct):
    data: str


def run(scenario):
    asyncio.run(scenario())


@pytest.fixture
def fast(monkeypatch):
    """Reconnect at once and call a link dead soon."""
    monkeypatch.setattr(backoff, "FIRST", 0.02)
    monkeypatch.setattr(connection.Liveness, "LIMIT", 0.3)
    monkeypatch.setattr(connection.Liveness, "PERIOD", 0.05)
    monkeypatch.setattr(connection.Liveness, "LATE", 0.3)


def test_a_wrong_address_is_refused_at_once():
    with pytest.raises(ConfigError, match="ws://localhost:9090"):
        Bridge("localhost:9090")


def test_before_its_start_a_bridge_stores_subscriptions_and_refuses_publishing():
    bridge = Bridge("WS://LocalHost:9/")
    bridge.subscribe("/a", print)
    assert bridge.url == "ws://localhost:9"
    assert bridge.state == "new"
    assert bridge.last_heard is None
    with pytest.raises(BridgeClosed):
        bridge.publish("/b", {"data": "x"}, "std_msgs/String")


def test_a_message_reaches_its_listener_as_a_plain_mapping():
    async def scenario():
        got = []
        async with bridged() as (server, bridge):
            bridge.subscribe("chatter", got.append)
            (asked,) = await server.wait_for("subscribe", topic="/chatter")
            assert asked["id"].startswith("WebMap-")
            await server.publish("/chatter", {"data": "hello"})
            await until(lambda: got)
            assert got == [{"data": "hello"}]
            assert bridge.stats.frames == 1
            assert bridge.last_heard is not None

    run(scenario)


def test_a_message_is_decoded_to_the_requested_type():
    async def scenario():
        got = []
        async with bridged() as (server, bridge):
            bridge.subscribe(
                "/robot_0/odom", got.append, "nav_msgs/Odometry", decode=OdometryMsg
            )
            (asked,) = await server.wait_for("subscribe")
            assert asked["type"] == "nav_msgs/Odometry"
            assert "compression" not in asked
            for name in (
                "ros1/publish_odom.ujson.json",
                "ros2/publish_odom_nan_covariance.stdlib.json",
            ):
                await server.send((CAPTURED / name).read_text())
            await until(lambda: len(got) == 2)
            assert all(isinstance(each, OdometryMsg) for each in got)

    run(scenario)


@pytest.mark.parametrize("type", ["sensor_msgs/LaserScan", "sensor_msgs/msg/LaserScan"])
def test_scans_are_subscribed_in_cbor_with_the_ros1_type_name(type):
    async def scenario():
        got = []
        async with bridged() as (server, bridge):
            bridge.subscribe(
                "/robot_0/base_scan", got.append, type, decode=LaserScanMsg
            )
            (asked,) = await server.wait_for("subscribe")
            assert asked["compression"] == "cbor"
            assert asked["type"] == "sensor_msgs/LaserScan"
            await server.send((CAPTURED / "ros2/cbor_scan_inf_nan.bin").read_bytes())
            await until(lambda: got)
            assert len(got[0].ranges) == 720
            assert math.isnan(got[0].ranges[0])

    run(scenario)


def test_two_listeners_share_one_subscription_and_one_decoded_message():
    async def scenario():
        one, two, plain = [], [], []
        async with bridged() as (server, bridge):
            bridge.subscribe("/chatter", one.append, decode=Text)
            bridge.subscribe("/chatter", two.append, decode=Text)
            bridge.subscribe("/chatter", plain.append)
            await server.wait_for("subscribe")
            await server.publish("/chatter", {"data": "hello"})
            await until(lambda: one and two and plain)
            assert one[0] is two[0]
            assert plain == [{"data": "hello"}]
            assert len(server.ops("subscribe")) == 1

    run(scenario)


def test_removing_one_listener_does_not_silence_another_listener():
    async def scenario():
        one, two = [], []
        async with bridged() as (server, bridge):
            first = bridge.subscribe("/chatter", one.append)
            second = bridge.subscribe("/chatter", two.append)
            await server.wait_for("subscribe")
            first.remove()
            first.remove()
            await server.publish("/chatter", {"data": "hello"})
            await until(lambda: two)
            assert one == []
            assert server.ops("unsubscribe") == []
            second.remove()
            (ended,) = await server.wait_for("unsubscribe")
            assert ended["id"] == server.ops("subscribe")[0]["id"]

    run(scenario)


def test_the_subscription_uses_the_lowest_throttle_of_its_listeners():
    async def scenario():
        async with bridged() as (server, bridge):
            bridge.subscribe("/chatter", print, throttle=500)
            quick = bridge.subscribe("/chatter", print, throttle=100)
            asked = await server.wait_for("subscribe", 2)
            assert [each["throttle_rate"] for each in asked] == [500, 100]
            (ended,) = await server.wait_for("unsubscribe")
            assert ended["id"] == asked[0]["id"]
            order = [m["op"] for m in server.received]
            assert order == ["subscribe", "subscribe", "unsubscribe"]
            quick.remove()
            asked = await server.wait_for("subscribe", 3)
            assert asked[2]["throttle_rate"] == 500

    run(scenario)


def test_each_listener_has_its_own_throttle_and_receives_the_last_message():
    async def scenario():
        every, some = [], []
        async with bridged() as (server, bridge):
            bridge.subscribe("/n", lambda m: every.append(m["data"]))
            bridge.subscribe("/n", lambda m: some.append(m["data"]), throttle=200)
            for number in range(10):
                await server.publish("/n", {"data": number})
            await until(lambda: len(every) == 10)
            await until(lambda: some[-1] == 9)
            assert some[0] == 0
            assert len(some) < 5

    run(scenario)


def test_a_message_on_an_unsubscribed_topic_is_ignored():
    async def scenario():
        got = []
        async with bridged() as (server, bridge):
            bridge.subscribe("/a", got.append)
            await server.publish("/b", {"data": 1})
            await server.publish("/a", {"data": 2})
            await until(lambda: got)
            assert got == [{"data": 2}]

    run(scenario)


def test_a_late_listener_receives_the_last_map():
    async def scenario():
        early, late = [], []
        async with bridged() as (server, bridge):
            bridge.subscribe("/map", early.append, "nav_msgs/OccupancyGrid")
            await server.wait_for("subscribe")
            await server.publish("/map", {"data": [1]})
            await until(lambda: early)
            bridge.subscribe("/map", late.append, "nav_msgs/OccupancyGrid")
            await until(lambda: late)
            assert late == early
            assert len(early) == 1

    run(scenario)


def test_a_raising_callback_is_reported_and_other_callbacks_still_run(caplog):
    async def scenario():
        errors, got = [], []

        def bad(message):
            raise ZeroDivisionError("mine")

        async with bridged() as (server, bridge):
            bridge.on_error(lambda error: 1 / 0)
            bridge.on_error(errors.append)
            bridge.subscribe("/a", bad)
            bridge.subscribe("/a", got.append)
            await server.publish("/a", {"data": 1})
            await server.publish("/a", {"data": 2})
            await until(lambda: len(got) == 2)
            assert [str(error) for error in errors] == ["mine", "mine"]
            assert bridge.state == "open"

    run(scenario)
    assert "a callback raised" in caplog.text


def test_a_callback_may_be_a_coroutine_function():
    async def scenario():
        got, errors = [], []

        async def callback(message):
            await asyncio.sleep(0)
            got.append(message)
            raise ValueError("later")

        async with bridged() as (server, bridge):
            bridge.on_error(errors.append)
            bridge.subscribe("/a", callback)
            await server.publish("/a", {"data": 1})
            await until(lambda: errors)
            assert got == [{"data": 1}]

    run(scenario)


def test_a_subscription_made_in_a_callback_belongs_to_the_callback_scope():
    async def scenario():
        scope = Scope("page")
        async with bridged() as (server, bridge):
            with scope.active():
                bridge.subscribe("/a", lambda _: bridge.subscribe("/b", print))
            await server.publish("/a", {})
            await server.wait_for("subscribe", topic="/b")
            assert len(scope) == 2
            scope.close()
            await server.wait_for("unsubscribe", 2)
            with scope.active():
                assert bridge.subscribe("/c", print).removed
            assert server.ops("subscribe", topic="/c") == []

    run(scenario)


def test_link_callbacks_are_removed_with_their_scope():
    bridge = Bridge("ws://localhost:9")
    scope = Scope()
    with scope.active():
        bridge.on_open(print)
        bridge.on_close(print).remove()
        bridge.on_error(print)
    assert len(scope) == 2
    scope.close()
    assert len(bridge._on_open) == len(bridge._on_error) == 0


def test_a_message_of_the_wrong_type_is_reported_once_with_both_types():
    async def scenario():
        errors, got = [], []
        async with bridged(topic_type={"type": "std_msgs/Bool"}) as (server, bridge):
            bridge.on_error(errors.append)
            bridge.subscribe("/a", got.append, "std_msgs/String", decode=Text)
            for value in (True, False, True):
                await server.publish("/a", {"data": value})
            await server.publish("/a", {"data": "good"})
            await until(lambda: errors and got)
            assert got == [Text("good")]
            assert len(errors) == 1
            assert isinstance(errors[0], ProtocolError)
            for part in ("/a", "std_msgs/String", "std_msgs/Bool", "data"):
                assert part in str(errors[0])

    run(scenario)


class Shown:
    """Records the problems of a module that are reported and cleared."""

    def __init__(self):
        self.reported, self.standing = [], {}
        self.scope = Scope("module", self.report, self.standing.pop)

    def report(self, text, about):
        self.reported.append(text)
        self.standing[about] = text


def test_undecodable_messages_are_a_problem_until_a_message_decodes_again():
    async def scenario():
        errors, got, plain, shown = [], [], [], Shown()
        async with bridged(topic_type={"type": "std_msgs/Bool"}) as (server, bridge):
            bridge.on_error(errors.append)
            with shown.scope.active():
                bridge.subscribe("/a", got.append, "std_msgs/String", decode=Text)
            bridge.subscribe("/a", plain.append)
            for count in (1, 2, 3):
                await server.publish("/a", {"data": True})
                await until(lambda: shown.standing)
                await server.publish("/a", {"data": False})
                await until(lambda c=count: len(plain) == 3 * c - 1)
                assert shown.standing, "a callback for any type clears no problem"
                await server.publish("/a", {"data": "good"})
                await until(lambda c=count: len(got) == c)
                assert shown.standing == {}
            assert len(shown.reported) == 3
            assert {*shown.reported} == {str(error) for error in errors}
            assert len(errors) == 1, "the reason is reported once"
            await server.send('{"op": "publish", "topic": "/a", "msg": {"data": "x"')
            await until(lambda: shown.standing)
            shown.scope.close()
            assert shown.standing == {}, "closing the scope clears the problem"

    run(scenario)


def test_a_decoding_problem_is_cleared_with_the_last_listener_of_that_type():
    async def scenario():
        got, shown, other = [], Shown(), Scope("other")
        async with bridged(topic_type={"type": "std_msgs/Bool"}) as (server, bridge):
            with shown.scope.active():
                bridge.subscribe("/a", got.append)
            with other.active():
                bridge.subscribe("/a", print, decode=Text)
            await server.publish("/a", {"data": True})
            await until(lambda: shown.standing)
            other.close()
            assert shown.standing == {}

    run(scenario)


def test_a_lost_link_clears_a_decoding_problem_until_the_next_wrong_message(fast):
    async def scenario():
        shown = Shown()
        async with bridged(topic_type={"type": "std_msgs/Bool"}) as (server, bridge):
            with shown.scope.active():
                bridge.subscribe("/a", print, "std_msgs/String", decode=Text)
            await server.publish("/a", {"data": True})
            await until(lambda: shown.standing)
            server.drop()
            await until(lambda: not shown.standing)
            await server.wait_for("subscribe", 2)
            await server.publish("/a", {"data": True})
            await until(lambda: shown.standing)

    run(scenario)


def test_the_problem_of_a_silent_topic_is_cleared_by_its_next_message(monkeypatch):
    monkeypatch.setattr("webmap.ros.topic_faults.SILENCE", 0.02)

    async def scenario():
        got, shown = [], Shown()
        async with bridged(topic_type={"type": "std_msgs/Bool"}) as (server, bridge):
            with shown.scope.active():
                bridge.subscribe("/a", got.append, "std_msgs/String", decode=Text)
            await until(lambda: shown.standing)
            assert "no messages come" in shown.reported[0]
            await server.publish("/a", {"data": "good"})
            await until(lambda: got)
            assert shown.standing == {}

    run(scenario)


def test_a_topic_that_is_silent_because_of_a_wrong_type_is_reported(monkeypatch):
    monkeypatch.setattr("webmap.ros.topic_faults.SILENCE", 0.02)

    async def scenario():
        errors = []
        async with bridged(topic_type={"type": "nav_msgs/msg/Path"}) as (_, bridge):
            bridge.on_error(errors.append)
            bridge.subscribe("/a", print, "nav_msgs/Odometry")
            await until(lambda: errors)
            assert "nav_msgs/msg/Path" in str(errors[0])
            assert "nav_msgs/Odometry" in str(errors[0])

    run(scenario)


def test_two_types_or_encodings_for_one_topic_are_refused():
    bridge = Bridge("ws://localhost:9")
    bridge.subscribe("/a", print, "std_msgs/String")
    bridge.subscribe("/a", print, "std_msgs/msg/String")
    with pytest.raises(ConfigError, match="std_msgs/Bool"):
        bridge.subscribe("/a", print, "std_msgs/Bool")
    with pytest.raises(ConfigError, match="raw"):
        bridge.subscribe("/a", print, encoding="raw")


@pytest.mark.parametrize(
    "wrong", [{"throttle": -1}, {"throttle": 0.5}, {"decode": dict}, {"type": "x"}]
)
def test_invalid_subscribe_arguments_are_refused(wrong):
    bridge = Bridge("ws://localhost:9")
    with pytest.raises(ConfigError):
        bridge.subscribe("/a", print, **wrong)
    with pytest.raises(ConfigError):
        bridge.subscribe("/a", "no function")


def test_garbage_is_reported_once_and_the_link_stays_open():
    async def scenario():
        errors, got = [], []
        async with bridged() as (server, bridge):
            bridge.on_error(errors.append)
            bridge.subscribe("/a", got.append)
            for garbage in ("{{{{", b"\xa1\xff", "[]", '{"op":"dance"}', ""):
                await server.send(garbage)
            await server.publish("/a", {"data": 1})
            await until(lambda: got)
            assert bridge.stats.malformed == 4
            assert len(errors) == 1
            assert "not rosbridge" in str(errors[0])

    run(scenario)


def test_an_error_status_of_the_bridge_is_reported():
    async def scenario():
        errors = []
        async with bridged() as (server, bridge):
            bridge.on_error(errors.append)
            await server.send('{"op":"status","level":"info","msg":"fine"}')
            await server.send('{"op":"status","level":"error","msg":"no such type"}')
            await until(lambda: errors)
            assert "no such type" in str(errors[0])

    run(scenario)


def test_statuses_of_a_hostile_bridge_do_not_forge_or_flood_the_log(
    caplog, monkeypatch
):
    # However long a slow machine needs: no link is dead, and no more lines are allowed.
    monkeypatch.setattr(connection.Liveness, "LIMIT", math.inf)
    # A run that counts branches imports the module of the logs twice, with two filters.
    for each in logging.getLogger("webmap.ros").filters:
        monkeypatch.setattr(each._budgets, "_pause", math.inf)

    async def scenario():
        errors = []
        async with bridged() as (server, bridge):
            bridge.on_error(errors.append)
            words = "bad\\nERROR webmap.gate: forged \\u001b[2J" + "x" * 5000
            for _ in range(300):
                await server.send(f'{{"op":"status","level":"error","msg":"{words}"}}')
            await until(lambda: len(errors) == 300)
            assert len(str(errors[0])) < 1100

    run(scenario)
    lines = [r.getMessage() for r in caplog.records if "forged" in r.getMessage()]
    assert len(lines) == logs.BURST
    assert all(one.isprintable() and len(one) < 1200 for one in lines)


def test_publishing_advertises_the_topic_once_before_the_first_message():
    async def scenario():
        async with bridged() as (server, bridge):
            bridge.publish("/a", {"data": "1"}, "std_msgs/msg/String")
            bridge.publish("/a", {"data": "2"})
            await server.wait_for("publish", 2)
            assert [m["op"] for m in server.received] == [
                "advertise",
                "publish",
                "publish",
            ]
            assert server.received[0]["type"] == "std_msgs/String"
            with pytest.raises(BridgeError, match="std_msgs/String"):
                bridge.publish("/a", {"data": True}, "std_msgs/Bool")
            with pytest.raises(BridgeError, match="the message type is unknown"):
                bridge.publish("/b", {})
            with pytest.raises(ValueError, match=r"JSON|nan"):
                bridge.publish("/a", {"data": math.nan})
            bridge.unadvertise("/a")
            await server.wait_for("unadvertise")

    run(scenario)


@pytest.mark.parametrize(
    "type",
    [
        "geometry_msgs/Twist",
        "geometry_msgs/msg/Twist",
        "geometry_msgs/TwistStamped",
        " geometry_msgs/msg/TwistStamped",
    ],
)
def test_publishing_a_velocity_is_refused_on_open_and_closed_links(type):
    async def scenario():
        async with bridged() as (server, bridge):
            with pytest.raises(MotionRefused, match="gate"):
                bridge.publish("/anything", {}, type)
            bridge.publish("/a", {"data": 1}, "std_msgs/Int8")
            await server.wait_for("publish")
            assert len(server.received) == 2

    run(scenario)
    with pytest.raises(MotionRefused):
        Bridge("ws://localhost:9").publish("/anything", {}, type)


def test_publishing_to_a_known_velocity_topic_is_refused_for_any_stated_type():
    async def scenario():
        async with bridged(topic_type={"type": "geometry_msgs/Twist"}) as (_, bridge):
            assert await bridge.topic_type("/cmd_vel") == "geometry_msgs/Twist"
            for type in (None, "std_msgs/String"):
                with pytest.raises(MotionRefused):
                    bridge.publish("cmd_vel", {}, type)

    run(scenario)


def test_a_protected_topic_is_unadvertised_and_refuses_publishing():
    async def scenario():
        async with bridged() as (server, bridge):
            bridge.publish("/goal", {}, "geometry_msgs/PoseStamped")
            bridge.protect("goal")
            with pytest.raises(MotionRefused):
                bridge.publish("/goal/", {}, "geometry_msgs/PoseStamped")
            with pytest.raises(MotionRefused):
                await bridge.call_service("/nav/_action/send_goal")
            await server.wait_for("unadvertise", topic="/goal")

    run(scenario)


def test_the_refusal_of_a_protected_topic_names_its_content_and_the_alternative():
    async def scenario():
        async with bridged() as (_, bridge):
            for topic, carries, instead in (
                ("/goal", "a goal", r"Robot\.move\(\)"),
                ("/lock", "the STOP", r"Robot\.stop\(\) and Robot\.reset_stop"),
            ):
                bridge.protect(topic, carries)
                with pytest.raises(MotionRefused, match=f"{carries}.*use {instead}"):
                    bridge.publish(topic, {"data": False}, "std_msgs/Bool")
            bridge.protect("/goal", "the STOP")
            with pytest.raises(MotionRefused, match="goals go through the gate"):
                await bridge.call_service("/goal")
            with pytest.raises(ServiceError, match="no such service"):
                await bridge.call_service("/lock")

    run(scenario)


def test_a_topic_is_protected_on_every_bridge_with_the_same_address():
    one, other = Bridge("ws://one.test:9"), Bridge("ws://ONE.test:9/")
    elsewhere = Bridge("ws://other.test:9")
    one.protect("/goal")
    for bridge in (other, Bridge("ws://one.test:9")):
        with pytest.raises(MotionRefused, match="/goal carries a goal"):
            bridge.publish("/goal", {}, "geometry_msgs/PoseStamped")
    with pytest.raises(BridgeClosed):
        elsewhere.publish("/goal", {}, "geometry_msgs/PoseStamped")


def test_publishing_on_a_closed_link_raises_and_sends_nothing_later(fast):
    async def scenario():
        async with bridged() as (server, bridge):
            await server.stop()
            await until(lambda: bridge.state == "connecting")
            with pytest.raises(BridgeClosed):
                bridge.publish("/a", {"data": "old"}, "std_msgs/String")
            await server.start()
            await until(lambda: bridge.state == "open")
            bridge.publish("/a", {"data": "new"}, "std_msgs/String")
            (published,) = await server.wait_for("publish")
            assert published["msg"] == {"data": "new"}

    run(scenario)


def test_after_a_reconnect_topics_are_advertised_and_subscribed_again(fast):
    async def scenario():
        opened, closed, got = [], [], []
        async with bridged() as (server, bridge):
            bridge.on_open(lambda: opened.append(bridge.state))
            bridge.on_close(closed.append)
            bridge.subscribe("/a", got.append)
            bridge.publish("/b", {"data": "1"}, "std_msgs/String")
            await server.wait_for("publish")
            await until(lambda: opened)
            server.drop()
            await server.wait_for("subscribe", 2)
            again = server.received[3:]
            assert [m["op"] for m in again] == ["advertise", "subscribe"]
            await server.publish("/a", {"data": 5})
            await until(lambda: got)
            assert opened == ["open", "open"]
            assert len(closed) == 1
            assert bridge.stats.links == 2
        assert bridge.state == "closed"
        assert len(closed) == 2

    run(scenario)


def test_an_unreachable_bridge_is_reported_and_retried(fast):
    async def scenario():
        server = FakeRosbridge()
        await server.start()
        await server.stop()
        bridge, errors = Bridge(server.url), []
        bridge.on_error(errors.append)
        bridge.start(asyncio.get_running_loop())
        try:
            await until(lambda: len(errors) >= 2)
            assert all(isinstance(error, BridgeClosed) for error in errors)
            assert server.url in str(errors[0])
            await server.start()
            await until(lambda: bridge.state == "open")
        finally:
            await bridge.stop()
            await server.stop()

    run(scenario)


def test_a_link_without_answers_to_pings_is_closed_and_reopened(fast):
    async def scenario():
        reasons = []
        async with bridged() as (server, bridge):
            bridge.on_close(reasons.append)
            silent = server.links[0]
            silent.transport.pause_reading()
            await until(lambda: reasons)
            assert "ping" in reasons[0]
            await until(lambda: bridge.state == "open")
            silent.transport.abort()

    run(scenario)


def test_a_link_without_data_stays_open_while_pings_are_answered(fast):
    async def scenario():
        reasons = []
        async with bridged() as (_, bridge):
            bridge.on_close(reasons.append)
            seen = bridge.last_heard
            await until(lambda: bridge.last_heard > seen + 0.6)
            assert reasons == []

    run(scenario)


def test_a_blocking_callback_does_not_close_the_link(fast, monkeypatch):
    monkeypatch.setattr("webmap.ros.sockets.connection.LOOK_PERIOD", 0.05)

    async def scenario():
        reasons, got = [], []
        async with bridged() as (server, bridge):
            bridge.on_close(reasons.append)
            bridge.subscribe("/a", lambda _: time.sleep(0.5))
            bridge.subscribe("/a", got.append)
            for _ in range(2):
                await server.publish("/a", {})
            await until(lambda: len(got) == 2)
            seen = bridge.last_heard
            await until(lambda: bridge.last_heard > seen)
            assert reasons == []

    run(scenario)


def test_publishing_is_refused_when_the_bridge_stops_reading():
    async def scenario():
        async with bridged() as (server, bridge):
            server.links[0].transport.pause_reading()
            big = {"data": "x" * (1 << 20)}
            refused = []

            def is_refused():
                try:
                    bridge.publish("/a", big, "std_msgs/String")
                except BridgeClosed as error:
                    refused.append(str(error))
                return bool(refused)

            await until(is_refused)
            assert "accepts no more data" in refused[0]
            server.links[0].transport.abort()

    run(scenario)


def test_service_calls_use_a_separate_socket():
    async def scenario():
        async with bridged(get_time={"time": {"sec": 5}}) as (server, bridge):
            assert len(server.links) == 1
            answer = await bridge.call_service("/rosapi/get_time")
            assert answer == {"time": {"sec": 5}}
            assert len(server.links) == 2
            await bridge.call_service("/rosapi/get_time", {})
            assert len(server.links) == 2
            with pytest.raises(ServiceError, match="no such service"):
                await bridge.call_service("/nobody")

    run(scenario)


def test_an_unanswered_service_call_blocks_neither_data_nor_other_calls():
    async def scenario():
        got = []
        async with bridged(get_time={"t": 1}) as (server, bridge):
            server.answer["/hangs"] = None
            bridge.subscribe("/a", got.append)
            call = asyncio.create_task(bridge.call_service("/hangs", timeout=0.5))
            await server.wait_for("call_service")
            await server.publish("/a", {"data": 1})
            await until(lambda: got)
            with pytest.raises(
                ServiceError, match=r"/hangs did not answer within 0\.5"
            ):
                await call
            assert await bridge.call_service("/rosapi/get_time") == {"t": 1}
            one, two = server.ops("call_service")
            assert one["link"] is not two["link"]
            # Otherwise some bridges report a call as failed after a time of their own.
            assert (one["timeout"], two["timeout"]) == (0.5, 5.0)
            await until(lambda: len(server.links) == 2)

    run(scenario)


def test_a_service_call_fails_at_once_when_its_link_ends():
    async def scenario():
        async with bridged() as (server, bridge):
            server.answer["/hangs"] = None
            call = asyncio.create_task(bridge.call_service("/hangs"))
            (asked,) = await server.wait_for("call_service")
            asked["link"].transport.abort()
            with pytest.raises(BridgeClosed):
                await call
            server.answer["/hangs"] = {}
            assert await bridge.call_service("/hangs") == {}

    run(scenario)


def test_a_service_call_to_an_unreachable_bridge_fails():
    async def scenario():
        server = FakeRosbridge()
        await server.start()
        await server.stop()
        with pytest.raises(BridgeClosed, match="cannot reach"):
            await Bridge(server.url).call_service("/a")

    run(scenario)


def test_stopping_a_bridge_fails_its_pending_service_calls():
    async def scenario():
        async with bridged() as (server, bridge):
            server.answer["/hangs"] = None
            call = asyncio.create_task(bridge.call_service("/hangs"))
            await server.wait_for("call_service")
            await bridge.stop()
            with pytest.raises(BridgeClosed):
                await call
            assert bridge.state == "closed"

    run(scenario)


def test_topic_types_are_requested_from_rosapi_and_cached_per_link(fast):
    async def scenario():
        async with bridged(topic_type={"type": "nav_msgs/Odometry"}) as (
            server,
            bridge,
        ):
            for _ in range(2):
                assert await bridge.topic_type("odom") == "nav_msgs/Odometry"
            assert len(server.ops("call_service")) == 1
            server.drop()
            await until(lambda: bridge.stats.links == 2)
            assert await bridge.topic_type("odom") == "nav_msgs/Odometry"
            assert len(server.ops("call_service")) == 2
            server.answer["/rosapi/topic_type"] = {"type": ""}
            assert await bridge.topic_type("/unknown") is None
            del server.answer["/rosapi/topic_type"]
            assert await bridge.topic_type("/unknown") is None

    run(scenario)


@pytest.mark.parametrize("folder", ["ros1", "ros2", "rs"])
def test_topics_are_parsed_from_captured_rosapi_responses(folder):
    (path,) = list(
        (CAPTURED / folder).glob("service_response_rosapi_topics.[ur]*.json")
    )
    values = json.loads(path.read_text())["values"]

    async def scenario():
        async with bridged(topics=values) as (server, bridge):
            topics = await bridge.topics()
            assert "Odometry" in topics["/robot_0/odom"]
            server.answer["/rosapi/topics"] = {"topics": ["/a"], "types": []}
            with pytest.raises(ServiceError):
                await bridge.topics()

    run(scenario)


@pytest.mark.parametrize(
    "answer",
    ["no such service", {"action_servers": 5}, {"action_servers": ["/go/follow_path"]}],
)
def test_hidden_topics_are_listed_only_for_known_actions(answer):
    """ROS 2's rosapi lists none of an action's topics, but it names the servers."""
    listed = {"topics": ["/a"], "types": ["std_msgs/msg/Bool"]}

    async def scenario():
        async with bridged(topics=listed) as (server, bridge):
            server.answer["/rosapi/action_servers"] = answer
            assert await bridge.topics() == {"/a": "std_msgs/msg/Bool"}
            servers = ["/bob/navigate_to_pose", "/bob/spin"]
            server.answer["/rosapi/action_servers"] = {"action_servers": servers}
            assert await bridge.topics() == {
                "/a": "std_msgs/msg/Bool",
                "/bob/navigate_to_pose/_action/feedback": (
                    "nav2_msgs/action/NavigateToPose_FeedbackMessage"
                ),
            }

    run(scenario)


def test_a_service_call_from_the_bridge_is_declined():
    async def scenario():
        async with bridged() as (server, _):
            call = {"op": "call_service", "service": "/x", "id": "1", "args": {}}
            await server.send(json.dumps(call))
            (answer,) = await server.wait_for("service_response")
            assert answer["result"] is False

    run(scenario)


def test_a_redirect_is_not_followed():
    async def scenario():
        hits = []

        async def redirect(reader, writer):
            hits.append(await reader.readuntil(b"\r\n\r\n"))
            writer.write(
                b"HTTP/1.1 302 Found\r\nLocation: ws://127.0.0.1:%d/elsewhere\r\n"
                b"Content-Length: 0\r\n\r\n" % port
            )
            await writer.drain()
            writer.close()

        server = await asyncio.start_server(redirect, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        with pytest.raises(BridgeClosed, match="302"):
            await Bridge(f"ws://127.0.0.1:{port}").call_service("/a")
        assert len(hits) == 1
        server.close()
        await server.wait_closed()

    run(scenario)


def test_a_stopped_bridge_can_start_again():
    async def scenario():
        async with bridged() as (server, bridge):
            bridge.subscribe("/a", print)
            await bridge.stop()
            await bridge.stop()
            bridge.start(asyncio.get_running_loop())
            await until(lambda: bridge.state == "open")
            await server.wait_for("subscribe", 2)

    run(scenario)


def test_a_thousand_removed_listeners_leave_no_topics_and_no_tasks():
    async def scenario():
        async with bridged() as (server, bridge):
            tasks = len(asyncio.all_tasks())
            for _ in range(1000):
                scope = Scope()
                with scope.active():
                    bridge.on_open(print)
                    bridge.subscribe("/a", print, throttle=100)
                scope.close()
            await server.wait_for("unsubscribe", 1000)
            assert bridge._topics == {}
            await until(lambda: len(asyncio.all_tasks()) <= tasks)

    run(scenario)


def test_importing_the_bridge_loads_no_heavy_library():
    code = (
        "import sys, webmap.ros.bridge, webmap.ros.messages, webmap.ros.messages\n"
        "heavy = {'numpy', 'websockets', 'cbor2', 'PIL', 'starlette', 'uvicorn'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr
