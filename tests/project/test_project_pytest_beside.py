"""The second run of failed tests."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

TOOL = Path(__file__).parents[2] / "tools/pytest_beside.py"

ONCE = """
from pathlib import Path

def test_once():
    before = Path(__file__).with_name("before")
    existed = before.exists()
    before.touch()
    assert existed
"""


@pytest.fixture
def run(tmp_path):
    def run(source: str, *options: str) -> tuple[int, str]:
        (tmp_path / "test_it.py").write_text(source)
        (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n  safety\n")
        command = [sys.executable, str(TOOL), "1", *options, "test_it.py"]
        done = subprocess.run(
            command,
            cwd=tmp_path,
            env=os.environ
            | {
                "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
                "PYTEST_ADDOPTS": "-p xdist -p pytest_cov",
            },
            capture_output=True,
            text=True,
            check=False,
        )
        return done.returncode, done.stdout

    return run


def test_a_test_that_passes_the_second_time_is_named(run):
    status, shown = run(ONCE)
    assert status == 0
    assert (
        "Passed the second time; correct these tests:\n  test_it.py::test_once" in shown
    )


def test_a_test_that_also_fails_the_second_time_fails_the_run(run):
    status, shown = run(ONCE + "\ndef test_never():\n    assert not 1\n")
    assert status == 1
    assert "2 failed at first" in shown
    assert "correct these tests" not in shown


def test_branches_of_the_second_run_are_added(run, tmp_path):
    text = "def f(x):\n    if x:\n        return 1\n    return 2\n"
    (tmp_path / "counted.py").write_text(text)
    source = ONCE.replace("    assert", "    f(existed)\n    assert")
    test = "\n\ndef test_f():\n    f(False)\n"
    status, _ = run("from counted import f\n" + source + test, "--cov=counted")
    assert status == 0
    report = [sys.executable, "-m", "coverage", "report", "--fail-under=100"]
    assert subprocess.run(report, cwd=tmp_path, check=False).returncode == 0


def test_a_failed_safety_test_is_not_repeated(run):
    status, shown = run("import pytest\npytestmark = pytest.mark.safety\n" + ONCE)
    assert status == 1
    assert "Now a second time" not in shown


def test_many_failed_tests_are_not_repeated(run):
    source = "import pytest\n@pytest.mark.parametrize('n', range(11))\n"
    status, shown = run(source + "def test_never(n):\n    assert False\n")
    assert status == 1
    assert "Now a second time" not in shown


def test_a_collection_error_fails_the_run(run):
    status, shown = run("import nothing_of_that_name\n")
    assert status != 0
    assert "correct these tests" not in shown
