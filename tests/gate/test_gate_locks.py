"""One gate alone on a computer has a machine, and knows if it was being driven."""

import os
from pathlib import Path

import pytest

from webmap.gate import locks as module
from webmap.gate.clock import now
from webmap.gate.disk import path_of
from webmap.gate.events import Key
from webmap.gate.locks import Locks, state_folder

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
    assert other.why == "another WebMap on this computer drives it"
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
    assert (
        other.why == "this WebMap already drives it as /cmd_vel of ws://127.0.0.1:9090"
    )
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


def test_files_of_machines_that_rest_are_removed_and_no_others(locks, folder):
    resting, driven, held = (Key(f"ws://robot:{n}", "/cmd_vel") for n in range(3))
    before = Locks(folder)
    for key in (resting, driven, held):
        before.acquire(key)
    before.mark(driven, driven=True)
    before.release(resting)
    before.release(driven)
    path_of(folder, KEY, "lock").mkdir()  # what cannot be opened is left
    locks.tidy()
    there = {path for path in folder.glob("*.lock")}
    assert there == {path_of(folder, key, "lock") for key in (driven, held, KEY)}
    path_of(folder, KEY, "lock").rmdir()
    before.release(held)


def test_a_file_that_cannot_be_removed_is_left(locks, folder, monkeypatch):
    locks.acquire(KEY)
    locks.release(KEY)

    def fail(self):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(module.Path, "unlink", fail)
    locks.tidy()
    assert path_of(folder, KEY, "lock").exists()


@pytest.mark.parametrize("made_anew", [True, False])
def test_a_file_that_is_removed_before_it_is_locked_is_no_lock(
    locks, folder, monkeypatch, made_anew
):
    """Between opening and locking, as if another gate tidied up then."""
    path, try_lock, removed = path_of(folder, KEY, "lock"), module._try_lock, []

    def try_later(file):
        if not removed:
            removed.append(path.read_bytes())
            path.unlink()
            if made_anew:
                path.touch()
        return try_lock(file)

    monkeypatch.setattr(module, "_try_lock", try_later)
    assert locks.acquire(KEY).held
    assert removed
    assert not Locks(folder).acquire(KEY).held


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


def test_a_file_that_was_made_anew_while_it_is_tidied_stays(tmp_path, monkeypatch):
    first = Locks(tmp_path)
    first.acquire(KEY)
    first.release(KEY)
    (file,) = tmp_path.glob("*.lock")
    lock = module._try_lock

    def slow(opened: int) -> bool:
        # Another gate tidies too, and a third one takes the machine.
        file.unlink()
        monkeypatch.setattr(module, "_try_lock", lock)
        assert other.acquire(KEY).held
        return lock(opened)

    other = Locks(tmp_path)
    monkeypatch.setattr(module, "_try_lock", slow)
    Locks(tmp_path).tidy()
    assert file.exists()
    assert not Locks(tmp_path).acquire(KEY).held
