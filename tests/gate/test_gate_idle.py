"""Robots that are not driven cause almost no work in the gate: the work is counted."""

import asyncio
import os

import pytest

from equipment.gate_harness import KEY, URL, Bench, spec
from webmap.base.geometry import Twist
from webmap.gate import actions, events, protocol
from webmap.gate.disk import Disk, Records, path_of
from webmap.gate.events import Key, LockState, Press, StopFileChanged
from webmap.gate.process import IDLE_STEP
from webmap.gate.rules import machines
from webmap.gate.rules.health import LinkHealth
from webmap.gate.rules.machine import Machine
from webmap.gate.rules.machines import Machines

MANY = 100
ANN, BEN = Press("Ann", "a1"), Press("Ben", "b1")
KEYS = [Key(f"ws://robot{number}:9090", "/cmd_vel") for number in range(MANY)]


def url(number):
    return f"ws://robot{number}:9090"


def fleet():
    """Return a bench with many robots, each with a bridge; only r1 is connected."""
    others = [
        spec(id=f"other{number}", bridge_url=url(number)) for number in range(MANY)
    ]
    bench = Bench().begin(spec(), *others)
    bench.run(1.0)
    return bench


@pytest.fixture
def work(awake, monkeypatch):
    """Count the checks of machines and links, and the reports."""
    counts = {"asked": 0, "links": 0, "reports": 0}

    def counting(name, do):
        def counted(*args):
            counts[name] += 1
            return do(*args)

        return counted

    # Without the fixture of ``conftest``, which also checks each machine.
    monkeypatch.setattr(Machines, "report", awake)
    active = counting("asked", Machine.active.fget)
    monkeypatch.setattr(Machine, "active", property(active))
    monkeypatch.setattr(Machine, "step", counting("asked", Machine.step))
    monkeypatch.setattr(LinkHealth, "stalled", counting("links", LinkHealth.stalled))
    monkeypatch.setattr(machines, "report", counting("reports", machines.report))
    return counts


def work_of(work, act):
    before = work.copy()
    act()
    return {name: work[name] - before[name] for name in work}


def test_no_machine_is_asked_while_nobody_drives(work):
    bench = fleet()
    done = work_of(work, lambda: bench.run(1.0, step=IDLE_STEP))
    assert not bench.gate.busy
    assert (done["asked"], done["reports"]) == (0, 0)
    assert done["links"] <= 2 * (MANY + 1)


def test_idle_robots_add_no_work_to_driving_another_robot(work):
    asked = []
    for bench in (Bench().begin(), fleet()):
        bench.drive_off()
        driven = work_of(work, lambda bench=bench: bench.hold(1.0, x=1.0))
        asked.append((driven["asked"], driven["reports"]))
    assert asked[0] == asked[1] > (0, 0)


@pytest.mark.parametrize(
    "event",
    [
        events.LinkUp(url(3), "control"),
        events.LinkUp(url(3), "tasks"),
        events.LinkDown(url(3), "control"),
        events.LinkDown(url(3), "tasks"),
        events.PingAnswered(url(3), 1000.0),
    ],
)
def test_an_event_of_one_bridge_concerns_no_machine_of_another(work, event):
    bench = fleet()
    done = work_of(work, lambda: bench.handle(event))
    assert done["asked"] <= 1
    assert done["reports"] <= 1


def test_a_page_that_comes_and_goes_concerns_only_the_machine_that_it_has(work):
    bench = fleet()
    bench.take("a")
    done = work_of(work, lambda: bench.join("c"))
    assert (done["asked"], done["reports"]) == (0, 0)
    done = work_of(work, lambda: bench.handle(protocol.Speeds("c", 0.1, 0.1)))
    assert (done["asked"], done["reports"]) == (0, 0)
    done = work_of(work, lambda: bench.handle(protocol.Disconnect("c")))
    assert (done["asked"], done["reports"]) == (0, 0)
    done = work_of(work, lambda: bench.handle(protocol.Disconnect("a")))
    assert (done["asked"], done["reports"]) == (1, 1)
    assert bench.state == "free"


def test_odometry_of_a_stopped_robot_makes_no_report_of_other_stopped_robots(work):
    names = [f"s{number}" for number in range(20)]
    bench = Bench().begin(
        *(
            spec(id=name, twist_topic=f"/{name}/cmd_vel", odometry_topic=f"/{name}")
            for name in names
        )
    )
    keys = [Key(URL, f"/{name}/cmd_vel") for name in names]
    bench.send("a", op="stop", robot="*")

    def measure(speed):
        for key in keys:
            bench.handle(events.OdometryReceived(key, Twist(speed, 0.0, 0.0)))

    measure(0.1)
    done = work_of(work, lambda: measure(0.2))
    assert done["reports"] == 0
    done = work_of(work, lambda: bench.run(0.2))
    assert done["reports"] <= 3 * len(names)
    assert [bench.report(name).measured[0] for name in names] == [0.2] * len(names)


def test_a_stopped_robot_is_reported_at_the_rate_of_its_numbers(work):
    bench = Bench().begin(spec(odometry_topic="/odom"))
    bench.send("a", op="stop", robot="r1")
    bench.run(3.0)

    def move():
        for number in range(100):
            bench.handle(events.OdometryReceived(KEY, Twist(0.1 + number / 100)))
            bench.run(0.01)

    done = work_of(work, move)
    assert 9 <= done["reports"] <= 11
    assert len({report.measured for report in bench.of(protocol.RobotReport)}) >= 10


def test_a_stopped_robot_whose_report_would_not_change_is_not_reported(work):
    bench = Bench().begin()
    bench.send("a", op="stop", robot="r1")
    bench.run(3.0)
    done = work_of(work, lambda: bench.run(1.0))
    assert 18 <= done["asked"] <= 22, "a step, and whether it is active, for each zero"
    assert done["reports"] == 0


def test_a_verdict_on_a_stop_is_reported_in_the_step_that_finds_it():
    bench = Bench().begin(spec(odometry_topic="/odom"))
    confirmation = bench.gate._machines.find("r1").active_stop.confirmation
    bench.send("a", op="stop", robot="r1")
    verdicts = set()
    for _ in range(300):
        bench.run(0.01)
        assert bench.report().stop.confirmed == confirmation.confirmed
        verdicts.add(confirmation.confirmed)
    assert verdicts == {None, False}, "no odometry was received"


def test_a_stalled_link_among_many_is_closed_after_a_second():
    bench = fleet()
    bench.handle(events.LinkUp(url(3), "control"))
    opened = bench.now
    bench.run(0.5)
    assert bench.report("other3").link == "up"
    for _ in range(200):
        bench.handle(events.PingAnswered(url(4), bench.now))
        bench.run(0.01)
        if bench.report("other3").link == "down":
            break
    assert 1.0 < bench.now - opened <= 1.0201
    assert bench.report("r1").link == "up"


def test_a_link_that_opens_later_is_closed_a_second_after_that():
    bench = Bench().begin(spec(), spec(id="other", bridge_url=url(1)))
    bench.run(10.0)
    bench.handle(events.LinkUp(url(1), "control"))
    opened = bench.now
    bench.run(0.99)
    assert bench.report("other").link == "up"
    bench.run(0.03)
    assert bench.now - opened <= 1.0201
    assert bench.report("other").link == "down"


def test_the_bridge_of_its_goals_concerns_a_machine_until_it_is_dropped():
    bench = Bench().begin(spec(goal_url=url(1)))
    bench.send("a", op="stop", robot="r1")
    assert bench.did(actions.CancelGoals) == []
    bench.handle(events.LinkUp(url(1), "tasks"))
    assert bench.did(actions.CancelGoals) != []
    bench.handle(protocol.Forget("r1"))
    bench.run(1.0)
    assert not any(bench.gate._machines._by_url.values())


# STOP files.


@pytest.fixture
def looked(monkeypatch):
    """Record the machines whose STOP file is checked."""
    keys, stamp_of = [], Records.stamp_of

    def noted(records, key):
        keys.append(key)
        return stamp_of(records, key)

    monkeypatch.setattr(Records, "stamp_of", noted)
    return keys


@pytest.fixture
def disk(tmp_path, looked):
    """Return the disk of a gate with many machines and no STOP."""
    disk = Disk(Records(tmp_path))
    for key in KEYS:
        disk.recall(LockState(key, held=True))
    looked.clear()
    return disk


def checked(disk):
    return asyncio.run(disk.check())


def test_without_stops_no_file_is_looked_at(disk, looked):
    assert checked(disk) == []
    assert looked == []


def test_only_the_files_that_have_changed_are_looked_at(disk, looked, tmp_path):
    Records(tmp_path).keep_latch(KEYS[3], ANN, frozenset())
    assert checked(disk) == [StopFileChanged(KEYS[3], ANN)]
    assert checked(disk) == []
    Records(tmp_path).keep_latch(KEYS[3], BEN, frozenset())
    assert checked(disk) == [StopFileChanged(KEYS[3], BEN)]
    assert looked == [KEYS[3]] * 2, "only those whose file has changed"
    path_of(tmp_path, KEYS[3], "stop").unlink()
    assert checked(disk) == [StopFileChanged(KEYS[3], None)]
    assert checked(disk) == []
    assert looked == [KEYS[3]] * 3


def test_a_stop_that_was_being_lifted_is_looked_at(disk, looked, tmp_path):
    path = path_of(tmp_path, KEYS[3], "stop")
    path.with_suffix(".stop.lifted").write_text('{"by": "Ann", "id": "a1"}')
    assert checked(disk) == [StopFileChanged(KEYS[3], ANN)]
    assert looked == [KEYS[3]]


def test_a_file_that_a_listing_misses_is_not_reported_as_removed(
    disk, tmp_path, monkeypatch
):
    Records(tmp_path).keep_latch(KEYS[3], ANN, frozenset())
    assert checked(disk) == [StopFileChanged(KEYS[3], ANN)]
    monkeypatch.setattr(os, "listdir", lambda _folder: [])
    assert checked(disk) == []


def test_every_file_is_looked_at_in_a_folder_that_cannot_be_listed(
    disk, looked, tmp_path, monkeypatch
):
    Records(tmp_path).keep_latch(KEYS[3], ANN, frozenset())

    def refuse(_folder):
        raise PermissionError("not listed")

    monkeypatch.setattr(os, "listdir", refuse)
    assert checked(disk) == [StopFileChanged(KEYS[3], ANN)]
    assert looked == KEYS
