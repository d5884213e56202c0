"""A STOP that was acknowledged stands, at whichever line the gate is killed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")


@pytest.fixture(scope="module")
def deaths(tmp_path_factory):
    """What is left after each: by, lines, acknowledged, lived, who says STOP."""
    script = Path(__file__).with_name("records_crash.py")
    command = [sys.executable, script, tmp_path_factory.mktemp("state")]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return [json.loads(line) for line in said.splitlines()]


def test_a_stop_is_on_disk_before_it_is_acknowledged(deaths):
    stops = [death for death in deaths if death[0] == "Ann"]
    assert len(stops) > 10, "it takes more lines than that"
    assert {stands for _, _, _, _, stands in stops} == {None, "Ann"}, "whole, or not"
    for _, lines, acknowledged, _, stands in stops:
        assert stands == "Ann" or not acknowledged, f"after {lines} lines"
    assert stops[-1][2:] == [True, True, "Ann"]


def test_a_stop_on_disk_stays_at_every_later_crash_point(deaths):
    stands = [death[4] for death in deaths if death[0] == "Ann"]
    assert stands == sorted(stands, key=lambda by: by == "Ann")


def test_a_reset_stop_is_gone_from_disk_before_the_reset_is_acknowledged(deaths):
    ends = [death for death in deaths if death[0] is None]
    assert {stands for _, _, _, _, stands in ends} == {"Ann", None}
    for _, lines, acknowledged, _, stands in ends:
        assert stands is None or not acknowledged, f"after {lines} lines"
