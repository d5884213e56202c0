"""The verdicts of the long run, and the age of a pose, with invented figures."""

import importlib.util
import json
import struct
import time

from benchmarks.__main__ import ROWS
from benchmarks.soak import AGES, FRAMES, MEMORY, judged
from benchmarks.stamped import Stamped, age
from benchmarks.watchers import PLACE
from webmap import svg
from webmap.scene.node import Fragment
from webmap.scene.wire.encode import encode_changes


def samples(**last):
    """Return equal samples, except for the last values of some figures."""
    names = (*MEMORY, *AGES, FRAMES)
    begin = dict.fromkeys(names, 100.0)
    return [begin] * 30 + [begin | last] * 10


def failed(**last):
    return [verdict.name for verdict in judged(samples(**last)) if not verdict.passed]


def test_equal_samples_pass():
    assert failed() == []


def test_memory_may_grow_by_two_percent():
    assert failed(**{MEMORY[0]: 101.9, MEMORY[1]: 102.1}) == [MEMORY[1]]


def test_ages_may_grow_by_one_tick_of_the_display():
    assert failed(**{AGES[0]: 149.0, AGES[1]: 151.0}) == [AGES[1]]


def test_the_slowest_viewer_must_keep_its_frames():
    assert failed(**{FRAMES: 94.0}) == [FRAMES]


def test_what_grows_before_the_warm_up_has_ended_is_no_growth():
    first = dict.fromkeys((*MEMORY, *AGES, FRAMES), 50.0)
    assert all(verdict.passed for verdict in judged([first] * 10 + samples()))


def test_the_age_of_a_pose_is_found_in_the_bytes_of_the_display():
    now = 1234.5
    frame = Stamped(3).frame(now)
    message = json.loads(frame[4:])["msg"]
    place = message["pose"]["pose"]["position"]
    root = svg.g()
    fragment = Fragment(root)
    root.set_pose(place["x"], place["y"], 0.0)
    (found,) = PLACE.findall(encode_changes(fragment, 0))
    assert abs(age(*struct.unpack("<f", found), now + 0.25) - 0.25) < 1e-3
    assert abs(message["header"]["stamp"]["secs"] - time.time()) < 60


def test_each_benchmark_has_a_module():
    names = [f"benchmarks.{row.name}" for row in ROWS]
    assert [name for name in names if importlib.util.find_spec(name) is None] == []
