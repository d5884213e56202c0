"""Robots of every source are declared, equipped and written as recorded."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from wires_recording import WRITES, agreed, compare
from wires_sources import SOURCES, WRONG

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

PROGRAM = Path(__file__).with_name("wires_sources.py")


@pytest.fixture(scope="module")
def recordings(tmp_path_factory, request):
    """The recording of each source."""
    folder = tmp_path_factory.mktemp("wires")
    chosen = [
        name
        for name in (*SOURCES, *WRONG)
        if any(f"[{name}]" in item.name for item in request.session.items)
    ]
    if WRITES:
        return agreed(played(folder, "write", chosen), played(folder, "write", chosen))
    return played(folder, "compare", chosen)


def played(folder, mode, chosen):
    """Play the chosen sources and return their recordings."""
    done = subprocess.run(
        [sys.executable, PROGRAM, folder / "played.json", mode, *chosen],
        capture_output=True,
        text=True,
        timeout=850,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "played.json").read_text("utf-8"))


@pytest.mark.parametrize("name", SOURCES)
def test_the_robots_of_each_source_match_the_recording(recordings, name):
    text = recordings[name]
    assert not text.startswith("it failed"), text
    compare(name, text)


@pytest.mark.parametrize("name", WRONG)
def test_error_messages_match_the_recording(recordings, name):
    """The recording has only error messages: record again after changing one."""
    text = recordings[name]
    assert "it failed" not in text, text
    compare(name, text)
