"""The thread that keeps recordings: bounded, and without effect on the rest."""

import fcntl
import os

import pytest

from equipment.waiting import wait_for
from webmap.bags.ring import EventRecord, Frame
from webmap.features.incidents import writer as writer_module
from webmap.features.incidents.writer import (
    ASKED,
    ITSELF,
    IncidentWriter,
    recordings,
    recordings_folder,
    remove_oldest,
    why_full,
)

STOPPED = Frame("r1", "Bob", [EventRecord(1_790_000_000 * 10**9, "stop", "STOP")])


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def writer():
    made = IncidentWriter()
    made.start()
    yield made
    made.finish()


def files(folder, kind, number, size=10):
    folder.mkdir(exist_ok=True)
    for index in range(number):
        (folder / f"incident-2026-11-{index:02d}-{kind}.mcap").write_bytes(b"x" * size)


def test_a_recording_is_made_of_what_was_put_before(writer):
    writer.put([STOPPED])
    writer.keep(asked=False)
    wait_for(lambda: writer.kept or writer.trouble)
    assert writer.trouble == ""
    assert writer.kept.path in recordings(recordings_folder(), ITSELF)
    assert "MB" in writer.kept.text
    wait_for(lambda: not writer.is_busy)


def test_two_writers_have_rings_of_their_own(writer, state):
    other = IncidentWriter()
    other.start()
    for each in (writer, other):
        each.put([STOPPED])
    rings = state / "incidents"
    wait_for(lambda: len(list(rings.glob("*/*.ring"))) == 2)
    other.finish()
    third = IncidentWriter()
    third.start()
    third.put([STOPPED])
    wait_for(lambda: len(list(rings.glob("*/*.ring"))) == 3)
    third.finish()
    assert len([each for each in rings.iterdir() if each.is_dir()]) == 2


def test_the_oldest_recordings_that_nobody_asked_for_are_deleted(state, monkeypatch):
    monkeypatch.setattr(writer_module, "MOST_FILES", 3)
    files(state, ITSELF, 5)
    files(state, ASKED, 5)
    removed = remove_oldest(state)
    assert [path.name[-12:-10] for path in removed] == ["00", "01"]
    assert len(recordings(state, ASKED)) == 5
    monkeypatch.setattr(writer_module, "MOST_BYTES", 15)
    assert len(remove_oldest(state)) == 2
    assert len(recordings(state, ITSELF)) == 1


def test_people_are_told_when_no_more_recordings_are_kept_for_them(writer, monkeypatch):
    monkeypatch.setattr(writer_module, "MOST_FILES", 3)
    folder = recordings_folder()
    files(folder, ASKED, 2)
    assert why_full(folder) == ""
    files(folder, ASKED, 3)
    writer.put([STOPPED])
    writer.keep(asked=True)
    wait_for(lambda: writer.trouble)
    assert "there are 3 recordings that people asked for" in writer.trouble
    assert not writer.is_busy
    assert len(recordings(folder, ASKED)) == 3


def test_a_disk_that_refuses_is_a_sentence_and_nothing_is_raised(writer, monkeypatch):
    def refuse(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writer_module.Ring, "write", refuse)
    writer.put([STOPPED])
    wait_for(lambda: writer.trouble)
    assert "not recorded: No space left on device." in writer.trouble
    monkeypatch.undo()


def test_a_folder_that_cannot_be_made_is_a_sentence(state):
    (state / "incidents").write_text("a file")
    made = IncidentWriter()
    made.start()
    wait_for(lambda: made.trouble)
    assert made.trouble.startswith("The last minutes are not recorded:")
    for _ in range(1000):  # nobody takes them
        made.put([STOPPED])
    made.finish(0.1)


def test_a_recording_that_was_not_finished_is_made_at_the_next_start(state):
    frozen = state / "incidents" / "1" / "keep-incident-2026-11-29-auto.mcap"
    frozen.mkdir(parents=True)
    ring = writer_module.Ring(frozen)
    ring.write([STOPPED], 0.0)
    ring.close()
    made = IncidentWriter()
    made.start()
    wait_for(lambda: made.kept)
    assert not frozen.exists()
    made.finish()


def test_a_recording_that_another_process_makes_is_left_to_that_process(state):
    frozen = state / "incidents" / "1" / "keep-incident-2026-11-29-auto.mcap"
    frozen.mkdir(parents=True)
    number = os.open(frozen, os.O_RDONLY)
    fcntl.flock(number, fcntl.LOCK_EX)
    made = IncidentWriter()
    made.start()
    wait_for(lambda: made.is_busy)
    wait_for(lambda: not made.is_busy)
    made.finish()
    assert frozen.exists()
    assert made.trouble == ""
    os.close(number)


def test_a_recording_that_is_due_at_the_end_is_made_by_a_process(state):
    made = IncidentWriter()
    made.start()
    made.put([STOPPED])
    made._is_ending = True
    made.keep(asked=False)
    made.finish()
    assert made.left.wait(60) == 0
    assert recordings(recordings_folder(), ITSELF)
    assert not list(state.glob("incidents/1/keep-*"))
