"""Run pytest on all cores, and what failed there once more, alone.

A browser that shares two cores with another one may be held up for seconds where a
test allows for less. So a few tests that fail beside others get a second look without
these. What fails then too has failed, and what passes is named: it waits for too
little, which is to be mended.

Usage: pytest_beside.py JOBS [PYTEST ARGUMENT...]
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

MOST = 5
"""More failures than that are no accident and get no second look."""

FAILED = 1
"""pytest's exit status if tests were run and some failed."""


def main(jobs: str, *arguments: str) -> int:
    """Run the tests.

    Args:
        jobs: How many of them run at once, as pytest-xdist's ``-n`` takes it.
        *arguments: Options of pytest and the tests that are meant.

    Returns:
        pytest's exit status: of the first run, or of the second look.

    """
    with tempfile.TemporaryDirectory() as folder:
        pytest = [sys.executable, "-m", "pytest", "-q", "-o", f"cache_dir={folder}"]
        beside = [*pytest, "-rN", "-n", jobs, "--dist", "loadfile", *arguments]
        status = subprocess.call(beside)
        cached = Path(folder, "v/cache/lastfailed")
        if status != FAILED or not cached.exists():
            return status
        failed = list(json.loads(cached.read_text()))
        print(f"\n{len(failed)} failed beside others:", *failed, sep="\n  ", flush=True)
        if len(failed) > MOST:
            return status
        print("\nNow alone:", flush=True)
        status = subprocess.call([*pytest, "-rA", *failed])
        if status == 0:
            print("Passed alone, and is to be mended:", *failed, sep="\n  ", flush=True)
        return status


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
