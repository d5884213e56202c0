"""Robots are watched while pages are open, and for a short time afterwards."""

from webmap.base.audience import GRACE, Audience


class Timer:
    """A timer that has not fired."""

    def __init__(self):
        self.is_cancelled = False

    def cancel(self):
        self.is_cancelled = True


class Clock:
    """A loop whose timers a test ends."""

    def __init__(self):
        self.timers = []

    def call_later(self, after, fn, *args):
        self.timers.append((after, fn, args, Timer()))
        return self.timers[-1][-1]

    def pass_on(self):
        """Let the time of all timers pass."""
        timers, self.timers = self.timers, []
        for after, fn, args, timer in timers:
            assert after == GRACE
            if not timer.is_cancelled:
                fn(*args)


class Follower:
    def __init__(self, audience, fails=False):
        self.audience, self.fails = audience, fails
        self.found = []
        audience.follow(self)

    def audience_changed(self):
        self.found.append(self.audience.present)
        if self.fails:
            raise ValueError("I cannot")


def test_somebody_looks_where_no_pages_are_served():
    audience = Audience()
    page = audience.page_opened()
    page.remove()
    assert audience.present


def test_nobody_looks_some_time_after_the_last_page_was_closed():
    audience, clock = Audience(), Clock()
    audience.expect_pages(clock)
    first, second = audience.page_opened(), audience.page_opened()
    clock.pass_on()
    assert audience.present
    first.remove()
    first.remove()
    clock.pass_on()
    assert audience.present
    second.remove()
    assert audience.present
    clock.pass_on()
    assert not audience.present


def test_nobody_looks_some_time_after_the_start_without_a_page():
    audience, clock = Audience(), Clock()
    audience.expect_pages(clock)
    clock.pass_on()
    assert not audience.present


def test_pages_that_were_open_before_they_are_expected_count():
    audience, clock = Audience(), Clock()
    audience.page_opened()
    audience.expect_pages(clock)
    clock.pass_on()
    assert audience.present


def test_a_page_that_is_loaded_again_changes_nothing():
    audience, clock = Audience(), Clock()
    audience.expect_pages(clock)
    follower = Follower(audience)
    audience.page_opened().remove()
    audience.page_opened()
    clock.pass_on()
    assert follower.found == []


def test_followers_hear_each_change_once_also_if_another_one_fails(caplog):
    audience, clock = Audience(), Clock()
    audience.expect_pages(clock)
    fails, well, gone = Follower(audience, fails=True), Follower(audience), None
    gone = Follower(audience)
    audience.forget(gone)
    clock.pass_on()
    audience.page_opened()
    audience.page_opened()
    assert (fails.found, well.found) == ([False, True], [False, True])
    assert gone.found == []
    assert caplog.text.count("did not adapt to who looks") == 2


def test_somebody_looks_after_the_end():
    audience, clock = Audience(), Clock()
    audience.expect_pages(clock)
    clock.pass_on()
    audience.end()
    audience.page_opened().remove()
    clock.pass_on()
    assert audience.present
