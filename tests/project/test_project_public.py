"""The public names, and the version, which is in several files."""

import inspect
import re
import subprocess
import sys
import tomllib
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

import click
import pytest

import webmap
from webmap import errors, geometry, testing, tf
from webmap.cli import cli

TagMaker = type(webmap.svg.g).__mro__[1]
ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "docs" / "reference").glob("*.md")
REFERENCE = "\n".join(page.read_text("utf-8") for page in PAGES)
OTHER_PAGES = "\n".join(
    (ROOT / "docs" / "reference" / name).read_text("utf-8")
    for name in ("modules.md", "layers.md")
)
API = (ROOT / "docs" / "reference" / "api.md").read_text("utf-8")


def made_here(module: ModuleType) -> list[str]:
    """Return the public classes and functions that a module defines."""
    return [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and getattr(value, "__module__", None) == module.__name__
        and (inspect.isclass(value) or inspect.isfunction(value))
    ]


def tags(module: ModuleType) -> list[str]:
    """Return the names of the functions that make elements."""
    return [name for name, value in vars(module).items() if isinstance(value, TagMaker)]


@pytest.mark.parametrize("name", webmap.__all__)
def test_every_public_name_can_be_imported(name: str) -> None:
    assert getattr(webmap, name) is not None


@pytest.mark.parametrize("name", webmap.__all__)
def test_every_public_name_is_in_the_api_reference(name: str) -> None:
    assert re.search(rf"webmap\.{name}\b", API)


PAGE_IMPORTS = """
import importlib, sys
import webmap

def attribute(name):
    value = webmap
    for part in name.split(".")[1:]:
        value = getattr(value, part)
    return value

shown, documented, page = sys.argv[1:]
packages = {"webmap.console", "webmap.testing"}
for name in shown.split():
    importlib.import_module(name) if name in packages else attribute(name)
for name in documented.split():
    before, _, last = name.rpartition(".")
    try:
        attribute(name)
    except AttributeError:
        getattr(importlib.import_module(before), last)
exec(page)
"""


def test_every_name_of_the_api_reference_is_imported_as_the_page_shows() -> None:
    table = API.partition("## Run")[0]
    shown = re.findall(r"`(webmap\.[\w.]+)`", table.partition("| group |")[2])
    documented = re.findall(r"^\.\. (?:auto|py:)\w+:: (webmap[\w.]+)", API, re.M)
    (example,) = re.findall(r"```python\n(.*?)```", table, re.S)
    assert len(shown) > 30
    assert len(documented) > 80
    command = [sys.executable, "-c", PAGE_IMPORTS]
    names = [" ".join(shown), " ".join(documented), example]
    done = subprocess.run([*command, *names], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


ALIASES = sorted(
    f"webmap.{name}" for name, home in webmap._HOMES.items() if ":" not in home
)


def test_the_api_reference_lists_the_attributes_that_are_no_modules() -> None:
    (listed,) = re.findall(r"^(`webmap.*) are attributes and no files", API, re.M)
    only = [name for name in ALIASES if find_spec(name) is None]
    assert re.findall(r"`([^`]+)`", listed) == only


def test_no_page_imports_from_an_attribute_that_is_no_module() -> None:
    wrong = [
        f"{page.relative_to(ROOT)}: {found}"
        for folder in ("docs", "examples")
        for page in (ROOT / folder).rglob("*.*")
        if page.suffix in {".md", ".py"}
        for found in re.findall(
            r"^(?:from|import) (webmap\.\w+)", page.read_text("utf-8"), re.M
        )
        if find_spec(found) is None
    ]
    assert not wrong


def test_every_public_name_is_listed_once() -> None:
    assert sorted(webmap._HOMES) == sorted(webmap.__all__)


@pytest.mark.parametrize("name", ["drawing", "messages", "options"])
def test_every_name_for_layers_is_in_the_api_reference(name: str) -> None:
    names = made_here(getattr(webmap, name))
    assert names
    assert not [each for each in names if f":: webmap.{name}.{each}\n" not in API]


@pytest.mark.parametrize("module", [errors, geometry, testing, tf])
def test_the_api_reference_documents_every_member_of_the_public_modules(
    module: ModuleType,
) -> None:
    directive = f".. automodule:: {module.__name__}\n   :members:\n"
    assert directive in API


@pytest.mark.parametrize("name", ["svg", "html"])
def test_every_tag_is_in_the_api_reference(name: str) -> None:
    listed = API.partition(f"\n`webmap.{name}`\n: ")[2].partition("\n")[0]
    assert sorted(tags(getattr(webmap, name))) == re.findall(r"`(\w+)`", listed)


@pytest.mark.parametrize("name", ["map", "robot"])
def test_every_module_is_in_the_api_reference(name: str) -> None:
    listed = API.partition(f"\n`webmap.modules.{name}`\n: ")[2].partition("\n")[0]
    modules = getattr(webmap.modules, name).namespace
    assert modules.names() == re.findall(r"`(\w+)`", listed)
    assert not [each for each in modules.names() if f"`{each}" not in OTHER_PAGES]


def test_both_groups_of_entry_points_are_in_the_api_reference() -> None:
    assert "`webmap.modules.map` and `webmap.modules.robot`" in API


def test_an_unknown_name_raises_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = webmap.no_such_name


def test_package_project_file_and_changelog_have_the_same_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    newest = re.search(r"^## (\S+?),", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert newest is not None
    assert {webmap.__version__, version("webmap"), newest[1]} == {project["version"]}


def test_the_layer_reference_is_generated_from_the_declarations() -> None:
    tool = ROOT / "tools" / "make_layers_page.py"
    done = subprocess.run([sys.executable, tool, "--check"], capture_output=True)
    assert done.returncode == 0, done.stderr.decode()


@pytest.mark.parametrize("command", ["demo", "play", "record", "run", "sim", "view"])
def test_every_command_line_option_is_in_the_reference(command: str) -> None:
    context = click.Context(cli)
    found = cli.get_command(context, command)
    assert found is not None
    shown = [p for p in found.params if not getattr(p, "hidden", False)]
    options = [o for parameter in shown for o in parameter.opts if "--" in o]
    assert options
    assert not [option for option in options if f"`{option}" not in REFERENCE]
