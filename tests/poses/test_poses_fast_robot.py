"""A robot at 1 kHz, behind a bridge that ignores the requested rate."""

import asyncio
import time

import pytest

from equipment.fake_rosbridge import bridged
from equipment.waiting import until
from webmap import Robot
from webmap.core.frame_pace import FramePace
from webmap.poses.frames import PERIOD
from webmap.poses.odometry import SharedThrottle
from webmap.ros.tf import Transform
from webmap.ros.tf.buffer import HISTORY
from webmap.ros.tf.track import MOST, Track

COUNT = 2000
LEVEL = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}


@pytest.fixture(autouse=True)
def no_other_robots(monkeypatch):
    """Count only the robots of the test, and not those of earlier tests."""
    monkeypatch.setattr("webmap.poses.odometry.shared_throttle", SharedThrottle())


def header(number: int, frame: str) -> dict:
    """Return a header with a stamp 1 ms after that of the previous number."""
    secs, millis = divmod(100_000 + number, 1000)
    return {"frame_id": frame, "stamp": {"secs": secs, "nsecs": millis * 1_000_000}}


def odometry(number: int) -> dict:
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    still = {"linear": zero, "angular": zero}
    at = {"position": {**zero, "x": number / 1000}, "orientation": LEVEL}
    return {
        "header": header(number, "odom"),
        "child_frame_id": "base_link",
        "pose": {"pose": at},
        "twist": {"twist": still},
    }


def frames(number: int) -> dict:
    move = {"translation": {"x": number / 1000, "y": 0.0, "z": 0.0}, "rotation": LEVEL}
    one = {"header": header(number, "map"), "child_frame_id": "base_link"}
    return {"transforms": [{**one, "transform": move}]}


async def publish(server, topic: str, message) -> None:
    for number in range(COUNT + 1):
        await server.publish(topic, message(number))
        if number % 10 == 0:
            await asyncio.sleep(0.01)


def counted(robot: Robot, monkeypatch) -> list[float]:
    """Return a list that grows with each pose that is drawn."""
    drawn: list[float] = []
    show = robot.pose_source._show_pose

    def count(reading, stamp):
        drawn.append(reading.position.x)
        show(reading, stamp)

    monkeypatch.setattr(robot.pose_source, "_show_pose", count)
    return drawn


@pytest.mark.parametrize("needed", [False, True], ids=["looked at", "needed"])
def test_of_the_poses_between_two_frames_only_the_newest_is_drawn_unless_all_are_needed(
    monkeypatch, needed
):
    pace = FramePace()
    monkeypatch.setattr("webmap.core.pose_source.frame_pace", pace)
    pace.made(time.monotonic(), took=10.0, number=1)
    pace.due(60.0)

    async def scenario() -> None:
        async with bridged() as (server, bridge):
            robot = Robot("fast")
            monkeypatch.setattr(robot, "_needs_poses", lambda: needed)
            drawn = counted(robot, monkeypatch)
            robot.set_odometry_topic(bridge, "/odom", 0, type="nav_msgs/Odometry")
            await server.wait_for("subscribe", topic="/odom")
            seen = []
            monkeypatch.setattr(
                robot.pose_source,
                "_on_reading",
                lambda reading, take=robot.pose_source._on_reading: (
                    take(reading),
                    seen.append(reading),
                ),
            )
            robot.feed._listener = robot.pose_source._on_reading
            for number in range(5):
                await server.publish("/odom", odometry(number))
            await until(lambda: len(seen) == 5)
            assert len(drawn) == (5 if needed else 1)
            pace.prepare()
            assert drawn[-1] == 4 / 1000
            assert len(drawn) == (5 if needed else 2)
            robot.destroy()

    asyncio.run(scenario())


@pytest.mark.slow
def test_odometry_at_1_khz_is_requested_and_drawn_sixty_times_a_second(monkeypatch):
    async def scenario() -> None:
        async with bridged() as (server, bridge):
            robot = Robot("fast")
            drawn = counted(robot, monkeypatch)
            robot.set_odometry_topic(bridge, "/odom", type="nav_msgs/Odometry")
            (asked,) = await server.wait_for("subscribe", topic="/odom")
            assert asked["throttle_rate"] == 16
            began = time.monotonic()
            await publish(server, "/odom", odometry)
            await until(lambda: drawn and drawn[-1] == COUNT / 1000)
            took = time.monotonic() - began
            assert len(drawn) <= 3 + took / 0.016
            robot.destroy()

    asyncio.run(scenario())


@pytest.mark.slow
def test_frames_at_1_khz_move_the_robot_sixty_times_a_second(monkeypatch):
    async def scenario() -> None:
        async with bridged() as (server, bridge):
            robot = Robot("fast")
            drawn = counted(robot, monkeypatch)
            robot.set_tf(bridge)
            await server.wait_for("subscribe", topic="/tf")
            began = time.monotonic()
            await publish(server, "/tf", frames)
            await until(lambda: drawn and drawn[-1] == COUNT / 1000)
            took = time.monotonic() - began
            assert len(drawn) <= 3 + took / PERIOD
            robot.destroy()

    asyncio.run(scenario())


def test_the_frames_of_a_robot_at_1_khz_take_limited_memory():
    track = Track("map")
    for number in range(2 * MOST):
        track.add(Transform(), number / 1000, HISTORY)
    assert len(track._stamps) == len(track._transforms) == MOST
