"""The type of a velocity topic is requested until rosapi knows the type."""

import asyncio
from types import SimpleNamespace

import pytest

from equipment.waiting import until
from webmap import Bridge, Robot
from webmap.base.scope import Removal
from webmap.core.motion import RobotMotion
from webmap.poses.odometry import FEW, LATER, SHARE, SOON
from webmap.ros.rosbridge.server.dialect import Dialect, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer

STAMPED = "geometry_msgs/msg/TwistStamped"


class Link:
    """A bridge whose rosapi returns the type of the test and counts its calls."""

    url = "ws://test:9090"

    def __init__(self) -> None:
        self.type: str | None = None
        self.asked = 0
        self.state = "open"
        self._opened: list = []

    def on_open(self, fn):
        self._opened.append(fn)
        asyncio.get_running_loop().call_soon(fn)
        return Removal(lambda: self._opened.remove(fn))

    def open(self):
        self.state = "open"
        for fn in self._opened:
            fn()

    async def topic_type(self, topic):
        self.asked += 1
        return self.type

    def protect(self, topic, carries):
        pass


class Gate:
    """Records the type of each declaration."""

    def __init__(self) -> None:
        self.types: list[str] = []

    def declare(self, spec):
        self.types.append(spec.twist_type)

    def forget(self, robot):
        self.types.append("forgotten")


class Time:
    """A loop time that passes when the test advances it."""

    def __init__(self, loop) -> None:
        self.pauses: list[float] = []
        self._next = None
        loop.call_later = self._later

    def _later(self, pause, fn, *args):
        self.pauses.append(pause)
        handle = asyncio.Handle(fn, args, asyncio.get_running_loop())
        self._next = handle
        return handle

    async def passes(self):
        handle, self._next = self._next, None
        if handle is not None and not handle.cancelled():
            handle._run()
        await settle()


async def settle():
    for _ in range(5):
        await asyncio.sleep(0)


@pytest.fixture
def received(monkeypatch):
    """Run actions on a robot whose velocity topic rosapi does not know yet."""
    gate = Gate()
    monkeypatch.setattr(RobotMotion, "gate", gate)
    clock = SimpleNamespace(monotonic=lambda: 0.0)  # rosapi answers at once
    monkeypatch.setattr("webmap.poses.odometry.time", clock)

    def run(scenario):
        async def all_of_it():
            time, link, robot = Time(asyncio.get_running_loop()), Link(), Robot("Bob")
            robot.set_twist_topic(link, "/cmd_vel")
            await settle()
            await scenario(robot, link, time)
            robot.destroy()
            assert asyncio.all_tasks() == {asyncio.current_task()}

        asyncio.run(all_of_it())
        return gate.types

    return run


def test_a_velocity_type_found_later_is_declared_to_the_gate(received):
    async def scenario(robot, link, time):
        await time.passes()
        link.type = STAMPED
        await time.passes()
        assert robot.motion.spec().twist_type == STAMPED

    assert received(scenario)[:3] == ["geometry_msgs/Twist", STAMPED, "forgotten"]


def test_an_unknown_velocity_type_is_marked_as_assumed(received):
    async def scenario(robot, link, time):
        assert robot.motion.spec().twist_type_assumed
        link.type = "geometry_msgs/Twist"
        await time.passes()
        await time.passes()
        assert not robot.motion.spec().twist_type_assumed
        robot.unadvertise_twist_topic()
        robot.set_move_topic(link, "/goal")
        assert not robot.motion.spec().twist_type_assumed

    received(scenario)


def test_the_type_is_requested_often_at_first_and_then_rarely(received):
    async def scenario(robot, link, time):
        for _ in range(FEW + 3):
            await time.passes()
        assert time.pauses[: FEW + 1] == [*[SOON] * FEW, LATER]
        assert time.pauses[-1] == LATER

    received(scenario)


def test_a_slow_rosapi_is_asked_less_often(received, monkeypatch):
    async def scenario(robot, link, time):
        clock = SimpleNamespace(monotonic=iter([0.0, 5.0]).__next__)
        with monkeypatch.context() as patch:
            patch.setattr("webmap.poses.odometry.time", clock)
            await time.passes()
        assert time.pauses[-1] == 5.0 * SHARE

    received(scenario)


def test_a_known_type_is_not_requested_again(received):
    async def scenario(robot, link, time):
        link.type = STAMPED
        await time.passes()
        pauses = len(time.pauses)
        await time.passes()
        assert (link.asked, len(time.pauses)) == (2, pauses)

    received(scenario)


@pytest.mark.parametrize(
    "end",
    [
        lambda robot, link: robot.unadvertise_twist_topic(),
        lambda robot, link: robot.destroy(),
        lambda robot, link: robot.set_twist_topic(link, "/cmd_vel", type=STAMPED),
        lambda robot, link: setattr(link, "state", "connecting"),
    ],
)
def test_no_type_is_requested_for_a_removed_or_typed_topic_or_on_a_closed_link(
    received, end
):
    async def scenario(robot, link, time):
        end(robot, link)
        asked = link.asked
        await time.passes()
        await time.passes()
        assert link.asked == asked

    received(scenario)


def test_a_reopened_link_triggers_one_immediate_type_request(received):
    async def scenario(robot, link, time):
        link.state = "connecting"
        await time.passes()
        link.open()
        await settle()
        assert link.asked == 2
        await time.passes()
        assert link.asked == 3

    received(scenario)


def test_a_known_type_is_kept_while_the_base_is_away(received):
    async def scenario(robot, link, time):
        link.type = STAMPED
        await time.passes()
        link.type = None
        link.open()
        await settle()
        asked = link.asked
        await time.passes()
        assert robot.motion.spec().twist_type == STAMPED
        assert link.asked == asked

    received(scenario)


def test_a_late_type_answer_for_a_replaced_topic_is_ignored(received):
    async def scenario(robot, link, time):
        late = asyncio.get_running_loop().create_future()
        link.topic_type = lambda topic: late
        await time.passes()
        robot.set_twist_topic(link, "/other", type="geometry_msgs/Twist")
        late.set_result(STAMPED)
        await settle()
        assert robot.motion.spec().twist_type == "geometry_msgs/Twist"

    received(scenario)


def test_a_rosapi_that_starts_after_rosbridge_is_asked_for_the_type(monkeypatch):
    monkeypatch.setattr("webmap.poses.odometry.SOON", 0.05)

    async def scenario():
        quirks = parse_quirks("real", "ros2")
        schema = Schema(Dialect("ros2"))
        graph = Graph(schema)
        base = object()
        graph.subscribe(base, "/cmd_vel", lambda _: None, "geometry_msgs/TwistStamped")
        server = RosbridgeServer(graph, Encoder(schema, quirks))
        bridge = Bridge(await server.start("127.0.0.1", 0))
        answers, ask = [], bridge.topic_type

        async def topic_type(topic):
            answers.append(await ask(topic))
            return answers[-1]

        bridge.topic_type = topic_type
        robot = Robot("Bob")
        robot.set_twist_topic(bridge, "/cmd_vel")
        bridge.start(asyncio.get_running_loop())
        assert set(await until(lambda: answers)) == {None}
        Rosapi(graph, quirks).start()
        await until(lambda: robot.motion.spec().twist_type == STAMPED)
        robot.destroy()
        await bridge.stop()
        await server.stop()

    asyncio.run(scenario())
