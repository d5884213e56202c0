"""Listeners to frames are called together, and each separately."""

import asyncio
import time

import pytest
from test_tf_robot import Link, transform

from equipment.waiting import until
from webmap import Robot
from webmap.poses.frames import PERIOD, frames_of

pytestmark = pytest.mark.slow


class OpenLink(Link):
    """A link that is up."""

    def on_open(self, fn):
        asyncio.get_running_loop().call_soon(fn)
        return super().on_open(fn)


def moved(x, stamp) -> dict:
    return {"transforms": [transform("map", "base_link", x, stamp=stamp)]}


def test_a_raising_frame_listener_is_logged_once_and_others_are_still_called(caplog):
    link = Link()
    frames = frames_of(link)

    def raising() -> None:
        raise ValueError("this one cannot")

    held = frames.join(raising)
    robot = Robot("Bob")
    robot.set_tf(link)
    for step in range(5):
        link.publish("/tf", moved(step, 10.0 + step))
        assert robot.position.x == step
    (record,) = caplog.records
    assert record.getMessage() == "test: a listener to frames raised"
    assert "this one cannot" in str(record.exc_info[1])
    held.remove()
    robot.destroy()


def test_frame_listeners_are_called_at_once_and_then_once_per_period(monkeypatch):
    monkeypatch.setattr("webmap.poses.frames.PERIOD", 0.3)

    async def scenario() -> None:
        link = OpenLink()
        received = []
        held = frames_of(link).join(lambda: received.append(time.monotonic()))
        robot = Robot("Bob")
        robot.set_tf(link)
        await asyncio.sleep(0.0)
        link.publish("/tf", moved(0.0, 10.0))
        assert (len(received), robot.position.x) == (1, 0.0)
        for step in range(1, 11):
            link.publish("/tf", moved(step, 10.0 + step / 100))
        seen = time.monotonic()
        assert len(received) == 1
        await until(lambda: len(received) == 2)
        assert robot.position.x == 10.0, "the newest transform is used"
        assert received[1] - received[0] >= 0.29
        assert robot.pose_stamp <= seen, "the age counts from the arrival of the frames"
        await asyncio.sleep(0.35)
        assert len(received) == 2, "the listener is not called without new frames"
        link.publish("/tf", moved(11.0, 11.0))
        assert (len(received), robot.position.x) == (3, 11.0), (
            "the first frames after a pause are used at once"
        )
        robot.destroy()
        held.remove()

    asyncio.run(scenario())


@pytest.mark.parametrize("robots", [1, 20])
def test_robots_without_odometry_are_updated_in_almost_every_frame_period(robots):
    """Transforms of each period are used, not those of every second period."""

    async def scenario() -> None:
        link = OpenLink()
        fleet = [Robot(f"r{number}", base_link="base_link") for number in range(robots)]
        for robot in fleet:
            robot.set_tf(link)
        received, accepted = [], []
        held = frames_of(link).join(lambda: received.append(1))
        last, began = None, time.monotonic()
        for step in range(100):
            link.publish("/tf", moved(step, 10.0 + step / 100))
            if fleet[-1].position.x != last:
                last = fleet[-1].position.x
                accepted.append(last)
            await asyncio.sleep(0.01)
        assert len(received) <= 3 + (time.monotonic() - began) / PERIOD
        assert len(accepted) >= 0.8 * len(received)
        for robot in fleet:
            robot.destroy()
        held.remove()

    asyncio.run(scenario())
