"""The work for moving robots in a display and its viewers, with a clock of the test.

The counts do not depend on the machine. An exceeded bound means more work for each
frame of each viewer: find the cause before you raise the bound.
"""

import gc
import sys
import tracemalloc

import pytest

from webmap.scene import live, svg
from webmap.scene.node import Fragment, frame_request
from webmap.scene.wire.encode import encode_changes
from webmap.scene.wire.opcodes import Op, varint
from webmap.scene.wire.session import SceneSession

TICK = 0.05
ROBOTS = 20


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(live, "time", clock)
    return clock


class Fleet:
    """Robots that move all the time, and pages that show all of them."""

    def __init__(self, clock: Clock, viewers: int) -> None:
        self.clock = clock
        self.fragments = [Fragment(svg.g(svg.title("r"))) for _ in range(ROBOTS)]
        self.sessions = [SceneSession() for _ in range(viewers)]
        for session in self.sessions:
            for fragment in self.fragments:
                session.mount(fragment, under=0)
        self.steps = 0
        self.sent: list[int] = []
        self.run(1.0)
        self.sent.clear()

    def run(self, seconds: float, rate: int = 20) -> None:
        """Let poses arrive at a rate, and the pages tick 20 times a second."""
        for _ in range(round(seconds / TICK)):
            self.clock.now += TICK
            for _ in range(max(1, rate // 20)):
                self.move()
            self.tick()

    def move(self) -> None:
        self.steps += 1
        for fragment in self.fragments:
            fragment.root.set_pose(self.steps / 100, 0.5, 0.1)
            fragment.root.set_age(0.0)

    def tick(self) -> None:
        for session in self.sessions:
            frame = session.frame(self.clock.now)
            if frame is not None:
                self.sent.append(len(frame))
                number = int.from_bytes(frame[3:7], "little")
                session.receive(f'{{"op":"seen","frame":{number}}}')


def calls_of(work, *args) -> int:
    """Return the number of calls of functions, in Python and in C."""
    calls = 0

    def count(frame, event, arg):
        nonlocal calls
        calls += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        work(*args)
    finally:
        sys.setprofile(before)
    return calls


@pytest.mark.parametrize("rate", [20, 1000])
def test_a_viewer_gets_20_frames_a_second_of_robots_of_any_rate(clock, rate):
    fleet = Fleet(clock, 1)
    fleet.run(5.0, rate)
    assert len(fleet.sent) == 100
    assert max(fleet.sent) <= 15 + 32 * ROBOTS


def test_a_frame_for_one_more_viewer_takes_few_calls(clock):
    one, many = Fleet(clock, 1), Fleet(clock, 11)
    for fleet in (one, many):
        clock.now += TICK
        fleet.move()
    alone, together = calls_of(one.tick), calls_of(many.tick)
    more = (together - alone) / 10
    assert alone <= 38 * ROBOTS
    assert more <= 5 * ROBOTS


def test_a_frame_looks_only_at_what_changed_since_the_last_one(clock):
    fleet = Fleet(clock, 1)
    (page,) = fleet.sessions
    frame_request.listen(lambda: None)
    try:
        for _ in range(2):  # the first one looks at everything
            frame_request.begin()
            fleet.tick()
        looked_at = []

        class Looked(dict):
            def get(self, fragment):
                looked_at.append(fragment)
                return dict.get(self, fragment)

        page._fragments = Looked(page._fragments)
        moved = fleet.fragments[3]
        moved.root.set_pose(1.0, 2.0, 3.0)
        frame_request.begin()
        fleet.tick()
        assert looked_at == [moved]
        moved.root.set_pose(2.0, 2.0, 3.0)  # a frame that the page missed
        frame_request.begin()
        frame_request.begin()
        fleet.tick()
        assert set(looked_at) == set(fleet.fragments)
        assert len(fleet.sent) >= 2
    finally:
        frame_request.listen(None)


def test_a_pose_takes_few_calls(clock):
    fleet = Fleet(clock, 1)
    calls = calls_of(fleet.move) / ROBOTS
    assert calls <= 16


def test_a_point_of_a_line_of_any_length_takes_few_calls_and_bytes(clock):
    for points in (2, 20_000):
        line = svg.polyline().set_line([(x, 0.5) for x in range(points)])
        fragment = Fragment(svg.g(line))
        session = SceneSession()
        session.mount(fragment, under=0)
        session.frame(clock.now)
        session.receive('{"op":"seen","frame":1}')
        assert calls_of(line.extend_line, [(1.0, 2.0)]) <= 13
        assert calls_of(encode_changes, fragment, fragment.revision - 1) <= 45
        head = 15 + len(bytes([Op.DELTA]) + varint(fragment.id))
        bytes_of_point = len(session.frame(clock.now)) - head
        assert bytes_of_point <= 13 + len(varint(line.id))


def fill_caches() -> None:
    for number in range(varint.cache_info().maxsize):
        varint(1 << 40 | number)


def test_frames_leave_no_memory_behind(clock):
    fill_caches()
    fleet = Fleet(clock, 3)
    fleet.run(5.0)
    gc.collect()
    before = sys.getallocatedblocks()
    fleet.run(50.0)
    fleet.sent.clear()
    gc.collect()
    # 1,000 frames of 3 viewers.
    assert sys.getallocatedblocks() - before < 200


def test_a_frame_takes_little_more_memory_than_its_bytes(clock):
    fleet = Fleet(clock, 1)
    clock.now += TICK
    fleet.move()
    tracemalloc.start()
    try:
        fleet.tick()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak <= 20 * fleet.sent[-1] + 4096


def test_a_viewer_that_reads_nothing_keeps_the_memory_of_one_frame(clock):
    """An hour of moving robots, and of messages to the parts of the page."""
    fill_caches()
    fleet = Fleet(clock, 1)
    (session,) = fleet.sessions
    for _ in range(SceneSession.WINDOW + 1):
        clock.now += TICK
        fleet.move()
        session.frame(clock.now)
    gc.collect()
    before = sys.getallocatedblocks()
    for _ in range(2000):
        clock.now += 1.8
        fleet.move()
        assert session.frame(clock.now) is None
    gc.collect()
    assert sys.getallocatedblocks() - before < 200
    for number in range(1, session._frame + 1):
        session.receive(f'{{"op":"seen","frame":{number}}}')
    frame = session.frame(clock.now)
    assert len(frame) <= 15 + 32 * ROBOTS
    assert session.frame(clock.now) is None, "one frame and no further frames"
