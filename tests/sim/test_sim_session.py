"""Clients of the server: the frames that they send and receive."""

import json
import math

import pytest
from simulated import Bench

from equipment.captured_frames import frame_file

CMD = "/robot_0/cmd_vel"
ODOM = "/robot_0/odom"
TEXT = "std_msgs/String"


@pytest.fixture
def bench():
    return Bench()


def twist(x=0.0, z=0.0):
    return {"linear": {"x": x}, "angular": {"z": z}}


class TestTopics:
    def test_a_subscriber_gets_odometry_twenty_times_a_second(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic=ODOM, type="nav_msgs/Odometry")
        bench.run(2)
        assert len(client.operations("publish", ODOM)) == 40

    def test_scans_are_sent_ten_times_a_second(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic="/robot_1/base_scan")
        bench.run(1)
        scans = client.operations("publish")
        assert len(scans) == 10
        assert len(scans[0]["msg"]["ranges"]) == 360

    def test_a_publish_operation_has_no_id(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic=ODOM, id="subscribe:1")
        bench.run(0.1)
        assert set(client.operations()[0]) == {"op", "topic", "msg"}

    def test_the_map_is_latched(self, bench):
        bench.run(1)
        client = bench.client()
        client.send(op="subscribe", topic="/map")
        (grid,) = client.operations("publish", "/map")
        assert grid["msg"]["info"]["width"] * grid["msg"]["info"]["height"] == len(
            grid["msg"]["data"]
        )

    def test_each_new_subscription_id_receives_the_latched_message_again(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic="/map", id="a")
        client.send(op="subscribe", topic="/map", id="b")
        client.send(op="subscribe", topic="/map", id="b")
        assert len(client.operations("publish", "/map")) == 2

    def test_two_subscriptions_of_one_client_receive_one_copy(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic=ODOM, id="a", throttle_rate=500)
        client.send(op="subscribe", topic=ODOM, id="b")
        bench.run(1)
        assert len(client.operations("publish", ODOM)) == 20

    def test_unsubscribing_the_faster_id_keeps_the_slower_rate(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic=ODOM, id="a", throttle_rate=500)
        client.send(op="subscribe", topic=ODOM, id="b")
        client.send(op="unsubscribe", topic=ODOM, id="b")
        bench.run(3)
        assert len(client.operations("publish", ODOM)) == pytest.approx(6, abs=1)

    def test_unsubscribing_without_an_id_ends_all_subscriptions_of_the_topic(
        self, bench
    ):
        client = bench.client()
        client.send(op="subscribe", topic=ODOM, id="a")
        client.send(op="subscribe", topic=ODOM, id="b")
        client.send(op="unsubscribe", topic=ODOM)
        bench.run(1)
        assert client.operations() == []

    def test_throttling_sends_the_newest_message_in_each_period(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic=ODOM, throttle_rate=300, queue_length=1)
        stamps = []
        for _ in range(80):
            bench.run(0.025)
            for message in client.operations("publish", ODOM):
                stamp = message["msg"]["header"]["stamp"]
                sent_at = bench.time
                stamps.append(sent_at - stamp["secs"] - stamp["nsecs"] * 1e-9)
        assert len(stamps) == pytest.approx(2 / 0.3, abs=1)
        assert max(stamps) < 0.06

    def test_a_published_message_reaches_its_sender_and_other_clients(self, bench):
        one, other = bench.client(), bench.client()
        for client in (one, other):
            client.send(op="subscribe", topic=CMD)
        one.send(op="advertise", topic=CMD, type="geometry_msgs/Twist")
        one.send(op="publish", topic=CMD, msg=twist(0.5))
        for client in (one, other):
            (echo,) = client.operations("publish", CMD)
            assert echo["msg"]["linear"] == {"x": 0.5, "y": 0.0, "z": 0.0}

    def test_a_topic_of_a_client_exists_until_the_client_disconnects(self, bench):
        talker, listener = bench.client(), bench.client()
        talker.send(op="advertise", topic="/chatter", type=TEXT, latch=True)
        talker.send(op="publish", topic="/chatter", msg={"data": "hallo"})
        listener.send(op="subscribe", topic="/chatter", type="std_msgs/msg/String")
        assert listener.operations("publish")[0]["msg"] == {"data": "hallo"}
        talker.session.close()
        late = bench.client()
        late.send(op="subscribe", topic="/chatter", type=TEXT)
        assert late.operations("publish") == []

    def test_a_subscription_may_come_before_its_publisher(self, bench):
        listener, talker = bench.client(), bench.client()
        listener.send(op="subscribe", topic="/chatter", type=TEXT)
        talker.send(op="advertise", topic="/chatter", type=TEXT)
        talker.send(op="publish", topic="/chatter", msg={"data": "at last"})
        assert listener.operations("publish")[0]["msg"]["data"] == "at last"

    def test_publishing_to_a_topic_of_known_type_needs_no_advertising(self, bench):
        client = bench.client()
        client.send(op="publish", topic=CMD, msg=twist(0.4))
        bench.run(0.3)
        assert bench.world.robots[0].twist.vx > 0.1

    def test_a_disconnected_client_leaves_no_topics_services_or_subscriptions(
        self, bench
    ):
        topics, services = set(bench.graph.topics), set(bench.graph.services)
        client = bench.client()
        client.send(op="subscribe", topic=ODOM)
        client.send(op="advertise", topic="/mine", type=TEXT)
        client.send(op="advertise_service", service="/serve", type="std_srvs/Empty")
        assert set(bench.graph.topics) != topics
        client.session.close()
        assert set(bench.graph.topics) == topics
        assert set(bench.graph.services) == services
        assert not bench.graph.topics[ODOM].subscribers


class TestDriving:
    @pytest.mark.parametrize("dialect", ["ros1", "ros2"])
    def test_odometry_shows_the_driven_distance(self, dialect):
        bench = Bench(dialect)
        client = bench.client()
        client.send(op="subscribe", topic=ODOM)
        client.send(op="advertise", topic=CMD, type="geometry_msgs/Twist")
        for _ in range(20):
            client.send(op="publish", topic=CMD, msg=twist(0.5))
            bench.run(0.05)
        client.send(op="publish", topic=CMD, msg=twist())
        bench.run(1)
        poses = [
            m["msg"]["pose"]["pose"]["position"] for m in client.operations("publish")
        ]
        way = math.hypot(poses[-1]["x"] - poses[0]["x"], poses[-1]["y"] - poses[0]["y"])
        assert way == pytest.approx(0.5, abs=0.02)

    def test_a_robot_with_stamped_twists_refuses_plain_twists(self):
        bench = Bench("ros2", twist="TwistStamped")
        client = bench.client()
        client.send(op="publish", topic=CMD, msg=twist(0.5))
        assert client.operations("status")
        client.send(op="publish", topic=CMD, msg={"twist": twist(0.5)})
        bench.run(0.2)
        assert bench.world.robots[0].twist.vx > 0.1

    def test_a_real_server_forwards_nan_and_infinity_to_a_robot_that_refuses_both(self):
        bench = Bench(quirks="real")
        client = bench.client()
        client.send(op="subscribe", topic=CMD)
        for number in ("NaN", "Infinity", "1e999"):
            client.session.receive(
                f'{{"op":"publish","topic":"{CMD}","msg":{{"linear":{{"x":{number}}}}}}}'
            )
        assert len(client.operations("publish", CMD)) == 3
        bench.run(0.5)
        assert bench.world.robots[0].twist.is_zero

    def test_a_polite_server_refuses_an_infinite_velocity(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic=CMD)
        client.send(op="publish", topic=CMD, msg=twist(math.inf), id="x")
        (status,) = client.operations()
        assert status["op"] == "status"
        assert status["id"] == "x"


class TestMalformed:
    BAD = [
        {"op": "bogus", "id": "x"},
        {"op": 5, "id": "x"},
        {"topic": "/x", "id": "x"},
        {"op": "subscribe", "topic": "/no/such/topic", "id": "x"},
        {"op": "subscribe", "topic": ODOM, "type": TEXT, "id": "x"},
        {"op": "subscribe", "topic": "/new", "type": "no_msgs/Such", "id": "x"},
        {"op": "subscribe", "id": "x"},
        {"op": "subscribe", "topic": ODOM, "compression": "zip", "id": "x"},
        {"op": "subscribe", "topic": ODOM, "throttle_rate": "often", "id": "x"},
        {"op": "publish", "topic": "/no/such", "msg": {"data": 1}, "id": "x"},
        {"op": "publish", "topic": CMD, "msg": {"linear": {"q": 1}}, "id": "x"},
        {"op": "publish", "topic": CMD, "msg": {"linear": {"x": "fast"}}, "id": "x"},
        {"op": "publish", "topic": CMD, "msg": [[1], 2, 3, 4], "id": "x"},
        {"op": "advertise", "topic": CMD, "type": TEXT, "id": "x"},
        {"op": "advertise", "topic": "/zzz", "type": "no_msgs/Such", "id": "x"},
        {"op": "unadvertise", "topic": "/zzz", "id": "x"},
        {"op": "unsubscribe", "topic": "/zzz", "id": "x"},
        {"op": "service_response", "id": "x", "values": {}},
    ]

    @pytest.mark.parametrize("bad", BAD, ids=lambda o: str(o)[:60])
    def test_a_real_server_ignores_an_invalid_operation_silently(self, bad):
        bench = Bench(quirks="real")
        client = bench.client()
        client.send(**bad)
        assert client.operations() == []
        assert client.call("/rosapi/get_time")["result"] is True

    @pytest.mark.parametrize("bad", BAD, ids=lambda o: str(o)[:60])
    def test_a_polite_server_answers_an_invalid_operation_with_an_error_status(
        self, bench, bad
    ):
        client = bench.client()
        client.send(**bad)
        (status,) = client.operations()
        assert (status["op"], status["level"]) == ("status", "error")
        assert status["id"] == "x"
        assert status["msg"]

    def test_an_id_other_than_text_is_refused(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic=ODOM, id={"not": "hashable"})
        bench.run(0.1)
        (status,) = client.operations()
        assert status["op"] == "status"

    @pytest.mark.parametrize(
        "data", ["this is not json", "", "[1, 2]", "null", b"\xff\xfe\x00", "{}" * 3]
    )
    def test_data_that_is_not_an_operation_is_ignored(self, bench, data):
        client = bench.client()
        client.session.receive(data)
        client.frames()
        assert client.call("/rosapi/get_time")["result"] is True

    def test_two_operations_in_one_frame_are_both_executed(self, bench):
        client = bench.client()
        client.session.receive(
            '{"op":"call_service","service":"/rosapi/nodes","id":"p"}'
            '{"op":"call_service","service":"/rosapi/nodes","id":"q"}'
        )
        assert [o["id"] for o in client.operations()] == ["p", "q"]

    def test_an_operation_may_be_split_over_two_frames(self, bench):
        client = bench.client()
        client.session.receive('{"op":"call_service","service":"/ros')
        assert client.operations() == []
        client.session.receive('api/nodes","id":"halves"}')
        assert [o["id"] for o in client.operations()] == ["halves"]

    def test_an_operation_after_broken_text_is_executed(self, bench):
        client = bench.client()
        client.session.receive('{"op": "call_service", {{{ "x" ')
        call = {"op": "call_service", "service": "/rosapi/nodes", "id": "after"}
        client.send(**call)
        assert [o["id"] for o in client.operations("service_response")] == ["after"]

    def test_json_in_a_binary_frame_is_answered(self, bench):
        client = bench.client()
        call = {"op": "call_service", "service": "/rosapi/nodes", "id": "b"}
        client.session.receive(json.dumps(call).encode())
        assert client.operations()[0]["id"] == "b"


class TestServices:
    def test_service_responses_match_those_of_the_real_server(self):
        bench = Bench(quirks="real")
        client = bench.client()
        for name, service, args in (
            ("stop_trigger", "/robot_0/stop", {}),
            ("unknown_service", "/does/not/exist", {}),
        ):
            path = frame_file("ros1", f"service_response_{name}.json")
            client.send(op="call_service", service=service, args=args, id="call:1")
            assert client.frames() == [path.read_text()]

    def test_a_call_without_an_id_gets_a_response_without_an_id(self, bench):
        client = bench.client()
        client.send(op="call_service", service="/rosapi/get_time")
        assert "id" not in client.operations()[0]

    def test_service_arguments_may_be_a_list(self, bench):
        client = bench.client()
        response = client.call("/rosapi/topic_type", [ODOM])
        assert response["values"] == {"type": "nav_msgs/Odometry"}

    def test_wrong_service_arguments_fail_with_a_text(self, bench):
        client = bench.client()
        for args in ({"bogus": 1}, {"topic": 5}):
            response = client.call("/rosapi/topic_type", args)
            assert response["result"] is False
            assert isinstance(response["values"], str)

    def test_a_long_service_response_may_be_sent_in_fragments(self, bench):
        client = bench.client()
        client.send(
            op="call_service", service="/rosapi/services", id="s", fragment_size=300
        )
        fragments = client.operations()
        assert {f["id"] for f in fragments} == {"s"}
        whole = json.loads("".join(f["data"] for f in fragments))
        assert "/robot_0/stop" in whole["values"]["services"]

    def test_the_stop_service_stops_the_robot(self, bench):
        client = bench.client()
        client.send(op="publish", topic=CMD, msg=twist(0.5))
        bench.run(0.2)
        response = client.call("/robot_0/stop", {})
        assert response["values"] == {"success": True, "message": "stopped"}
        bench.run(0.5)
        assert bench.world.robots[0].twist.is_zero

    def test_a_client_may_provide_a_service(self, bench):
        server, caller = bench.client(), bench.client()
        server.send(op="advertise_service", service="/srv", type="std_srvs/SetBool")
        caller.send(op="call_service", service="/srv", args={"data": True}, id="c")
        (request,) = server.operations("call_service")
        assert request["args"] == {"data": True}
        values = {"success": True, "message": "ok é"}
        server.send(
            op="service_response",
            id=request["id"],
            service="/srv",
            values=values,
            result=True,
        )
        (response,) = caller.operations()
        assert response["values"] == values
        assert response["id"] == "c"

    def test_calls_fail_when_the_client_that_provides_the_service_disconnects(
        self, bench
    ):
        server, caller = bench.client(), bench.client()
        server.send(op="advertise_service", service="/srv", type="std_srvs/Trigger")
        caller.send(op="call_service", service="/srv", id="c")
        server.session.close()
        assert caller.operations()[0]["result"] is False
        assert caller.call("/srv")["values"] == "Service /srv does not exist"

    def test_in_ros2_a_hanging_service_blocks_only_the_calling_socket(self):
        bench = Bench("ros2", "real")
        server, caller, other = bench.client(), bench.client(), bench.client()
        server.send(op="advertise_service", service="/slow", type="std_srvs/Trigger")
        caller.send(op="call_service", service="/slow", id="slow")
        caller.send(op="publish", topic=CMD, msg=twist(0.5))
        bench.run(0.5)
        assert bench.world.robots[0].twist.is_zero
        assert other.call("/rosapi/get_time")["result"] is True
        (request,) = server.operations("call_service")
        server.send(op="service_response", id=request["id"], values={}, result=True)
        bench.run(0.2)
        assert bench.world.robots[0].twist.vx > 0

    def test_in_ros1_a_hanging_service_blocks_nothing(self):
        bench = Bench("ros1", "real")
        server, caller = bench.client(), bench.client()
        server.send(op="advertise_service", service="/slow", type="std_srvs/Trigger")
        caller.send(op="call_service", service="/slow", id="slow")
        caller.send(op="publish", topic=CMD, msg=twist(0.5))
        bench.run(0.2)
        assert bench.world.robots[0].twist.vx > 0

    def test_thousands_of_calls_in_a_frame_are_answered(self):
        bench = Bench("ros2", "real")
        client = bench.client()
        call = '{"op":"call_service","service":"/rosapi/get_time"}'
        client.session.receive(call * 3000)
        assert len(client.operations("service_response")) == 3000

    def test_the_hanging_stop_quirk_leaves_stop_calls_unanswered(self):
        bench = Bench(quirks="real,hanging_stop")
        client = bench.client()
        assert client.call("/robot_0/stop") is None


class TestForms:
    def test_a_scan_in_cbor_has_its_ranges_as_a_float32_array(self):
        from simulated import room

        bench = Bench(quirks="real", plan=room(30, 30))
        client = bench.client()
        client.send(op="subscribe", topic="/robot_0/base_scan", compression="cbor")
        bench.run(0.1)
        (scan,) = client.operations()
        assert scan["msg"]["ranges"].tag == 85
        assert len(scan["msg"]["ranges"].value) == 360 * 4

    @pytest.mark.parametrize(
        ("dialect", "topic", "compression"),
        [
            ("ros1", ODOM, "cbor"),
            ("ros2", ODOM, "cbor"),
            ("ros2", ODOM, "png"),
        ],
    )
    def test_a_real_server_never_sends_odometry_in_unsupported_encodings(
        self, dialect, topic, compression
    ):
        bench = Bench(dialect, "real")
        client = bench.client()
        client.send(op="subscribe", topic=topic, compression=compression)
        bench.run(1)
        assert client.frames() == []
        polite = Bench(dialect, "polite").client()
        polite.send(op="subscribe", topic=topic, compression=compression)
        polite.bench.run(1)
        assert len(polite.frames()) == 20

    def test_a_real_server_never_sends_fragmented_cbor(self):
        bench = Bench(quirks="real")
        client = bench.client()
        client.send(
            op="subscribe", topic="/map", compression="cbor", fragment_size=1000
        )
        assert client.frames() == []

    def test_joined_fragments_give_the_whole_message(self):
        bench = Bench(quirks="real")
        client = bench.client()
        client.send(op="subscribe", topic=ODOM, fragment_size=300)
        bench.run(0.05)
        fragments = client.operations()
        assert {f["id"] for f in fragments} == {0}
        assert len(fragments) == math.floor(fragments[0]["total"])
        whole = json.loads("".join(f["data"] for f in fragments))
        assert whole["topic"] == ODOM

    def test_raw_cbor_is_sent_in_both_dialects(self):
        for dialect in ("ros1", "ros2"):
            client = Bench(dialect, "real").client()
            client.send(op="subscribe", topic=ODOM, compression="cbor-raw")
            client.bench.run(0.05)
            (frame,) = client.operations()
            assert set(frame["msg"]) == {"secs", "nsecs", "bytes"}

    def test_ros2_writes_nan_in_a_covariance_as_a_bare_token(self):
        client = Bench("ros2", "real", nan=True).client()
        client.send(op="subscribe", topic=ODOM)
        client.bench.run(0.05)
        (frame,) = client.frames()
        assert '"covariance":[0.001,NaN,0.0' in frame

    def test_unknown_battery_values_are_null(self, bench):
        client = bench.client()
        client.send(op="subscribe", topic="/robot_0/battery_state")
        bench.run(1)
        (battery,) = client.operations()
        assert battery["msg"]["charge"] is None
        assert 0 < battery["msg"]["percentage"] <= 1
