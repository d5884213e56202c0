"""The files that stay after the gate has ended: damage to them starts no motion."""

import hashlib
import json
import os

import pytest

from webmap.gate import disk
from webmap.gate.disk import UNKNOWN, Records, path_of
from webmap.gate.events import Key, Press, StopRecord

KEY = Key("ws://robot:9090", "/cmd_vel")
ANN, BEN = Press("Ann", "a1"), Press("Ben", "b1")
IDS = frozenset({"a1"})
OTHER = Key("ws://robot:9090", "/other")
HERE = [
    Key(f"ws://{host}:9090", "/cmd_vel") for host in ("localhost", "127.0.0.1", "[::1]")
]


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "deep" / "state"


@pytest.fixture
def records(folder):
    return Records(folder)


class TestLatch:
    def test_a_stop_is_stored_on_disk_until_reset(self, records, folder):
        assert records.latch_of(KEY) is None
        assert records.keep_latch(KEY, ANN, IDS) is None
        assert Records(folder).latch_of(KEY) == ANN
        assert Records(folder).latch_of(OTHER) is None
        assert records.keep_latch(KEY, None, IDS) is None
        assert Records(folder).latch_of(KEY) is None
        assert records.keep_latch(KEY, None, IDS) is None

    @pytest.mark.parametrize("said", HERE)
    @pytest.mark.parametrize("asked", HERE)
    def test_all_spellings_of_this_computer_share_one_stored_stop(
        self, records, said, asked
    ):
        records.keep_latch(said, ANN, IDS)
        assert records.latch_of(asked) == ANN
        assert records.stamp_of(asked) == records.stamp_of(said) is not None
        records.keep_latch(asked, None, IDS)
        assert records.latch_of(said) is None

    @pytest.mark.parametrize("old", HERE)
    def test_a_stop_stored_under_an_older_file_name_is_found_and_removed(
        self, records, folder, old
    ):
        name = hashlib.sha256("\n".join(old).encode()).hexdigest()[:24]
        folder.mkdir(parents=True)
        (folder / f"{name}.stop").write_text('{"by": "Ann"}')
        press = records.latch_of(HERE[0])
        assert press.by == "Ann"
        assert [records.latch_of(key) for key in HERE] == [press] * 3
        assert records.stamp_of(HERE[0]) is not None
        records.keep_latch(HERE[1], None, frozenset({press.id}))
        assert [records.latch_of(key) for key in HERE] == [None] * 3
        assert list(folder.iterdir()) == []

    def test_a_stored_stop_and_its_folder_are_flushed_to_disk(
        self, records, folder, monkeypatch
    ):
        flushed = []
        real = os.fsync

        def fsync(file):
            flushed.append(os.readlink(f"/proc/self/fd/{file}"))
            real(file)

        monkeypatch.setattr(os, "fsync", fsync)
        records.keep_latch(KEY, ANN, IDS)
        assert flushed[0].startswith(f"{folder}/.{path_of(folder, KEY, 'stop').name}.")
        assert flushed[1] == str(folder)
        records.keep_latch(KEY, None, IDS)
        assert flushed[2:] == [str(folder)]

    @pytest.mark.parametrize(
        "content",
        [
            b"",
            b"{",
            b"\xff\xfe",
            b"null",
            b"[]",
            b"{}",
            b'{"by": null}',
            b'{"by": ""}',
            b'{"by": "\\u001b[31m"}',
            b"[" * 100_000,
        ],
    )
    def test_an_unreadable_stop_file_counts_as_an_active_stop(
        self, records, folder, content
    ):
        folder.mkdir(parents=True)
        path_of(folder, KEY, "stop").write_bytes(content)
        assert records.latch_of(KEY).by == UNKNOWN

    def test_a_folder_in_place_of_the_stop_file_counts_as_an_active_stop(
        self, records, folder
    ):
        path_of(folder, KEY, "stop").mkdir(parents=True)
        assert records.latch_of(KEY).by == UNKNOWN
        assert "cannot be written" in records.keep_latch(KEY, ANN, IDS)

    def test_an_entry_of_any_kind_is_a_stop_that_a_person_can_reset(
        self, records, folder, tmp_path
    ):
        path = path_of(folder, KEY, "stop")
        folder.mkdir(parents=True)
        (tmp_path / "other").write_text('{"by": "Eve", "id": "e1"}')
        (tmp_path / "large").write_bytes(b" " * (disk.LARGEST + 1))
        for make in (
            lambda: os.mkfifo(path),
            lambda: path.symlink_to("/dev/zero"),
            lambda: path.symlink_to("nowhere"),
            lambda: path.symlink_to(tmp_path / "other"),
            lambda: (tmp_path / "large").rename(path),
        ):
            make()
            assert records.changed({KEY: None}) == [KEY]
            press = records.latch_of(KEY)
            assert press.by == UNKNOWN
            assert records.stamp_of(KEY) is not None
            assert records.keep_latch(KEY, None, frozenset({press.id})) is None
            assert list(folder.iterdir()) == []
        assert (tmp_path / "other").exists()

    def test_a_folder_as_stop_stays_a_stop_after_a_reset_with_a_reason(
        self, records, folder
    ):
        path_of(folder, KEY, "stop").mkdir(parents=True)
        press = records.latch_of(KEY)
        why = records.keep_latch(KEY, None, frozenset({press.id}))
        assert "cannot be written to" in why
        assert records.latch_of(KEY) == press

    def test_a_link_left_in_the_folder_never_leads_a_write_to_another_file(
        self, records, folder, tmp_path
    ):
        target, path = tmp_path / "target", path_of(folder, KEY, "stop")
        target.write_text("precious")
        folder.mkdir(parents=True)
        for link in (path, path.with_suffix(".stop.new")):
            link.symlink_to(target)
        records.keep_latch(KEY, ANN, IDS)
        assert (records.latch_of(KEY), target.read_text()) == (ANN, "precious")

    def test_the_files_and_a_new_folder_are_for_the_owner_alone(self, records, folder):
        records.keep_latch(KEY, ANN, IDS)
        records.keep_stop_test(KEY, StopRecord(0.3, "2026-11-21"))
        assert folder.stat().st_mode & 0o777 == 0o700
        assert {file.stat().st_mode & 0o777 for file in folder.iterdir()} == {0o600}

    def test_a_name_that_is_too_long_is_cut(self, records):
        records.keep_latch(KEY, Press("x" * 500, "a1"), IDS)
        assert len(records.latch_of(KEY).by) == 80

    def test_a_folder_that_cannot_be_created_is_reported(self, tmp_path):
        (tmp_path / "file").write_text("")
        records = Records(tmp_path / "file" / "state")
        assert "cannot be written" in records.keep_latch(KEY, ANN, IDS)
        records.keep_stop_test(KEY, StopRecord(0.3, "2026-11-21"))

    def test_a_file_left_half_written_by_a_crash_is_ignored(self, records, folder):
        folder.mkdir(parents=True)
        path_of(folder, KEY, "stop.new").write_text('{"by": "A')
        assert records.latch_of(KEY) is None
        records.keep_latch(KEY, BEN, IDS)
        assert records.latch_of(KEY) == BEN

    def test_a_stored_stop_keeps_its_id_and_a_file_without_an_id_gets_one(
        self, records, folder
    ):
        records.keep_latch(KEY, ANN, IDS)
        assert records.latch_of(KEY) == ANN
        path = path_of(folder, KEY, "stop")
        found = []
        for by in ("Ann", "Ben"):
            path.write_text(json.dumps({"by": by, "bridge": "", "topic": ""}))
            os.utime(path, ns=(len(found), len(found) + 1))
            found.append(records.latch_of(KEY))
            assert records.latch_of(KEY) == found[-1] == Records(folder).latch_of(KEY)
        assert [press.by for press in found] == ["Ann", "Ben"]
        assert len({ANN.id, *(press.id for press in found)}) == 3
        for id in ("", 7, "x" * 65, "\x1b[31m"):
            path.write_text(json.dumps({"by": "Ann", "id": id}))
            assert records.latch_of(KEY).id.startswith("file-")

    def test_a_reset_does_not_remove_the_stop_file_of_another_gate(
        self, records, folder
    ):
        records.keep_latch(KEY, ANN, IDS)
        Records(folder).keep_latch(KEY, BEN, frozenset({"b1"}))
        stamp = records.stamp_of(KEY)
        assert records.keep_latch(KEY, None, IDS) is None
        assert (records.latch_of(KEY), records.stamp_of(KEY)) == (BEN, stamp)
        records.keep_latch(KEY, None, frozenset({"b1"}))
        assert list(folder.iterdir()) == []

    def test_a_stop_whose_reset_was_interrupted_stays_active(self, records, folder):
        records.keep_latch(KEY, ANN, IDS)
        path = path_of(folder, KEY, "stop")
        path.rename(path.with_suffix(".stop.lifted"))
        assert records.latch_of(KEY) == ANN
        assert records.stamp_of(KEY) is not None
        records.keep_latch(KEY, None, frozenset({"b1"}))
        assert (path.exists(), records.latch_of(KEY)) == (True, ANN)
        path.rename(path.with_suffix(".stop.lifted"))
        records.keep_latch(KEY, None, IDS)
        assert list(folder.iterdir()) == []


class TestStopTest:
    @pytest.mark.parametrize("seconds", [0.27, None])
    def test_a_stop_test_result_is_stored_with_its_date(self, records, folder, seconds):
        assert records.stop_test_of(KEY) is None
        record = StopRecord(seconds, "2026-11-21", 0.12)
        records.keep_stop_test(KEY, record)
        assert Records(folder).stop_test_of(KEY) == record
        assert Records(folder).stop_test_of(OTHER) is None

    @pytest.mark.parametrize(
        "content",
        [
            "",
            "null",
            '{"seconds": 0.3}',
            '{"seconds": "fast", "date": "2026-11-21"}',
            '{"seconds": [], "date": "2026-11-21"}',
            '{"seconds": NaN, "date": "2026-11-21"}',
            '{"seconds": -1, "date": "2026-11-21"}',
            '{"seconds": 0.3, "date": 5}',
            '{"seconds": 0.3, "date": "2026-11-21", "error": -1}',
        ],
    )
    def test_an_invalid_stop_test_file_is_ignored(self, records, folder, content):
        folder.mkdir(parents=True)
        path_of(folder, KEY, "test").write_text(content)
        assert records.stop_test_of(KEY) is None
