"""Faults between an operator and a robot that has an agent."""

import json
import os
import random
import signal
import time

import pytest
from safety_agent_bench import ROBOT, AgentBench
from safety_bench import pass_time
from safety_figures import Figure, note
from safety_run import TRIALS, Progress, is_measured

from equipment.waiting import wait_for
from webmap.agents import address
from webmap.agents.peer import Peer
from webmap.agents.router_access import RouterUser
from webmap.testing import Shape

pytest.importorskip("zenoh")
pytestmark = [pytest.mark.safety, pytest.mark.serial]

TRIALS_OF_EACH = TRIALS if "WEBMAP_SAFETY_FIGURES" in os.environ else 1

PROMISED = 0.3
"""Seconds from the fault to the first zero at the robot (S1, S14)."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    with AgentBench(tmp_path_factory.mktemp("agents")) as bench:
        yield bench


def prove(bench, what, fail, back=lambda: None, within=PROMISED, *, program=False):
    """Drive, cause a fault, measure the time to the first zero, and end the fault.

    A run with figures does this in each trial, a quick run once.
    """
    name = f"{'a program' if program else 'an operator'} of an agent's robot: {what}"
    if is_measured(name):
        pytest.skip("the resumed run already has this figure")
    took, late = [], []
    progress = Progress(name, TRIALS_OF_EACH)
    for _ in range(TRIALS_OF_EACH):
        if program:
            bench.program_off()
        else:
            bench.drive_off()
        at = time.monotonic()
        fail()
        wait_for(lambda at=at: bench.robot.log.first_zero(at) is not None, "a zero", 10)
        zero = bench.robot.log.first_zero(at)
        took.append(zero - at)
        late.append(bench.sentinel.stolen(at - 0.1, zero))
        progress.add(took[-1], late[-1])
        pass_time(0.5)
        moved = [t.at for t in bench.robot.log.twists if t.at > zero and not t.is_zero]
        assert not moved, "the robot moved again"
        back()
    worst = Figure(name, "zero", within, max(took), max(late), len(took))
    note(worst)
    assert worst.worst <= within, worst


def back(bench):
    """Wait until the robot can be driven again; check that it does not move."""
    since = time.monotonic()
    wait_for(lambda: bench.driver.now.get("link") == "up", "the agent", 30)
    pass_time(1.0)
    assert not [t for t in bench.robot.log.twists if t.at > since and not t.is_zero]


def renew_driver(bench):
    bench.driver.end()
    bench.driver = bench.new_driver("west")


def test_letting_go_stops_the_robot_through_the_router(bench):
    let_go(bench)


def let_go(bench):
    prove(bench, "the key is released", lambda: bench.driver.order("x 0"), within=0.15)


def let_go_once(bench):
    """Check that commands still reach the robot."""
    bench.drive_off()
    at = time.monotonic()
    bench.driver.order("x 0")
    wait_for(lambda: bench.robot.log.first_zero(at), "a zero")
    late = bench.robot.log.first_zero(at) - at
    assert late < 0.15 + bench.sentinel.stolen(at - 0.1), late


def reset(bench):
    """Press reset until the STOP ends: a lost command is not sent again."""

    def has_ended():
        bench.driver.order("reset")
        pass_time(0.5)
        return not bench.driver.now.get("latched")

    wait_for(lambda: bench.driver.now.get("latched"), "a latched STOP")
    wait_for(has_ended, "the reset")


def test_stop_reaches_the_agent_and_stays(bench):
    stop = lambda: bench.driver.order("stop")  # noqa: E731
    prove(bench, "STOP", stop, lambda: reset(bench), 0.15)


def test_a_killed_display_stops_the_robot(bench):
    kill = lambda: bench.driver.popen.kill()  # noqa: E731
    prove(bench, "the display is killed", kill, lambda: renew_driver(bench))


def test_a_suspended_display_stops_the_robot_and_its_old_commands_move_nothing(bench):
    what = "the display is stopped (SIGSTOP)"
    prove(bench, what, *suspension(bench, bench.driver.popen))


def suspension(bench, popen, seconds=1.0):
    """Return what stops a process by a signal, and what continues it."""

    def back_again():
        pass_time(seconds)
        popen.send_signal(signal.SIGCONT)
        back(bench)

    return lambda: popen.send_signal(signal.SIGSTOP), back_again


HOPS = {
    "display_hop": "the link between display and router",
    "agent_hop": "the link between router and agent",
}


@pytest.mark.parametrize("hop", ["display_hop", "agent_hop"])
def test_a_link_that_carries_nothing_stops_the_robot(bench, hop):
    proxy = getattr(bench, hop)

    def release():
        pass_time(1.0)
        proxy.release()
        back(bench)

    prove(bench, f"{HOPS[hop]} carries nothing", proxy.hold, release)


@pytest.mark.parametrize("number", range(3), ids=["first", "second", "third"])
@pytest.mark.parametrize("hop", ["display_hop", "agent_hop"])
def test_one_connection_that_stalls_does_not_stop_the_robot(bench, hop, number):
    proxy = getattr(bench, hop)
    assert proxy.links == 3, "two for the gate, one for data"
    bench.drive_off()
    at = time.monotonic()
    proxy.hold_link(number)
    pass_time(1.0)
    proxy.release_link(number)
    pass_time(0.5)
    assert bench.robot.log.first_zero(at) is None, "the robot was stopped"
    let_go_once(bench)


@pytest.mark.parametrize("hop", ["display_hop", "agent_hop"])
def test_a_link_that_becomes_slow_stops_the_robot(bench, hop):
    proxy = getattr(bench, hop)
    slow = Shape(latency=0.4, bandwidth=50_000)

    def hasten():
        bench.driver.order("x 1")
        at = time.monotonic()
        pass_time(1.5)
        moved = [t for t in bench.robot.log.twists if t.at > at and not t.is_zero]
        assert not moved, "commands of a slow link moved the robot"
        bench.driver.order("x 0")
        proxy.shape(Shape())
        pass_time(1.0)
        back(bench)

    what = f"{HOPS[hop]} becomes slow, 400 ms each way"
    prove(bench, what, lambda: proxy.shape(slow), hasten)


def test_repeated_and_disordered_samples_of_a_display_move_nothing(bench):
    recorded = []
    other = Peer(f"zenoh://127.0.0.1:{bench.port}", RouterUser())
    try:
        other.start()
        key = address.gate_in("bay3", address.EVERY, address.EVERY)
        number = other.listen(key, lambda *sample: recorded.append(sample), gate=True)
        wait_for(lambda: other.connected, "the router")
        bench.drive_off()
        other.unlisten(number)
        let_go_once(bench)
        wait_for(lambda: bench.driver.now.get("mine"), "control of the robot")
        at = time.monotonic()
        assert any(b'"drive"' in sample for _, sample in recorded)
        random.Random(1).shuffle(recorded)
        for where, sample in recorded:
            other.put_gate(where.rpartition("/")[0], sample)
            time.sleep(0.001)
        pass_time(1.0)
    finally:
        other.close()
    moved = [t for t in bench.robot.log.twists if t.at > at and not t.is_zero]
    assert not moved, "old samples moved the robot"
    let_go_once(bench)


@pytest.mark.parametrize("hop", ["display_hop", "agent_hop"])
def test_a_link_that_is_reset_stops_the_robot(bench, hop):
    proxy = getattr(bench, hop)

    def fail():
        proxy.refuse()
        proxy.reset()

    def accept():
        proxy.refuse(False)
        back(bench)

    prove(bench, f"{HOPS[hop]} is reset and refused", fail, accept)


def test_a_suspended_router_stops_the_robot(bench):
    what = "the router is stopped (SIGSTOP)"
    prove(bench, what, *suspension(bench, bench.router.popen))


def test_a_killed_router_stops_the_robot_and_the_next_one_is_found(bench):
    def start_again():
        bench.router.end()
        bench.start_router()
        back(bench)

    kill = lambda: bench.router.popen.kill()  # noqa: E731
    prove(bench, "the router is killed", kill, start_again)


def test_a_suspended_agent_stops_the_robot_by_its_gate(bench):
    what = "the agent is stopped (SIGSTOP)"
    prove(bench, what, *suspension(bench, bench.agent.popen, 0.5))


def test_a_killed_agent_stops_the_robot_by_its_gate(bench):
    def start_again():
        bench.agent.end()
        bench.start_agent()
        back(bench)

    kill = lambda: bench.agent.popen.kill()  # noqa: E731
    prove(bench, "the agent is killed", kill, start_again)


def test_a_stop_for_an_agent_that_is_away_is_the_first_it_gets_on_return(bench):
    bench.agent_hop.refuse()
    bench.agent_hop.reset()
    wait_for(lambda: bench.driver.now.get("link") == "down", "a lost agent")
    bench.driver.order("stop")
    pass_time(1.0)
    assert not bench.driver.now.get("latched"), "STOP is active without the agent"
    bench.agent_hop.refuse(False)
    wait_for(lambda: bench.driver.now.get("latched"), "the STOP", 20)
    reset(bench)


def test_two_displays_cannot_both_drive_and_the_loss_of_one_ends_only_its_own(bench):
    other = bench.new_driver("east")
    bench.drive_off()

    def is_refused():
        other.order("take")  # again: a command on a busy network may be lost
        pass_time(0.5)
        return other.refused

    wait_for(is_refused, "a refusal")
    assert "has control" in json.dumps(other.refused[-1])
    assert other.now["holder"]["name"] == "Ann"
    assert not other.now["mine"]
    other.popen.kill()
    pass_time(1.0)
    assert bench.robot.velocity.vx > 0.1, "the other display's loss stopped the robot"
    assert bench.driver.now["mine"]
    bench.driver.order("x 0")
    assert bench.driver.now["robot"] == ROBOT


# A program on a display drives the robot of an agent.


@pytest.fixture
def program(bench):
    """A driver whose program can take control; it has no control afterwards."""
    bench.driver.order("x 0")
    renew_driver(bench)  # its operator loses control
    yield bench.driver
    renew_driver(bench)


def has_no_control(bench):
    """Wait until the program gets the error that it does not have control."""
    wait_for(lambda: bench.driver.lost, "a program without control")
    assert "does not have control" in bench.driver.lost[-1]["why"]


def test_a_program_that_stops_sending_stops_an_agents_robot(bench, program):
    what = "the program sends no more"
    prove(bench, what, lambda: program.order("silent"), program=True)
    assert bench.driver.now["holder"]["connection"] == "program"


def test_a_zero_of_a_program_stops_an_agents_robot_at_once(bench, program):
    zero = lambda: program.order("v 0")  # noqa: E731
    prove(bench, "the program sends zero", zero, within=0.15, program=True)


def test_a_killed_display_with_a_program_stops_an_agents_robot(bench, program):
    def start_again():
        renew_driver(bench)
        wait_for(lambda: bench.driver.now.get("holder") is None, "a free robot")

    kill = lambda: bench.driver.popen.kill()  # noqa: E731
    prove(bench, "the display is killed", kill, start_again, program=True)


def test_a_program_has_no_control_after_its_display_was_suspended(bench, program):
    fail, back_again = suspension(bench, program.popen)

    def check():
        back_again()
        has_no_control(bench)

    prove(bench, "the display is stopped (SIGSTOP)", fail, check, program=True)
    bench.program_off()


@pytest.mark.parametrize("hop", ["display_hop", "agent_hop"])
def test_a_program_has_no_control_after_its_link_carried_nothing(bench, program, hop):
    proxy = getattr(bench, hop)

    def release():
        pass_time(1.0)
        proxy.release()
        back(bench)
        has_no_control(bench)

    prove(bench, f"{HOPS[hop]} carries nothing", proxy.hold, release, program=True)
    bench.program_off()


def test_stop_stops_the_robot_of_a_program_and_ends_its_control(bench, program):
    def check():
        reset(bench)
        has_no_control(bench)

    stop = lambda: program.order("stop")  # noqa: E731
    prove(bench, "STOP", stop, check, 0.15, program=True)


def test_a_program_takes_no_robot_from_that_of_another_display(bench, program):
    other = bench.new_driver("east")
    bench.program_off()
    why = other.acquire()["why"]
    assert "program of" in why
    assert "has control" in why
    other.popen.kill()
    pass_time(1.5)
    assert bench.robot.velocity.vx > 0.1, "the other display's loss stopped the robot"


def test_an_operator_takes_an_agents_robot_from_a_program(bench, program):
    other = bench.new_driver("east")
    bench.program_off()
    other.order("take")
    wait_for(lambda: other.now.get("mine"), "control of the robot")
    has_no_control(bench)
    other.end()
