"""Scripted robots: their poses, frames and clocks, and what is drawn.

Time is virtual: a loop that has nothing to do jumps to its next timer at once, and
``time.monotonic`` returns the loop's time. ``recorded_poses.json`` has a digest of the
output of each script, which shows that a refactoring changes no picture.

- ``WEBMAP_POSES=write pytest tests/poses/test_poses_recorded_poses.py`` writes it.
- ``WEBMAP_POSES=FOLDER pytest ...`` writes the whole output to files of the folder, to
  compare two versions of the code.
"""

import asyncio
import contextlib
import itertools
import json
import logging
import math
import random
import selectors
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from webmap import Map, Robot
from webmap.base.errors import ProtocolError
from webmap.base.scope import Removal, current_scope, keep, no_scope
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.ros.bridge import BridgeStats
from webmap.ros.rosbridge.protocol import Protocol
from webmap.scene.node import Added, Changed

BEGIN = 5000.0
"""Seconds of the virtual clock when a script begins."""


class VirtualLoop(asyncio.SelectorEventLoop):
    """An event loop that never waits."""

    def __init__(self) -> None:
        self.now = BEGIN
        super().__init__(Jumping(self))

    def time(self) -> float:
        return self.now

    async def shutdown_default_executor(self, timeout: float | None = None) -> None:
        """Wait without a limit: the limit of Python 3.12 would be over at once."""
        await super().shutdown_default_executor()


class Jumping(selectors.SelectSelector):
    """A selector that advances the loop's time instead of waiting."""

    def __init__(self, loop: VirtualLoop) -> None:
        super().__init__()
        self._loop = loop

    def select(self, timeout: float | None = None) -> list:
        ready = super().select(0)
        if not ready and timeout is not None:
            self._loop.now += max(0.0, timeout)
        return ready


class Listening(Removal):
    """A subscription whose rate makes no difference."""

    def set_pace(self, throttle: int, unwatched: int) -> None:
        pass


class Link:
    """A bridge whose frames, state and lag come from a script."""

    def __init__(self, name: str) -> None:
        self.url = self.name = name
        self.state, self.lost, self.replays = "connecting", False, False
        self.lag = 0.0
        self.stats = BridgeStats()
        self.types: dict[str, str] = {}
        self._opening: dict[int, Callable[[], object]] = {}
        self._subscriptions: dict[str, list[tuple]] = {}

    def open(self) -> None:
        self.state, self.lost = "open", False
        self.stats.links += 1
        for fn in tuple(self._opening.values()):
            fn()

    def close(self) -> None:
        self.state, self.lost = "connecting", True

    def on_open(self, fn: Callable[[], object]) -> Removal:
        key = id(fn)
        self._opening[key] = fn
        if self.state == "open":
            asyncio.get_running_loop().call_soon(fn)
        return keep(Removal(lambda: self._opening.pop(key, None)))

    async def topic_type(self, topic: str) -> str | None:
        return self.types.get(topic)

    def protect(self, topic: str, carries: str) -> None:
        """Do nothing: no program publishes here."""

    def subscribe(self, topic, callback, type=None, *, decode=None, **options):
        entry = (callback, decode, current_scope())
        self._subscriptions.setdefault(topic, []).append(entry)
        return keep(Listening(lambda: self._subscriptions[topic].remove(entry)))

    def publish(self, topic: str, message: dict) -> None:
        """Receive a message as a rosbridge writes it, if the link is open."""
        if self.state != "open":
            return
        text = json.dumps(message).replace("NaN", "null")
        frame = f'{{"op":"publish","topic":"{topic}","msg":{text}}}'.encode()
        event = Protocol().receive(frame, time.monotonic())
        for entry in tuple(self._subscriptions.get(topic, ())):
            if entry in self._subscriptions[topic]:
                self._give(event, *entry)

    def _give(self, event: Any, callback: Any, decode: Any, scope: Any) -> None:
        try:
            value = event.decode(decode)
        except ProtocolError as error:
            if scope is not None and scope.report is not None:
                scope.report(str(error), callback)
            return
        if scope is not None and scope.mended is not None:
            scope.mended(callback)
        with scope.active() if scope else no_scope():
            callback(value)


class Seer:
    """A module that records each new pose of the robot."""

    def __init__(self, robot: Robot, note: Callable[[str], None]) -> None:
        self._robot, self._note = robot, note

    def on_odometry_update(self) -> None:
        at, seen = self._robot.position, self._robot.measured_twist
        speed = "" if seen is None else f" at {rounded((seen.vx, seen.wz))}"
        place = rounded((at.x, at.y, at.z, self._robot.yaw))
        self._note(f"{self._robot.name} is at {place}{speed}")


class Channel:
    """A page that records what it receives."""

    def __init__(self, note: Callable[[str], None]) -> None:
        self._note = note
        self._numbers = itertools.count(1)
        self._known: dict[int, str] = {}

    def mount(self, fragment: Any, **options: Any) -> int:
        return next(self._numbers)

    def error(self, text: str) -> None:
        self._note(f"page: {text}")

    def problem(self, number: int, text: str) -> None:
        self._known[number] = text
        self._note(f"page: {text}")

    def mended(self, number: int) -> None:
        self._note(f"page, mended: {self._known.pop(number, '?')}")

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *args, **options: None


class Stage(logging.Handler):
    """The robots and links of a script, and its whole output.

    Args:
        names: The names of the robots.

    """

    def __init__(self, *names: str) -> None:
        super().__init__(logging.INFO)
        self.lines: list[str] = []
        self.links = [Link("hall"), Link("yard")]
        self.link = self.links[0]
        self.robots = [Robot(name) for name in names]
        for robot in self.robots:
            robot.add_module(Seer, self.note)
        self.robot = self.robots[0]
        entry = PageEntry("/", lambda page: None, None, Path(), "test")
        someone = Viewer("v1", "Ann")
        self.page = Page(entry, Channel(self.note), someone, None, {})
        map = Map(self.page.element("map"), 700, 500)
        for robot in self.robots:
            map.add_robot(robot)
        self._seen = {robot: robot.fragment.revision for robot in self.robots}
        self._facts: dict[Robot, str] = {}

    # The steps of a script.

    @property
    def loop(self) -> VirtualLoop:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, VirtualLoop)
        return loop

    async def wait(self, seconds: float) -> None:
        """Let time pass, and record changes every half a second."""
        until = self.loop.now + seconds
        while (rest := until - self.loop.now) > 1e-6:
            await asyncio.sleep(min(rest, 0.5))
            self.look()

    async def stall(self, seconds: float) -> None:
        """Let time pass without running the loop."""
        self.loop.now += seconds
        await asyncio.sleep(0)
        self.look()

    def publish(self, topic: str, message: dict, link: Link | None = None) -> None:
        """Publish a message on a link, and record changes."""
        (link or self.link).publish(topic, message)
        self.look()

    # The output of a script.

    def emit(self, record: logging.LogRecord) -> None:
        error = "" if record.exc_info is None else f" ({record.exc_info[1]})"
        self.note(f"log, {record.levelname}: {record.getMessage()}{error}")

    def note(self, line: str) -> None:
        self.lines.append(f"{time.monotonic() - BEGIN:.3f} {line}")

    def look(self) -> None:
        """Record the changes since the last look."""
        for robot in self.robots:
            for line in self._drawn(robot):
                self.note(f"{robot.name}, {line}")
            facts = self._facts_of(robot)
            if facts != self._facts.get(robot):
                self._facts[robot] = facts
                self.note(f"{robot.name}: {facts}")

    def _drawn(self, robot: Robot) -> Iterator[str]:
        changes = robot.fragment.changes_since(self._seen[robot])
        self._seen[robot] = robot.fragment.revision
        found = []
        for change in changes or ():
            if isinstance(change, Changed):
                node = change.node
                name = node.get("class") or node.tag
                found.append(f"{name}.{change.slot}: {_value(node, change.slot)}")
            else:
                kind = "added" if isinstance(change, Added) else "removed"
                found.append(kind)
        yield from sorted(found)

    def _facts_of(self, robot: Robot) -> str:
        age, silent = robot.pose_age, robot.silent_for
        problems = sorted(_name(about) for about in robot.problems)
        facts = {
            "valid": robot.valid,
            "age": None if age is None else round(age, 2),
            "silent": None if silent is None else round(silent, 2),
            "poses come": robot.hears_poses(1.0),
            "state": robot.state.name,
            "problems": problems,
        }
        return str(facts)


def _value(node: Any, slot: str) -> str:
    if slot == "transform":
        place = node._transform
        return rounded(getattr(place, "values", place))
    if slot == "age":
        return f"{node._age.measured - BEGIN:.3f}"
    if slot == "data-since":
        return str(node.get(slot) is not None)
    if slot in ("dots", "age-limit", "events"):
        return slot
    return str(node.get(slot))


def _name(about: object) -> str:
    return about if isinstance(about, str) else type(about).__name__


def rounded(numbers: Any) -> str:
    """Return numbers to a hundredth of a millimetre."""
    if numbers is None or isinstance(numbers, str):
        return str(numbers)
    return ", ".join(f"{round(number, 5) + 0.0:.5f}" for number in numbers)


def play(script: Callable[[Stage], Any], monkeypatch: Any, *names: str) -> list[str]:
    """Return the whole output of a script."""

    async def run() -> list[str]:
        loop = asyncio.get_running_loop()
        monkeypatch.setattr(time, "monotonic", loop.time)
        stage = Stage(*(names or ("Bob",)))
        logger = logging.getLogger("webmap")
        logger.addHandler(stage)
        level = logger.level
        logger.setLevel(logging.INFO)
        try:
            await script(stage)
            stage.look()
        finally:
            logger.removeHandler(stage)
            logger.setLevel(level)
            for robot in stage.robots:
                robot.destroy()
            with contextlib.suppress(Exception):
                stage.page.close()
        return stage.lines

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        lines = runner.run(run())
    monkeypatch.undo()
    return list(_without_ties(lines))


def _without_ties(lines: list[str]) -> Iterator[str]:
    """Sort the lines of timers that are due at the same time."""
    for silent, group in itertools.groupby(lines, lambda line: ": no pose for" in line):
        each = list(group)
        yield from sorted(each) if silent else each


# Messages.

ODOMETRY = "nav_msgs/Odometry"
AMCL = "geometry_msgs/PoseWithCovarianceStamped"


def header(frame: str, stamp: float) -> dict:
    whole = math.floor(stamp)
    part = min(round((stamp - whole) * 1e9), 999_999_999)
    return {"frame_id": frame, "stamp": {"secs": whole, "nsecs": part}}


def pose(x: float, y: float, yaw: float) -> dict:
    turn = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    return {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turn}


def odometry(x: float, y=0.0, yaw=0.0, *, stamp: float, frame="odom", v=0.0) -> dict:
    linear, angular = {"x": v, "y": 0.0, "z": 0.0}, {"x": 0.0, "y": 0.0, "z": 0.0}
    return {
        "header": header(frame, stamp),
        "child_frame_id": "base_link",
        "pose": {"pose": pose(x, y, yaw), "covariance": [0.0] * 36},
        "twist": {"twist": {"linear": linear, "angular": angular}},
    }


def amcl(x: float, y=0.0, yaw=0.0, *, stamp: float, frame="map") -> dict:
    return {
        "header": header(frame, stamp),
        "pose": {"pose": pose(x, y, yaw), "covariance": [0.0] * 36},
    }


def transform(
    parent: str, child: str, x: float, y=0.0, yaw=0.0, *, stamp: float
) -> dict:
    place = pose(x, y, yaw)
    return {
        "header": header(parent, stamp),
        "child_frame_id": child,
        "transform": {
            "translation": place["position"],
            "rotation": place["orientation"],
        },
    }


def transforms(*each: dict) -> dict:
    return {"transforms": list(each)}


def scan(stamp: float, frame="laser") -> dict:
    return {
        "header": header(frame, stamp),
        "angle_min": 0.0,
        "angle_max": 3.0,
        "angle_increment": 1.0,
        "time_increment": 0.0,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 10.0,
        "ranges": [1.0, 2.0, 3.0],
        "intensities": [],
    }


def planned_path(stamp: float, frame="odom") -> dict:
    each = [{"header": header(frame, stamp), "pose": pose(x, 0, 0)} for x in (0, 1)]
    return {"header": header(frame, stamp), "poses": each}


# A robot and a network with random behaviour.


class Chance:
    """Robots on links with random messages and faults.

    Args:
        stage: The stage of the robots.
        seed: The seed of the random choices.

    """

    def __init__(self, stage: Stage, seed: int) -> None:
        self.stage = stage
        self.random = random.Random(seed)
        self.ahead = self.random.choice([0.0, 0.0, 3600.0])
        """The time by which the robots' clock is ahead, in seconds."""
        self.x = self.yaw = 0.0
        self.clear = True
        for link in stage.links:
            link.types["/odom"] = ODOMETRY

    @property
    def stamp(self) -> float:
        return time.monotonic() + self.ahead

    async def go(self, steps: int) -> None:
        self.set_up()
        for _ in range(steps):
            await self.step()

    def set_up(self) -> None:
        pick = self.random.random
        for robot in self.stage.robots:
            if pick() < 0.8:
                self.follow(robot)
            if pick() < 0.7:
                robot.set_tf(self.stage.link, quiet=pick() < 0.3)
            if pick() < 0.5:
                robot.add_module("LaserScanner", self.stage.link, "/scan", throttle=0)
            if pick() < 0.5:
                robot.add_module("Path", self.stage.link, "/plan", throttle=0)
        self.stage.link.open()
        if pick() < 0.7:
            self.mount()

    def mount(self) -> None:
        chain = transform("base_link", "laser", 0.3, stamp=0.0)
        self.stage.publish("/tf_static", transforms(chain))

    def follow(self, robot: Robot) -> None:
        topic, type, throttle = self.random.choice(
            [
                ("/odom", ODOMETRY, 0),
                ("/odom", None, 100),
                ("/amcl_pose", AMCL, 0),
                ("/odom2", None, 4000),
            ]
        )
        robot.set_odometry_topic(self.stage.link, topic, throttle, type=type)

    async def step(self) -> None:
        await self.stage.wait(self.random.choice([0.02, 0.05, 0.1, 0.1, 0.1, 0.3, 0.7]))
        self.x += self.random.uniform(-0.05, 0.15)
        self.yaw += self.random.uniform(-0.1, 0.1)
        if self.random.random() < 0.85:
            self.usual()
        else:
            await self.unusual()

    def usual(self) -> None:
        kinds = [self.poses, self.poses, self.frames, self.frames, self.sensors]
        self.random.choice(kinds)()

    def poses(self) -> None:
        late, v = self.random.choice([0.0, 0.0, 0.05, 0.2]), self.random.choice([0, 1])
        place = (self.x, self.random.uniform(-0.01, 0.01), self.yaw)
        stamp = self.stamp - late
        publish = self.stage.publish
        publish("/odom", odometry(*place, stamp=stamp, v=v))
        publish("/odom2", amcl(*place, stamp=stamp, frame="odom"))
        if self.random.random() < 0.3:
            publish("/amcl_pose", amcl(*place, stamp=stamp))

    def frames(self) -> None:
        moved = [transform("odom", "base_link", self.x, 0, self.yaw, stamp=self.stamp)]
        if self.clear:
            drift = 0.01 * self.x
            moved.append(transform("map", "odom", 1.0 + drift, stamp=self.stamp))
        self.stage.publish("/tf", transforms(*moved))

    def sensors(self) -> None:
        stamp = self.random.choice([0.0, self.stamp, self.stamp - 0.1, self.stamp + 5])
        frame = self.random.choice(["laser", "laser", "", "camera"])
        self.stage.publish("/scan", scan(stamp, frame))
        self.stage.publish(
            "/plan", planned_path(stamp, self.random.choice(["odom", "map", ""]))
        )

    async def unusual(self) -> None:
        does = [
            self.jump,
            self.set_pose,
            self.nonsense,
            self.wrong_frames,
            self.lose_localisation,
            self.set_the_clock,
            self.be_silent,
            self.restart,
            self.be_slow,
            self.change_topic,
            self.change_frames,
            self.align,
            self.mount_again,
        ]
        done = self.random.choice(does)()
        if done is not None:
            await done

    def jump(self) -> None:
        self.x += self.random.choice([-20.0, 20.0, 3.0])
        self.poses()

    def set_pose(self) -> None:
        for robot in self.stage.robots:
            robot.expect_jump()
        self.jump()

    def nonsense(self) -> None:
        wrong = self.random.choice([math.nan, 1e12])
        publish, frame = (
            self.stage.publish,
            self.random.choice(["odom", "map", "elsewhere"]),
        )
        publish("/odom", odometry(wrong, stamp=self.stamp, frame=frame))
        self.stage.publish("/amcl_pose", {"header": {}, "pose": 3})
        zero = odometry(self.x, stamp=0.0, frame=frame)
        if self.random.random() < 0.5:
            zero["pose"]["pose"]["orientation"] = {"x": 0, "y": 0, "z": 0, "w": 0}
        publish("/odom", zero)

    def wrong_frames(self) -> None:
        wrong = [
            transform("base_link", "map", 0.0, stamp=self.stamp),
            transform("odom", "base_link", math.nan, stamp=self.stamp),
            transform("world", "base_link", 1.0, stamp=self.stamp),
            transform("map", "odom", 1.0, stamp=self.stamp - 30.0),
            transform("elsewhere", "camera", 1.0, stamp=self.stamp),
            transform("", "camera", 1.0, stamp=self.stamp),
        ]
        self.stage.publish("/tf", transforms(self.random.choice(wrong)))

    async def lose_localisation(self) -> None:
        self.clear = not self.clear

    async def set_the_clock(self) -> None:
        self.ahead += self.random.choice([-3600.0, 3600.0, -5.0, 5.0, 100.0])

    async def be_silent(self) -> None:
        await self.stage.wait(self.random.choice([3.5, 12.0, 40.0, 70.0]))

    async def restart(self) -> None:
        self.stage.link.close()
        await self.stage.wait(self.random.choice([0.5, 4.0]))
        self.stage.link.open()

    async def be_slow(self) -> None:
        self.stage.link.lag = self.random.choice([0.0, 0.2, 2.0])
        await self.stage.stall(self.random.choice([0.1, 1.0, 6.0]))

    async def change_topic(self) -> None:
        robot = self.random.choice(self.stage.robots)
        if self.random.random() < 0.3:
            robot.unsubscribe_odometry_topic()
        else:
            self.follow(robot)

    async def change_frames(self) -> None:
        robot = self.random.choice(self.stage.robots)
        if self.random.random() < 0.3:
            robot.unset_tf()
        else:
            robot.set_tf(self.stage.link, quiet=self.random.random() < 0.3)

    async def align(self) -> None:
        from webmap import align_bridge

        robot, chance = self.random.choice(self.stage.robots), self.random.random()
        if chance < 0.4:
            robot.set_alignment(self.random.randint(-3, 3), 1.0, 90.0)
        elif chance < 0.6:
            robot.unset_alignment()
        else:
            align_bridge(self.stage.link, self.random.randint(-3, 3), 0.0, 30.0)

    async def mount_again(self) -> None:
        self.mount()


class CountingLoop(VirtualLoop):
    """A virtual loop that counts its timers."""

    timers = 0

    def call_at(self, *args, **options):
        self.timers += 1
        return super().call_at(*args, **options)
