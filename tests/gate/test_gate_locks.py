"""One gate alone on a computer has a machine, and knows if it was being driven."""

import os
from pathlib import Path

import pytest

from webmap.gate.clock import now
from webmap.gate.events import Key
from webmap.gate.kept import locks as module
from webmap.gate.kept.locks import Locks, state_folder
from webmap.gate.kept.records import path_of

KEY = Key("ws://robot:9090", "/cmd_vel")


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "deep" / "state"


@pytest.fixture
def locks(folder):
    locks = Locks(folder)
    yield locks
    locks.release(KEY)


def test_a_machine_belongs_to_who_came_first(locks, folder):
    assert locks.acquire(KEY).held
    other = Locks(folder).acquire(KEY)
    assert (other.held, other.elsewhere) == (False, True)
    assert other.why == "another WebMap on this computer has it"
    locks.release(KEY)
    second = Locks(folder)
    assert second.acquire(KEY).held
    second.release(KEY)


def test_a_machine_of_this_computer_is_had_once_however_that_is_spelled(locks):
    one, two = (Key(f"ws://{h}:9090", "/cmd_vel") for h in ("127.0.0.1", "[::1]"))
    locks.acquire(KEY)
    assert locks.acquire(one).held
    other = locks.acquire(two)
    assert (other.held, other.elsewhere) == (False, True)
    assert other.why == "it is driven as /cmd_vel of ws://127.0.0.1:9090 here"
    locks.release(two)
    assert not locks.acquire(two).held, "who does not have it lets nothing go"
    locks.release(one)
    assert locks.acquire(two).held
    locks.release(two)


def test_what_is_let_go_twice_or_never_was_had_is_no_matter(locks):
    locks.release(KEY)
    locks.mark(KEY, driven=True)
    assert locks.acquire(KEY).driven is False


@pytest.mark.parametrize("driven", [True, False])
def test_whether_it_was_being_driven_outlives_its_gate(locks, folder, driven):
    assert locks.acquire(KEY).driven is False
    locks.mark(KEY, driven)
    locks.release(KEY)
    assert locks.acquire(KEY).driven is driven
    text = path_of(folder, KEY, "lock").read_text()
    assert text[1:] == " ws://robot:9090 /cmd_vel\n"


def test_a_file_that_says_nothing_clear_means_that_it_was(locks, folder):
    folder.mkdir(parents=True)
    path_of(folder, KEY, "lock").write_bytes(b"?")
    assert locks.acquire(KEY).driven is True


def test_a_file_that_cannot_be_read_means_that_it_was(locks, monkeypatch):
    def fail(*_):
        raise OSError("broken")

    with monkeypatch.context() as broken:
        broken.setattr(module.os, "read", fail)
        assert locks.acquire(KEY).driven is True


def test_a_full_disk_stands_in_the_way_of_nothing(locks, monkeypatch, caplog):
    locks.acquire(KEY)

    def fail(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(module.os, "write", fail)
        locks.mark(KEY, driven=True)
    assert "No space left on device" in caplog.text


def test_a_folder_that_cannot_be_written_to_is_said(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    state = Locks(blocked).acquire(KEY)
    assert (state.held, state.elsewhere) == (False, False)
    assert "cannot be written to" in state.why


def test_the_folder_is_named_or_where_the_system_keeps_such_things(monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", "/some/where")
    assert state_folder() == Path("/some/where")
    monkeypatch.delenv("WEBMAP_STATE_DIR")
    assert state_folder().name == "webmap"
    assert os.environ.get("WEBMAP_STATE_DIR") is None


def test_the_clock_only_grows():
    assert now() <= now()
