"""Run pytest, and run the tests that failed a second time, alone.

A browser that shares two cores with another one may be held up for seconds where a
test allows for less, and a shared machine may stop for a moment. So a few tests that
fail get a second look. What fails then too has failed, and what passes is named: it
waits for too little, which is to be mended. A proof of safety gets no second look.

Usage: pytest_beside.py JOBS [PYTEST ARGUMENT...]
"""

import subprocess
import sys

import pytest

BY_FILE = ("--dist", "loadfile", "--no-loadscope-reorder")
"""Workers take whole files, in order. Otherwise xdist begins with the files that have
most tests."""

MOST = 10
"""More failures than that are no accident and get no second look."""


class Failed:
    """A plugin of pytest that notes which tests have failed.

    Attributes:
        tests: Their ids, each once.
        uncollected: Whether there is anything that could not be collected.
        unsafe: Whether a test with the mark ``safety`` is among them.

    """

    def __init__(self) -> None:
        self.tests: dict[str, None] = {}
        self.uncollected = False
        self.unsafe = False

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Take what became of a part of a test."""
        if report.failed:
            self.tests[report.nodeid] = None
            self.unsafe = self.unsafe or "safety" in report.keywords

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Take what became of a file."""
        self.uncollected = self.uncollected or report.failed


def main(jobs: str, *arguments: str) -> int:
    """Run the tests.

    Args:
        jobs: How many of them run at once, as pytest-xdist's ``-n`` takes it.
        *arguments: Options of pytest and the tests that are meant.

    Returns:
        pytest's exit status: of the first run, or of the second look.

    """
    failed = Failed()
    beside = ["-q", "-rN", "-n", jobs, *BY_FILE, *arguments]
    status = int(pytest.main(beside, plugins=[failed]))
    if status != pytest.ExitCode.TESTS_FAILED or failed.uncollected:
        return status
    tests = list(failed.tests)
    print(f"\n{len(tests)} failed at first:", *tests, sep="\n  ", flush=True)
    if failed.unsafe or not 0 < len(tests) <= MOST:
        return status
    print("\nNow a second time, alone:", flush=True)
    status = subprocess.call([sys.executable, "-m", "pytest", "-q", "-rA", *tests])
    if status == 0:
        print("Passed the second time, to be mended:", *tests, sep="\n  ", flush=True)
    return status


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
