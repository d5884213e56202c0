"""An operator drives a good robot while hostile bridges send arbitrary data."""

import pytest
from safety_hostile import beside, drive
from safety_load import helper
from safety_run import FULL, grace

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]


TRIALS = 7
"""The greatest number of trials, if other processes disturb some of them."""

MOST_STOLEN = 0.1
"""Steal time, in seconds per quarter second, above which a trial may not count."""

MOST_WAITED = 0.1
"""Wait for a processor, in the same unit, above which a trial may not count."""


def check(bench, strict=FULL):
    """Assert that the peers disturb neither the good robot nor its STOP.

    If ``strict``, one trial decides. Otherwise a disturbed trial does not count if
    other processes or the host took the processors during the trial. After one
    disturbed trial that counts, the next two that count must be undisturbed. The test
    is skipped if no trial counts; STOP is checked in each of them.
    """
    trials, owed, allowed = [], 1, not strict
    while owed and len(trials) < TRIALS:
        driven = drive(bench)
        trials.append(driven)
        assert driven.stop < 0.1 + grace(driven.stop_jitter), driven
        assert driven.moved_after == 0, driven
        if undisturbed(driven):
            owed -= 1
        elif strict or not contended(driven):
            assert allowed, f"disturbed: {trials}"
            owed, allowed = 2, False
    assert allowed or not owed, f"disturbed too often: {trials}"
    if owed:
        pytest.skip(f"other processes took the processors in {TRIALS} trials: {trials}")


def undisturbed(driven):
    """Return whether the robot drove as well as without other robots."""
    late = grace(driven.driving_jitter)
    return (
        driven.refused == 0
        and driven.zeros == 0
        and driven.velocity_gap < 0.15 + late
        and driven.tick_gap < 0.15 + late
    )


def contended(driven):
    """Return whether other processes or the host took processor time."""
    waited = max(driven.driving_jitter, driven.waited)
    return driven.stolen > MOST_STOLEN or waited > MOST_WAITED


def test_a_robot_without_hostile_peers_drives_and_stops(bench):
    with beside(bench):
        check(bench)


FLOODS = [
    ("tiny_texts", "tiny_texts", "tiny_texts"),
    ("endless_message", "pings", "empty_frames"),
]


@pytest.mark.parametrize("peers", FLOODS, ids=" ".join)
def test_a_robot_drives_and_stops_while_three_peers_flood_the_display(bench, peers):
    with beside(bench, *(f"safety_hostile_peers:{peer}" for peer in peers)):
        check(bench)


def test_a_robot_drives_and_stops_beside_a_hostile_robot_and_a_hostile_viewer(bench):
    with (
        beside(bench, "safety_hostile_peers:tiny_texts"),
        helper("safety_hostile_viewer.py", bench.url, prepare=None) as viewer,
    ):
        assert viewer.stdout.readline() == "ready\n"
        check(bench)
