"""Robots with an active STOP cause little work in the gate: the work is counted."""

import asyncio
import itertools
import json

import pytest
from link_bench import in_loop, noting_bridge

from equipment.gate_harness import KEY, URL, ZERO, Bench, spec
from equipment.waiting import until
from webmap.base.geometry import Twist
from webmap.gate import actions, commands, events, protocol
from webmap.gate.events import Key
from webmap.gate.lanes import control, links, odometry, rosbridge
from webmap.gate.lanes.sockets import Socket
from webmap.gate.rules import machines
from webmap.gate.rules.machine import Machine

MANY, SLICE = 30, 20
"""The robots of a large fleet, and of how many the zeros are written in one step; the
gate itself takes ten times as many."""

STILL = events.OdometryReceived(KEY, ZERO)


def key(number):
    return Key(URL, f"/s{number}/cmd_vel")


def stopped_fleet(robots=MANY):
    """Return a bench with stopped robots, and r1, of which the STOP was reset."""
    others = [spec(id=f"s{n}", twist_topic=key(n).topic) for n in range(robots)]
    bench = Bench().begin(spec(), *others)
    bench.send("a", op="stop", robot="*")
    bench.run(0.02)
    bench.send("a", op="reset", robot="r1")
    bench.run(3.0)
    return bench


@pytest.fixture(autouse=True)
def small_slices(monkeypatch):
    monkeypatch.setattr(machines, "SLICE", SLICE)


@pytest.fixture
def steps(monkeypatch):
    """Record the keys of the machines that are stepped."""
    keys, step = [], Machine.step

    def noted(machine, now):
        keys.append(machine.key)
        step(machine, now)

    monkeypatch.setattr(Machine, "step", noted)
    return keys


# The rules.


def test_a_stopped_robot_steps_for_its_zeros_ten_times_a_second(steps):
    bench = stopped_fleet(1)
    steps.clear()
    begun = bench.now
    bench.run(1.0)
    assert 9 <= steps.count(key(0)) <= 11
    zeros = [write.at for write in bench.since(begun) if write.key == key(0)]
    assert 9 <= len(zeros) <= 11
    assert max(b - a for a, b in itertools.pairwise(zeros)) < 0.111


def test_commands_for_a_stopped_robot_delay_neither_its_zeros_nor_its_steps(steps):
    bench = stopped_fleet(1)
    for up in (True, False):
        if not up:
            bench.break_links()
        steps.clear()
        begun = bench.now
        for _ in range(100):
            bench.send("a", op="release", robot="s0")
            bench.run(0.01)
        assert 9 <= steps.count(key(0)) <= 11
        zeros = [write.at for write in bench.since(begun) if write.key == key(0)]
        assert 9 <= len(zeros) <= 11 if up else not zeros


def test_the_zeros_of_many_stopped_robots_are_spread_and_delay_no_driven_one(steps):
    bench = stopped_fleet()
    bench.drive_off()
    begun, most = bench.now, 0

    def drive():
        bench.drive(x=1.0)

    for _ in range(20):
        drive()
        for _ in range(5):
            steps.clear()
            bench.run(0.01)
            assert steps[0] == KEY, "the driven robot first"
            most = max(most, len(steps))
    assert most <= 1 + SLICE
    assert {write.twist for write in bench.since(begun) if write.key == KEY} == {
        Twist(1.0)
    }
    for number in range(MANY):
        zeros = [write for write in bench.since(begun) if write.key == key(number)]
        assert 9 <= len(zeros) <= 11


def test_of_many_late_zeros_the_latest_are_written_first():
    bench = stopped_fleet()
    bench.now += 0.2  # the gate was suspended
    written = []
    for _ in range(3):
        begun = bench.now
        bench.run(0.01)
        written += [write.key for write in bench.since(begun)]
    assert len(set(written)) == MANY


def test_stop_all_writes_the_zero_of_each_robot_before_anything_else():
    others = [spec(id=f"s{n}", twist_topic=key(n).topic) for n in range(3)]
    bench = Bench().begin(spec(), *others)
    bench.drive_off()
    at = len(bench.done)
    bench.send("a", op="stop", robot="*")
    first = [
        action
        for action in bench.done[at:]
        if not isinstance(action, actions.SendToDisplay)
    ]
    assert {action.key for action in first[:4]} == {KEY, *map(key, range(3))}
    assert all(isinstance(action, actions.WriteTwist) for action in first[:4])
    assert not any(isinstance(action, actions.WriteTwist) for action in first[4:])


def test_stop_all_of_very_many_robots_makes_few_reports_before_their_zeros():
    others = [spec(id=f"s{n}", twist_topic=key(n).topic) for n in range(MANY)]
    bench = Bench().begin(spec(), *others)
    bench.messages.clear()
    stop = commands.Stop(None)
    todo = bench.gate.handle(protocol.FromProgram(stop), bench.now)
    made = [each for each in todo if isinstance(each, actions.SendToDisplay)]
    assert len(made) == SLICE
    bench._do(todo)
    bench.run(0.1)
    assert all(bench.report(f"s{n}").latched for n in range(MANY))


def test_a_stopped_robot_is_reported_beside_many_robots_in_control(monkeypatch):
    monkeypatch.setattr(machines, "SLICE", 1)
    others = [spec(id=f"s{n}", twist_topic=key(n).topic) for n in range(10)]
    bench = Bench().begin(spec(odometry_topic="/odom"), *others)
    for number in range(10):
        take = commands.Take(f"s{number}")
        bench.handle(protocol.FromProgram(take, request=number))
    assert all(bench.report(f"s{number}").holder for number in range(10))
    bench.send("a", op="stop", robot="r1")
    bench.run(2.5)
    assert bench.report().stop.confirmed is False


def test_the_second_zeros_of_stop_all_are_spread_too(steps):
    others = [spec(id=f"s{n}", twist_topic=key(n).topic) for n in range(MANY)]
    bench = Bench().begin(spec(), *others)
    bench.send("a", op="stop", robot="*")
    bench.now += 0.08  # the gate needed this time for the first ones
    steps.clear()
    bench.run(0.01)
    assert len(steps) <= SLICE


def test_the_zeros_of_any_number_of_stopped_robots_come_in_time(monkeypatch):
    monkeypatch.setattr(machines, "SLICE", 1)
    bench = stopped_fleet(40)
    begun = bench.now
    bench.run(1.0)
    for number in range(40):
        zeros = [w.at for w in bench.since(begun) if w.key == key(number)]
        assert 9 <= len(zeros) <= 11


def test_motion_of_a_stopped_robot_ends_the_confirmation_at_once():
    bench = Bench().begin(spec(odometry_topic="/odom"))
    bench.send("a", op="stop", robot="r1")
    for _ in range(250):
        bench.handle(STILL)
        bench.run(0.01)
    assert bench.report().stop.confirmed
    bench.handle(events.OdometryReceived(KEY, Twist(0.5)))
    assert bench.report().stop.confirmed is False


def test_numbers_of_very_many_stopped_robots_are_reported_less_often(monkeypatch):
    bench = stopped_fleet(10)
    counts = []
    for most in (machines.REPORTS, 20):
        monkeypatch.setattr(machines, "REPORTS", most)
        bench.run(1.0)
        bench.messages.clear()
        for each in range(100):
            for number in range(10):
                speed = Twist(0.1 + each / 100)
                bench.handle(events.OdometryReceived(key(number), speed))
            bench.run(0.01)
        counts.append(len(bench.of(protocol.RobotReport)))
    assert 90 <= counts[0] <= 110
    assert 10 <= counts[1] <= 30


def test_links_of_a_stopped_robot_are_pinged_at_once_and_then_seldom():
    bench = Bench().begin()

    def paces():
        kinds = (actions.Watch, actions.PingOften)
        found = [(type(a), a.on) for a in bench.done if isinstance(a, kinds)]
        bench.done.clear()
        return found

    paces()
    once = [(actions.PingOften, True), (actions.PingOften, False)]
    bench.send("a", op="stop", robot="r1")
    assert paces() == [(actions.Watch, True), (actions.PingOften, False)]
    bench.run(3.0)
    assert paces() == []
    bench.send("a", op="stop", robot="r1")
    assert paces() == once, "each STOP has a ping of its own"
    bench.send("a", op="reset", robot="r1")
    bench.take("a")
    bench.run(1.0)
    assert paces()[-1] in ((actions.Watch, True), (actions.PingOften, True))
    bench.send("b", op="stop", robot="r1")
    assert paces()[-1] == (actions.PingOften, False)


# The links.


@in_loop
async def test_the_zeros_of_one_bridge_are_written_in_one_piece(monkeypatch):
    pieces, write = [], Socket._flush

    def noted(socket, *args):
        pieces.append(socket)
        return write(socket, *args)

    happened = []
    async with noting_bridge() as bridge:
        lanes = links.Links(happened.append)
        keys = [Key(bridge.url, f"/s{n}/cmd_vel") for n in range(20)]
        for number, each in enumerate(keys):
            robot = spec(id=f"s{number}", bridge_url=bridge.url, twist_topic=each.topic)
            lanes.perform(actions.Attach(each, robot))
        up = events.LinkUp(bridge.url, "control")
        await until(lambda: up in happened, "the link")
        monkeypatch.setattr(Socket, "_flush", noted)
        elsewhere = [Key(bridge.url, "/unknown"), Key("ws://127.0.0.1:1", "/s")]
        zeros = [actions.WriteTwist(k, ZERO, None, None) for k in keys + elsewhere]
        results = lanes.write_zeros(zeros)
        assert len(pieces) == 1
        assert [result.key for result in results] == keys + elsewhere
        assert [result.done for result in results] == [True] * 20 + [False] * 2
        await until(lambda: len(bridge.of("publish")) == 20, "the zeros")
        monkeypatch.undo()
        lanes.close()
        await lanes.settle()


@in_loop
async def test_a_resting_robot_is_pinged_at_the_rate_of_an_idle_one():
    happened = []
    async with noting_bridge() as bridge:
        lanes = links.Links(happened.append)
        robot = spec(bridge_url=bridge.url, odometry_topic="/odom")
        machine = Key(bridge.url, "/cmd_vel")
        lanes.perform(actions.Attach(machine, robot))
        lanes.perform(actions.Watch(machine, True))

        def periods():
            return (
                lanes._control[bridge.url].lane.ping_period,
                lanes._odometry[bridge.url].lane.ping_period,
            )

        busy = (control.BUSY_PING, odometry.BUSY_PING)
        assert periods() == busy
        lanes.perform(actions.PingOften(machine, False))
        assert periods() == (control.IDLE_PING, odometry.Lane.PING)
        lanes.perform(actions.PingOften(machine, True))
        assert periods() == busy
        lanes.perform(actions.PingOften(machine, False))
        lanes.perform(actions.Watch(machine, False))
        goals_only = Key(bridge.url, "")
        lanes.perform(actions.Attach(goals_only, spec(twist_topic=None, id="r2")))
        lanes.perform(actions.Watch(goals_only, True))
        lanes.perform(actions.PingOften(goals_only, False))
        assert periods() == (control.IDLE_PING, odometry.Lane.PING)
        lanes.close()
        await lanes.settle()


def test_the_zero_of_a_topic_and_its_echo_are_encoded_and_decoded_once(monkeypatch):
    count = {"encode": 0, "decode": 0}
    encode, decode = rosbridge.ops.publish, rosbridge._decode_frame

    def encoded(*args):
        count["encode"] += 1
        return encode(*args)

    def decoded(data):
        count["decode"] += 1
        return decode(data)

    monkeypatch.setattr(rosbridge.ops, "publish", encoded)
    monkeypatch.setattr(rosbridge, "_decode_frame", decoded)
    for _ in range(10):
        zero = rosbridge.velocity("/once/cmd_vel", "geometry_msgs/Twist", ZERO)
        assert rosbridge.parse_echo(zero).twist == ZERO
    assert count == {"encode": 1, "decode": 1}
    assert json.loads(zero)["msg"] == ZERO.to_message()
    long = json.dumps({"op": "publish", "topic": "/t", "id": "x" * rosbridge.SHORT})
    for _ in range(3):
        assert rosbridge.parse_echo(long.encode()).topic == "/t"
    assert count["decode"] == 4, "long messages are not kept"


@in_loop
async def test_the_topics_of_a_link_count_for_what_its_bridge_may_send():
    happened = []
    lanes = links.Links(happened.append)
    for number in range(3):
        robot = spec(
            id=f"s{number}",
            bridge_url="ws://127.0.0.1:1",
            twist_topic=f"/s{number}/cmd_vel",
            odometry_topic=f"/s{number}/odom",
        )
        machine = Key(robot.bridge_url, robot.base.topic)
        lanes.perform(actions.Attach(machine, robot))
        lanes.perform(actions.Watch(machine, True))
    assert lanes._control["ws://127.0.0.1:1"].lane.budget.topics == 3
    assert lanes._odometry["ws://127.0.0.1:1"].lane.budget.topics == 3
    lanes.close()
    await asyncio.sleep(0)
