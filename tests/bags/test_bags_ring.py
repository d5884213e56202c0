"""The ring of the last minutes: bounded, whole after a crash, and made a recording."""

import contextlib
import itertools
import json

import pytest

from webmap.bags import ring as ring_module
from webmap.bags.incident import make_recording
from webmap.bags.marks import find_marks
from webmap.bags.recording import Recording
from webmap.bags.ring import (
    SEGMENTS,
    EventRecord,
    Frame,
    PoseRecord,
    Ring,
    ScanRecord,
    VelocityRecord,
    encode,
    frames_in,
    segments,
)
from webmap.base.errors import ConfigError

SECOND = 10**9
BEGIN = 1_790_000_000 * SECOND
HERE = (1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0)
AHEAD = (0.5, 0.0, 0.1, 0.0, 0.0, 0.0)


def pose(time, place=HERE):
    return PoseRecord(time, time - 5_000_000, place, AHEAD)


def event(time, text="STOP by Ann", kind="stop"):
    return EventRecord(time, kind, text)


def frame(*records, robot="r1", name="Bob"):
    return Frame(robot, name, list(records))


@pytest.fixture
def new_ring(tmp_path):
    """Make rings in a folder, and close them at the end."""
    with contextlib.ExitStack() as rings:

        def make(folder=tmp_path, **limits):
            return rings.enter_context(contextlib.closing(Ring(folder, **limits)))

        yield make


def frames_of(folder):
    return [each for path in segments(folder) for each in frames_in(path.read_bytes())]


def test_frames_are_read_back_up_to_one_that_was_cut_off():
    whole = frame(pose(BEGIN), VelocityRecord(BEGIN, AHEAD, None, AHEAD), event(BEGIN))
    data = encode(whole) + encode(frame(event(BEGIN)))
    assert len(list(frames_in(data))) == 2
    assert list(frames_in(data[:-1])) == [whole]
    spoilt = data[:-1] + bytes([data[-1] ^ 1])
    assert list(frames_in(spoilt)) == [whole]


def test_the_oldest_segment_is_deleted_and_ten_minutes_stay(tmp_path, new_ring):
    ring = new_ring()
    for second in range(0, 1000, 10):
        ring.write([frame(pose(BEGIN + second * SECOND))], float(second))
    kept = frames_of(tmp_path)
    assert len(segments(tmp_path)) == SEGMENTS
    span = kept[-1].records[0].time - kept[0].records[0].time
    assert 600 * SECOND <= span <= 640 * SECOND


def test_a_robot_above_its_share_keeps_its_events_and_the_others_everything(
    tmp_path, new_ring
):
    ring = new_ring(per_robot=SEGMENTS * 2000)
    for number in range(100):
        loud = frame(*[pose(BEGIN)] * 20, event(BEGIN, f"{number}"), robot="loud")
        calm = [frame(pose(BEGIN), robot="calm")] if number % 10 == 0 else []
        ring.write([loud, *calm], 0.0)
    kept = frames_of(tmp_path)
    assert len([each for each in kept if each.robot == "calm"]) == 10
    loud = [each for each in kept if each.robot == "loud"]
    assert 2000 < sum(len(encode(each)) for each in loud) <= 4000
    assert all(isinstance(each.records[-1], EventRecord) for each in loud)
    assert len(loud[-1].records) == 1


def test_a_ring_is_bounded_however_many_robots_there_are(tmp_path, new_ring):
    ring = new_ring(total=SEGMENTS * 10_000)
    for second in range(700):
        frames = [frame(*[pose(BEGIN)] * 5, robot=f"r{n}") for n in range(50)]
        ring.write(frames, float(second))
    size = sum(path.stat().st_size for path in segments(tmp_path))
    assert size <= SEGMENTS * 10_000


def test_nothing_is_written_to_a_disk_that_is_nearly_full(tmp_path, new_ring):
    ring = new_ring(spare=1 << 60)
    with pytest.raises(OSError, match="are free on the disk"):
        ring.write([frame(pose(BEGIN))], 0.0)
    assert segments(tmp_path) == []


def test_a_frozen_ring_stays_when_its_segments_are_deleted(tmp_path, new_ring):
    ring = new_ring()
    ring.write([frame(event(BEGIN))], 0.0)
    frozen = tmp_path / "keep"
    ring.freeze(frozen)
    for path in segments(tmp_path):
        path.unlink()
    ring.write([frame(event(BEGIN, "later"))], 1.0)
    assert [each.records for each in frames_of(frozen)] == [[event(BEGIN)]]


def test_segments_of_an_earlier_run_that_are_too_old_are_deleted(
    tmp_path, monkeypatch, new_ring
):
    new_ring().write([frame(event(BEGIN, "before"))], 0.0)
    new_ring().write([frame(event(BEGIN, "after"))], 0.0)
    assert len(segments(tmp_path)) == 2
    late = ring_module.time.time() + 3600
    monkeypatch.setattr(ring_module.time, "time", lambda: late)
    new_ring().write([frame(event(BEGIN, "an hour later"))], 0.0)
    assert len(segments(tmp_path)) == 1


def recorded(tmp_path, new_ring, *frames):
    """Return the messages of a recording by topic, and its marks."""
    ring = new_ring(tmp_path / "ring")
    for number, each in enumerate(frames):
        ring.write([each], 40.0 * number)
    file = tmp_path / "incident.mcap"
    make_recording(tmp_path / "ring", file)
    recording = Recording([file])
    found = {}
    for each in recording.messages_of(lambda topic, type_name: True):
        found.setdefault(each.topic, []).append(recording.message(each))
    recording.close()
    marks = []
    find_marks([file], marks.append)
    return found, marks[-1].marks


def test_a_recording_has_the_poses_velocities_scans_and_events_of_all_robots(
    tmp_path, new_ring
):
    ranges = b"\x00\x00\x80\x3f" * 3  # one metre, as a float
    scan = ScanRecord(
        BEGIN + SECOND, BEGIN + SECOND, -1.0, 0.5, 0.1, 10.0, ranges, HERE
    )
    found, marks = recorded(
        tmp_path,
        new_ring,
        frame(pose(BEGIN), VelocityRecord(BEGIN, AHEAD, AHEAD, None), name="Bay 2/Bob"),
        frame(scan, event(BEGIN + 2 * SECOND), name="Bay 2/Bob"),
        frame(pose(BEGIN + SECOND), robot="r2", name="bay 2-bob"),
        frame(event(BEGIN + 3 * SECOND, "Controlled by Ann", "note"), robot="r2"),
    )
    assert {"/bay_2_bob/odom", "/bay_2_bob_2/odom", "/bay_2_bob/scan"} <= found.keys()
    (odometry,) = found["/bay_2_bob/odom"]
    assert odometry["pose"]["pose"]["position"] == {"x": 1.0, "y": 2.0, "z": 0.0}
    assert odometry["twist"]["twist"]["angular"]["z"] == pytest.approx(0.1)
    assert odometry["header"]["frame_id"] == "map"
    assert "/bay_2_bob/velocity_measured" not in found
    (sent,) = found["/bay_2_bob/velocity_sent"]
    assert sent["twist"]["linear"]["x"] == 0.5
    (scanned,) = found["/bay_2_bob/scan"]
    assert list(scanned["ranges"]) == [1.0, 1.0, 1.0]
    assert scanned["angle_max"] == 0.0
    frames = {
        each["child_frame_id"]: each["header"]["frame_id"]
        for topic in ("/tf", "/tf_static")
        for message in found[topic]
        for each in message["transforms"]
    }
    assert frames["bay_2_bob/laser"] == "bay_2_bob/base_link"
    assert frames["bay_2_bob/base_link"] == "map"
    assert [log["msg"] for log in found["/rosout"]] == [
        "STOP by Ann",
        "Controlled by Ann",
    ]
    assert [json.loads(e["data"])["kind"] for e in found["/webmap/events"]] == [
        "stop",
        "note",
    ]
    assert [(mark.at, mark.kind, mark.text) for mark in marks] == [
        (2.0, "stop", "Bay 2/Bob: STOP by Ann")
    ]


def test_no_recording_is_made_of_nothing_and_none_is_overwritten(tmp_path):
    file = tmp_path / "incident.mcap"
    with pytest.raises(ConfigError, match="no robot was seen"):
        make_recording(tmp_path, file)
    assert not list(tmp_path.iterdir())
    file.write_bytes(b"evidence")
    with pytest.raises(ConfigError, match="exists already"):
        make_recording(tmp_path, file)
    assert file.read_bytes() == b"evidence"


def test_robots_whose_names_have_no_letters_have_topics_too(tmp_path, new_ring):
    names = ["", "7", "\u674e", "7!"]
    found, _ = recorded(
        tmp_path,
        new_ring,
        *(
            frame(pose(BEGIN + n), robot=f"r{n}", name=name)
            for n, name in zip(itertools.count(), names, strict=False)
        ),
    )
    assert {topic for topic in found if topic.endswith("/odom")} == {
        "/robot/odom",
        "/robot_7/odom",
        "/robot_2/odom",
        "/robot_7_2/odom",
    }
