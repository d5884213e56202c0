"""The whole gate in the process of the test: decisions, links, disk and locks."""

import asyncio
import contextlib
import json

import pytest
from link_bench import in_loop, noting_bridge

from equipment.gate_harness import spec
from equipment.waiting import polls, until
from webmap.config.motion import StopHook
from webmap.gate import actions, commands, events, process, protocol
from webmap.gate.disk import UNKNOWN, Disk, Records, path_of
from webmap.gate.events import Key, Press
from webmap.gate.lanes.control import ControlLane
from webmap.gate.locks import Locks
from webmap.gate.process import Shell

pytestmark = pytest.mark.slow


class Running:
    """A running gate, its display, and a page that drives."""

    def __init__(self, folder):
        self.messages = []
        self.locks = Locks(folder)
        self.shell = Shell(self, self.locks, Disk(Records(folder)))
        self.x = None
        """The forward input; ``None`` sends no commands."""
        self._seq = 0

    def put(self, message):
        """Receive a message to the display."""
        self.messages.append(message)

    async def __aenter__(self):
        self.work = asyncio.create_task(self.shell.run())
        self._driver = asyncio.create_task(self._stream())
        self.shell.deliver(protocol.Connect("a", "Ann", "operator"))
        return self

    async def __aexit__(self, *_):
        self._driver.cancel()
        await self.end()

    async def end(self):
        """End the gate as the end of its pipe does."""
        if not self.work.done():
            self.shell.deliver(events.Shutdown("the display process has ended"))
        await self.work

    async def _stream(self):
        while True:
            await asyncio.sleep(0.05)
            self.shell.deliver(protocol.Heartbeat())
            report, tick = self.report(), self.tick
            if self.x is not None and report is not None and tick is not None:
                self._seq += 1
                self.send(
                    op="drive",
                    robot="r1",
                    epoch=report.epoch or 0,
                    seq=self._seq,
                    tick=tick,
                    x=self.x if report.armed else 0.0,
                    y=0.0,
                    turn=0.0,
                )

    def send(self, **command):
        text = json.dumps(command).encode()
        self.shell.deliver(protocol.FromPage("a", text))

    @property
    def tick(self):
        ticks = (
            m.tick for m in reversed(self.messages) if isinstance(m, protocol.Tick)
        )
        return next(ticks, None)

    def report(self):
        for message in reversed(self.messages):
            if isinstance(message, protocol.RobotReport):
                return message
        return None

    async def reported(self, check, what):
        await until(lambda: (r := self.report()) is not None and check(r), what)

    async def drive_off(self, bridge):
        """Drive; on a busy machine the gate may end control, so take it again then."""
        for _ in polls("motion", 30.0, 1.0):
            if any(speeds(bridge)):
                return
            await self.reported(lambda r: r.armable or r.holder, "a robot to drive")
            if self.report().holder is None:
                self.send(op="take", robot="r1")
            self.x = 1.0
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(1.0):
                    while not any(speeds(bridge)):
                        await asyncio.sleep(0.005)


def speeds(bridge):
    return [t.message["msg"]["linear"]["x"] for t in bridge.of("publish", "/cmd_vel")]


def robot(bridge, **more):
    return spec(bridge_url=bridge.url, stops_within=0.25, v_max=0.25, **more)


@contextlib.asynccontextmanager
async def driving(folder, **more):
    async with noting_bridge() as bridge, Running(folder) as gate:
        gate.shell.deliver(robot(bridge, **more))
        await gate.drive_off(bridge)
        yield bridge, gate


@in_loop
async def test_a_gate_without_its_display_stops_its_robots_and_ends(tmp_path):
    async with driving(tmp_path) as (bridge, gate):
        before = asyncio.get_running_loop().time()
        await gate.end()
        assert asyncio.get_running_loop().time() - before < process.DRAIN + 5.0
        assert not gate.shell.failed
        await until(lambda: speeds(bridge)[-1] == 0.0, "the zero")
        await until(lambda: not bridge.links, "the end of the links")


@in_loop
async def test_goals_are_cancelled_before_the_gate_ends(tmp_path, monkeypatch):
    monkeypatch.setattr(process, "DRAIN", 30.0)
    async with noting_bridge() as bridge, Running(tmp_path) as gate:
        gate.shell.deliver(
            robot(bridge, action="/go", cancel_topic=None, on_operator_loss="cancel")
        )
        await gate.reported(lambda r: r.armable, "a free robot")
        await until(lambda: bridge.of("advertise", "/goal"), "the link of goals")
        gate.send(op="take", robot="r1")
        await gate.reported(lambda r: r.holder is not None, "the lease")
        epoch, tick = gate.report().epoch, gate.tick
        goal = {"op": "goal", "robot": "r1", "epoch": epoch, "seq": 1, "tick": tick}
        gate.send(**goal, x=1.0, y=2.0, yaw=0.0)
        await until(lambda: bridge.of("send_action_goal"), "the goal")
        # The goal has used its socket; the cancel works with or without a new socket.
        await gate.end()
        assert [t.message["service"] for t in bridge.of("call_service")] == [
            "/go/_action/cancel_goal"
        ]


@in_loop
async def test_a_hanging_stop_hook_does_not_prevent_the_end_of_the_gate(tmp_path):
    hook = StopHook(service="/e_stop", type="std_srvs/Trigger")
    async with noting_bridge() as bridge, Running(tmp_path) as gate:
        bridge.answers_services = False
        gate.shell.deliver(robot(bridge, stop_hooks=(hook,)))
        await gate.reported(lambda r: r.armable, "a link")
        gate.send(op="stop", robot="r1")
        await until(lambda: bridge.of("call_service"), "the call")
        before = asyncio.get_running_loop().time()
        await gate.end()
        assert asyncio.get_running_loop().time() - before < process.DRAIN + 5.0
        bridge.unblock()


@pytest.mark.parametrize("where", ["handle", "step"])
@in_loop
async def test_a_failed_gate_sends_zero_and_ends(tmp_path, monkeypatch, caplog, where):
    async with driving(tmp_path) as (bridge, gate):

        def fail(*_):
            raise ArithmeticError("a slip")

        gate.x = None
        moves = len(speeds(bridge))
        monkeypatch.setattr(gate.shell._gate, where, fail)
        gate.shell.deliver(protocol.Heartbeat())
        await gate.work
        assert gate.shell.failed
        assert "every driven robot is stopped" in caplog.text
        assert "ArithmeticError: a slip" in caplog.text
        await until(lambda: speeds(bridge)[-1] == 0.0, "the zero")
        await until(lambda: not bridge.links, "the end of the links")
        assert 0.0 in speeds(bridge)[moves:]
        gate._driver.cancel()


@in_loop
async def test_an_error_while_sending_one_last_zero_does_not_prevent_the_others(
    tmp_path, monkeypatch, caplog
):
    """The link of the first machine fails; the second machine still gets its zero."""
    write, broken = ControlLane.write, []

    def break_on_the_first(lane, topic, twist, *until):
        if topic == "/cmd_vel":
            broken.append(topic)
            raise BufferError("a slip of the link's own")
        return write(lane, topic, twist, *until)

    async with driving(tmp_path) as (bridge, gate):
        gate.x = None
        gate.shell.deliver(robot(bridge, id="r2", twist_topic="/second"))
        await gate.reported(lambda r: r.robot == "r2" and r.armable, "the second")
        gate.send(op="take", robot="r2")
        await until(lambda: len(gate.shell._watched) == 2, "two watched machines")
        assert next(iter(gate.shell._links._watched)).topic == "/cmd_vel"
        before = len(bridge.of("publish", "/second"))
        monkeypatch.setattr(ControlLane, "write", break_on_the_first)
        monkeypatch.setattr(ControlLane, "write_zeros", lambda *_: 1 / 0)
        monkeypatch.setattr(gate.shell._gate, "handle", lambda *_: 1 / 0)
        gate.shell.deliver(protocol.Heartbeat())
        async with asyncio.timeout(5):
            await gate.work
        assert broken
        assert "zero not sent to all robots" in caplog.text
        zeros = await until(lambda: bridge.of("publish", "/second")[before:], "zero")
        assert zeros[0].message["msg"]["linear"]["x"] == 0.0


@in_loop
async def test_a_failed_gate_sends_only_zeros_while_the_page_continues_to_drive(
    tmp_path, monkeypatch
):
    """While the gate waits for a hook that hangs, page and display go on as before."""
    hook = StopHook(service="/e_stop", type="std_srvs/Trigger")
    async with driving(tmp_path, stop_hooks=(hook,)) as (bridge, gate):
        bridge.answers_services = False
        key = Key(bridge.url, "/cmd_vel")
        gate.shell._links.perform(actions.RunHook(key, "r1", hook, True, 1))
        await until(lambda: bridge.of("call_service"), "a call that hangs")
        with monkeypatch.context() as patch:
            patch.setattr(gate.shell._gate, "handle", lambda *_: 1 / 0)
            gate.shell.deliver(protocol.Heartbeat())
        assert gate.shell.failed
        before = len(speeds(bridge))
        await gate.work
        bridge.unblock()
        await until(lambda: not bridge.links, "the end of the links")
        late = speeds(bridge)[before:]
        assert late[late.index(0.0) :] == [0.0] * late.count(0.0)
        assert late.count(0.0) >= 2
        gate._driver.cancel()


@in_loop
async def test_a_stalled_link_is_cut_and_zero_is_sent_first_on_the_new_link(tmp_path):
    async with driving(tmp_path) as (bridge, gate):
        links = set(bridge.links)
        for link in links:
            bridge.transport_of(link).pause_reading()
        await gate.reported(lambda r: r.link == "down", "a link that is cut")
        for link in links & bridge.links:
            bridge.transport_of(link).resume_reading()

        def on_the_next():
            received = bridge.of("publish", "/cmd_vel")
            return [
                t.message["msg"]["linear"]["x"] for t in received if t.link not in links
            ]

        await until(on_the_next, "a velocity on another link")
        assert on_the_next()[0] == 0.0


@contextlib.asynccontextmanager
async def robot_of_another_gate(tmp_path, monkeypatch):
    """Run a gate and declare a robot whose lock another gate has."""
    monkeypatch.setattr(process, "LOCK_RETRY", 0.05)
    other = Locks(tmp_path)
    async with noting_bridge() as bridge, Running(tmp_path) as gate:
        key = Key(bridge.url, "/cmd_vel")
        assert other.acquire(key).held
        gate.shell.deliver(robot(bridge))
        yield gate, other, key


@in_loop
async def test_a_gate_retries_the_lock_of_a_robot_until_another_gate_releases_it(
    tmp_path, monkeypatch
):
    async with robot_of_another_gate(tmp_path, monkeypatch) as (gate, other, key):
        await gate.reported(
            lambda r: "another WebMap" in (r.reason or ""), "the reason"
        )
        assert not gate.report().armable
        other.release(key)
        await gate.reported(lambda r: r.armable, "a free robot")


@in_loop
async def test_removing_a_robot_ends_the_wait_for_its_lock(tmp_path, monkeypatch):
    async with robot_of_another_gate(tmp_path, monkeypatch) as (gate, other, key):
        await gate.reported(lambda r: not r.armable, "a robot that cannot be taken")
        gate.shell.deliver(protocol.Forget("r1"))
        gone = protocol.RobotGone("r1")
        await until(lambda: gone in gate.messages, "the end of the robot")
        assert gate.shell._waiting_for_lock == {}
        other.release(key)
        assert other.acquire(key).held, "the gate no longer waits for the lock"


@in_loop
async def test_removing_a_robot_releases_its_lock_for_another_gate(tmp_path):
    async with noting_bridge() as bridge, Running(tmp_path) as gate:
        key = Key(bridge.url, "/cmd_vel")
        gate.shell.deliver(robot(bridge))
        await gate.reported(lambda r: r.armable, "a free robot")
        assert not Locks(tmp_path).acquire(key).held
        gate.shell.deliver(protocol.Forget("r1"))
        await until(lambda: Locks(tmp_path).acquire(key).held, "the lock")


@in_loop
async def test_an_unreadable_stop_file_means_an_active_stop(tmp_path, caplog):
    async with noting_bridge() as bridge, Running(tmp_path) as gate:
        path = path_of(tmp_path, Key(bridge.url, "/cmd_vel"), "stop")
        path.write_bytes(b"\xff{")
        gate.shell.deliver(robot(bridge))
        await gate.reported(lambda r: r.latched, "the STOP")
        assert gate.report().stop.by == UNKNOWN
        assert "cannot be read" in caplog.text
        gate.shell.deliver(
            protocol.FromProgram(commands.Reset("r1", gate.report().stop.id))
        )
        await gate.reported(lambda r: r.armable, "a free robot")
        await until(lambda: not path.exists(), "no file")
        assert not any(speeds(bridge))


@in_loop
async def test_a_gate_follows_stops_of_another_gate_and_saves_its_own(tmp_path):
    async with driving(tmp_path) as (bridge, gate):
        key = Key(bridge.url, "/cmd_vel")
        Records(tmp_path).keep_latch(key, Press("Ben", "b1"), frozenset())
        await gate.reported(lambda r: r.latched and r.stop.by == "Ben", "the STOP")
        await until(lambda: speeds(bridge)[-1] == 0.0, "the zero")
        gate.x = None
        gate.shell.deliver(
            protocol.FromProgram(commands.Reset("r1", gate.report().stop.id))
        )
        await gate.reported(lambda r: not r.latched, "the reset")
        await until(lambda: Records(tmp_path).latch_of(key) is None, "no file")
        gate.send(op="stop", robot="r1")
        await until(lambda: Records(tmp_path).latch_of(key), "the file")
        assert Records(tmp_path).latch_of(key).by == "Ann"


@in_loop
async def test_all_spellings_of_this_computer_name_the_same_machine(tmp_path):
    async with driving(tmp_path) as (bridge, gate):
        url = bridge.url.replace("127.0.0.1", "localhost")
        assert url != bridge.url
        gate.shell.deliver(spec(id="r2", bridge_url=url))
        await gate.reported(lambda r: r.robot == "r2" and r.reason, "the reason")
        second = gate.report()
        gate.x = None
        gate.send(op="stop", robot="r2")
        await gate.reported(
            lambda r: r.robot == "r1" and r.latched and r.stop.by == "Ann", "its STOP"
        )
        assert not second.armable
        assert (
            second.reason == f"this WebMap already uses it as /cmd_vel of {bridge.url}"
        )


@in_loop
async def test_the_step_loop_of_a_failed_gate_ends_at_once(tmp_path):
    failed = Running(tmp_path).shell
    failed.failed = True
    async with asyncio.timeout(5):
        await failed._keep_stepping()
