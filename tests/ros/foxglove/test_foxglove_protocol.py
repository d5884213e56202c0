"""The frames of the Foxglove WebSocket protocol, captured and invented."""

import json
import struct
from pathlib import Path

import pytest

from webmap.ros.foxglove import protocol
from webmap.ros.foxglove.protocol import (
    Advertise,
    AdvertiseServices,
    Channel,
    ConnectionGraphUpdate,
    Malformed,
    MessageData,
    MessageSchema,
    Parameter,
    ParameterValues,
    ServerInfo,
    Service,
    ServiceCallFailure,
    ServiceCallResponse,
    Status,
    Time,
    Unadvertise,
    UnadvertiseServices,
    Unknown,
    receive,
)

CAPTURED = Path(__file__).parents[2] / "captured" / "foxglove"


def captured(name: str) -> bytes:
    return (CAPTURED / name).read_bytes()


def text(**fields) -> bytes:
    return json.dumps(fields).encode()


def test_the_first_message_of_a_captured_server():
    info = receive(captured("serverInfo.json"))
    assert isinstance(info, ServerInfo)
    assert info.name == "webmap-rig"
    assert info.capabilities == ["clientPublish"]
    assert info.supported_encodings == ["cdr", "json"]
    assert info.metadata == {"fg-library": "foxglove-sdk-python/0.30.3"}


def test_a_server_that_states_less():
    info = receive(
        text(
            op="serverInfo",
            name="old",
            capabilities=["clientPublish"],
            supportedEncodings=None,
            metadata=None,
            sessionId=None,
        )
    )
    assert info == ServerInfo("old", ["clientPublish"])
    assert receive(b'{"op":"serverInfo"}') == ServerInfo()


def test_a_captured_channel():
    event = receive(captured("advertise.json"))
    assert isinstance(event, Advertise)
    assert not event.faults
    (channel,) = event.channels
    assert channel.id == 1
    assert channel.topic == "/robot_0/odom"
    assert (channel.encoding, channel.schema_encoding) == ("cdr", "ros2msg")
    assert channel.schema_name == "nav_msgs/msg/Odometry"
    assert channel.schema.startswith("std_msgs/Header header\n")


def test_a_channel_that_cannot_be_read_costs_no_other():
    event = receive(
        text(
            op="advertise",
            channels=[
                {"id": 1, "topic": "/a", "encoding": "cdr"},
                {"id": "2", "topic": "/b", "encoding": "cdr"},
                {"id": -3, "topic": "/c", "encoding": "cdr"},
                ["d"],
                {"id": 5, "topic": "/e", "encoding": "cdr", "future": [1]},
            ],
        )
    )
    assert isinstance(event, Advertise)
    assert [channel.topic for channel in event.channels] == ["/a", "/e"]
    assert len(event.faults) == 3
    assert "`$.id`" in event.faults[0]
    assert "/b" in event.faults[0]


def test_captured_message_data():
    frame = captured("message_data.bin")
    subscription, time = struct.unpack_from("<IQ", frame, 1)
    assert receive(frame) == MessageData(subscription, time)
    assert frame[protocol.PAYLOAD :][:4] == b"\0\1\0\0"  # the head of CDR


def test_services_of_both_subprotocols_have_one_form():
    new = {
        "encoding": "cdr",
        "schemaName": "std_srvs/srv/SetBool_Request",
        "schemaEncoding": "ros2msg",
        "schema": "bool data",
    }
    event = receive(
        text(
            op="advertiseServices",
            services=[
                {"id": 1, "name": "/new", "type": "std_srvs/srv/SetBool"}
                | {"request": new, "response": new},
                {"id": 2, "name": "/old", "type": "std_srvs/SetBool"}
                | {"requestSchema": "bool data", "responseSchema": "bool success"},
                {"id": 3, "name": "/bare", "type": "std_srvs/Empty"},
                {"id": 1 << 32, "name": "/large", "type": "std_srvs/Empty"},
            ],
        )
    )
    assert isinstance(event, AdvertiseServices)
    schema = MessageSchema(
        "std_srvs/srv/SetBool_Request", "bool data", "cdr", "ros2msg"
    )
    assert event.services == [
        Service(1, "/new", "std_srvs/srv/SetBool", schema, schema),
        Service(
            2,
            "/old",
            "std_srvs/SetBool",
            MessageSchema("std_srvs/SetBool_Request", "bool data"),
            MessageSchema("std_srvs/SetBool_Response", "bool success"),
        ),
        Service(3, "/bare", "std_srvs/Empty"),
    ]
    assert len(event.faults) == 1


@pytest.mark.parametrize(
    ("fields", "event"),
    [
        ({"op": "status", "level": 2, "message": "no"}, Status("no", 2)),
        ({"op": "status", "message": "a", "id": "b"}, Status("a", 0, "b")),
        ({"op": "removeStatus", "statusIds": ["b"]}, Unknown("removeStatus")),
        ({"op": "unadvertise", "channelIds": [1, 2]}, Unadvertise([1, 2])),
        (
            {"op": "unadvertiseServices", "serviceIds": [3]},
            UnadvertiseServices([3]),
        ),
        (
            {"op": "serviceCallFailure", "serviceId": 1, "callId": 7, "message": "x"},
            ServiceCallFailure(7, "x"),
        ),
        ({"op": "tomorrow", "level": "high"}, Unknown("tomorrow")),
    ],
)
def test_operations_in_json(fields, event):
    assert receive(text(**fields)) == event
    assert receive(b" \n" + text(**fields)) == event


def test_parameters_and_their_values():
    event = receive(
        text(
            op="parameterValues",
            id=None,
            parameters=[
                {"name": "/a.b", "value": 3, "type": "float64"},
                {"name": "/gone"},
            ],
        )
    )
    assert isinstance(event, ParameterValues)
    assert event.parameters[0] == Parameter("/a.b", 3, "float64")
    assert event.parameters[1] == Parameter("/gone")


def test_changes_of_the_graph():
    event = receive(
        text(
            op="connectionGraphUpdate",
            publishedTopics=[{"name": "/a", "publisherIds": ["/n"]}],
            subscribedTopics=[{"name": "/b", "subscriberIds": ["/m"]}],
            advertisedServices=[{"name": "/s", "providerIds": ["/p"]}],
            removedTopics=["/c"],
            removedServices=[],
        )
    )
    assert isinstance(event, ConnectionGraphUpdate)
    assert event.published_topics[0].publisher_ids == ["/n"]
    assert event.subscribed_topics[0].subscriber_ids == ["/m"]
    assert event.removed_topics == ["/c"]


def test_binary_frames():
    assert receive(struct.pack("<BQ", 2, 5_000)) == Time(5_000)
    head = struct.pack("<BIII", 3, 8, 9, 3)
    assert receive(head + b"cdr" + b"abc") == ServiceCallResponse(8, 9, "cdr", b"abc")
    assert receive(b"\x05later") == Unknown("binary operation 5")
    assert receive(b"\x09later") == Unknown("binary operation 9")


@pytest.mark.parametrize(
    "frame",
    [
        b"",
        b"\1",
        b"\1" + bytes(11),
        b"\2" + bytes(7),
        b"\3" + bytes(11),
        struct.pack("<BIII", 3, 1, 1, 1 << 31) + b"cdr",
        struct.pack("<BIII", 3, 1, 1, 2) + b"\xff\xfe",
        b"{",
        b'{"op":3}',
        b'{"op":"status"}',
        b'{"op":"status","message":"\xff"}',
        b'{"op":"advertise","channels":{}}',
        b'{"op":"advertise"}',
        b'{"op":"unadvertise","channelIds":["1"]}',
        b'{"op":"parameterValues","parameters":[{"name":"a","value":'
        + b"[" * 60
        + b"]" * 60
        + b"}]}",
        b'{"op":"x","y":' + b"[" * 100_000,
    ],
)
def test_bytes_that_are_not_the_protocol_are_reported(frame):
    event = receive(frame)
    assert isinstance(event, Malformed)
    assert event.reason
    assert event.size == len(frame)


def test_an_operation_that_is_too_long_is_not_read(monkeypatch):
    monkeypatch.setattr(protocol, "MAX_TEXT", 20)
    event = receive(text(op="status", message="long"))
    assert isinstance(event, Malformed)
    assert "the limit is 20" in event.reason


def test_operations_of_the_client():
    assert json.loads(protocol.subscribe({7: 1})) == json.loads(
        captured("client_subscribe.json")
    )
    assert json.loads(protocol.unsubscribe([7])) == {
        "op": "unsubscribe",
        "subscriptionIds": [7],
    }
    sent = json.loads(captured("client_advertise.json"))
    channel = sent["channels"][0]
    made = protocol.advertise(
        [
            Channel(
                1,
                "/robot_0/cmd_vel",
                "cdr",
                "geometry_msgs/msg/Twist",
                channel["schema"],
                "ros2msg",
            )
        ]
    )
    assert json.loads(made) == sent
    assert json.loads(protocol.unadvertise([1])) == {
        "op": "unadvertise",
        "channelIds": [1],
    }
    message = captured("client_message_data.bin")
    assert protocol.message(1, message[5:]) == message
    assert protocol.call_service(8, 9, "cdr", b"x") == (
        b"\2" + struct.pack("<III", 8, 9, 3) + b"cdrx"
    )
    made = protocol.set_parameters([Parameter("/a.b", 1.5), Parameter("/c")], "2")
    assert json.loads(made) == {
        "op": "setParameters",
        "parameters": [{"name": "/a.b", "value": 1.5}, {"name": "/c"}],
        "id": "2",
    }
    graph = json.loads(protocol.subscribe_connection_graph())
    assert graph == {"op": "subscribeConnectionGraph"}
