"""An acknowledged STOP stays active, at whichever line the gate is killed."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")


@pytest.fixture(scope="module")
def deaths(tmp_path_factory):
    """The result of each kill: by, lines, acknowledged, lived, user of the STOP."""
    script = Path(__file__).with_name("records_crash.py")
    command = [sys.executable, script, tmp_path_factory.mktemp("state")]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return [json.loads(line) for line in output.splitlines()]


def test_a_stop_is_on_disk_before_it_is_acknowledged(deaths):
    stops = [death for death in deaths if death[0] == "Ann"]
    assert len(stops) > 10, "storing takes more lines"
    assert {stored for _, _, _, _, stored in stops} == {None, "Ann"}, (
        "complete, or not at all"
    )
    for _, lines, acknowledged, _, stored in stops:
        assert stored == "Ann" or not acknowledged, f"after {lines} lines"
    assert stops[-1][2:] == [True, True, "Ann"]


def test_a_stop_on_disk_stays_at_every_later_crash_point(deaths):
    stored = [death[4] for death in deaths if death[0] == "Ann"]
    assert stored == sorted(stored, key=lambda by: by == "Ann")


def test_a_reset_stop_is_gone_from_disk_before_the_reset_is_acknowledged(deaths):
    ends = [death for death in deaths if death[0] is None]
    assert {stored for _, _, _, _, stored in ends} == {"Ann", None}
    for _, lines, acknowledged, _, stored in ends:
        assert stored is None or not acknowledged, f"after {lines} lines"
