"""The page reports a robot that does not obey, and a slow link.

Keys go from a real Chromium through the real display and gate to a robot that records
its commands. Its odometry goes back to the text on the page.
"""

import time

import pytest
from safety_bench import V_MAX, Bench, pass_time
from safety_run import LONG

from equipment.waiting import wait_for
from webmap.gate.rules.motion import DEADMAN
from webmap.testing import Shape

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

ALARM = "document.querySelector('.webmap-alarm')?.innerText"
COVERED = """(() => {
    const box = document.querySelector(".webmap-alarm").getBoundingClientRect();
    return box.left <= 0 && box.top <= 0 &&
        box.right >= innerWidth && box.bottom >= innerHeight;
})()"""
TEXT = "document.body.innerText"

EACH_WAY = 0.075
"""Latency of the slow link in seconds: a round trip then takes over 150 ms."""

BLIND, STOPS_WITHIN = 0.25, 0.5
"""The distance that S15 allows, in metres, and the time to stop, in seconds."""


@pytest.fixture(scope="module")
def stubborn(tmp_path_factory):
    """A bench whose robot never stops by itself."""
    with Bench(tmp_path_factory.mktemp("truth"), timeout=None) as bench:
        yield bench


@pytest.fixture
def bench(stubborn):
    yield stubborn
    stubborn.web_hop.shape(Shape())
    stubborn.robot.obeys = True
    stubborn.let_go()
    stop_and_reset(stubborn)


def drive_at_full_speed(bench):
    """Drive at full speed; on a busy machine this may need several attempts."""
    deadline = time.monotonic() + 40
    while time.monotonic() < deadline:
        bench.drive_off()
        if bench.robot.log.moving_since(0.0)[-1].twist.vx == pytest.approx(V_MAX):
            return
        bench.let_go()
        pass_time(2.0)  # the gate forgets slow round trips in this time
    raise AssertionError(f"not at full speed: {bench.tab.evaluate(TEXT)}")


def stop_and_reset(bench):
    """Press STOP, whose repeated zeros stop the robot, and reset the STOP."""
    bench.space("keyDown")
    bench.space("keyUp")
    wait_for(lambda: abs(bench.robot.velocity.vx) < 0.01, "a standstill")
    bench.reset_stop()


def test_the_page_shows_an_alarm_until_a_disobeying_robot_stops(bench):
    bench.drive_off()
    bench.robot.obeys = False
    bench.let_go()
    released = time.monotonic()
    bench.tab.wait(f"({ALARM} ?? '').includes('ROBOT NOT OBEYING')")
    shown_after = time.monotonic() - released
    assert shown_after > 0.9, "the robot has a second to brake"
    # The page also waits for a processor, with a lower priority.
    assert shown_after < 1.6 + 3 * bench.sentinel.stolen(released)
    alarm = bench.tab.evaluate(ALARM)
    assert "Use the emergency stop of the robot." in alarm
    assert "Bob" in alarm
    assert "zero sent, still moving at" in alarm
    assert bench.tab.evaluate(COVERED), "the alarm does not cover the page"
    assert bench.robot.log.moving_since(released + 0.5) == []
    bench.robot.obeys = True
    stop_and_reset(bench)
    bench.tab.wait("document.querySelector('.webmap-alarm') === null")


def test_the_page_shows_no_alarm_for_a_robot_that_obeys(bench):
    bench.drive_off()
    bench.let_go()
    released = time.monotonic()
    while time.monotonic() < released + 1.5:
        assert bench.tab.evaluate(ALARM) is None


@LONG
def test_no_velocity_is_sent_for_ten_seconds_after_a_key_release_and_its_zeros(bench):
    bench.drive_off()
    bench.let_go()
    pass_time(1.0)
    count = len(bench.robot.log.twists)
    pass_time(10.0)
    assert bench.robot.log.twists[count:] == []


def test_a_slow_link_lowers_the_speed_limit_and_the_page_shows_the_reason(bench):
    drive_at_full_speed(bench)
    # A sudden latency is a gap that may stop the robot, so stop and drive again.
    bench.let_go()
    bench.web_hop.shape(Shape(latency=EACH_WAY))
    bench.drive_off(within=45.0)
    text = bench.tab.evaluate(TEXT)
    assert "slow connection: " in text, text
    assert "at most 0.2" in text, text
    # A round trip takes both ways, and longer because of the wait for a tick.
    most = BLIND / (2 * EACH_WAY + DEADMAN + STOPS_WITHIN)
    now = time.monotonic()
    late = [received.speed for received in bench.robot.log.moving_since(now - 0.3)]
    assert late
    assert max(late) <= most, (max(late), most)
    assert min(late) > 0.1, "a slow link must slow the robot down, not stop it"

    bench.web_hop.shape(Shape())
    bench.let_go()
    drive_at_full_speed(bench)
    assert "slow connection: " not in bench.tab.evaluate(TEXT)


def test_a_link_slower_than_the_age_limit_stops_a_robot_despite_a_held_key(bench):
    bench.drive_off()
    bench.web_hop.shape(Shape(latency=0.2))
    wait_for(lambda: bench.robot.log.twists[-1].is_zero, "zero")
    stopped = time.monotonic()
    pass_time(1.5)
    bench.repeat_press()
    assert bench.robot.log.moving_since(stopped) == []
