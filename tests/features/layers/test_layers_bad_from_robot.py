"""Bad messages of robots, over a real socket: reported once, without other effects.

Two robots are on one page, each behind a rosbridge of its own. One of them sends a bad
message on one of its topics. The drawing stays, the other robot and the other topics
still work, and the topic itself works again after its next valid message.
"""

import asyncio
import json
import logging
import math
import time
from contextlib import AsyncExitStack

import cbor2
import numpy as np
import pytest
from module_fakes import dots, header, pose, typed
from websockets.asyncio.server import serve

from equipment.waiting import polls, until
from webmap import Bridge, Robot

pytestmark = pytest.mark.slow


class Server:
    """A rosbridge that sends only the frames of the test."""

    def __init__(self) -> None:
        self.links, self.asked = set(), set()

    async def start(self, stack: AsyncExitStack) -> Bridge:
        server = await stack.enter_async_context(
            serve(self._serve, "127.0.0.1", 0, compression=None, ping_interval=None)
        )
        port = server.sockets[0].getsockname()[1]
        bridge = Bridge(f"ws://127.0.0.1:{port}")
        bridge.start(asyncio.get_running_loop())
        stack.push_async_callback(bridge.stop)
        await until(lambda: bridge.state == "open")
        return bridge

    async def _serve(self, link) -> None:
        self.links.add(link)
        try:
            async for text in link:
                message = json.loads(text)
                if message["op"] == "subscribe":
                    self.asked.add(message["topic"])
                if message["op"] == "call_service":
                    type = TYPES.get(message["args"].get("topic"), "")
                    answer = {"op": "service_response", "values": {"type": type}}
                    answer |= {"service": message["service"], "id": message["id"]}
                    await link.send(json.dumps({**answer, "result": True}))
        finally:
            self.links.discard(link)

    async def send(self, frame: str | bytes) -> None:
        for link in list(self.links):
            await link.send(frame)


def publish(topic: str, message, **more) -> str:
    return json.dumps({"op": "publish", "topic": topic, "msg": message, **more})


def publish_cbor(topic: str, message) -> bytes:
    return cbor2.dumps({"op": "publish", "topic": topic, "msg": message})


def odometry(x: float, **changed) -> dict:
    placed = {"pose": changed.pop("pose", pose(x, 1.0)), "covariance": [0.1] * 36}
    still = {"linear": dict.fromkeys("xyz", 0), "angular": dict.fromkeys("xyz", 0)}
    twist = {"twist": still, "covariance": [0.0] * 36}
    about = {"header": changed.pop("header", header("odom")), "child_frame_id": "base"}
    return {**about, "pose": placed, "twist": twist}


def scan(reach: float, **changed) -> dict:
    return {
        "header": header("laser"),
        "angle_min": -1.0,
        "angle_max": 1.0,
        "angle_increment": 0.5,
        "time_increment": 0.0,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 10.0,
        "ranges": [reach, 2.0, 2.0, 2.0, 2.0],
        "intensities": [],
        **changed,
    }


def grid(value: int, **changed) -> dict:
    info = {"map_load_time": header()["stamp"], "resolution": 0.5}
    info |= {"width": 2, "height": 2, "origin": pose(0, 0)}
    data = changed.pop("data", [0, 100, value, 0])
    return {"header": header(), "info": {**info, **changed}, "data": data}


def amcl(x: float, **changed) -> dict:
    spread = [0.0] * 36
    spread[0], spread[7], spread[35] = 0.04, 0.01, 0.01
    at = changed.pop("pose", pose(x, 0))
    return {"header": header(), "pose": {"pose": at, "covariance": spread}}


def plan(x: float, **changed) -> dict:
    there = changed.pop("pose", pose(x, 2))
    poses = [{"header": header(), "pose": at} for at in (pose(0, 0), there)]
    return {"header": changed.pop("header", header()), "poses": poses}


GOOD = {
    "/odom": odometry,
    "/scan": scan,
    "/map": lambda x: grid(int(x)),
    "/amcl_pose": amcl,
    "/plan": plan,
}
TYPES = {
    "/odom": "nav_msgs/Odometry",
    "/scan": "sensor_msgs/LaserScan",
    "/map": "nav_msgs/OccupancyGrid",
    "/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
    "/plan": "nav_msgs/Path",
}
ZEROS = {"position": {"x": 9, "y": 9, "z": 0}, "orientation": dict.fromkeys("xyzw", 0)}
NANS = {
    "position": {"x": 9, "y": 9, "z": 0},
    "orientation": {"x": 0, "y": 0, "z": math.nan, "w": 1},
}
NOWHERE = pose(math.inf, 0)
NANOSECONDS = {"stamp": {"secs": 1, "nsecs": 2_000_000_005}}
WHOLE = publish("/map", grid(50))
TEN_MILLION = scan(1.0, ranges=typed(85, np.full(10_000_000, 2, "<f4")))
ONE_MILLION = scan(1.0, ranges=typed(85, np.full(1_000_000, 2, "<f4")))

REFUSED = {
    "a frame that was cut": (
        "/map",
        WHOLE[: len(WHOLE) - 30],
        "got a frame that was cut",
    ),
    "two objects in one frame": ("/map", WHOLE + WHOLE, "or is not one message: not"),
    "braces without end": (None, "{" * 800 + "}" * 800, "not rosbridge"),
    "a cut frame of braces": (None, '{"op":' * 1500, "not rosbridge"),
    "bytes that are nothing": (None, b"\xa1\xff\x00", "not rosbridge"),
    "cells that are missing": ("/map", grid(1, data=[0]), "got 1 cells for a grid"),
    "two to the 31st cells a side": (
        "/map",
        grid(1, width=2**31, height=2**31),
        "expected at most",
    ),
    "a resolution of zero": ("/map", grid(1, resolution=0), "above 0, got 0"),
    "a resolution below zero": ("/map", grid(1, resolution=-1), "above 0, got -1"),
    "a resolution of NaN": ("/map", grid(1, resolution=None), "above 0, got nan"),
    "a cell of text": ("/map", grid(1, data=["x"] * 4), "array of numbers"),
    "a grid turned by NaN": ("/map", grid(1, origin=NANS), "finite"),
    "odometry of zeros": ("/odom", odometry(3, pose=ZEROS), "quaternion of zeros"),
    "odometry of NaN": ("/odom", odometry(3, pose=NANS), "NaN"),
    "odometry from infinity": ("/odom", odometry(3, pose=NOWHERE), "infinity"),
    "a pose of NaN": ("/amcl_pose", amcl(3, pose=NANS), "finite"),
    "a plan to infinity": ("/plan", plan(3, pose=NOWHERE), "finite"),
    "an increment of zero": ("/scan", scan(1, angle_increment=0), "increment"),
    "an increment of NaN": ("/scan", scan(1, angle_increment=None), "increment"),
    "an angle of NaN": ("/scan", scan(1, angle_min=None), "angle_min"),
    "a million beams": ("/scan", ONE_MILLION, "1000000 rays"),
    "ten million beams": ("/scan", TEN_MILLION, "may have 4 MiB"),
    "ranges of text": (
        "/scan",
        scan(1, ranges=["far"]),
        "but a field is missing or wrong",
    ),
    "another type": ("/scan", {"data": "hello"}, "angle_min"),
    "odometry of another type": (
        "/odom",
        {"data": "hello"},
        "reports nav_msgs/Odometry, but a field is missing",
    ),
    "odometry that was cut": (
        "/odom",
        publish("/odom", odometry(3))[:-40],
        "got a frame that was cut",
    ),
    "odometry of an endless time": (
        "/odom",
        odometry(3, header=header("odom") | {"stamp": {"secs": 10**400}}),
        "seconds of hundreds of digits",
    ),
    "a scan of an endless time": (
        "/scan",
        scan(1, header=header("laser") | {"stamp": {"secs": 10**400}}),
        "seconds of hundreds of digits",
    ),
    "a scan of two thousand million nanoseconds": (
        "/scan",
        scan(1, header=header("laser") | NANOSECONDS),
        "2000000005 nanoseconds; expected 0 to 999999999",
    ),
    "odometry of two thousand million nanoseconds": (
        "/odom",
        odometry(3, header=header("odom") | NANOSECONDS),
        "2000000005 nanoseconds; expected 0 to 999999999",
    ),
    "a plan of two thousand million nanoseconds": (
        "/plan",
        plan(3, header=header() | NANOSECONDS),
        "2000000005 nanoseconds; expected 0 to 999999999",
    ),
    "a grid of two thousand million nanoseconds": (
        "/map",
        grid(1) | {"header": header() | NANOSECONDS},
        "2000000005 nanoseconds; expected 0 to 999999999",
    ),
    "a pose of nanoseconds below zero": (
        "/amcl_pose",
        amcl(3) | {"header": header() | {"stamp": {"secs": 1, "nsecs": -1}}},
        "a time has -1 nanoseconds; expected 0 to 999999999",
    ),
}
"""What is refused: the topic, the frame or the message, and the notice."""

DRAWN = {
    "a bare NaN": ("/scan", publish("/scan", scan(math.nan)), 4),
    "a bare infinity": ("/scan", publish("/scan", scan(-math.inf)), 4),
    "one ray with no increment": ("/scan", scan(1, ranges=[2.0], angle_increment=0), 1),
    "a stamp of zero": ("/scan", scan(1, header=header() | {"stamp": {}}), 5),
}
"""Unusual scans that are drawn: the number of dots."""

DOUBTED = {
    "no ranges": (scan(1, ranges=[]), 0, "its scans have no ranges"),
    "nothing but null": (
        scan(1, ranges=[None] * 5),
        0,
        "none of its 5 ranges is a nu",
    ),
}
"""Scans that are drawn in part: the number of dots, and the notice."""


def look(element) -> tuple:
    """Return everything that users see of an element, without its age."""
    attributes = {k: v for k, v in element.attributes.items() if k != "data-age"}
    drawn = getattr(element, "_dots", None)
    parts = tuple(look(child) for child in element.children)
    return (element.tag, sorted(attributes.items()), element._transform, drawn, parts)


class Scene:
    """A page with two robots; the first robot will send bad messages."""

    def __init__(self, map, channel) -> None:
        self.map, self.errors = map, channel.errors
        self.servers = [Server(), Server()]
        self.robots = [Robot("Bob"), Robot("Ann")]

    async def start(self, stack: AsyncExitStack) -> None:
        self.bridges = [await server.start(stack) for server in self.servers]
        self.bridge_errors = []
        self.grids = []
        for robot, bridge in zip(self.robots, self.bridges, strict=True):
            bridge.on_error(lambda error: self.bridge_errors.append(str(error)))
            robot.set_odometry_topic(bridge, "/odom", type="nav_msgs/Odometry")
            scanner = {"max_dots": None, "throttle": 0}
            robot.add_module("LaserScanner", bridge, "/scan", **scanner)
            robot.add_module("PoseWithCovariance", bridge, "/amcl_pose", throttle=0)
            robot.add_module("Path", bridge, "/plan", throttle=0)
            self.map.add_robot(robot)
            grid = self.map.add_module("OccupancyGrid", bridge, "/map")
            self.grids.append(grid.layer)
        for server in self.servers:
            await until(lambda server=server: set(GOOD) <= server.asked)
        stack.callback(self.end)

    def end(self) -> None:
        self.map.page.close()
        for robot in self.robots:
            robot.destroy()

    def state(self, number: int) -> dict[str, tuple]:
        """Return what is drawn of each topic of a robot."""
        robot = self.robots[number]
        by = {type(module).__name__: module for module in robot.modules}
        at = robot.position
        return {
            "/odom": (at.x, at.y, robot.yaw),
            "/scan": look(by["LaserScanner"].dots),
            "/map": look(self.grids[number].svg),
            "/amcl_pose": by["PoseWithCovariance"].ellipse._transform,
            "/plan": by["Path"].points,
        }

    async def send_good(self, number: int, x: float) -> dict[str, tuple]:
        """Send good messages on every topic, and wait until all of them are drawn."""
        before = self.state(number)
        for topic, make in GOOD.items():
            await self.servers[number].send(publish(topic, make(x)))
        kept = lambda: [t for t, s in self.state(number).items() if s == before[t]]  # noqa: E731
        await until(lambda: not kept(), lambda: f"a new drawing of {kept()}")
        return self.state(number)


def frame_of(topic, what) -> str | bytes:
    if not isinstance(what, dict):
        return what
    binary = any(isinstance(value, cbor2.CBORTag) for value in what.values())
    return publish_cbor(topic, what) if binary else publish(topic, what)


def with_scene(map, channel, scenario) -> None:
    async def run() -> None:
        async with AsyncExitStack() as stack:
            scene = Scene(map, channel)
            await scene.start(stack)
            await scenario(scene)

    asyncio.run(run())


@pytest.mark.parametrize("name", REFUSED)
def test_invalid_data_gives_one_notice_and_affects_nothing_else(map, channel, name):
    topic, what, expected = REFUSED[name]

    async def scenario(scene: Scene) -> None:
        mine = await scene.send_good(0, 1.0)
        theirs = await scene.send_good(1, 1.0)
        assert scene.errors == []
        frame = frame_of(topic, what)
        for _ in range(3):
            await scene.servers[0].send(frame)
        lines = lambda: [*scene.errors, *scene.bridge_errors]  # noqa: E731
        await until(lambda: any(expected in line for line in lines()))
        assert scene.state(0) == mine, "the drawing stays"
        assert scene.state(1) == theirs
        await scene.send_good(1, 2.0)
        after = await scene.send_good(0, 2.0)
        assert all(after[t] != mine[t] for t in GOOD), (
            "all topics still work, and the link"
        )
        for received in (scene.errors, scene.bridge_errors):
            found = [line for line in received if expected in line]
            assert len(found) == len(received) <= 1, "three equal notices are one"
        (line,) = scene.errors
        assert (topic or "sent ") in line, "the notice names its source"
        assert "Ann" not in line
        assert channel.problems == {}, "the problem is cleared"

    with_scene(map, channel, scenario)


AILING = {
    "/amcl_pose": lambda n: amcl(3, pose=pose(n * 0.013, math.nan)),
    "/plan": lambda n: plan(3, pose=pose(n * 0.37, math.nan)),
    "/map": lambda n: grid(1, origin=pose(n * 0.05, math.nan)),
}


def test_repeated_nan_messages_give_one_notice_until_the_data_is_valid(
    map, channel, caplog, monkeypatch
):
    """The text has other numbers each time."""
    # Otherwise a pause of three seconds between two poses adds a log line.
    monkeypatch.setattr("webmap.poses.silence.LIMIT", 60.0)

    async def scenario(scene: Scene) -> None:
        await scene.send_good(0, 1.0)
        robot, layer = scene.robots[0], scene.grids[0]
        standing = lambda: [*robot.problems.values(), *layer.problems.values()]  # noqa: E731
        caplog.clear()
        for number in range(60):
            for topic, make in AILING.items():
                await scene.servers[0].send(publish(topic, make(number)))
        newest = {"0.767", "21.83", "2.95"}
        await until(lambda: all(n in str(standing()) for n in newest))
        assert len(standing()) == 3, "a card shows the newest problems"
        assert len(scene.errors) == 3
        assert sorted(channel.problems.values()) == sorted(scene.errors)
        assert len(warnings(caplog)) == 3
        await scene.send_good(0, 2.0)
        assert standing() == []
        assert channel.problems == {}, "no page shows a problem"
        await scene.servers[0].send(publish("/plan", AILING["/plan"](7)))
        await until(standing)
        assert len(channel.problems) == 1
        assert len(warnings(caplog)) == 3, "the log already has the line"

    with_scene(map, channel, scenario)


def warnings(caplog) -> list[str]:
    found = [r for r in caplog.records if r.levelno >= logging.WARNING]
    return [r.getMessage() for r in found if r.name.startswith("webmap")]


@pytest.mark.parametrize("name", DRAWN)
def test_unusual_but_valid_scans_are_drawn_without_a_notice(map, channel, name):
    topic, what, count = DRAWN[name]

    async def scenario(scene: Scene) -> None:
        mine = await scene.send_good(0, 1.0)
        await scene.servers[0].send(frame_of(topic, what))
        if scene.state(0)["/scan"] == mine["/scan"]:
            await until(lambda: len(dots_of(scene)) == count)
        assert len(dots_of(scene)) == count
        await scene.send_good(0, 3.0)
        assert [*scene.errors, *scene.bridge_errors] == []

    with_scene(map, channel, scenario)


@pytest.mark.parametrize("name", DOUBTED)
def test_a_scan_without_any_range_is_drawn_without_dots_and_gives_one_notice(
    map, channel, name
):
    what, count, expected = DOUBTED[name]

    async def scenario(scene: Scene) -> None:
        await scene.send_good(0, 1.0)
        theirs = await scene.send_good(1, 1.0)
        for _ in range(3):
            await scene.servers[0].send(publish("/scan", what))
        await until(lambda: scene.errors != [])
        await until(lambda: len(dots_of(scene)) == count)
        await scene.send_good(0, 3.0)
        (line,) = scene.errors
        assert line.startswith("Bob: /scan: ")
        assert expected in line
        assert scene.state(1) == theirs

    with_scene(map, channel, scenario)


def dots_of(scene: Scene) -> np.ndarray:
    (scanner,) = (m for m in scene.robots[0].modules if hasattr(m, "max_dots"))
    return dots(scanner.dots)


def test_frames_of_nested_braces_take_little_processor_time(map, channel):
    async def scenario(scene: Scene) -> None:
        began = time.process_time()
        for _ in range(20):
            await scene.servers[0].send("{" * 800 + "}" * 800)
        await scene.send_good(0, 1.0)
        assert time.process_time() - began < 1.0

    with_scene(map, channel, scenario)


SIDE = 4096


@pytest.mark.slow
@pytest.mark.serial
def test_a_map_of_50_megabytes_is_drawn_without_blocking_another_robot(map, channel):
    text = publish("/map", grid(0, width=SIDE, height=SIDE, resolution=0.05, data=[-7]))
    huge = text.replace("[-7]", "[" + "-1," * (SIDE * SIDE - 1) + "100]")

    async def scenario(scene: Scene) -> None:
        mine = await scene.send_good(0, 1.0)
        assert len(huge) > 48_000_000
        seen: list[float] = []
        scene.bridges[1].subscribe(
            "/odom", lambda message: seen.append(time.monotonic())
        )
        sending = asyncio.create_task(scene.servers[0].send(huge))
        while scene.state(0)["/map"] == mine["/map"]:
            await scene.servers[1].send(publish("/odom", odometry(4.0)))
            await asyncio.sleep(0.01)
        await sending
        assert len(seen) > 20, "the other robot was still updated"
        assert max(np.diff(seen)) < 1.0
        layer = scene.grids[0]
        assert layer.cells.shape == (SIDE, SIDE)
        assert layer.cells[-1, -1] == 100
        assert [*scene.errors, *scene.bridge_errors] == []

    with_scene(map, channel, scenario)


BEAMS = publish("/scan", scan(1, ranges=[-7])).replace(
    "[-7]", "[" + "2," * 1_899_999 + "2]"
)


@pytest.mark.slow
@pytest.mark.serial
def test_a_scan_of_two_million_rays_is_refused_without_blocking_another_robot(
    map, channel
):
    async def scenario(scene: Scene) -> None:
        mine = await scene.send_good(0, 1.0)
        seen: list[float] = []
        scene.bridges[1].subscribe(
            "/odom", lambda message: seen.append(time.monotonic())
        )
        sending = asyncio.create_task(scene.servers[0].send(BEAMS))
        for _ in polls("the error", 60.0):
            if scene.errors:
                break
            await scene.servers[1].send(publish("/odom", odometry(4.0)))
            await asyncio.sleep(0.01)
        await sending
        assert max(np.diff(seen)) < 1.0, "the other robot was still updated"
        (line,) = scene.errors
        assert "/scan: a scan of 1900000 rays" in line
        assert scene.state(0) == mine, "the drawing stays"
        await scene.send_good(0, 2.0)

    with_scene(map, channel, scenario)
