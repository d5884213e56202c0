"""How many calls it takes to make a robot, as for a fleet of thousands."""

import gc
import sys

import webmap


def test_a_robot_and_its_topics_take_few_calls():
    bridge = webmap.Bridge("ws://127.0.0.1:9")
    calls: list[int] = []

    def count(frame, event, arg):
        calls[-1] += event in ("call", "c_call")

    def make(name):
        robot = webmap.Robot(name)
        robot.set_odometry_topic(bridge, f"/{name}/odom", type="nav_msgs/Odometry")
        robot.set_twist_topic(bridge, f"/{name}/cmd_vel", stops_within=0.5)
        return robot

    def make_counted(name):
        calls.append(0)
        sys.setprofile(count)
        try:
            return make(name)
        finally:
            sys.setprofile(None)

    made = [make(f"robot_{number}") for number in range(3)]
    gc.collect()
    gc.disable()
    try:
        made += [make_counted(f"counted_{number}") for number in range(3)]
    finally:
        gc.enable()
    # One of several robots may change the pace of the robots of other tests.
    assert min(calls) <= 1700
    for robot in made:
        robot.destroy()
