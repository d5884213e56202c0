"""Faults of the display and of the gate while an operator holds W."""

import signal

import pytest
from safety_bench import ROBOT_TIMEOUT, pass_time
from safety_run import LONG

from equipment.waiting import wait_for

pytestmark = [
    pytest.mark.safety,
    pytest.mark.browser,
    pytest.mark.serial,
]

PROMISED = 0.3
"""Seconds from the fault to the first zero at the robot (S1, S14)."""

BY_ITSELF = ROBOT_TIMEOUT + 0.05
"""Seconds until a robot stops without a zero: its command timeout and its braking."""


@pytest.mark.parametrize(
    ("name", "sig"), [("killed", signal.SIGKILL), ("ended (SIGTERM)", signal.SIGTERM)]
)
def test_a_killed_or_terminated_display_stops_the_robot(bench, name, sig):
    def back():
        bench.end_display()
        bench.start_display()
        # The old page still has a key down; afterwards the test opens a new page.
        bench.repeat_press()
        bench.linger(1.0)
        bench.close_page()
        bench.open_page()

    bench.prove(
        f"the display is {name}",
        lambda: bench.display.popen.send_signal(sig),
        within=PROMISED,
        back=back,
        new_link=True,  # the next gate sends the zeros if this one could not
    )


def test_a_suspended_display_stops_the_robot(bench):
    def send(sig):
        bench.display.popen.send_signal(sig)

    def back():
        bench.linger(1.5)
        send(signal.SIGCONT)

    bench.prove(
        "the display is stopped (SIGSTOP) for 2 s",
        lambda: send(signal.SIGSTOP),
        within=PROMISED,
        back=back,
        watch=1.5,
    )


@LONG
def test_user_code_that_holds_the_interpreter_stops_the_robot(bench):
    bench.prove(
        "user code holds the interpreter for 2 s",
        lambda: bench.robot.publish("/hold", {"data": bench.stretch(2.0, 0.6)}),
        within=PROMISED,
        back=lambda: bench.linger(3.0, 1.0),
        watch=1.0,
    )


def test_releasing_the_key_stops_the_robot_while_user_code_blocks(bench):
    def let_go_while_it_blocks():
        bench.let_go()

    def block():
        bench.robot.publish("/block", {"data": bench.stretch(2.0, 1.0)})
        bench.linger(0.8, 0.5)
        assert bench.steady(), "the robot does not move on while user code blocks"

    bench.prove(
        "user code blocks for 2 s, then the key is released",
        let_go_while_it_blocks,
        before=block,
        within=0.1,
        held_after=False,
        back=lambda: bench.linger(1.5, 0.8),
    )


def test_releasing_the_key_stops_the_robot_while_a_service_call_hangs(bench):
    def call():
        bench.robot.answers_services(False)
        bench.robot.publish("/call", {"data": 1.0})
        wait_for(lambda: bench.robot.log.of("call_service"), "the call")
        pass_time(0.5)
        assert bench.steady(), "the robot does not move on while a call hangs"

    def back():
        bench.robot.answers_services(True)
        bench.robot.unblock()

    bench.prove(
        "a service call hangs, then the key is released",
        bench.let_go,
        before=call,
        within=0.1,
        held_after=False,
        back=back,
    )


def test_the_command_timeout_stops_the_robot_when_the_gate_is_killed(bench):
    bench.prove(
        "the gate is killed",
        lambda: bench.gate.kill(),
        within=BY_ITSELF,
        back=bench.wait_for_gate,
        stops_by="itself",
        watch=1.5,
    )


def test_the_command_timeout_stops_the_robot_when_the_gate_is_suspended(bench):
    stopped = []

    def stop():
        stopped.append(bench.gate)
        stopped[-1].suspend()

    def back():
        bench.linger(1.0)
        stopped[-1].resume()

    bench.prove(
        "the gate is stopped (SIGSTOP) for 1.5 s",
        stop,
        within=BY_ITSELF,
        back=back,
        stops_by="itself",
        watch=1.5,
    )
