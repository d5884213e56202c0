"""The wheel holds all that WebMap needs, and starts where nothing else is."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import webmap

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    run(
        [
            sys.executable,
            "-m",
            "build",
            "--wheel",
            "--no-isolation",
            "-o",
            folder,
            ROOT,
        ],
        cwd=folder,
    )
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of commands of a fresh environment with the wheel in it."""
    folder = tmp_path_factory.mktemp("a path with spaces") / "environment"
    run([sys.executable, "-m", "venv", "--without-pip", folder])
    commands = folder / ("Scripts" if os.name == "nt" else "bin")
    pip = [sys.executable, "-m", "pip", "--python", commands / "python"]
    run([*pip, "install", "--quiet", wheel])
    return commands


def run(command: list[str | Path], cwd: Path | None = None) -> str:
    # Nothing of this checkout may leak in: that is the point of the test.
    clean = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(command, cwd=cwd, env=clean, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_wheel_holds_every_file_of_the_package(wheel: Path) -> None:
    wanted = {
        path.relative_to(SOURCE).as_posix()
        for path in (SOURCE / "webmap").rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    assert "webmap/py.typed" in wanted
    assert wanted <= set(zipfile.ZipFile(wheel).namelist())


def test_an_installed_wheel_says_its_version(installed: Path, tmp_path: Path) -> None:
    said = run([installed / "webmap", "--version"], cwd=tmp_path)
    assert webmap.__version__ in said


def test_an_installed_wheel_shows_the_demo(installed: Path, tmp_path: Path) -> None:
    command = [installed / "webmap", "demo", "--port", "0", "--bridge-port", "0"]
    with subprocess.Popen(
        [*command, "--no-browser"],
        cwd=tmp_path,
        env=os.environ | {"WEBMAP_STATE_DIR": str(tmp_path / "state")},
        stdout=subprocess.PIPE,
        text=True,
    ) as demo:
        try:
            assert demo.stdout is not None
            assert demo.stdout.readline().startswith("WebMap is ready at http://")
        finally:
            demo.terminate()
            assert demo.wait(10) == 0
