"""Problems are reported once, whatever their numbers, and are cleared."""

import logging

import pytest

from webmap import Map, Robot
from webmap.core.problems import Problems, without_numbers

log = logging.getLogger("webmap.test")


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def problems(clock, container) -> Problems:
    problems = Problems(log, lambda text: f"Bob: {text}", clock)
    problems.join(Map(container, 100, 100))
    return problems


@pytest.fixture
def lines(caplog) -> "Lines":
    caplog.set_level(logging.WARNING)
    return Lines(caplog)


class Lines:
    """The lines of the log."""

    def __init__(self, caplog) -> None:
        self._caplog = caplog

    @property
    def all(self) -> list[str]:
        return [record.getMessage() for record in self._caplog.records]


def received(channel) -> list[tuple]:
    return [call for call in channel.calls if call[0] in ("error", "mended")]


def nan_at(number: int) -> str:
    at = f"({number * 0.37 - 2:.3f}, nan)"
    return f"/plan: got {at} as point {number} of {number + 20}"


def test_a_problem_with_changing_numbers_is_sent_once_and_keeps_its_newest_text(
    problems, channel, lines, clock
):
    for number in range(100):
        clock.now += 0.1
        problems.set("plan", nan_at(number))
    assert lines.all == ["Bob: " + nan_at(0)]
    assert [call[:2] for call in received(channel)] == [("error", "Bob: " + nan_at(0))]
    assert problems.current == {"plan": nan_at(99)}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("it is 1 m off", "it is -3.25e-7 m off"),
        ("got nan", "got -inf"),
        ("got 3", "got NaN"),
        ("got Infinity", "got 1e300"),
        ("of [1, 2.5]", "of [1, 2.5, nan, -7]"),
        ("at (0.1, nan)", "at (nan, 12)"),
        ("of 0x7f3a12ff", "of 0x1b"),
        ("robot_1/odom", "robot_12/odom"),
    ],
)
def test_texts_that_differ_only_in_numbers_count_as_the_same(one, other):
    assert without_numbers(one) == without_numbers(other)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("got 3 metres", "got 3 seconds"),
        ("there is no frame 'laser'", "there is no frame 'map'"),
        ("information", "formation"),
    ],
)
def test_texts_that_differ_in_words_count_as_different(one, other):
    assert without_numbers(one) != without_numbers(other)


def test_a_text_with_other_words_replaces_the_previous_text(problems, channel, lines):
    problems.set("tf", "no frame 'map'")
    problems.set("tf", "two trees")
    assert lines.all == ["Bob: no frame 'map'", "Bob: two trees"]
    (_, first, number), (_, second, again) = received(channel)
    assert (first, second) == ("Bob: no frame 'map'", "Bob: two trees")
    assert number == again


def test_a_mended_problem_is_removed_from_the_page_once(problems, channel):
    problems.set("plan", nan_at(1))
    number = received(channel)[0][2]
    problems.clear("plan")
    problems.clear("plan")
    problems.clear("never set")
    assert received(channel)[1:] == [("mended", number)]
    assert problems.current == {}


def test_a_recurring_problem_is_logged_once_a_minute(problems, channel, lines, clock):
    for number in range(1250):
        problems.set("plan", nan_at(number))
        clock.now += 0.1
        problems.clear("plan")
    assert len(lines.all) == 3, "at 0, 60 and 120 seconds"
    assert len(received(channel)) == 2500, "the page receives each change"
    assert len({call[-1] for call in received(channel)}) == 1


def test_two_alternating_texts_are_each_logged_once_a_minute(problems, lines, clock):
    for _ in range(290):
        for text in ("no frame 'map'", "two trees"):
            problems.set("tf", text)
            clock.now += 0.1
    assert len(lines.all) == 2


def test_texts_that_always_differ_do_not_flood_the_log(problems, lines, clock):
    for number in range(500):
        problems.set("tf", "no frame " + "ab"[number % 2] * (number + 1))
        clock.now += 0.1
    assert len(lines.all) == 10
    clock.now += 60
    problems.set("tf", "no frame c")
    assert len(lines.all) == 11


@pytest.mark.parametrize(("good_for", "same"), [(59.0, True), (61.0, False)])
def test_a_problem_that_returns_within_a_minute_is_the_same_problem(
    problems, channel, clock, good_for, same
):
    problems.set("plan", nan_at(1))
    clock.now += 300
    problems.clear("plan")
    clock.now += good_for
    problems.set("plan", nan_at(1))
    first, _, second = received(channel)
    assert (first[2] == second[2]) is same


def test_problems_mended_long_ago_are_forgotten(problems, clock):
    for number in range(1000):
        problems.set(object(), "it broke")
        about = next(iter(problems.current))
        problems.clear(about)
        clock.now += 1.0 + number % 2
    assert len(problems._recurring) <= 61


def test_a_map_added_later_shows_the_newest_text(problems, channel, page):
    problems.set("plan", nan_at(1))
    problems.set("plan", nan_at(2))
    number = received(channel)[0][2]
    problems.join(Map(page.element("other"), 100, 100))
    assert received(channel)[1:] == [("error", "Bob: " + nan_at(2), number)]


def test_a_page_with_two_maps_gets_a_problem_once_until_its_last_map_leaves(
    problems, channel, page
):
    problems.join(Map(page.element("other"), 100, 100))
    problems.set("plan", nan_at(1))
    number = received(channel)[0][2]
    assert len(received(channel)) == 1
    one, other = problems.maps
    problems.leave(one)
    assert len(received(channel)) == 1
    problems.leave(other)
    assert received(channel)[1:] == [("mended", number)]


def test_removing_a_robot_from_its_map_removes_its_problems(container, channel):
    robot, map = Robot("Bob"), Map(container, 100, 100)
    map.add_robot(robot)
    robot.set_problem("odometry", "no pose")
    map.remove_robot(robot)
    number = received(channel)[0][2]
    assert received(channel)[1:] == [("mended", number)]
    robot.destroy()


def test_a_closed_page_gets_no_problems(problems, channel, page):
    problems.set("plan", nan_at(1))
    page.closed = True
    problems.set("tf", "two trees")
    problems.clear("plan")
    problems.leave(problems.maps[0])
    assert len(received(channel)) == 1
    page.closed = False


def test_a_very_long_text_is_shortened(problems, lines):
    problems.set("it", "x" * 100_000)
    (current,) = problems.current.values()
    assert current == "x" * 1000 + "..."
    problems.set("it", "x" * 100_000)
    problems.report("y" * 100_000)
