"""Run pytest, and run the failed tests a second time, alone.

A browser that shares two cores with another browser may be delayed by seconds, longer
than a test allows, and a shared machine may not run for a moment. So if only a few
tests fail, they run again. A test that fails again has failed. A test that passes is
listed: its waiting time is too short and must be corrected. A safety test does not run
again. If branches are counted, those of the second run are added to the first.

Usage: pytest_beside.py JOBS [PYTEST ARGUMENT...]
"""

import subprocess
import sys

import pytest

BY_FILE = ("--dist", "loadfile", "--no-loadscope-reorder")
"""Workers run whole files, in order. Otherwise xdist starts with the files that have
the most tests."""

MOST = 10
"""With more failures than this, no test runs again."""


class Failed:
    """A plugin of pytest that records the failed tests.

    Attributes:
        tests: Their ids, each once.
        uncollected: Whether anything could not be collected.
        unsafe: Whether a test with the mark ``safety`` has failed.

    """

    def __init__(self) -> None:
        self.tests: dict[str, None] = {}
        self.uncollected = False
        self.unsafe = False

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record the result of a part of a test."""
        if report.failed:
            self.tests[report.nodeid] = None
            self.unsafe = self.unsafe or "safety" in report.keywords

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Record the result of collecting a file."""
        self.uncollected = self.uncollected or report.failed


def main(jobs: str, *arguments: str) -> int:
    """Run the tests.

    Args:
        jobs: Number of parallel workers, in the form of pytest-xdist's ``-n``.
        *arguments: Options of pytest and the tests to run.

    Returns:
        pytest's exit status: of the first run, or of the second.

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
    results = [each for each in arguments if each.startswith("--results=")]
    counted = [each for each in arguments if each.startswith("--cov")]
    added = [*counted, "--cov-append"] if counted else []
    again = [sys.executable, "-m", "pytest", "-q", "-rA", *results, *added, *tests]
    status = subprocess.call(again)
    if status == 0:
        print(
            "Passed the second time; correct these tests:",
            *tests,
            sep="\n  ",
            flush=True,
        )
    return status


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
