"""Robots are watched while pages are open, and for a short time afterwards."""

from webmap.base.looking import GRACE, Looking


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
    def __init__(self, looking, fails=False):
        self.looking, self.fails = looking, fails
        self.found = []
        looking.follow(self)

    def looking_changed(self):
        self.found.append(self.looking.somebody)
        if self.fails:
            raise ValueError("I cannot")


def test_somebody_looks_where_no_pages_are_served():
    looking = Looking()
    page = looking.page_opened()
    page.remove()
    assert looking.somebody


def test_nobody_looks_some_time_after_the_last_page_was_closed():
    looking, clock = Looking(), Clock()
    looking.expect_pages(clock)
    first, second = looking.page_opened(), looking.page_opened()
    clock.pass_on()
    assert looking.somebody
    first.remove()
    first.remove()
    clock.pass_on()
    assert looking.somebody
    second.remove()
    assert looking.somebody
    clock.pass_on()
    assert not looking.somebody


def test_nobody_looks_some_time_after_the_start_without_a_page():
    looking, clock = Looking(), Clock()
    looking.expect_pages(clock)
    clock.pass_on()
    assert not looking.somebody


def test_pages_that_were_open_before_they_are_expected_count():
    looking, clock = Looking(), Clock()
    looking.page_opened()
    looking.expect_pages(clock)
    clock.pass_on()
    assert looking.somebody


def test_a_page_that_is_loaded_again_changes_nothing():
    looking, clock = Looking(), Clock()
    looking.expect_pages(clock)
    follower = Follower(looking)
    looking.page_opened().remove()
    looking.page_opened()
    clock.pass_on()
    assert follower.found == []


def test_followers_hear_each_change_once_also_if_another_one_fails(caplog):
    looking, clock = Looking(), Clock()
    looking.expect_pages(clock)
    fails, well, gone = Follower(looking, fails=True), Follower(looking), None
    gone = Follower(looking)
    looking.forget(gone)
    clock.pass_on()
    looking.page_opened()
    looking.page_opened()
    assert (fails.found, well.found) == ([False, True], [False, True])
    assert gone.found == []
    assert caplog.text.count("did not adapt to who looks") == 2


def test_somebody_looks_after_the_end():
    looking, clock = Looking(), Clock()
    looking.expect_pages(clock)
    clock.pass_on()
    looking.end()
    looking.page_opened().remove()
    clock.pass_on()
    assert looking.somebody
