"""Where a real ROS cannot be installed, that is said in a sentence."""

import os
import subprocess
import sys

import pytest
from real_ros import CANNOT, ROOT


def make_ros(folder, **environment):
    return subprocess.run(
        [sys.executable, ROOT / "tools" / "make_ros.py", folder],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        check=False,
    )


def test_without_the_python_that_its_wheels_are_for_that_is_named(tmp_path):
    nowhere = str(tmp_path)
    done = make_ros(tmp_path / "ros", PATH=nowhere, PYENV_ROOT=nowhere, PYTHON312="")
    assert done.returncode == CANNOT, done.stderr
    assert "for Python 3.12, which is not here; PYTHON312=" in done.stdout


def test_what_pip_says_is_passed_on_and_nothing_counts_as_installed(tmp_path):
    folder = tmp_path / "ros"
    done = make_ros(folder, PIP_NO_INDEX="1")
    if "which is not here" in done.stdout or "shared library" in done.stdout:
        pytest.skip(done.stdout)
    assert done.returncode == CANNOT, done.stderr
    assert "No matching distribution found for ros-jazzy-" in done.stdout
    assert not (folder / "installed").exists()
