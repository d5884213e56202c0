"""The bench is the same for all that needs a real browser."""

import sys
from pathlib import Path

import pytest

# What drives Chromium and starts our processes is with the tests of the browser.
sys.path.insert(0, str(Path(__file__).parents[1] / "browser"))


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A robot, a display and a browser, with a proxy on each hop."""
    from safety_proof import ProvingBench

    with ProvingBench(tmp_path_factory.mktemp("safety")) as bench:
        yield bench


@pytest.fixture(scope="session", autouse=True)
def progress(pytestconfig):
    """Show how far a long run has come, past the capturing of output."""
    from safety_run import SHOW

    capture = pytestconfig.pluginmanager.getplugin("capturemanager")

    def show(text):
        with capture.global_and_fixture_disabled():
            print(f"\n{text}", end=" ", flush=True)

    SHOW.append(show)
    yield
    SHOW.remove(show)
