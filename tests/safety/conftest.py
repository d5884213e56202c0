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
