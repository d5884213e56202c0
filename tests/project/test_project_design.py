"""The design page names files, and each folder has a description."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "webmap"
DESIGN = (ROOT / "docs" / "explanation" / "design.md").read_text("utf-8")
FOLDERS = sorted(file.parent for file in PACKAGE.rglob("__init__.py"))
MOST_FILES = 28


def section(title: str) -> str:
    """Return the text of a section of the design page."""
    return re.split(r"^###? ", DESIGN.partition(f"## {title}\n")[2], flags=re.M)[0]


def test_every_file_named_in_the_design_page_exists():
    named = set(re.findall(r"`([a-z_]+/[\w/]+\.(?:py|js))`", DESIGN))
    assert len(named) > 30
    there = {name for name in named for at in (PACKAGE, ROOT) if (at / name).is_file()}
    assert sorted(named - there) == []


@pytest.mark.parametrize(
    ("head", "folder"),
    [
        ("| part | content |", "gate"),
        ("| chapter of `rules` | decides |", "gate/rules"),
    ],
)
def test_the_tables_of_the_gate_in_the_design_page_name_every_file(head, folder):
    rows = DESIGN.partition(f"{head}\n")[2].partition("\n\n")[0].splitlines()
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row.split("|")[1])}
    there = PACKAGE / folder
    files = {file.stem for file in there.glob("*.py")}
    folders = {file.parent.name for file in there.glob("*/__init__.py")}
    assert named == (files | folders) - {"__init__", "__main__"}


@pytest.mark.parametrize("title", ["The path of a command", "The path of a pose"])
def test_each_step_of_the_paths_in_the_design_page_names_a_file(title):
    steps = re.findall(r"^\d+\. (.*(?:\n   .*)*)", section(title), re.M)
    assert len(steps) > 5
    assert all(re.search(r"`[a-z_]+/[\w/]+\.(?:py|js)`", step) for step in steps)


def test_the_design_page_describes_every_folder_of_the_package():
    rows = re.findall(r"^\| `([a-z]+)` \|", section("Folders"), re.M)
    folders = {file.name for file in PACKAGE.iterdir() if file.is_dir()}
    assert set(rows) == folders - {"__pycache__"}


def test_the_import_contract_lists_every_folder_of_the_package():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    layers = contracts["tool"]["importlinter"]["contracts"][0]["layers"]
    order = [set(re.findall(r"webmap\.([a-z]+)", layer)) for layer in layers]
    assert set().union(*order) == {
        folder.name for folder in FOLDERS if folder.parent == PACKAGE
    }


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda each: each.name)
def test_each_folder_has_a_docstring_in_its_init_file(folder):
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text("utf-8")))
    assert text is not None
    assert len(text.split()) >= 12, text


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda each: each.name)
def test_no_folder_outside_the_gate_has_too_many_files(folder):
    gate_is_last = "gate" in folder.parts
    files = [file for file in folder.iterdir() if file.is_file()]
    assert gate_is_last or len(files) <= MOST_FILES, len(files)


def test_the_style_of_tools_has_no_class_of_a_single_tool() -> None:
    style = (PACKAGE / "web/style/controls.css").read_text("utf-8")
    rules = re.sub(r"/\*.*?\*/", "", style[style.index("/* Buttons. */") :], flags=re.S)
    shared = "".join(file.read_text("utf-8") for file in PACKAGE.glob("web/**/*.js"))
    tools = [file.read_text("utf-8") for file in PACKAGE.glob("features/**/*.js")]
    for name in set(re.findall(r"\.(webmap-[\w-]+)", rules)) - {"webmap-console"}:
        assert name in shared or sum(name in tool for tool in tools) > 1, name
    assert not re.findall(r"\.webmap-(?!tool\b)\w+ :where\(input", rules)
    console = (PACKAGE / "console/tools.css").read_text("utf-8")
    assert not re.findall(r"\.webmap-(?!export)\w+-word", console)
