"""Simulated robots over real sockets, with and without an open page."""

import time

import pytest
from page_loop import make_model, open_page

import webmap
from equipment.waiting import wait_for
from equipment.webmap_process import simulator
from webmap.base import audience as audience_module
from webmap.base.audience import audience


@pytest.fixture
def grace(monkeypatch):
    """A short time until robots count as unwatched."""
    monkeypatch.setattr(audience_module, "GRACE", 0.2)
    yield
    audience.end()


@pytest.mark.slow
def test_few_messages_come_without_a_page_and_the_first_frames_are_fresh(loop, grace):
    with simulator("--robots", "2") as url:
        bridge = webmap.Bridge(url)
        robots = [webmap.Robot(f"Robot {number}") for number in range(2)]
        mine = []
        for number, robot in enumerate(robots):
            name = f"/robot_{number}"
            robot.set_odometry_topic(bridge, f"{name}/odom", type="nav_msgs/Odometry")
            robot.set_tf(bridge)
            robot.add_module("LaserScanner", bridge, f"{name}/base_scan", throttle=100)

        def build(page):
            map = webmap.Map(page.element("webmap_container"))
            for robot in robots:
                map.add_robot(robot)

        def received(seconds):
            before = bridge.stats.frames
            time.sleep(seconds)
            return bridge.stats.frames - before

        def fresh():
            return all(
                robot.pose_age is not None and robot.pose_age < 1.0 for robot in robots
            )

        model = make_model(loop, build)
        loop.call(lambda: bridge.start(loop.runtime._loop) or True)
        loop.call(lambda: audience.expect_pages(loop.runtime._loop) or True)
        wait_for(lambda: not audience.present and bridge.state == "open")
        time.sleep(1.0)  # for messages that were already sent
        few = received(4.0)
        assert few <= 2 * (4 / 2 + 4 / 5) + 4  # poses and scans, and one more of each
        handle, socket = open_page(model)
        wait_for(lambda: socket.frames)
        assert audience.present
        wait_for(fresh)
        before = bridge.stats.frames
        wait_for(lambda: bridge.stats.frames > before + 10 * few)
        handle.closed()
        wait_for(lambda: not audience.present)
        subscription = loop.call(
            lambda: bridge.subscribe("/robot_0/odom", mine.append, throttle=100)
        )
        wait_for(lambda: len(mine) > 30)  # a user's own code gets all messages
        assert not audience.present
        loop.call(lambda: subscription.remove() or True)
        loop.call(lambda: model.close() or True)
        loop.wait(bridge.stop())
