"""Ages of unchanged data are sent twice a second, and pages show correct ages."""

import random
import struct
from types import SimpleNamespace

import pytest

from webmap.scene import live, svg
from webmap.scene.node import Fragment
from webmap.scene.wire.session import SceneSession

HEADER = struct.Struct("<HBId")
TICK = 0.05
START = 1000.0


class Clock:
    """The display's clock, which a test moves on."""

    def __init__(self):
        self.now = START

    def monotonic(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(live, "time", SimpleNamespace(monotonic=clock.monotonic))
    return clock


class Page:
    """A page that keeps the newest measurement time of each element, in seconds."""

    def __init__(self, *fragments):
        self.session = SceneSession()
        self.fragments = fragments
        for fragment in fragments:
            self.session.mount(fragment, under=0)
        self.known = {}
        self.sent = []

    def tick(self, now):
        """Receive the next frame, if there is one, and all its ages."""
        before = {f: self.session._fragments[f] for f in self.fragments}
        frame = self.session.frame(now)
        if frame is None:
            return
        number = HEADER.unpack_from(frame)[2]
        self.session.receive(f'{{"op":"seen","frame":{number}}}')
        self.sent.append((now, len(frame)))
        for fragment in self.fragments:
            if self.session._fragments[fragment] != before[fragment]:
                for node in fragment.root.walk():
                    if node._age is not None:
                        self.known[node] = node._age.measured


def robots(count):
    return [Fragment(svg.g()) for _ in range(count)]


def run(clock, page, feeds, seconds):
    """Let data arrive and the page tick at their own times."""
    due = sorted((START + first, each) for each, (first, _, _) in enumerate(feeds))
    end = START + seconds
    tick = START
    while tick < end:
        while due and due[0][0] <= tick:
            clock.now, each = due.pop(0)
            _, period, show = feeds[each]
            show()
            due = sorted([*due, (clock.now + period, each)])
        clock.now = tick
        page.tick(tick)
        yield tick
        tick += TICK


def test_a_page_of_robots_that_stand_still_gets_two_frames_a_second(clock):
    chance = random.Random(1)
    fragments = robots(20)
    page = Page(*fragments)
    feeds = [
        (chance.uniform(0, 0.1), 0.1, lambda f=fragment: set_same_pose(f))
        for fragment in fragments
    ]

    def set_same_pose(fragment):
        fragment.root.set_pose(1.0, 2.0, 3.0)
        fragment.root.set_age(0.02)

    for now in run(clock, page, feeds, 12.0):
        if now >= START + 2:
            for fragment in fragments:
                old = now - page.known[fragment.root]
                true = now - fragment.root._age.measured
                assert true <= old < 0.85, "fresh data looks stale"
    steady = [(at, size) for at, size in page.sent if at >= START + 2]
    assert len(steady) == 2 * 10
    # A section of a fragment and one age each, and nothing else.
    assert all(size <= HEADER.size + len(fragments) * 14 for _, size in steady)


def test_ages_that_wait_are_encoded_once_for_all_pages(clock, monkeypatch):
    from webmap.scene.wire import encode

    calls = []
    real = encode._encode_changes
    monkeypatch.setattr(
        encode, "_encode_changes", lambda *args: calls.append(args) or real(*args)
    )
    (fragment,) = robots(1)
    pages = [Page(fragment) for _ in range(10)]
    fragment.root.set_age(0.0)
    for step in range(40):
        clock.now = START + step * TICK
        fragment.root.set_age(0.0)
        for page in pages:
            page.tick(clock.now)
    assert len(calls) == 3  # the first frame has the age too
    assert {len(page.sent) for page in pages} == {4}


def test_an_age_travels_at_once_with_the_pose_that_it_dates(clock):
    (fragment,) = robots(1)
    page = Page(fragment)
    for step in range(40):
        clock.now = START + step * TICK
        fragment.root.set_pose(step, 0, 0)
        fragment.root.set_age(0.0)
        page.tick(clock.now)
        assert page.known[fragment.root] == clock.now
    assert len(page.sent) == 40


@pytest.mark.parametrize("period", [0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.3, 2.0])
def test_data_is_never_shown_fresher_than_it_is_nor_stale_while_it_is_fresh(
    clock, period
):
    """This holds at any rate; data that arrives too rarely looks stale in between."""
    fragments = robots(3)
    page = Page(*fragments)
    feeds = [
        (0.01 + 0.13 * number, period, lambda f=fragment: f.root.set_age(0.0))
        for number, fragment in enumerate(fragments)
    ]
    for now in run(clock, page, feeds, 8.0):
        for fragment in fragments:
            age, known = fragment.root._age, page.known.get(fragment.root)
            if age is None or known is None:
                continue
            assert known <= age.measured
            stale = now - known > age.limit
            assert stale == (now - age.measured > age.limit)


def test_data_that_stopped_is_stale_as_early_as_if_each_age_was_sent(clock):
    (fragment,) = robots(1)
    page = Page(fragment)
    stopped = START + 2.25
    feeds = [
        (0.0, 0.1, lambda: clock.now <= stopped and fragment.root.set_age(0.0)),
    ]
    stale = None
    for now in run(clock, page, feeds, 5.0):
        if stale is None and now - page.known.get(fragment.root, now) > 1.0:
            stale = now
    assert stopped + 0.9 <= stale <= stopped + 1.0 + TICK + 1e-9


def test_an_age_that_grows_and_an_age_that_ends_staleness_go_at_once(clock):
    (fragment,) = robots(1)
    root = fragment.root
    page = Page(fragment)
    root.set_age(0.0)
    page.tick(START)
    for now, old in [(0.1, 0.6), (0.15, float("inf")), (0.2, 0.0)]:
        clock.now = START + now
        root.set_age(old)
        page.tick(clock.now)
        assert page.known[root] == clock.now - old
    assert len(page.sent) == 4


def test_the_same_time_of_measurement_is_not_sent_again(clock):
    """A list that shows the age of a lost robot sets it at each look."""
    (fragment,) = robots(1)
    page = Page(fragment)
    fragment.root.set_age(0.0, limit=1.0)
    page.tick(START)
    for step in range(1, 200):
        clock.now = START + step * TICK + 1e-7 * step
        fragment.root.set_age(clock.now - START - 1e-7)
    revision = fragment.revision
    page.tick(clock.now)
    assert [size for _, size in page.sent[1:]] == [HEADER.size]  # its heartbeat
    fragment.root.set_age(float("inf"))
    assert fragment.revision == revision + 1
    fragment.root.set_age(float("inf"))
    assert fragment.revision == revision + 1


def test_a_pose_changes_only_by_what_can_be_seen(clock):
    (fragment,) = robots(1)
    root = fragment.root
    root.set_pose(1.0, 2.0, 0.5)
    revision = fragment.revision
    for step in range(100):
        root.set_pose(1.0 + step % 2 * 9e-5, 2.0 - step % 3 * 4e-5, 0.5 + 9e-6)
    assert fragment.revision == revision
    for step in range(100):  # slow motion adds up
        root.set_pose(1.0 + step * 1e-5, 2.0, 0.5)
    assert 5 <= fragment.revision - revision <= 10
    assert abs(root._transform[0] - (1.0 + 99e-5)) < 1e-4
    root.set_pose(1.0 + 99e-5, 2.0, 0.5 + 2e-5)
    assert root._transform[2] == 0.5 + 2e-5


def test_a_page_whose_answer_was_late_gets_each_age_at_once(clock):
    """With the network delay added, ages that wait would look stale."""
    (fragment,) = robots(1)
    page = Page(fragment)
    answers, frames = [], []
    for step in range(600):
        clock.now = START + step * TICK
        fragment.root.set_age(0.0)
        while answers and answers[0][0] <= clock.now:
            page.session.receive(answers.pop(0)[1])
        frame = page.session.frame(clock.now)
        if frame is not None:
            number = HEADER.unpack_from(frame)[2]
            delay = 0.4 if 10 <= step / 20 < 12 else 0.1
            answers.append((clock.now + delay, f'{{"op":"seen","frame":{number}}}'))
            frames.append(clock.now - START)
    prompt = [at for at in frames if 2 <= at < 10]
    late = [at for at in frames if 13 <= at < 20]
    again = [at for at in frames if 23 <= at < 30]
    assert len(prompt) == 2 * 8
    assert len(late) > 15 * 7
    assert len(again) == 2 * 7
