import json

import pytest
from simulated import Bench

from equipment.captured_frames import frame_file


@pytest.fixture
def client():
    return Bench().client()


@pytest.fixture
def ros2():
    return Bench("ros2").client()


def values(client, service, args=None):
    response = client.call(f"/rosapi/{service}", args or {})
    assert response["result"] is True, response
    return response["values"]


def test_topics_are_listed_with_their_types(client, ros2):
    for asked, odometry, twist in (
        (client, "nav_msgs/Odometry", "geometry_msgs/Twist"),
        (ros2, "nav_msgs/msg/Odometry", "geometry_msgs/msg/Twist"),
    ):
        found = values(asked, "topics")
        types = dict(zip(found["topics"], found["types"], strict=True))
        assert types["/robot_1/odom"] == odometry
        assert types["/robot_0/cmd_vel"] == twist
        assert "/map" in types


def test_hidden_topics_are_not_listed_as_in_the_real_rosapi(ros2):
    hidden = "/robot_0/navigate_to_pose/_action/feedback"
    type = "nav2_msgs/action/NavigateToPose_FeedbackMessage"
    assert not any("/_" in name for name in values(ros2, "topics")["topics"])
    assert values(ros2, "topic_type", {"topic": hidden}) == {"type": ""}
    assert values(ros2, "topics_for_type", {"type": type}) == {"topics": []}


def test_topic_type_returns_an_empty_text_for_an_unknown_topic(client):
    assert values(client, "topic_type", {"topic": "/map"}) == {
        "type": "nav_msgs/OccupancyGrid"
    }
    assert values(client, "topic_type", {"topic": "/nope"}) == {"type": ""}


def test_topics_are_found_by_type_in_either_spelling(client, ros2):
    for asked in (client, ros2):
        for spelled in ("nav_msgs/Odometry", "nav_msgs/msg/Odometry"):
            found = values(asked, "topics_for_type", {"type": spelled})
            assert found == {"topics": ["/robot_0/odom", "/robot_1/odom"]}


def test_topics_and_raw_types_include_the_definition_texts(client):
    found = values(client, "topics_and_raw_types")
    texts = dict(zip(found["topics"], found["typedefs_full_text"], strict=True))
    assert "float64[36] covariance" in texts["/robot_0/odom"]


def test_services_and_their_types_are_listed(client, ros2):
    assert "/robot_0/stop" in values(client, "services")["services"]
    assert values(client, "service_type", {"service": "/robot_0/stop"}) == {
        "type": "std_srvs/Trigger"
    }
    assert values(ros2, "service_type", {"service": "/rosapi/topics"}) == {
        "type": "rosapi_msgs/srv/Topics"
    }
    assert values(client, "services_for_type", {"type": "std_srvs/Trigger"}) == {
        "services": ["/robot_0/stop", "/robot_1/stop"]
    }


def test_publishers_and_subscribers_of_a_topic_are_listed(client):
    assert values(client, "publishers", {"topic": "/map"}) == {
        "publishers": ["/robots"]
    }
    topic = {"topic": "/robot_0/cmd_vel"}
    assert values(client, "subscribers", topic) == {"subscribers": ["/robots"]}
    client.send(op="subscribe", **topic)
    assert values(client, "subscribers", topic) == {
        "subscribers": ["/robots", "/rosbridge_websocket"]
    }
    assert values(client, "publishers", {"topic": "/nope"}) == {"publishers": []}


def test_nodes_are_listed_with_their_topics_and_services(client):
    assert {"/robots", "/rosapi"} <= set(values(client, "nodes")["nodes"])
    details = values(client, "node_details", {"node": "/robots"})
    assert "/robot_0/cmd_vel" in details["subscribing"]
    assert "/map" in details["publishing"]
    assert "/robot_1/stop" in details["services"]


def test_message_details_match_those_of_the_real_rosapi(client):
    path = frame_file("ros1", "service_response_rosapi_message_details.json")
    real = json.loads(path.read_text())["values"]["typedefs"]
    made = values(client, "message_details", {"type": "nav_msgs/Odometry"})["typedefs"]
    by_type = {definition["type"]: definition for definition in made}
    assert by_type == {definition["type"]: definition for definition in real}


def test_service_details_list_the_request_and_response_fields(client):
    (request,) = values(
        client, "service_request_details", {"type": "std_srvs/SetBool"}
    )["typedefs"]
    assert request["fieldnames"] == ["data"]
    (response,) = values(
        client, "service_response_details", {"type": "std_srvs/SetBool"}
    )["typedefs"]
    assert response["fieldnames"] == ["success", "message"]


def test_details_of_an_unknown_type_fail(client):
    response = client.call("/rosapi/message_details", {"type": "no_msgs/Such"})
    assert response["result"] is False


def test_get_time_returns_the_time_of_the_graph(client, ros2):
    assert values(client, "get_time")["time"]["secs"] == int(client.bench.time)
    assert set(values(ros2, "get_time")["time"]) == {"sec", "nanosec"}


def test_a_polite_server_returns_parameter_names(client):
    assert values(client, "get_param_names") == {"names": []}
    default = values(client, "get_param", {"name": "/x", "default": '"d"'})
    assert default == {"value": '"d"'}


def test_action_servers_are_listed_in_both_dialects(client, ros2):
    assert "/robot_0/move_base" in values(client, "action_servers")["action_servers"]
    assert values(ros2, "action_servers")["action_servers"] == [
        "/robot_0/navigate_to_pose",
        "/robot_1/navigate_to_pose",
    ]


def test_only_ros2_returns_its_version(client, ros2):
    assert values(ros2, "get_ros_version")["version"] == 2
    assert client.call("/rosapi/get_ros_version")["result"] is False


def test_in_ros2_a_request_for_parameter_names_hangs_rosapi():
    bench = Bench("ros2", "real")
    assert bench.client().call("/rosapi/get_param_names") is None
    assert bench.client().call("/rosapi/get_time") is None
    # The rest of the graph still works.
    assert bench.client().call("/robot_0/stop")["result"] is True


def test_in_ros2_a_request_for_message_details_kills_rosapi():
    bench = Bench("ros2", "real")
    args = {"type": "nav_msgs/msg/Odometry"}
    assert bench.client().call("/rosapi/message_details", args) is None
    response = bench.client().call("/rosapi/get_time")
    assert response["values"] == "Service /rosapi/get_time does not exist"
