"""Two gates on one computer: one has the machine, and a STOP to either gate counts."""

import asyncio
import os
import time

import pytest
from gate_page import Page

from equipment.gate_harness import KEY, URL, ZERO, Bench, spec
from equipment.waiting import wait_for
from webmap.config.motion import StopHook
from webmap.gate import actions
from webmap.gate.disk import Disk, Records
from webmap.gate.display.client import GateClient
from webmap.gate.events import Key, LockState, Press, StopFileChanged, StopSaved

ANN, BEN = Press("Ann", "a1"), Press("Ben", "b1")
IDS = frozenset({"a1", "b1"})


@pytest.fixture
def owner():
    """The gate that has the machine."""
    return Bench().begin()


@pytest.fixture
def onlooker():
    """A gate that does not have the machine."""
    bench = Bench().begin()
    why = "another WebMap on this computer uses this robot"
    bench.handle(LockState(KEY, held=False, why=why, elsewhere=True))
    return bench


class TestOwner:
    def test_the_owner_enforces_a_stop_of_the_other_gate(self, owner):
        owner.drive_off()
        at = owner.now
        owner.handle(StopFileChanged(KEY, ANN))
        assert owner.written[-1].twist == ZERO
        assert (owner.state, owner.report().holder) == ("stopped", None)
        assert owner.report().stop.by == "Ann"
        assert owner.refusals()[-1].why == "STOP by Ann"
        owner.hold(1.0, x=1.0)
        assert [w for w in owner.moving_since(at) if w.at > at] == []

    def test_the_owner_cancels_goals_and_runs_hooks_for_a_stop_of_the_other_gate(self):
        hook = StopHook(topic="/lock", type="std_msgs/Bool")
        bench = Bench().begin(spec(stop_hooks=(hook,)))
        bench.handle(StopFileChanged(KEY, ANN))
        assert bench.did(actions.CancelGoals)
        assert [hook.stopped for hook in bench.did(actions.RunHook)] == [True]

    def test_the_owner_stops_a_robot_without_a_velocity_topic(self):
        bench = Bench().begin(spec(twist_topic=None, cancel_topic=None))
        bench.handle(StopFileChanged(Key(URL, "goal /goal"), ANN))
        assert bench.state == "stopped"

    def test_the_owner_ignores_the_file_change_of_its_own_stop(self, owner):
        owner.send("a", op="stop", robot="r1")
        before = len(owner.done)
        owner.handle(StopFileChanged(KEY, owner.disk[KEY]))
        assert owner.done[before:] == []

    def test_the_owner_keeps_a_stop_whose_file_is_gone(self, owner):
        owner.send("a", op="stop", robot="r1")
        owner.disk.clear()
        owner.handle(StopFileChanged(KEY, None))
        assert owner.stops == {KEY: "A"}
        assert owner.state == "stopped"

    def test_the_owner_ignores_a_file_change_during_its_own_disk_write(self, owner):
        owner.send("a", op="stop", robot="r1")
        owner.slow_disk = True
        owner.send("a", op="reset", robot="r1")
        # The file was read before it was removed.
        owner.handle(StopFileChanged(KEY, owner.disk[KEY]))
        owner.run(0.1)
        assert not owner.report().latched

    def test_a_reset_that_leaves_a_stop_on_disk_is_refused_with_the_reason(self, owner):
        owner.send("a", op="stop", robot="r1")
        owner.send("a", op="reset", robot="r1")
        owner.handle(StopFileChanged(KEY, BEN))
        assert owner.report().stop.by == "Ben"
        refused = owner.refusals()[-1]
        assert (refused.connection, refused.what) == ("a", "reset")
        assert refused.why.startswith("Ben pressed STOP meanwhile; look at the robot")
        owner.full_disk = True
        owner.send("a", op="reset", robot="r1")
        owner.handle(StopFileChanged(KEY, BEN))
        assert owner.report().latched
        assert owner.refusals()[-1].why == "STOP stays active: the disk is full"

    def test_a_stop_after_a_completed_reset_refuses_no_reset(self, owner):
        owner.send("a", op="stop", robot="r1")
        owner.send("a", op="reset", robot="r1")
        owner.handle(StopFileChanged(KEY, None))
        before = len(owner.refusals())
        owner.handle(StopFileChanged(KEY, BEN))
        assert (owner.report().latched, len(owner.refusals())) == (True, before)

    def test_the_owner_ignores_the_stop_file_of_an_unknown_machine(self, owner):
        owner.handle(StopFileChanged(Key(URL, "/gone"), ANN))
        assert owner.state == "free"


class TestSecondGate:
    def test_the_other_gate_can_stop_the_robot_but_cannot_reset_the_stop(
        self, onlooker
    ):
        onlooker.send("a", op="stop", robot="r1")
        assert onlooker.stops == {KEY: "A"}
        assert onlooker.written[-1].twist == ZERO
        onlooker.send("a", op="reset", robot="r1")
        assert onlooker.refusals()[-1].why == (
            "another WebMap on this computer uses this robot: reset the STOP there"
        )
        assert onlooker.stops == {KEY: "A"}

    def test_the_other_gate_sends_no_zeros_after_a_reset_by_the_owner(self, onlooker):
        onlooker.send("a", op="stop", robot="r1")
        onlooker.run(1.0)
        onlooker.disk.clear()
        onlooker.handle(StopFileChanged(KEY, None))
        at = onlooker.now
        onlooker.run(1.0)
        assert onlooker.since(at) == []
        assert onlooker.stops == {}
        assert not onlooker.report().latched

    def test_the_other_gate_sends_nothing_for_a_stop_of_the_owner(self, onlooker):
        onlooker.handle(StopFileChanged(KEY, ANN))
        onlooker.run(0.2)
        assert onlooker.written == []

    def test_the_other_gate_shows_a_newer_stop_of_the_owner(self, onlooker):
        onlooker.send("a", op="stop", robot="r1")
        onlooker.run(1.0)
        onlooker.disk[KEY] = ANN
        onlooker.handle(StopFileChanged(KEY, ANN))
        assert onlooker.report().stop.by == "Ann"
        assert onlooker.stop_of() == ANN.id

    def test_the_other_gate_ignores_a_missing_file_during_its_own_disk_write(
        self, onlooker
    ):
        onlooker.slow_disk = True
        onlooker.send("a", op="stop", robot="r1")
        onlooker.handle(StopFileChanged(KEY, None))
        onlooker.keep(onlooker.did(actions.SaveStop)[-1])
        assert onlooker.report().latched

    def test_the_other_gate_keeps_its_stop_when_it_gets_the_lock(self, onlooker):
        onlooker.send("a", op="stop", robot="r1")
        onlooker.handle(LockState(KEY, held=True, latched=onlooker.disk[KEY]))
        assert onlooker.state == "stopped"
        onlooker.send("a", op="reset", robot="r1")
        onlooker.run(1.0)
        assert onlooker.state == "free"


def test_every_changed_stop_file_is_reported_once(tmp_path):
    async def scenario():
        mine, theirs = Disk(Records(tmp_path)), Records(tmp_path)
        mine.recall(LockState(KEY, held=True))
        assert await mine.check() == []
        theirs.keep_latch(KEY, ANN, IDS)
        # The STOP is recalled first; the change is still reported.
        assert mine.recall(LockState(KEY, held=False)).latched == ANN
        assert await mine.check() == [StopFileChanged(KEY, ANN)]
        assert await mine.check() == []
        theirs.keep_latch(KEY, BEN, IDS)
        assert await mine.check() == [StopFileChanged(KEY, BEN)]
        theirs.keep_latch(KEY, None, IDS)
        assert await mine.check() == [StopFileChanged(KEY, None)]
        mine.forget(KEY)
        theirs.keep_latch(KEY, ANN, IDS)
        assert await mine.check() == []

    asyncio.run(scenario())


def test_a_stop_of_another_gate_saved_during_a_reset_is_reported(tmp_path):
    async def scenario():
        theirs = Records(tmp_path)

        class Slow(Records):
            def keep_latch(self, key, press, ids):
                result = super().keep_latch(key, press, ids)
                theirs.keep_latch(key, BEN, ids)
                return result

        disk, received = Disk(Slow(tmp_path)), []
        disk.recall(LockState(KEY, held=True))
        disk.keep(actions.SaveStop(KEY, 1, None, IDS), received.append)
        await disk.settle()
        assert await disk.check() == [StopFileChanged(KEY, BEN)]
        assert received == [StopSaved(KEY, 1, None)]

    asyncio.run(scenario())


class Interleaved(Records):
    """Another gate stores a STOP at one moment of a store of this gate.

    Args:
        folder: The folder of both gates.
        monkeypatch: Intercepts the flush to the disk.
        flush: After how many flushes of this gate that is.

    """

    def __init__(self, folder, monkeypatch, flush):
        super().__init__(folder)
        real, left = os.fsync, [flush]

        def fsync(file):
            real(file)
            left[0] -= 1
            if left[0] == 0:
                assert Records(folder).keep_latch(KEY, BEN, frozenset({"b1"})) is None

        monkeypatch.setattr(os, "fsync", fsync)


@pytest.mark.parametrize("flush", [1, 2])
def test_two_gates_that_store_a_stop_at_once_agree_on_the_one_in_the_file(
    tmp_path, monkeypatch, flush
):
    async def scenario():
        disk, received = Disk(Interleaved(tmp_path, monkeypatch, flush)), []
        disk.recall(LockState(KEY, held=True))
        disk.keep(actions.SaveStop(KEY, 1, ANN, frozenset({"a1"})), received.append)
        await disk.settle()
        newest = Records(tmp_path).latch_of(KEY)
        assert newest == (ANN if flush == 1 else BEN)
        seen = await disk.check()
        assert received == [StopSaved(KEY, 1, None)]
        assert seen == ([] if newest == ANN else [StopFileChanged(KEY, BEN)])
        assert await disk.check() == []

    asyncio.run(scenario())


def test_a_stop_that_cannot_be_stored_is_not_reported_as_removed(tmp_path):
    async def scenario():
        (tmp_path / "state").write_text("a file")
        disk = Disk(Records(tmp_path / "state"))
        disk.recall(LockState(KEY, held=False))
        disk.keep(actions.SaveStop(KEY, 1, ANN, IDS), lambda event: None)
        await disk.settle()
        assert await disk.check() == []

    asyncio.run(scenario())


def test_an_own_stop_deleted_by_another_gate_before_a_check_is_reported(tmp_path):
    async def scenario():
        disk = Disk(Records(tmp_path))
        disk.recall(LockState(KEY, held=False))
        disk.keep(actions.SaveStop(KEY, 1, ANN, IDS), lambda event: None)
        await disk.settle()
        Records(tmp_path).keep_latch(KEY, None, IDS)
        assert await disk.check() == [StopFileChanged(KEY, None)]

    asyncio.run(scenario())


def test_a_stop_on_another_gate_stops_the_driven_robot(client, page, robot_spec, fake):
    page.drive_off(fake)
    second = GateClient()
    second.start()
    second.declare(robot_spec)
    other = Page(second, name="Ben")
    reason = "another WebMap on this computer uses this robot"
    wait_for(lambda: other.robot().get("reason") == reason, "the other's reason")
    other.send(op="stop", robot="r1")
    at = time.monotonic()
    wait_for(lambda: page.robot()["latched"], "a STOP here")
    assert page.robot()["stop"]["by"] == "Ben"
    wait_for(lambda: other.robot()["latched"], "a STOP there")
    assert all(moved < at + 1.0 for moved, _ in fake.moving)
    page.send(op="reset", robot="r1")
    wait_for(lambda: not page.robot()["latched"], "no STOP here")
    wait_for(lambda: not other.robot()["latched"], "no STOP there")
    other.end()
    second.stop()
