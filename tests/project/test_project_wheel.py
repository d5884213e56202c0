"""Wheel and sdist have all files, and the wheel runs in an empty environment."""

import os
import re
import subprocess
import sys
import tarfile
import zipfile
from email import message_from_bytes
from pathlib import Path

import httpx
import pytest

import webmap
from equipment.environment import outside

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built("wheel", tmp_path_factory.mktemp("wheel"))


def built(kind: str, folder: Path) -> Path:
    """Return the file of a wheel or an sdist of this checkout."""
    build = [sys.executable, "-m", "build", f"--{kind}", "--no-isolation"]
    run([*build, "-o", folder, ROOT], cwd=folder)
    (file,) = folder.iterdir()
    return file


@pytest.fixture(scope="session")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """Return the names of the files in an sdist of this checkout."""
    with tarfile.open(built("sdist", tmp_path_factory.mktemp("sdist"))) as archive:
        return {name.partition("/")[2] for name in archive.getnames()}


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the commands of a new environment with the wheel."""
    folder = tmp_path_factory.mktemp("a path with spaces") / "environment"
    run([sys.executable, "-m", "venv", "--without-pip", folder])
    commands = folder / ("Scripts" if os.name == "nt" else "bin")
    pip = [sys.executable, "-m", "pip", "--python", commands / "python"]
    run([*pip, "install", "--quiet", wheel])
    return commands


def run(command: list[str | Path], cwd: Path | None = None) -> str:
    # The environment must not use any file of this checkout.
    clean = {k: v for k, v in outside().items() if not k.startswith("PYTHON")}
    done = subprocess.run(command, cwd=cwd, env=clean, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_wheel_contains_every_file_of_the_package(wheel: Path) -> None:
    wanted = {
        path.relative_to(SOURCE).as_posix()
        for path in (SOURCE / "webmap").rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    assert "webmap/py.typed" in wanted
    assert wanted <= set(zipfile.ZipFile(wheel).namelist())


INCLUDED = re.compile(r"^```\{(?:literal)?include\} (\S+)$", re.M)
"""A file that a page of the documentation includes."""


def test_the_sdist_contains_every_file_that_the_documentation_includes(
    sdist: set[str],
) -> None:
    wanted = {
        (page.parent / name).resolve().relative_to(ROOT).as_posix()
        for page in (ROOT / "docs").rglob("*.md")
        for name in INCLUDED.findall(page.read_text("utf-8"))
    }
    assert {"CONTRIBUTING.md", "examples/simple/simple.py"} <= wanted
    assert wanted <= sdist


def test_the_sdist_contains_every_text_of_the_project(sdist: set[str]) -> None:
    assert {path.name for path in ROOT.glob("*.md")} <= sdist


def test_the_package_description_links_to_pages_that_the_documentation_has(
    wheel: Path,
) -> None:
    archive = zipfile.ZipFile(wheel)
    (name,) = (each for each in archive.namelist() if each.endswith("/METADATA"))
    metadata = message_from_bytes(archive.read(name))
    links = re.findall(r"\]\(([^)]*)\)", str(metadata.get_payload()))
    site = "https://webmap.readthedocs.io/en/latest/"
    assert f"{site}demo.webp" in links
    pages = {link.removeprefix(site) for link in links} - {"demo.webp"}
    there = {
        page.relative_to(ROOT / "docs").with_suffix(".html").as_posix()
        for page in (ROOT / "docs").rglob("*.md")
    }
    assert len(pages) > 5
    assert pages <= there


def test_an_installed_wheel_prints_its_version(installed: Path, tmp_path: Path) -> None:
    output = run([installed / "webmap", "--version"], cwd=tmp_path)
    assert webmap.__version__ in output


LOADED = re.compile(
    r'''(?:\b(?:src|href)=|\bfrom |\bimport |\bimport\(|\burl\()"([^"#?][^"]*)"'''
)
"""The files that a browser loads for a page, a module or a style sheet."""


def load(url: str) -> set[str]:
    """Load a page and all files that it needs, as a browser does; return the paths."""
    wanted = [
        f"/_webmap/{path.relative_to(SOURCE / 'webmap').as_posix()}"
        for folder in ("web", "features", "console")
        for path in (SOURCE / "webmap" / folder).rglob("*")
        if path.suffix in {".js", ".css"}
    ]
    with httpx.Client(follow_redirects=True) as client:
        page = client.get(url).url
        # Only the socket of the page names the scripts of features.
        todo, seen = [page, *map(page.join, wanted)], set()
        while todo:
            answer = client.get(todo.pop())
            assert answer.status_code == 200, answer.url
            seen.add(answer.url.path)
            if answer.headers["content-type"].startswith("text/"):
                named = {answer.url.join(name) for name in LOADED.findall(answer.text)}
                todo += [name for name in named if name.path not in seen]
    return seen


def test_an_installed_wheel_serves_the_demo_page_and_all_its_files(
    installed: Path, tmp_path: Path
) -> None:
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
            line = demo.stdout.readline()
            assert line.startswith("WebMap is ready at http://")
            loaded = load(line.split()[-1])
            own = {"web/page.js", "icon.svg", "features/drive/teleop.js"}
            assert "/" in loaded
            named = {re.sub("^/_webmap/v-[0-9a-f]{16}/", "", path) for path in loaded}
            assert named >= own
        finally:
            demo.terminate()
            assert demo.wait(10) == 0
