"""The gate's process, at both ends of its pipes; its coverage is measured."""

import asyncio
import gc
import importlib
import os
import signal
import subprocess
import threading

import pytest

from equipment.waiting import wait_for
from webmap.base.processes import python_command
from webmap.gate import pipe, process
from webmap.gate.events import Shutdown
from webmap.gate.pipe import PipeWriter
from webmap.gate.protocol import FromGate, Heartbeat, Ready
from webmap.gate.rules.gate import Gate


@pytest.fixture
def not_measured():
    """Measure the coverage of these processes: each of them ends normally."""


@pytest.fixture
def gate():
    """A gate process."""
    started = subprocess.Popen(
        python_command("webmap.gate"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    with started:
        try:
            yield started
        finally:
            started.kill()


def messages_until_ready(gate):
    unpacker, messages = pipe.Unpacker(FromGate), []

    def ready():
        messages.extend(unpacker.feed(os.read(gate.stdout.fileno(), 1 << 16)))
        return messages

    wait_for(ready, "its first message", 60.0)
    return messages


def test_the_gate_reports_its_process_id_and_exits_when_the_pipe_closes(gate):
    assert messages_until_ready(gate)[0] == Ready(gate.pid)
    _, err = gate.communicate(pipe.pack(Heartbeat()), timeout=60)
    assert (gate.returncode, err) == (0, b"")


def test_an_error_in_the_reader_thread_shuts_the_gate_down():
    """A gate that cannot receive a STOP must not go on, whatever the error is."""

    class Loop:
        def __init__(self):
            self.received = []

        def call_soon_threadsafe(self, fn, event):
            self.received.append(event)
            if isinstance(event, Heartbeat):
                raise LookupError(event)

    class Shell:
        deliver = None

    out, into = os.pipe()
    os.write(into, pipe.pack(Heartbeat()))
    loop = Loop()
    with pytest.raises(LookupError):
        process._read(out, loop, Shell())
    assert isinstance(loop.received[-1], Shutdown)
    os.close(out)
    os.close(into)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_makes_the_gate_exit_with_code_0(gate, number):
    messages_until_ready(gate)
    gate.send_signal(number)
    assert gate.wait(60) == 0, "the signal itself does not end the gate"


def test_invalid_data_on_the_pipe_makes_the_gate_exit(gate):
    messages_until_ready(gate)
    gate.stdin.write(b"\xff" * 8)
    gate.stdin.flush()
    assert gate.wait(60) == 0, "although the pipe is still open"


def test_an_internal_error_is_logged_and_ends_the_gate_with_code_1(monkeypatch, caplog):
    def fail(*_):
        raise ArithmeticError("a slip")

    monkeypatch.setattr(Gate, "step", fail)
    kept = {n: signal.getsignal(n) for n in (signal.SIGTERM, signal.SIGINT)}
    (pipe_in, theirs), (out, pipe_out) = os.pipe(), os.pipe()
    box = PipeWriter(pipe_out)
    try:
        assert asyncio.run(process._serve(pipe_in, box)) == 1
        assert "the gate has failed" in caplog.text
        box.close(30.0)
        messages = pipe.Unpacker(FromGate).feed(os.read(out, 1 << 16))
        assert messages == [Ready(os.getpid())]
    finally:
        gc.unfreeze()
        for number, handler in kept.items():
            signal.signal(number, handler)
        (reader,) = (t for t in threading.enumerate() if t.name == "gate-inbox")
        os.close(theirs)
        reader.join(30)
        for end in (pipe_in, pipe_out, out):
            os.close(end)
    assert not reader.is_alive(), "the reader ends after the loop"


def test_importing_the_main_module_does_not_start_a_gate(monkeypatch):
    monkeypatch.setattr(os, "_exit", lambda code: pytest.fail("it ended the process"))
    assert importlib.import_module("webmap.gate.__main__").main is not None
