"""A gate process of a display: messages to the process, from the process, and its end.

The processes here are not gates but programs that behave like a faulty gate.
"""

import sys
import threading

import pytest

from equipment.waiting import wait_for
from webmap.gate import pipe
from webmap.gate.display import supervisor as supervisor_module
from webmap.gate.display.supervisor import GateProcess
from webmap.gate.protocol import Ready, RefusedCount, Tick


class Watched:
    """A process, and its messages."""

    def __init__(self, *command):
        self.on_echo = []
        self.ends = []
        self.may_go_on = threading.Event()
        self.may_go_on.set()
        self.child = GateProcess(self._receive, self._ended, command)
        self.child.start()

    def _receive(self, child, message):
        self.may_go_on.wait(60)
        self.on_echo.append(message)

    def _ended(self, child):
        self.ends.append(child)


@pytest.fixture
def run():
    """Start a program as a gate; it ends with the test."""
    started = []

    def start(*command):
        started.append(Watched(*command))
        return started[-1]

    yield start
    for each in started:
        each.may_go_on.set()
        each.child.stop(0.0)


def shell(script):
    return ("/bin/sh", "-c", script)


ENDLESS = ("/bin/sleep", "600")


def test_messages_are_sent_and_received_complete_and_in_order(run):
    mirror = run("/bin/cat")
    mirror.child.send(Ready(1), Ready(2))
    mirror.child.send(Tick(3, {}))
    wait_for(lambda: len(mirror.on_echo) == 3, "all messages")
    assert mirror.on_echo == [Ready(1), Ready(2), Tick(3, {})]
    assert mirror.child.pid > 0


def test_a_stopped_process_ends_and_gets_no_more_messages(run):
    mirror = run("/bin/cat")
    mirror.child.stop(30.0)
    assert mirror.ends == [mirror.child]
    assert mirror.child.end_reason == "exit code 0, no message"
    mirror.child.send(Ready(1))
    assert mirror.on_echo == []


def test_the_last_line_of_stderr_is_the_end_reason_and_all_lines_are_passed_on(
    run, capfd
):
    gate = run(*shell("echo first >&2; echo 'no such module' >&2; echo >&2; exit 3"))
    wait_for(lambda: gate.ends, "its end")
    gate.child.stop(30.0)
    assert gate.child.end_reason == "no such module"
    assert capfd.readouterr().err == "first\nno such module\n\n"


def test_control_characters_in_stderr_are_escaped(run, capfd):
    gate = run(*shell(r"printf 'ValueError: \033[2J\r\302\233 \377\n' >&2; exit 3"))
    wait_for(lambda: gate.ends, "its end")
    gate.child.stop(30.0)
    assert gate.child.end_reason == r"ValueError: \x1b[2J\r\x9b �"
    assert capfd.readouterr().err == "ValueError: \\x1b[2J\\r\\x9b �\n"


def test_the_end_reason_of_a_killed_process_names_the_signal(run):
    gate = run(*shell("kill -9 $$"))
    wait_for(lambda: gate.ends, "its end")
    gate.child.stop(30.0)
    assert gate.child.end_reason == "ended by SIGKILL"


def test_a_process_that_does_not_end_in_time_is_killed(run, caplog):
    gate = run(*ENDLESS)
    gate.child.stop(0.05)
    assert gate.child.end_reason == "ended by SIGKILL"
    assert "it has not ended within 0.05 s" in caplog.text


def test_a_process_that_does_not_read_is_ended_when_its_unsent_data_is_too_large(
    run, caplog, monkeypatch
):
    gate = run(*ENDLESS)
    text = "x" * (1 << 16)
    for _ in range(4):
        gate.child.send(RefusedCount("a", 1, text))
    assert gate.ends == [], "the process may only be slow so far"
    monkeypatch.setattr(supervisor_module, "MAX_UNSENT", 1 << 16)
    gate.child.send(RefusedCount("a", 1, text))
    wait_for(lambda: gate.ends, "its end")
    assert "it does not read its pipe" in caplog.text


def test_unread_messages_are_delivered_later_and_in_order(run):
    mirror = run("/bin/cat")
    mirror.may_go_on.clear()
    text = "x" * (1 << 14)
    sent = [RefusedCount("a", number, text) for number in range(30)]
    for message in sent:
        mirror.child.send(message)
    assert mirror.child._unsent, "the pipes are full"
    mirror.may_go_on.set()

    def through():
        mirror.child.send()  # as the next heartbeat does
        return len(mirror.on_echo) == len(sent)

    wait_for(through, "all messages")
    assert mirror.on_echo == sent


def test_sending_to_an_ended_process_drops_the_message(run):
    gate = run("/bin/true")
    wait_for(lambda: gate.ends, "its end")
    gate.child.send(Ready(1))
    assert not gate.child._unsent


def test_a_process_that_sends_invalid_data_is_killed(run, caplog):
    gate = run(*shell(r"printf '\377\377\377\377'; exec sleep 600"))
    wait_for(lambda: gate.ends, "its end")
    gate.child.stop(30.0)
    assert gate.child.end_reason == "ended by SIGKILL"
    assert "a message of 4294967295 bytes" in caplog.text


@pytest.mark.slow
def test_a_process_whose_message_raises_an_error_is_killed(run, caplog):
    data = pipe.pack(Ready(5)).hex()
    code = f"import os, time; os.write(1, bytes.fromhex('{data}')); time.sleep(600)"

    def receive(child, message):
        raise LookupError(message)

    ended = threading.Event()
    gate = GateProcess(receive, lambda _: ended.set(), (sys.executable, "-c", code))
    gate.start()
    assert ended.wait(30)
    gate.stop(30.0)
    assert gate.end_reason == "ended by SIGKILL"
    assert "the gate is ended: its message could not be processed" in caplog.text
    assert "LookupError: Ready(pid=5)" in caplog.text


def test_a_gate_whose_message_raises_an_error_exits_with_code_0():
    """The display has failed; the gate still sends zeros to its robots."""

    def receive(child, message):
        raise LookupError(message)

    ended = threading.Event()
    gate = GateProcess(receive, lambda _: ended.set())
    gate.start()
    assert ended.wait(60)
    gate.stop(30.0)
    assert gate.end_reason == "exit code 0, no message"


def test_the_ended_callback_may_stop_the_process():
    reasons = []

    def ended(gate):
        gate.stop(30.0)
        reasons.append(gate.end_reason)

    gate = GateProcess(lambda *_: None, ended, shell("echo 'full disk' >&2; exit 1"))
    gate.start()
    wait_for(lambda: reasons == ["full disk"], "the reason")
