"""Poses, problems, log lines and drawings are the same as the recorded ones."""

import hashlib
import json
import os
from pathlib import Path

import pytest
from pose_script import (
    AMCL,
    ODOMETRY,
    Chance,
    amcl,
    odometry,
    planned_path,
    play,
    scan,
    transform,
    transforms,
)

from webmap import align_bridge

pytestmark = pytest.mark.slow

FILE = Path(__file__).with_name("recorded_poses.json")
MODE = os.environ.get("WEBMAP_POSES", "")
SEEDS = range(40)


async def drive(stage, seconds, x=0.0, *, localised=True, ahead=0.0, step=0.1):
    """Publish the odometry and frames of a robot that drives along x."""
    until = stage.loop.now + seconds
    while stage.loop.now < until - 1e-6:
        await stage.wait(step)
        x += 0.5 * step
        stamp = stage.loop.now + ahead
        moved = [transform("odom", "base_link", x, stamp=stamp)]
        if localised:
            moved.append(transform("map", "odom", 2.0, 1.0, 0.5, stamp=stamp))
        stage.publish("/tf", transforms(*moved))
        stage.publish("/odom", odometry(x, stamp=stamp, v=0.5))
    return x


async def odometry_alone(stage):
    stage.robot.set_odometry_topic(stage.link, "/odom", 0, type=ODOMETRY)
    stage.robot.add_module("LaserScanner", stage.link, "/scan", 0.2, throttle=0)
    stage.link.open()
    for step in range(30):
        await stage.wait(0.1)
        now = stage.loop.now
        stage.publish("/odom", odometry(step / 20, yaw=step / 10, stamp=now, v=0.5))
        stage.publish("/scan", scan(now + 0.03))
    stage.link.lag = 2.0
    stage.publish("/odom", odometry(1.5, stamp=stage.loop.now))
    await stage.wait(50.0)
    stage.publish("/odom", odometry(1.5, stamp=stage.loop.now))
    stage.robot.unsubscribe_odometry_topic()
    await stage.wait(5.0)


async def odometry_by_frames(stage):
    stage.robot.set_odometry_topic(stage.link, "/odom", 0, type=ODOMETRY)
    stage.robot.set_tf(stage.link)
    stage.robot.add_module("Path", stage.link, "/plan", throttle=0)
    stage.robot.add_module("LaserScanner", stage.link, "/scan", throttle=0)
    stage.link.open()
    x = await drive(stage, 4.0, localised=False)
    stage.publish("/plan", planned_path(stage.loop.now))
    stage.publish("/scan", scan(stage.loop.now, "laser"))
    x = await drive(stage, 2.0, x)
    mount = transform("base_link", "laser", 0.3, stamp=0.0)
    stage.publish("/tf_static", transforms(mount))
    stage.publish("/scan", scan(stage.loop.now + 0.1, "laser"))
    x = await drive(stage, 4.0, x, localised=False)
    x = await drive(stage, 1.0, x)
    x = await drive(stage, 2.0, x + 30.0)
    stage.robot.expect_jump()
    x = await drive(stage, 14.0, x + 30.0, step=0.5)
    await drive(stage, 3.0, x, ahead=-3600.0)


async def amcl_by_frames(stage):
    stage.robot.set_odometry_topic(stage.link, "/amcl_pose", 0, type=AMCL)
    stage.robot.set_tf(stage.link)
    stage.link.open()
    for x in (1.0, 1.5, 1.5, 30.0):
        await stage.wait(0.6)
        stage.publish("/amcl_pose", amcl(x, stamp=stage.loop.now))
    await stage.wait(60.0)


async def frames_alone(stage):
    stage.robot.set_tf(stage.link)
    stage.link.open()
    await drive(stage, 2.0)
    moved = transform("map", "other", 1.0, stamp=1.0)
    for _ in range(40):
        await stage.wait(0.2)
        stage.publish("/tf", transforms(moved))
    await drive(stage, 2.0, 1.0, step=0.01)
    stage.link.close()
    await stage.wait(40.0)
    stage.link.open()
    await drive(stage, 1.0, 1.0)


async def static_frames_alone(stage):
    stage.robot.set_tf(stage.link)
    stage.link.open()
    stage.publish(
        "/tf_static", transforms(transform("map", "base_link", 3.0, stamp=0.0))
    )
    await stage.wait(0.2)
    stage.publish("/tf", transforms(transform("map", "other", 3.0, stamp=1.0)))
    await stage.wait(40.0)


async def type_by_shape(stage):
    stage.robot.set_odometry_topic(stage.link, "/odom", 0)
    stage.link.open()
    await stage.wait(0.1)
    stage.publish("/odom", {"data": 3})
    stage.publish("/odom", odometry(1.0, stamp=stage.loop.now))
    stage.publish("/odom", odometry(float("nan"), stamp=stage.loop.now))
    stage.publish("/odom", {"data": 3})
    await stage.wait(1.0)
    stage.publish("/odom", odometry(1.1, stamp=stage.loop.now))
    await stage.wait(1.0)


async def two_places(stage):
    stage.robot.set_odometry_topic(stage.link, "/odom", 0, type=ODOMETRY)
    stage.link.open()
    for step in range(12):
        await stage.wait(0.1)
        stage.publish("/odom", odometry(20.0 * (step % 2), stamp=stage.loop.now))
    for step in range(12):
        await stage.wait(1.1)
        stage.publish("/odom", odometry(0.1 * step, stamp=stage.loop.now))


async def aligned_and_shared(stage):
    ann, bob = stage.robots
    for robot in stage.robots:
        robot.set_odometry_topic(stage.link, "/odom", 0, type=ODOMETRY)
        robot.set_tf(stage.link)
        robot.add_module("Path", stage.link, "/plan", throttle=0)
    stage.link.open()
    x = await drive(stage, 1.0)
    stage.publish("/plan", planned_path(stage.loop.now))
    align_bridge(stage.link, 5.0, 6.0, 90.0)
    stage.look()
    ann.set_alignment(1.0, 2.0, 45.0)
    stage.look()
    x = await drive(stage, 0.5, x)
    ann.unset_alignment()
    bob.unset_tf()
    ann.unsubscribe_odometry_topic()
    x = await drive(stage, 1.0, x)
    ann.set_odometry_topic(stage.links[1], "/odom", 0, type=ODOMETRY)
    stage.links[1].open()
    stage.publish("/odom", odometry(7.0, stamp=stage.loop.now), stage.links[1])
    await drive(stage, 0.5, x)


SCRIPTS = {
    "odometry alone": odometry_alone,
    "odometry by frames": odometry_by_frames,
    "amcl by frames": amcl_by_frames,
    "frames alone": frames_alone,
    "static frames alone": static_frames_alone,
    "type by shape": type_by_shape,
    "two places": two_places,
    "aligned and shared": aligned_and_shared,
}


def compare(name, lines):
    """Compare the output with the record, or write the record."""
    digest = hashlib.sha256("\n".join(lines).encode()).hexdigest()[:12]
    found = json.loads(FILE.read_text()) if FILE.exists() else {}
    if MODE == "write":
        found[name] = digest
        text = json.dumps(dict(sorted(found.items())), indent=0)
        FILE.write_text(f"{text}\n")
    elif MODE:
        folder = Path(MODE)
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{name.replace(' ', '_')}.txt"
        file.write_text("\n".join(lines) + "\n")
    else:
        assert found[name] == digest, (
            f"{len(lines)} lines: see tests/poses/pose_script.py"
        )


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_scripted_scenario_matches_its_recording(name, monkeypatch):
    robots = ("Ann", "Bob") if SCRIPTS[name] is aligned_and_shared else ("Bob",)
    compare(name, play(SCRIPTS[name], monkeypatch, *robots))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_scenario_matches_its_recording(seed, monkeypatch):
    async def script(stage):
        await Chance(stage, seed).go(120)

    compare(f"seed {seed}", play(script, monkeypatch, "Ann", "Bob"))
