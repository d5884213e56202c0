"""Random schedules of users, links, disks and the display, with fixed seeds.

The decisions of the gate in each schedule are recorded (see ``decisions.py``): random
schedules have sequences of events that the other tests do not have.
"""

import random

import pytest
from machine_bench import PacedBench

from equipment.gate_harness import KEY, spec
from webmap.base.geometry import Twist
from webmap.gate import commands, events, protocol
from webmap.gate.events import Press

PEOPLE = ("a", "b")

SCHEDULES = 24
STEPS = 40


def lose(bench, chance):
    match chance.choice(["links", "display", "bridge", "page", "disk"]):
        case "links":
            bench.break_links()
        case "display":
            bench.beating = False
        case "bridge":
            bench.answering = False
        case "page":
            bench.handle(protocol.Disconnect(chance.choice(PEOPLE)))
        case "disk":
            bench.full_disk = not bench.full_disk
    bench.run(chance.choice([0.1, 0.4]))


def mend(bench, chance):
    bench.beating = bench.answering = True
    bench.connect_links()
    for who in PEOPLE:
        bench.handle(protocol.Disconnect(who))
        bench.join(who)
    bench.run(0.2)


def hold(bench, chance):
    who, x = chance.choice(PEOPLE), chance.choice([0.0, 0.0, 0.5, 1.0, -1.0, 3.0])
    turn = chance.choice([0.0, 1.0])
    bench.run(chance.choice([0.1, 0.3, 0.6]), lambda: bench.drive(who, x=x, turn=turn))


def drive_off(bench, chance):
    bench.drive_off(chance.choice(PEOPLE), x=chance.choice([0.5, 1.0]))


def send_command(bench, chance):
    op = chance.choice(["take", "release", "ask", "grant", "deny", "cancel"])
    bench.send(chance.choice(PEOPLE), op=op, robot="r1")


def stop(bench, chance):
    bench.send(chance.choice(PEOPLE), op="stop", robot=chance.choice(["r1", "*"]))


def reset(bench, chance):
    bench.send(chance.choice(PEOPLE), op="reset", robot="r1")


def stop_elsewhere(bench, chance):
    bench.disk[KEY] = Press("Ann", f"other-{chance.randrange(1000)}")
    bench.handle(events.StopFileChanged(KEY, bench.disk[KEY]))


def goal(bench, chance):
    bench.goal(chance.choice(PEOPLE), x=chance.choice([1.0, 2.0]))


def odometry(bench, chance):
    seen = events.OdometryReceived(KEY, Twist(chance.choice([0.0, 0.02, 0.3, 1.0])))
    bench.run(chance.choice([0.3, 1.2]), lambda: bench.handle(seen))


def echo(bench, chance):
    bench.handle(events.EchoReceived(KEY, Twist(chance.choice([0.0, 0.5]))))


def speeds(bench, chance):
    v = chance.choice([0.2, 0.8, 9.0])
    bench.handle(protocol.Speeds(chance.choice(PEOPLE), v, v))


def program(bench, chance):
    bench.handle(protocol.FromProgram(commands.Take("r1"), chance.randrange(1000)))
    epoch = bench.report().epoch or 0
    bench.handle(
        protocol.FromProgram(
            commands.SetVelocity("r1", epoch, bench.tick, (0.4, 0.0, 0.0))
        )
    )


def declare(bench, chance):
    odometry = chance.choice([None, "/odom"])
    bench.handle(spec(v_max=chance.choice([0.4, 1.0]), odometry_topic=odometry))


def wait(bench, chance):
    bench.run(chance.choice([0.01, 0.2, 1.0, 3.0]))


EVENTS = (
    lose,
    mend,
    *(hold, drive_off, send_command, odometry) * 3,
    stop,
    *(reset,) * 2,
    stop_elsewhere,
    goal,
    echo,
    speeds,
    program,
    declare,
    wait,
)


@pytest.mark.parametrize("number", range(SCHEDULES))
def test_a_schedule_never_writes_motion_while_stop_is_in_force(number):
    chance = random.Random(number)
    bench = PacedBench()
    bench.begin(spec(odometry_topic="/odom"))
    for _ in range(STEPS):
        before = len(bench.written)
        is_stopped = bench.report().state == "stopped"
        event = chance.choice(EVENTS)
        event(bench, chance)
        if is_stopped and event is not reset and bench.report().state == "stopped":
            assert all(w.twist.is_zero for w in bench.written[before:])
