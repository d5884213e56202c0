"""How many calls it takes to make a robot, as for a fleet of thousands."""

import gc
import sys

import webmap


def test_a_robot_and_its_topics_take_few_calls():
    calls = 0
    bridge = webmap.Bridge("ws://127.0.0.1:9")

    def count(frame, event, arg):
        nonlocal calls
        calls += event in ("call", "c_call")

    def make(name):
        robot = webmap.Robot(name)
        robot.set_odometry_topic(bridge, f"/{name}/odom", type="nav_msgs/Odometry")
        robot.set_twist_topic(bridge, f"/{name}/cmd_vel", stops_within=0.5)
        return robot

    made = [make(f"robot_{number}") for number in range(3)]
    gc.collect()  # robots of other tests also do something for a new one
    gc.disable()
    sys.setprofile(count)
    try:
        made.append(make("counted"))
    finally:
        sys.setprofile(None)
        gc.enable()
    assert calls <= 1700
    for robot in made:
        robot.destroy()
