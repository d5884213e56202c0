"""Scripted drives send the recorded messages over pipe, sockets and bridges."""

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from wires_recording import WRITES, agreed, compare, difference, recorded
from wires_scripts import SCRIPTS

pytestmark = [pytest.mark.slow, pytest.mark.serial, pytest.mark.timeout(300)]

PROGRAM = Path(__file__).with_name("wires_scripts.py")


def played(folder, names):
    """Play scripts in processes of their own and return the recordings.

    Two run at once, since each waits most of the time.
    """
    with ThreadPoolExecutor(2) as both:
        halves = [names[::2], names[1::2]]
        found = both.map(played_by_one, (folder / "one", folder / "two"), halves)
        return {name: text for each in found for name, text in each.items()}


def played_by_one(folder, names):
    """Play scripts in one process and return the recordings."""
    if not names:
        return {}
    folder.mkdir()
    result = folder / "played.json"
    mode = "write" if WRITES else "compare"
    done = subprocess.run(
        [sys.executable, PROGRAM, result, mode, *names],
        env=os.environ | {"PYTHONPATH": str(PROGRAM.parents[1])},
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert result.exists(), done.stderr
    return json.loads(result.read_text("utf-8"))


@pytest.fixture(scope="module")
def recordings(tmp_path_factory, request):
    """The recording of each script; a script with differences is played again.

    A pause of the computer ends a drive, which is correct.
    """
    chosen = [
        name
        for name in SCRIPTS
        if any(name in item.name for item in request.session.items)
    ]
    found = played(tmp_path_factory.mktemp("wires"), chosen)
    if WRITES:
        return agreed(found, played(tmp_path_factory.mktemp("wires"), chosen))
    others = [name for name in chosen if found.get(name) != recorded(name)]
    if others:
        for name in others:
            print(f"played a second time: {difference(name, found.get(name, ''))}")
        found |= played(tmp_path_factory.mktemp("wires"), others)
    return found


@pytest.mark.parametrize("name", SCRIPTS)
def test_the_messages_of_each_scripted_drive_match_the_recording(recordings, name):
    text = recordings.get(name, "it was not played")
    assert not text.startswith("it "), text
    compare(name, text)
