"""Faults between an operator and a robot that has an agent."""

import json
import random
import signal
import time

import pytest
from safety_agent_bench import ROBOT, AgentBench
from safety_bench import pass_time, wait_for

from webmap.agents import address
from webmap.agents.peer import Peer, User
from webmap.testing import Shape

pytest.importorskip("zenoh")
pytestmark = [pytest.mark.safety, pytest.mark.serial]

PROMISED = 0.3
"""Seconds from the fault to the first zero at the robot (S1, S14)."""


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    with AgentBench(tmp_path_factory.mktemp("agents")) as bench:
        yield bench


def prove(bench, what, fail, within=PROMISED, *, program=False):
    """Drive, cause a fault, and measure the time to the first zero."""
    if program:
        bench.program_off()
    else:
        bench.drive_off()
    at = time.monotonic()
    fail()
    wait_for(
        lambda: bench.robot.log.first_zero(at) is not None, "a zero at the robot", 10
    )
    took = bench.robot.log.first_zero(at) - at
    pass_time(0.5)
    moved = [t.at for t in bench.robot.log.twists if t.at > at + took and not t.is_zero]
    assert not moved, "the robot moved again"
    print(f"{what}: the first zero came after {took * 1000:.0f} ms")
    assert took <= within, f"{what}: the first zero came after {took * 1000:.0f} ms"


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
    prove(bench, "letting go", lambda: bench.driver.order("x 0"), 0.15)


def test_stop_reaches_the_agent_and_stays(bench):
    prove(bench, "STOP", lambda: bench.driver.order("stop"), 0.15)
    wait_for(lambda: bench.driver.now.get("latched"), "a latched STOP")
    bench.driver.order("reset")
    wait_for(lambda: not bench.driver.now.get("latched"), "the reset")


def test_a_killed_display_stops_the_robot(bench):
    prove(bench, "the display is killed", bench.driver.popen.kill)
    renew_driver(bench)


def test_a_suspended_display_stops_the_robot_and_its_old_commands_move_nothing(bench):
    driver = bench.driver.popen
    prove(bench, "the display is stopped", lambda: driver.send_signal(signal.SIGSTOP))
    pass_time(1.0)
    driver.send_signal(signal.SIGCONT)
    back(bench)


@pytest.mark.parametrize("hop", ["display_hop", "agent_hop"])
def test_a_link_that_carries_nothing_stops_the_robot(bench, hop):
    proxy = getattr(bench, hop)
    prove(bench, f"the {hop} carries nothing", proxy.hold)
    pass_time(1.0)
    proxy.release()
    back(bench)


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
    prove(bench, "letting go", lambda: bench.driver.order("x 0"), 0.15)


@pytest.mark.parametrize("hop", ["display_hop", "agent_hop"])
def test_a_link_that_becomes_slow_stops_the_robot(bench, hop):
    proxy = getattr(bench, hop)
    slow = Shape(latency=0.4, bandwidth=50_000)
    prove(bench, f"the {hop} becomes slow", lambda: proxy.shape(slow))
    bench.driver.order("x 1")
    at = time.monotonic()
    pass_time(1.5)
    moved = [t for t in bench.robot.log.twists if t.at > at and not t.is_zero]
    assert not moved, "commands of a slow link moved the robot"
    bench.driver.order("x 0")
    proxy.shape(Shape())
    pass_time(1.0)
    back(bench)


def test_repeated_and_disordered_samples_of_a_display_move_nothing(bench):
    recorded = []
    other = Peer(f"zenoh://127.0.0.1:{bench.port}", User())
    try:
        other.start()
        key = address.gate_in("bay3", address.EVERY, address.EVERY)
        number = other.listen(key, lambda *sample: recorded.append(sample), gate=True)
        wait_for(lambda: other.connected, "the router")
        bench.drive_off()
        other.unlisten(number)
        prove(bench, "letting go", lambda: bench.driver.order("x 0"), 0.15)
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
    prove(bench, "letting go", lambda: bench.driver.order("x 0"), 0.15)


@pytest.mark.parametrize("hop", ["display_hop", "agent_hop"])
def test_a_link_that_is_reset_stops_the_robot(bench, hop):
    proxy = getattr(bench, hop)

    def fail():
        proxy.refuse()
        proxy.reset()

    prove(bench, f"the {hop} is reset", fail)
    proxy.refuse(False)
    back(bench)


def test_a_suspended_router_stops_the_robot(bench):
    router = bench.router.popen
    prove(bench, "the router is stopped", lambda: router.send_signal(signal.SIGSTOP))
    pass_time(1.0)
    router.send_signal(signal.SIGCONT)
    back(bench)


def test_a_killed_router_stops_the_robot_and_the_next_one_is_found(bench):
    prove(bench, "the router is killed", bench.router.popen.kill)
    bench.router.end()
    bench.start_router()
    back(bench)


def test_a_suspended_agent_stops_the_robot_by_its_gate(bench):
    agent = bench.agent.popen
    prove(bench, "the agent is stopped", lambda: agent.send_signal(signal.SIGSTOP))
    pass_time(0.5)
    agent.send_signal(signal.SIGCONT)
    back(bench)


def test_a_killed_agent_stops_the_robot_by_its_gate(bench):
    prove(bench, "the agent is killed", bench.agent.popen.kill)
    bench.agent.end()
    bench.start_agent()
    back(bench)


def test_a_stop_for_an_agent_that_is_away_is_the_first_it_gets_on_return(bench):
    bench.agent_hop.refuse()
    bench.agent_hop.reset()
    wait_for(lambda: bench.driver.now.get("link") == "down", "a lost agent")
    bench.driver.order("stop")
    pass_time(1.0)
    assert not bench.driver.now.get("latched"), "STOP is active without the agent"
    bench.agent_hop.refuse(False)
    wait_for(lambda: bench.driver.now.get("latched"), "the STOP", 20)
    bench.driver.order("reset")
    wait_for(lambda: not bench.driver.now.get("latched"), "the reset")


def test_two_displays_cannot_both_drive_and_the_loss_of_one_ends_only_its_own(bench):
    other = bench.new_driver("east")
    bench.drive_off()
    other.order("take")
    wait_for(lambda: other.refused, "a refusal")
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
    prove(bench, "no velocity", lambda: program.order("silent"), program=True)
    assert bench.driver.now["holder"]["connection"] == "program"


def test_a_zero_of_a_program_stops_an_agents_robot_at_once(bench, program):
    prove(bench, "zero", lambda: program.order("v 0"), 0.15, program=True)


def test_a_killed_display_with_a_program_stops_an_agents_robot(bench, program):
    prove(bench, "the display is killed", program.popen.kill, program=True)
    renew_driver(bench)
    wait_for(lambda: bench.driver.now.get("holder") is None, "a free robot")


def test_a_program_has_no_control_after_its_display_was_suspended(bench, program):
    popen = program.popen
    prove(
        bench,
        "the display is stopped",
        lambda: popen.send_signal(signal.SIGSTOP),
        program=True,
    )
    pass_time(1.0)
    popen.send_signal(signal.SIGCONT)
    back(bench)
    has_no_control(bench)
    bench.program_off()


@pytest.mark.parametrize("hop", ["display_hop", "agent_hop"])
def test_a_program_has_no_control_after_its_link_carried_nothing(bench, program, hop):
    proxy = getattr(bench, hop)
    prove(bench, f"the {hop} carries nothing", proxy.hold, program=True)
    pass_time(1.0)
    proxy.release()
    back(bench)
    has_no_control(bench)
    bench.program_off()


def test_stop_stops_the_robot_of_a_program_and_ends_its_control(bench, program):
    prove(bench, "STOP", lambda: program.order("stop"), 0.15, program=True)
    wait_for(lambda: program.now.get("latched"), "a latched STOP")
    program.order("reset")
    wait_for(lambda: not program.now.get("latched"), "the reset")
    has_no_control(bench)


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
