"""The witness robot: it records messages, moves, and stops by itself."""

import json
import time

import pytest
from websockets.sync.client import connect

from equipment.waiting import wait_for
from webmap.base.geometry import Twist
from webmap.ros.rosbridge import ops
from webmap.testing import Sentinel, WitnessRobot


def twist(vx, wz=0.0):
    message = {
        "linear": {"x": vx, "y": 0.0, "z": 0.0},
        "angular": {"x": 0.0, "y": 0.0, "z": wz},
    }
    return ops.publish("/cmd_vel", message).decode()


@pytest.fixture
def robot():
    with WitnessRobot(timeout=0.2) as robot:
        yield robot


@pytest.fixture
def link(robot):
    with connect(robot.url) as link:
        yield link


def test_the_witness_robot_logs_velocities_with_their_arrival_time(robot, link):
    before = time.monotonic()
    link.send(twist(0.5, 0.25))
    received = wait_for(lambda: robot.log.twists, "a velocity")[0]
    assert received.twist == Twist(0.5, 0.0, 0.25)
    assert before <= received.at <= time.monotonic()
    assert robot.log.of("publish", "/cmd_vel")[0].link == 1


def test_the_witness_robot_stops_after_its_command_timeout(robot, link):
    link.send(twist(0.5))
    # The robot may have stopped again before this thread checks.
    wait_for(lambda: any(m.twist.vx == 0.5 for m in robot.log.moved[:]), "moving")
    received_at = robot.log.twists[-1].at
    rest = wait_for(lambda: robot.log.standstill(received_at + 0.1), "a standstill")
    assert rest - received_at >= 0.2
    assert robot.log.first_zero(0) is None


def test_a_witness_robot_without_command_timeout_moves_until_a_zero_arrives():
    with WitnessRobot(timeout=None) as robot, connect(robot.url) as link:
        link.send(twist(0.5))
        wait_for(lambda: robot.velocity.vx == 0.5, "moving")
        received_at = robot.log.twists[-1].at
        wait_for(lambda: robot.log.moved[-1].at > received_at + 0.7, "a while")
        assert robot.velocity.vx == 0.5
        link.send(twist(0.0))
        wait_for(lambda: robot.velocity.vx == 0.0, "a stop")


def test_a_disobeying_witness_robot_logs_velocities_but_does_not_move(robot, link):
    robot.obeys = False
    link.send(twist(0.5))
    wait_for(lambda: robot.log.twists, "a velocity")
    assert robot.velocity.is_zero


def test_the_witness_robot_sends_odometry_with_its_velocity_to_subscribers(robot, link):
    link.send(ops.subscribe("/odom", id="1").decode())
    deadline = time.monotonic() + 5
    while time.monotonic() < deadline:
        link.send(twist(0.5))
        message = json.loads(link.recv(timeout=5))["msg"]
        if message["twist"]["twist"]["linear"]["x"] == 0.5:
            return
    raise AssertionError("odometry never reported motion")


def test_a_witness_robot_without_telemetry_sends_no_odometry(robot, link):
    robot.sends_telemetry = False
    link.send(ops.subscribe("/odom", id="1").decode())
    with pytest.raises(TimeoutError):
        link.recv(timeout=0.3)


def test_a_published_velocity_is_echoed_to_subscribers(robot, link):
    link.send(ops.subscribe("/cmd_vel", id="1").decode())
    link.send(twist(0.5))
    assert json.loads(link.recv(timeout=5))["msg"]["linear"]["x"] == 0.5


def call(service):
    return ops.call_service(service, {}, id="c").decode()


def test_a_hanging_service_call_blocks_later_messages_of_the_same_socket(robot, link):
    robot.answers_services(False)
    link.send(call("/e_stop"))
    link.send(twist(0.5))
    wait_for(lambda: robot.log.of("call_service"), "the call")
    assert link.ping().wait(5), "pings are not answered while the call hangs"
    assert robot.log.twists == []
    with connect(robot.url) as other:
        other.send(twist(0.25))
        wait_for(lambda: robot.log.twists, "another socket's velocity")
    robot.unblock()
    assert json.loads(link.recv(timeout=5))["result"] is True
    wait_for(lambda: len(robot.log.twists) == 2, "the delayed velocity")


def test_a_blocking_goal_delays_later_messages_until_the_goal_ends():
    with WitnessRobot(goals_block=True) as robot, connect(robot.url) as link:
        link.send(json.dumps({"op": "send_action_goal", "action": "/go", "id": "g"}))
        link.send(twist(0.5))
        wait_for(lambda: robot.log.of("send_action_goal"), "the goal")
        assert link.ping().wait(5), "pings are not answered while the goal runs"
        assert robot.log.twists == []
        robot.unblock()
        wait_for(lambda: robot.log.twists, "the delayed velocity")


def test_rosapi_lists_the_topics_of_the_witness_robot(robot, link):
    link.send(call("/rosapi/topics"))
    values = json.loads(link.recv(timeout=5))["values"]
    assert dict(zip(values["topics"], values["types"], strict=True)) == {
        "/cmd_vel": "geometry_msgs/Twist",
        "/odom": "nav_msgs/Odometry",
    }


def test_a_killed_witness_bridge_restarts_on_the_same_port(robot, link):
    port = robot.port
    robot.kill_bridge()
    with pytest.raises(OSError, match="refused"):
        connect(robot.url).close()
    robot.restart_bridge()
    assert robot.port == port
    with connect(robot.url) as again:
        again.send(twist(0.5))
        wait_for(lambda: robot.log.twists, "a velocity")


def test_the_witness_robot_receives_a_velocity_after_invalid_messages(robot, link):
    for junk in ("{", "[]", "7", '{"op": "publish", "topic": "/cmd_vel", "msg": 7}'):
        link.send(junk)
    link.send(twist(0.5))
    received = wait_for(lambda: robot.log.moving_since(0)[1:], "the valid velocity")
    assert received[-1].twist.vx == 0.5


def test_the_sentinel_measures_the_delays_of_the_computer():
    with Sentinel() as sentinel:
        begin = time.monotonic()
        wait_for(lambda: time.monotonic() > begin + 0.1, "a while")
        assert 0 < sentinel.worst(begin) < 5
        assert sentinel.worst(begin + 60) == 0
        assert 0 <= sentinel.stolen(begin) <= time.monotonic() - begin + 0.1
