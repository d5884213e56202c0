"""Provide the bench of all tests that need a real browser."""

import pytest


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A robot, a display and a browser, with a proxy on each connection."""
    from safety_proof import ProvingBench

    with ProvingBench(tmp_path_factory.mktemp("safety")) as bench:
        yield bench


@pytest.fixture(scope="session", autouse=True)
def progress(pytestconfig):
    """Print the progress of a long run, although pytest captures output."""
    from safety_run import SHOW

    capture = pytestconfig.pluginmanager.getplugin("capturemanager")

    def show(text):
        with capture.global_and_fixture_disabled():
            print(f"\n{text}", end=" ", flush=True)

    SHOW.append(show)
    yield
    SHOW.remove(show)
