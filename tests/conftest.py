"""Settings and fixtures of all tests."""

import gc
import json
import os
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from playwright.sync_api import Browser, expect

from equipment.chromium import launched
from equipment.environment import use_own_environment
from equipment.simulator_fixtures import later_port, ros1, ros2
from thorough import is_thorough
from webmap.base.logs import budgets

__all__ = ["later_port", "ros1", "ros2"]
"""Fixtures from another file."""

use_own_environment()

# Else each run of pytest compiles all tests again.
sys.dont_write_bytecode = False

# On two busy cores, the time of an example does not depend on the code alone.
# Each run tries other examples, so a run needs few.
settings.register_profile(
    "webmap",
    deadline=None,
    max_examples=50,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("webmap")

# This setting is for the whole process.
expect.set_options(timeout=15_000)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--results",
        type=Path,
        help="a file that gets a line of JSON for the outcome of each test",
    )


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Write the outcome and the time of each test, if the option asks for it."""
    file = config.getoption("results")
    if file is None or hasattr(config, "workerinput"):  # a worker of pytest-xdist
        return
    seconds = Counter[str]()
    for report in chain(*terminalreporter.stats.values()):
        if isinstance(report, pytest.TestReport):  # preparation, test, or clean-up
            seconds[report.nodeid] += report.duration
    kinds = {"passed": "passed", "skipped": "skipped", "xfailed": "skipped"}
    kinds |= dict.fromkeys(("failed", "error", "xpassed"), "failed")
    with file.open("a", encoding="utf-8") as results:
        for kind, outcome in kinds.items():
            for report in terminalreporter.stats.get(kind, []):
                skipped = outcome == "skipped" and isinstance(report.longrepr, tuple)
                why = report.longrepr[2].removeprefix("Skipped: ") if skipped else ""
                line = {
                    "test": report.nodeid,
                    "outcome": outcome,
                    "why": why,
                    "seconds": round(seconds[report.nodeid], 2),
                }
                results.write(json.dumps(line) + "\n")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the thorough tests, and run the slow files first.

    A slow file that begins last runs alone.
    """
    for item in items:
        if is_thorough(item.nodeid):
            item.add_marker("thorough")
    long = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in long)


def pytest_collection_finish() -> None:
    """Exclude the objects of all test modules from the garbage collection.

    Otherwise a full collection checks a million objects, and takes half a second. Many
    tests run a full collection.
    """
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def state_folder() -> Iterator[None]:
    """Store state, such as a STOP, in a new folder, not in the folder of the user."""
    with tempfile.TemporaryDirectory(prefix="webmap-state-") as folder:
        before = os.environ.get("WEBMAP_STATE_DIR")
        os.environ["WEBMAP_STATE_DIR"] = folder
        yield
        if before is None:
            del os.environ["WEBMAP_STATE_DIR"]
        else:
            os.environ["WEBMAP_STATE_DIR"] = before


@pytest.fixture(autouse=True)
def log_budgets() -> None:
    """Reset the limits of the log before each test."""
    budgets.clear()


def of_browsers(fixture_name: str, config: pytest.Config) -> str:
    """Return the scope of the browser.

    Other tests of the same worker need the thread for asyncio, so a browser ends with
    its module. If only tests with a browser run, all tests of a worker use one browser.
    """
    alone = re.match(r"browser\b(?!.* or )", config.getoption("markexpr"))
    return "session" if alone else "module"


@pytest.fixture(scope=of_browsers)
def chromium() -> Iterator[Browser]:
    with launched() as browser:
        yield browser
