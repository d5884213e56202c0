"""Run pytest, and what failed once more, alone.

A browser that shares two cores with another one may be held up for seconds where a
test allows for less, and a shared machine may stop for a moment. So a few tests that
fail get a second look. What fails then too has failed, and what passes is named: it
waits for too little, which is to be mended.

Usage: pytest_beside.py JOBS [PYTEST ARGUMENT...]
"""

import subprocess
import sys

import pytest

BY_FILE = ("--dist", "loadfile", "--no-loadscope-reorder")
"""A file at a time, in the order of the tests; xdist would begin with files of many."""

MOST = 10
"""More failures than that are no accident and get no second look."""


class Failed:
    """A plugin of pytest that notes which tests have failed.

    Attributes:
        tests: Their ids, each once.
        uncollected: Whether there is anything that could not be collected.

    """

    def __init__(self) -> None:
        self.tests: dict[str, None] = {}
        self.uncollected = False

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take what became of a part of a test."""
        if report.failed:
            self.tests[report.nodeid] = None

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Take what became of a file."""
        self.uncollected = self.uncollected or report.failed


def main(jobs: str, *arguments: str) -> int:
    """Run the tests.

    Args:
        jobs: How many of them run at once, as pytest-xdist's ``-n`` takes it; ``0``
            runs them one after the other.
        *arguments: Options of pytest and the tests that are meant.

    Returns:
        pytest's exit status: of the first run, or of the second look.

    """
    failed = Failed()
    workers = [] if jobs == "0" else ["-n", jobs, *BY_FILE]
    status = int(pytest.main(["-q", "-rN", *workers, *arguments], plugins=[failed]))
    if status != pytest.ExitCode.TESTS_FAILED or failed.uncollected:
        return status
    tests = list(failed.tests)
    print(f"\n{len(tests)} failed at first:", *tests, sep="\n  ", flush=True)
    if not 0 < len(tests) <= MOST:
        return status
    print("\nNow once more, alone:", flush=True)
    status = subprocess.call([sys.executable, "-m", "pytest", "-q", "-rA", *tests])
    if status == 0:
        print("Passed then, and is to be mended:", *tests, sep="\n  ", flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
