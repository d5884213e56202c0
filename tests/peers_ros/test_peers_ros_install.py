"""If a real ROS cannot be installed, a sentence states the reason."""

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


def test_the_error_without_python_3_12_names_the_missing_version(tmp_path):
    nowhere = str(tmp_path)
    done = make_ros(tmp_path / "ros", PATH=nowhere, PYENV_ROOT=nowhere, PYTHON312="")
    assert done.returncode == CANNOT, done.stderr
    assert "for Python 3.12, which is not here; PYTHON312=" in done.stdout


def test_a_pip_error_is_printed_and_nothing_is_marked_as_installed(tmp_path):
    folder = tmp_path / "ros"
    done = make_ros(folder, PIP_NO_INDEX="1")
    if "which is not here" in done.stdout or "shared library" in done.stdout:
        pytest.skip(done.stdout)
    assert done.returncode == CANNOT, done.stderr
    assert "No matching distribution found for ros-jazzy-" in done.stdout
    assert not (folder / "installed").exists()
