"""An operator holds W under the full load: much data to show and many viewers."""

import os
import signal

import pytest
from safety_bench import pass_time
from safety_load import UNDER_LOAD, maps_coming, under_load

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]


@pytest.fixture(scope="module")
def loaded(bench):
    """The bench under the full load."""
    with under_load(bench):
        yield bench


def test_releasing_the_key_under_load_stops_the_robot_within_100_ms(loaded):
    with maps_coming(loaded):
        loaded.prove(
            f"the key is released; {UNDER_LOAD}",
            loaded.let_go,
            within=0.1,
            held_after=False,
        )


def test_the_dead_man_timeout_under_load_stops_the_robot_within_300_ms(loaded):
    def send(sig):
        os.killpg(loaded.browser.process.pid, sig)

    def back():
        loaded.linger(0.5)
        send(signal.SIGCONT)

    with maps_coming(loaded):
        loaded.prove(
            f"the browser is stopped; {UNDER_LOAD}",
            lambda: send(signal.SIGSTOP),
            within=0.3,
            back=back,
        )


def test_stop_under_load_stops_the_robot_within_100_ms(loaded):
    def back():
        loaded.space("keyUp")
        pass_time(0.5)
        loaded.reset_stop()

    with maps_coming(loaded):
        loaded.prove(
            f"STOP by the space bar while W is held; {UNDER_LOAD}",
            lambda: loaded.space("keyDown"),
            within=0.1,
            back=back,
        )
