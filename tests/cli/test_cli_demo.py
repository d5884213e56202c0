"""``webmap demo``: its robots are those that the simulator plays."""

import asyncio

import pytest

from webmap import Bridge
from webmap.cli.demo import demo_robot, simulator
from webmap.discovery import discover
from webmap.ros.asking import ask_topics


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_demo_robot_uses_the_topics_of_the_simulator(dialect):
    with simulator("--port", 0, "--robots", 1, "--dialect", dialect) as url:
        topics = asyncio.run(ask_topics(url, wait=10.0, waiting=print))
        (found,) = discover(topics, "bob").robots
        robot = demo_robot(Bridge(url), 0, dialect)
    try:
        spec = robot.motion.spec()
        assert spec.twist_topic == found.topic("velocity")
        assert (spec.action, spec.action_type) == found.action
        assert spec.goal_topic == found.topic("goal")
        assert (spec.cancel_topic or "") == found.topic("cancel")
    finally:
        robot.destroy()
