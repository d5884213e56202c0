"""How the newer versions of rosbridge differ from 2.1, as the simulator plays them."""

import asyncio
import json
import re
from pathlib import Path

import pytest
from simulated import Bench

from webmap.base.errors import ConfigError
from webmap.ros.messages import OdometryMsg
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.events import Publish
from webmap.ros.rosbridge.protocol import Protocol
from webmap.ros.rosbridge.server.dialect import REAL, dialect_of
from webmap.sim import run_simulator

NEWER = "4.2"
ACTION = "/robot_0/navigate_to_pose"


def bench(version=NEWER):
    return Bench(version, "real")


def send_goal(client, frame, action=ACTION):
    client.send(
        op="send_action_goal",
        id="g1",
        action=action,
        action_type="nav2_msgs/action/NavigateToPose",
        args={"pose": {"header": {"frame_id": frame}}},
    )


@pytest.mark.parametrize(
    ("frame", "action", "reason"),
    [
        ("moon", ACTION, "Action goal was rejected"),
        ("map", "/nobody", "No action server available"),
    ],
)
def test_a_newer_bridge_answers_a_goal_that_nobody_follows(frame, action, reason):
    client = bench().client()
    send_goal(client, frame, action)
    (result,) = client.operations("action_result")
    assert (result["result"], result["status"], result["values"]) == (False, 0, reason)
    assert client.call("/rosapi/get_time")["result"] is True


@pytest.mark.parametrize(("frame", "action"), [("moon", ACTION), ("map", "/nobody")])
def test_bridge_2_1_never_answers_such_a_goal_nor_its_socket(frame, action):
    made = bench("2.1")
    client = made.client()
    send_goal(client, frame, action)
    assert client.call("/rosapi/get_time") is None
    made.run(10)
    assert client.operations() == []
    assert made.client().call("/rosapi/get_time")["result"] is True


def test_a_goal_blocks_nothing_on_the_socket_that_sent_it():
    client = bench().client()
    send_goal(client, "map")
    assert client.call("/rosapi/get_time")["result"] is True


def call_a_slow_service(made, **more):
    """Call a service; return the client, and a function that lets it answer."""
    answers, client = [], made.client()
    made.graph.serve(
        "a test", "/slow", "a/B", lambda request, respond: answers.append(respond)
    )
    client.session.receive(ops.call_service("/slow", id="c1", **more))
    return client, lambda: answers[0]({})


@pytest.mark.parametrize(("timeout", "passes"), [(None, 5.0), (8.0, 8.0)])
def test_a_newer_bridge_fails_a_call_that_is_not_answered_in_time(timeout, passes):
    made = bench()
    client, answer = call_a_slow_service(made, timeout=timeout)
    made.run(passes - 0.5)
    assert client.operations() == []
    assert client.session.poll() == pytest.approx(0.5, abs=1e-3)
    made.run(0.6)
    (response,) = client.operations("service_response")
    assert response["result"] is False
    assert response["values"].startswith("Timeout exceeded")
    answer()
    assert client.operations() == []


@pytest.mark.parametrize(("version", "timeout"), [("2.1", None), ("4.2", 0)])
def test_other_calls_wait_for_ever(version, timeout):
    made = bench(version)
    client, answer = call_a_slow_service(made, timeout=timeout)
    made.run(60)
    assert client.operations() == []
    answer()
    assert client.operations("service_response")[0]["result"] is True


def test_odometry_in_cbor_has_its_covariance_as_a_list():
    made = bench()
    client = made.client()
    client.send(op="subscribe", topic="/robot_0/odom", compression="cbor")
    made.run(0.2)
    frame = client.frames()[-1]
    assert isinstance(frame, bytes)
    event = Protocol().receive(frame, 0.0)
    assert isinstance(event, Publish)
    assert event.decode(OdometryMsg).pose.pose.position.x != 0.0
    covariance = event.decode(None)["pose"]["covariance"]
    assert (type(covariance), len(covariance)) == (list, 36)


def test_fragments_are_counted_in_whole_numbers_and_png_comes():
    made = bench()
    client = made.client()
    topic = "/robot_0/odom"
    client.send(op="subscribe", topic=topic, id="a", fragment_size=500)
    made.run(0.1)
    parts = client.operations("fragment")
    assert type(parts[0]["total"]) is int
    client.send(op="unsubscribe", topic=topic)
    client.send(op="subscribe", topic=topic, compression="png")
    made.run(0.1)
    assert client.operations("png")


def test_the_newer_versions_are_alike_on_the_wire():
    """Their other differences concern races, and options that WebMap does not use."""
    assert {REAL[each] for each in ("2.7", "3.2", "3.3", "4.1")} == {REAL[NEWER]}


def test_a_publication_with_a_type_creates_its_topic_in_newer_versions():
    publish = {"op": "publish", "topic": "/new", "msg": {"data": "x"}}
    for version in REAL:
        made = bench(version)
        client = made.client()
        client.send(**publish)
        assert "/new" not in made.graph.topics
        client.send(**publish, type="std_msgs/String")
        assert ("/new" in made.graph.topics) == REAL[version].typed_publish


def test_a_version_sets_the_dialect_and_an_unknown_one_is_refused():
    assert {version: dialect_of(version) for version in ("0.11", "2.1", "4.2")} == {
        "0.11": "ros1",
        "2.1": "ros2",
        "4.2": "ros2",
    }
    with pytest.raises(ConfigError, match=r"rosbridge must be one of .*'4\.2'"):
        asyncio.run(run_simulator(rosbridge="1.0"))


def test_the_simulator_plays_the_stated_version():
    """ROS 1 is its usual dialect; 4.1 answers what 2.1 would not."""
    from websockets.asyncio.client import connect

    async def ask():
        url, stop = asyncio.get_running_loop().create_future(), asyncio.Event()
        running = asyncio.create_task(
            run_simulator(rosbridge="4.1", on_ready=url.set_result, stop=stop)
        )
        async with connect(await url, proxy=None) as link:
            call = ops.call_service("/rosapi/get_param_names", id="1")
            await link.send(call.decode())
            answer = json.loads(await link.recv())
        stop.set()
        await running
        return answer

    assert asyncio.run(ask())["result"] is True


def test_the_table_of_versions_has_a_row_for_every_version():
    page = Path(__file__).parents[2] / "docs" / "howto" / "connect-a-robot.md"
    rows = re.findall(r"^\| (\d\.\d+) \|", page.read_text("utf-8"), re.M)
    assert set(rows) == {*REAL, "2.0"}
