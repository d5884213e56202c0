"""The shift log: its lines, its files and their bounds, and disks that refuse."""

import errno
import os
import threading
import time
from pathlib import Path

import msgspec
import pytest

from equipment.waiting import wait_for
from webmap.core.operators import Operator
from webmap.core.shift_files import (
    LARGEST,
    LARGEST_FILE,
    LONGEST_FILE,
    MOST_FILES,
    OLDEST,
    Bounds,
    Entry,
    LogFiles,
    read_newest,
)
from webmap.core.shift_log import MOST_QUEUED, Person, RobotName, ShiftLog

BOB = RobotName("r1", "Bob")


def written(folder: Path) -> list[Entry]:
    return read_newest(folder, 10_000)


@pytest.fixture
def log(tmp_path):
    made = ShiftLog()
    made.begin(tmp_path / "shift-log")
    yield made
    made.end()


def test_a_line_has_time_robot_person_and_facts(tmp_path, log):
    ana = Operator("Ana", "desk 4", "91c2", verified=True)
    log.note("stop", "STOP", robot=BOB, person=ana, v=0.51234, bad=float("nan"))
    log.end()
    (file,) = (tmp_path / "shift-log").iterdir()
    line = msgspec.json.decode(file.read_bytes())
    assert line.pop("time").startswith("20")
    assert line.pop("unix") > 1e9
    assert line == {
        "kind": "stop",
        "text": "STOP",
        "robot": "r1",
        "robot_name": "Bob",
        "person": "Ana",
        "verified": True,
        "place": "desk 4",
        "facts": {"v": 0.512, "bad": None},
    }
    assert file.stat().st_mode & 0o077 == 0


def test_a_person_without_a_name_keeps_the_whole_label():
    assert Person.of("Ana 2 (desk 4)", None) == Person("Ana 2 (desk 4)")
    nameless = Operator("", "", "91c2", address="10.0.0.5")
    assert nameless.label == "an operator at 10.0.0.5 (no name)"
    log = ShiftLog()
    log.note("stop", "STOP", person=nameless)
    assert log.entries()[0].person == nameless.label
    assert log.entries()[0].verified is False


@pytest.mark.parametrize(
    "text",
    [
        'a"}\n{"kind":"reset","text":"forged"}',
        "two\r\nlines",
        "nul \x00, escape \x1b[2J, bell \x07",
        "right to left \u202e, separator \u2028, mark \ufeff",
        "lone \ud800 surrogate",
        "x" * 100_000,
    ],
)
def test_no_text_adds_a_line_or_has_a_control_character(tmp_path, log, text):
    robot = RobotName(text, text)
    log.note("note", text, robot=robot, person=Person(text, False, text), fact=text)
    log.end()
    (file,) = (tmp_path / "shift-log").iterdir()
    data = file.read_bytes()
    assert data.count(b"\n") == 1
    assert len(data) < 4096
    (entry,) = written(tmp_path / "shift-log")
    fields = entry.text, entry.robot, entry.robot_name, entry.person, entry.place
    assert all(each.isprintable() for each in (*fields, entry.facts["fact"]))


def test_no_entry_has_a_token_or_the_password_of_an_address(log):
    log.hide("canary-token")
    log.note("note", "it is canary-token", person=Person("canary-token"))
    log.note("disconnect", "no connection to ws://ann:canary@10.0.0.5:9090/x")
    log.note("refused", "GET /?token=canary&x=1", why="webmap_code=canary")
    text = str(log.entries())
    assert "canary" not in text
    assert "ws://...@10.0.0.5:9090/x" in text


def test_a_source_cannot_push_out_the_entries_of_others(log):
    ana, ben = Person("Ana", False, mark="a"), Person("Ben", False, mark="b")
    kept = [log.note("note", f"{i}", person=ana) for i in range(200)]
    assert sum(kept) == 30
    assert not kept[-1]
    assert log.note("note", "hello", person=ben)
    assert "similar lines are left out" in log.entries()[29].text


def test_a_new_process_shows_the_entries_of_earlier_ones(tmp_path):
    first = ShiftLog()
    first.begin(tmp_path)
    first.note("note", "one")
    first.end()
    (file,) = tmp_path.iterdir()
    with file.open("ab") as stream:
        stream.write(b'{"time": "cut off')
    second = ShiftLog()
    second.note("note", "two")
    second.begin(tmp_path)
    wait_for(lambda: second.restored)
    assert [entry.text for entry in second.entries()] == ["one", "two"]
    assert [entry.text for entry in second.since(0)] == ["two"]
    second.end()
    assert [entry.text for entry in written(tmp_path)] == ["one", "two"]


def test_a_file_ends_when_it_is_full_or_a_day_old():
    bounds = Bounds()
    assert bounds.is_over(10, 0.0)
    bounds.began, bounds.size = 0.0, LARGEST_FILE - 10
    assert not bounds.is_over(10, 1.0)
    assert bounds.is_over(11, 1.0)
    assert bounds.is_over(10, LONGEST_FILE)
    assert bounds.is_over(10, -1.0)  # the clock was set


def test_the_oldest_files_are_removed():
    bounds = Bounds()
    names = [bounds.name(float(day * 86_400)) for day in range(40)]
    assert names == sorted(names)
    many = [(name, LARGEST_FILE, 39 * 86_400.0) for name in names]
    most = LARGEST // LARGEST_FILE - 1  # one place for the file that begins
    assert sorted(bounds.surplus(many, 39 * 86_400.0)) == names[:-most]
    old = [(names[0], 10, 0.0), (names[1], 10, 86_400.0)]
    assert bounds.surplus(old, OLDEST + 3600) == names[:1]
    tiny = [(f"{number:06}", 1, 0.0) for number in range(MOST_FILES + 7)]
    assert len(bounds.surplus(tiny, 0.0)) == 7


def test_files_rotate_and_stay_within_the_bound(tmp_path):
    files, line = LogFiles(tmp_path), b"x" * (1 << 20)
    for number in range(70):
        files.write(line, float(number))
    files.close()
    total = sum(file.stat().st_size for file in tmp_path.iterdir())
    assert LARGEST - 2 * LARGEST_FILE <= total <= LARGEST


def test_a_full_disk_loses_nothing_while_the_queue_has_room(tmp_path, monkeypatch):
    monkeypatch.setattr("webmap.core.shift_log.RETRY", 0.02)
    full = True
    write = os.write

    def written_or_full(number, data):
        if full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(number, data)

    monkeypatch.setattr("webmap.core.shift_files.os.write", written_or_full)
    log = ShiftLog()
    log.begin(tmp_path)
    log.note("stop", "STOP")
    wait_for(lambda: log.trouble)
    assert log.trouble == "The log could not be written: No space left on device."
    full = False
    wait_for(lambda: not log.trouble)
    log.end()
    texts = [entry.text for entry in written(tmp_path)]
    assert texts[0] == "STOP"
    assert texts[1].startswith("The log could not be written")
    assert len(list(tmp_path.iterdir())) == 1  # no empty files of the failed tries


@pytest.mark.parametrize("disk", ["full", "hangs"])
def test_a_disk_that_hangs_or_is_full_delays_nobody_who_notes(
    tmp_path, monkeypatch, disk
):
    freed = threading.Event()

    def opened(file, flags):
        if disk == "hangs":
            freed.wait(30)
        return os.open("/dev/full", os.O_WRONLY)

    monkeypatch.setattr("webmap.core.shift_files.open_regular", opened)
    log = ShiftLog()
    log.begin(tmp_path)
    begin = time.monotonic()
    for number in range(MOST_QUEUED + 50):
        log.note("stop", "STOP", robot=RobotName(f"r{number}", "Bob"))
    assert time.monotonic() - begin < 2.0
    assert log.lost == 50
    assert len(log.entries()) == MOST_QUEUED + 50  # pages still show them
    freed.set()
    wait_for(lambda: log.trouble)
    assert log.trouble == "The log could not be written: No space left on device."
    log.end()


def test_note_never_raises():
    class Broken:
        id = name = property(lambda self: 1 / 0)

    assert ShiftLog().note("stop", "STOP", robot=Broken()) is False
