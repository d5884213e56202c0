"""Messages to the display and to the log do not block the gate."""

import logging
import os
import threading

import pytest

from equipment.gate_harness import Bench
from webmap.gate import pipe as pipe_module
from webmap.gate.pipe import BackgroundHandler, PipeWriter, Unpacker
from webmap.gate.protocol import FromGate, GateUp, Ready, SentTwist, Tick


@pytest.fixture
def pipe():
    ends = os.pipe()
    yield ends
    for end in ends:
        os.close(end)


def shut(end):
    """Close an end of a pipe, and keep its number in use."""
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, end)
    os.close(nothing)


def received(read):
    return Unpacker(FromGate).feed(os.read(read, 1 << 16))


class TestOutbox:
    def test_messages_are_sent_in_order(self, pipe):
        box = PipeWriter(pipe[1])
        for number in range(3):
            box.put(Ready(number))
        box.close(5.0)
        assert received(pipe[0]) == [Ready(0), Ready(1), Ready(2)]

    def test_a_full_outbox_drops_only_messages_that_newer_ones_replace(
        self, pipe, monkeypatch
    ):
        monkeypatch.setattr(pipe_module, "FULL", -1)
        box = PipeWriter(pipe[1])
        bench = Bench().begin()
        box.put(Tick(1, {}))
        box.put(SentTwist("r1", 0.0, 0.0, 0.0, None))
        box.put(bench.report())
        box.put(Ready(1))
        box.close(5.0)
        assert received(pipe[0]) == [bench.report(), Ready(1)]

    def test_an_overfull_outbox_drops_every_message(self, pipe, monkeypatch):
        monkeypatch.setattr(pipe_module, "OVERFULL", -1)
        box = PipeWriter(pipe[1])
        box.put(Ready(1))
        box.close(5.0)
        shut(pipe[1])
        assert os.read(pipe[0], 100) == b""

    def test_writing_to_a_closed_display_raises_no_error(self, pipe):
        shut(pipe[0])
        box = PipeWriter(pipe[1])
        box.put(Ready(1))
        box.close(5.0)
        assert not box._thread.is_alive()


class TestLog:
    def record(self, text):
        return logging.LogRecord("gate", logging.INFO, "", 0, text, (), None)

    def test_a_blocked_terminal_does_not_block_logging(self, monkeypatch):
        monkeypatch.setattr(pipe_module, "FULL", 2)
        go_on, written = threading.Event(), []

        class Stopped(logging.Handler):
            def emit(self, record):
                go_on.wait(10)
                written.append(record.getMessage())

        handler = BackgroundHandler(Stopped())
        for number in range(50):
            handler.emit(self.record(str(number)))
        handler.drain(0.0)  # the queue is too full even for its end
        go_on.set()
        handler.drain(0.0)
        while not written or handler._thread.is_alive():
            handler.drain(0.1)
        assert 1 <= len(written) < 50
        assert written[0] == "0"


class TestFraming:
    def test_data_that_is_not_a_valid_message_is_skipped_and_logged(self, caplog):
        data = pipe_module.pack(GateUp()) + pipe_module.pack(Ready(5))
        assert Unpacker(FromGate).feed(data) == [Ready(5)]
        assert "not a message" in caplog.text

    def test_messages_are_decoded_from_single_bytes(self):
        unpacker, data = Unpacker(FromGate), pipe_module.pack(Ready(5)) * 2
        found = [m for byte in data for m in unpacker.feed(bytes([byte]))]
        assert found == [Ready(5), Ready(5)]

    def test_an_invalid_message_length_raises_a_wire_error(self):
        with pytest.raises(
            pipe_module.WireError, match="a message of 4294967295 bytes"
        ):
            Unpacker(FromGate).feed(b"\xff" * 8)


def test_messages_that_wait_are_written_with_one_call(monkeypatch):
    read, write = os.pipe()
    calls, real = [], os.write
    box = PipeWriter(write)
    box.close(5.0)  # the thread has ended: what comes now waits

    def noted(file, data):
        if file == write:
            calls.append(len(data))
        return real(file, data)

    monkeypatch.setattr(os, "write", noted)
    for number in range(10):
        box.put(Ready(number))
    box._queue.put(None)
    box._write()
    assert len(calls) == 1
    assert len(os.read(read, 1 << 16)) == sum(calls)
    os.close(read)
    os.close(write)
