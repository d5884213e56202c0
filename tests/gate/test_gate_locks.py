"""Only one gate on a computer has a machine; its lock file shows if it was driven."""

import os
from pathlib import Path

import pytest

from webmap.gate import locks as module
from webmap.gate.clock import now
from webmap.gate.disk import path_of
from webmap.gate.events import Key
from webmap.gate.locks import Locks, keep_private, state_folder

KEY = Key("ws://robot:9090", "/cmd_vel")


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "deep" / "state"


@pytest.fixture
def locks(folder):
    locks = Locks(folder)
    yield locks
    locks.release(KEY)


def test_the_first_gate_has_the_lock_of_a_machine_until_release(locks, folder):
    assert locks.acquire(KEY).held
    other = Locks(folder).acquire(KEY)
    assert (other.held, other.elsewhere) == (False, True)
    assert other.why == "another WebMap on this computer uses this robot"
    locks.release(KEY)
    second = Locks(folder)
    assert second.acquire(KEY).held
    second.release(KEY)


def test_all_spellings_of_this_computer_share_one_lock(locks):
    one, two = (Key(f"ws://{h}:9090", "/cmd_vel") for h in ("127.0.0.1", "[::1]"))
    locks.acquire(KEY)
    assert locks.acquire(one).held
    other = locks.acquire(two)
    assert (other.held, other.elsewhere) == (False, True)
    assert other.why == "this WebMap already uses it as /cmd_vel of ws://127.0.0.1:9090"
    locks.release(two)
    assert not locks.acquire(two).held, "only the owner can release a lock"
    locks.release(one)
    assert locks.acquire(two).held
    locks.release(two)


def test_releasing_or_marking_a_lock_without_owning_the_lock_does_nothing(locks):
    locks.release(KEY)
    locks.mark(KEY, driven=True)
    assert locks.acquire(KEY).driven is False


def test_a_pipe_or_a_link_in_place_of_a_lock_blocks_nothing(locks, folder, tmp_path):
    folder.mkdir(parents=True)
    path, target = path_of(folder, KEY, "lock"), tmp_path / "target"
    os.mkfifo(path)
    locks.tidy()
    state = locks.acquire(KEY)
    assert not state.held
    assert state.why == f"{path}: expected a file, got a pipe"
    path.unlink()
    target.write_bytes(b"0")
    path.symlink_to(target)
    locks.tidy()
    assert (path.is_symlink(), locks.acquire(KEY).held) == (True, False)
    assert target.read_bytes() == b"0"


def test_the_folder_is_for_its_owner_alone_also_one_of_an_earlier_version(
    folder, monkeypatch, caplog
):
    for mode in (0o755, 0o700):
        keep_private(folder)
        assert folder.stat().st_mode & 0o777 == 0o700
        folder.chmod(mode)
    folder.chmod(0o755)
    monkeypatch.setattr(os, "geteuid", lambda: folder.stat().st_uid + 1)
    keep_private(folder)
    assert folder.stat().st_mode & 0o777 == 0o755
    assert "belongs to another user" in caplog.text
    keep_private(folder / ("y" * 300))
    assert "File name too long" in caplog.text


@pytest.mark.parametrize("driven", [True, False])
def test_the_driven_mark_is_kept_after_the_lock_is_released(locks, folder, driven):
    assert locks.acquire(KEY).driven is False
    locks.mark(KEY, driven)
    locks.release(KEY)
    assert locks.acquire(KEY).driven is driven
    text = path_of(folder, KEY, "lock").read_text()
    assert text[1:] == " ws://robot:9090 /cmd_vel\n"


def test_a_lock_file_with_invalid_content_means_driven(locks, folder):
    folder.mkdir(parents=True)
    path_of(folder, KEY, "lock").write_bytes(b"?")
    assert locks.acquire(KEY).driven is True


def test_an_unreadable_lock_file_means_driven(locks, monkeypatch):
    def fail(*_):
        raise OSError("broken")

    with monkeypatch.context() as broken:
        broken.setattr(module.os, "read", fail)
        assert locks.acquire(KEY).driven is True


def test_tidy_removes_only_lock_files_of_machines_neither_driven_nor_locked(
    locks, folder
):
    resting, driven, held = (Key(f"ws://robot:{n}", "/cmd_vel") for n in range(3))
    before = Locks(folder)
    for key in (resting, driven, held):
        before.acquire(key)
    before.mark(driven, driven=True)
    before.release(resting)
    before.release(driven)
    path_of(folder, KEY, "lock").mkdir()  # a lock that cannot be opened is kept
    locks.tidy()
    there = {path for path in folder.glob("*.lock")}
    assert there == {path_of(folder, key, "lock") for key in (driven, held, KEY)}
    path_of(folder, KEY, "lock").rmdir()
    before.release(held)


def test_a_lock_file_that_cannot_be_removed_is_left(locks, folder, monkeypatch):
    locks.acquire(KEY)
    locks.release(KEY)

    def fail(self):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(module.Path, "unlink", fail)
    locks.tidy()
    assert path_of(folder, KEY, "lock").exists()


@pytest.mark.parametrize("made_anew", [True, False])
def test_a_lock_file_removed_before_locking_does_not_count_as_the_lock(
    locks, folder, monkeypatch, made_anew
):
    """It is removed between opening and locking, as if another gate tidied up."""
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


def test_a_full_disk_is_only_logged_when_a_machine_is_marked_as_driven(
    locks, monkeypatch, caplog
):
    locks.acquire(KEY)

    def fail(*_):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(module.os, "write", fail)
        locks.mark(KEY, driven=True)
    assert "No space left on device" in caplog.text


def test_a_lock_in_a_folder_that_is_not_writable_reports_the_reason(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    state = Locks(blocked).acquire(KEY)
    assert (state.held, state.elsewhere) == (False, False)
    assert "cannot be written to" in state.why


def test_the_state_folder_comes_from_the_environment_or_the_system_default(monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", "/some/where")
    assert state_folder() == Path("/some/where")
    monkeypatch.delenv("WEBMAP_STATE_DIR")
    assert state_folder().name == "webmap"
    assert os.environ.get("WEBMAP_STATE_DIR") is None


def test_the_clock_never_goes_backwards():
    assert now() <= now()


def test_tidy_keeps_a_lock_file_that_another_gate_has_just_locked(
    tmp_path, monkeypatch
):
    first = Locks(tmp_path)
    first.acquire(KEY)
    first.release(KEY)
    (file,) = tmp_path.glob("*.lock")
    lock = module._try_lock

    def slow(opened: int) -> bool:
        # Another gate tidies too, and a third gate takes the machine.
        file.unlink()
        monkeypatch.setattr(module, "_try_lock", lock)
        assert other.acquire(KEY).held
        return lock(opened)

    other = Locks(tmp_path)
    monkeypatch.setattr(module, "_try_lock", slow)
    Locks(tmp_path).tidy()
    assert file.exists()
    assert not Locks(tmp_path).acquire(KEY).held
