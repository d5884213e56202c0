"""Messages with stamps an hour off, over a real socket, are drawn with one notice.

The notice contains the difference. Invalid stamps are refused;
``test_layers_bad_from_robot`` tests this for most types.
"""

import asyncio

import pytest
from module_fakes import header, pose
from test_layers_bad_from_robot import (
    NANOSECONDS,
    Scene,
    dots_of,
    odometry,
    publish,
    scan,
    with_scene,
)

from equipment.waiting import polls, until

NOW = 1_000_000.0
"""A time of the robot's clock, in seconds; this machine's clock does not matter."""

HOUR = 3600.0
WAYS = {"ahead": HOUR, "behind": -HOUR}


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Allow this process to be delayed for a second without a notice."""
    monkeypatch.setattr("webmap.poses.placing.PROBLEM_DELAY", 60.0)


def at(frame: str, seconds: float) -> dict:
    nanoseconds = round(seconds % 1 * 1e9)
    return header(frame) | {"stamp": {"secs": int(seconds), "nsecs": nanoseconds}}


def transform(parent: str, child: str, x: float, about: dict) -> dict:
    place = pose(x, 0.0)
    move = {"translation": place["position"], "rotation": place["orientation"]}
    about = about | {"frame_id": parent}
    return {"header": about, "child_frame_id": child, "transform": move}


async def send(scene: Scene, topic: str, message: dict) -> None:
    await scene.servers[0].send(publish(topic, message))


async def move_to(scene: Scene, x: float, seconds: float) -> None:
    """Publish the place of the robot, and wait until the robot is drawn there."""
    await send(scene, "/odom", odometry(x, header=at("odom", seconds)))
    await until(lambda: drawn_at(scene, x))


def drawn_at(scene: Scene, x: float) -> bool:
    return scene.robots[0].position.x == pytest.approx(x)


@pytest.mark.parametrize("way", WAYS)
def test_a_scan_an_hour_off_is_drawn_with_one_notice(map, channel, monkeypatch, way):
    monkeypatch.setattr("webmap.poses.placing.PROBLEM_DELAY", 0.0)
    off = scan(1.5, header=at("laser", NOW + WAYS[way]))

    async def scenario(scene: Scene) -> None:
        await move_to(scene, 1.0, NOW)
        for _ in polls("the notice", pause=0.02):
            if scene.errors:
                break
            # A silent robot is not requested again.
            await send(scene, "/odom", odometry(1.0, header=at("odom", NOW)))
            await send(scene, "/scan", off)
            await asyncio.sleep(0.02)
        assert len(dots_of(scene)) == 5
        for _ in range(3):
            await send(scene, "/scan", off)
        await move_to(scene, 1.1, NOW + 0.1)
        await send(scene, "/scan", scan(1.0, header=at("laser", NOW + 0.1)))
        await until(lambda: channel.problems == {})
        (line,) = scene.errors
        assert line.startswith("Bob: laserscan: ")
        side = "before" if way == "ahead" else "after"
        assert f"3600.000 s {side} the requested" in line
        assert "; are the clocks of the sensor and of the" in line

    with_scene(map, channel, scenario)


@pytest.mark.parametrize("way", WAYS)
def test_odometry_an_hour_off_is_drawn_with_one_notice(map, channel, way):
    async def scenario(scene: Scene) -> None:
        await move_to(scene, 1.0, NOW)
        await move_to(scene, 1.1, NOW + WAYS[way])
        await until(lambda: scene.errors)
        await move_to(scene, 1.2, NOW + 0.2)
        await move_to(scene, 1.3, NOW + 0.3)
        (line,) = scene.errors
        assert line.startswith("Bob: the clock of its poses jumped by ")
        assert f"{WAYS[way]:+.1f} s" in line

    with_scene(map, channel, scenario)


async def placed(scene: Scene) -> None:
    """Publish frames of the robot, and wait until they place the robot."""
    scene.robots[0].set_tf(scene.bridges[0])
    await until(lambda: "/tf" in scene.servers[0].asked)
    await send_transforms(scene, at("", NOW))
    await send(scene, "/odom", odometry(1.0, header=at("odom", NOW)))
    await until(lambda: drawn_at(scene, 11.0))


async def send_transforms(scene: Scene, about: dict) -> None:
    chain = [("map", "odom", 10.0), ("odom", "base_link", 1.0)]
    transforms = [transform(*link, about) for link in chain]
    await send(scene, "/tf", {"transforms": transforms})


@pytest.mark.parametrize("way", WAYS)
def test_a_transform_an_hour_off_gives_one_notice_and_does_not_move_the_robot(
    map, channel, way
):
    async def scenario(scene: Scene) -> None:
        await placed(scene)
        await send_transforms(scene, at("", NOW + WAYS[way]))
        await send_transforms(scene, at("", NOW))
        await until(lambda: scene.errors)
        await send(scene, "/odom", odometry(1.1, header=at("odom", NOW + 0.1)))
        await until(lambda: drawn_at(scene, 11.1))
        (line,) = scene.errors
        assert line.startswith("Bob: 'map' -> 'odom': time jumped back by 3600.000 s")

    with_scene(map, channel, scenario)


def test_a_transform_with_invalid_nanoseconds_is_ignored_with_one_notice(map, channel):
    async def scenario(scene: Scene) -> None:
        await placed(scene)
        for _ in range(3):
            await send_transforms(scene, header() | NANOSECONDS)
        await until(lambda: scene.errors)
        await send(scene, "/odom", odometry(1.1, header=at("odom", NOW + 0.1)))
        await until(lambda: drawn_at(scene, 11.1))
        (line,) = scene.errors
        assert line == (
            "Bob: a transform was left out: 'map' -> 'odom': a time has 2000000005 "
            "nanoseconds; expected 0 to 999999999"
        )

    with_scene(map, channel, scenario)
