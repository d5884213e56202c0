"""The tests have the same surroundings on every machine."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from equipment.environment import outside, unusual_environment

HERE = Path(__file__).parent


@pytest.mark.browser
@pytest.mark.slow
def test_nothing_of_the_machine_reaches_the_tests(tmp_path):
    def seen(environment, umask):
        printed = subprocess.check_output(
            [sys.executable, HERE / "seen_surroundings.py"],
            env=environment,
            umask=umask,
            text=True,
        )
        return json.loads(printed)

    usual = seen({"PATH": os.environ["PATH"]}, 0o022)
    assert usual["page"]["language"] == "en-US"
    assert usual["page"]["zone"] == "UTC"
    assert seen(unusual_environment(tmp_path), 0o077) == usual


def test_pip_gets_the_environment_of_the_machine(monkeypatch):
    assert outside()["PATH"] == os.environ["PATH"]
