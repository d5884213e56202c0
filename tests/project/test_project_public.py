"""The public names, and the version that is said in several places."""

import re
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import click
import pytest

import webmap
from webmap.cli import cli

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "docs" / "reference").glob("*.md")
REFERENCE = "\n".join(page.read_text("utf-8") for page in PAGES)


@pytest.mark.parametrize("name", webmap.__all__)
def test_every_public_name_can_be_had(name: str) -> None:
    assert getattr(webmap, name) is not None


@pytest.mark.parametrize("name", webmap.__all__)
def test_every_public_name_stands_in_the_reference(name: str) -> None:
    assert f"webmap.{name}" in REFERENCE


def test_a_name_that_does_not_exist_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = webmap.no_such_name


def test_every_place_says_the_same_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    newest = re.search(r"^## (\S+?),", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert newest is not None
    assert {webmap.__version__, version("webmap"), newest[1]} == {project["version"]}


def test_the_reference_of_layers_is_made_from_their_declarations() -> None:
    tool = ROOT / "tools" / "make_layers_page.py"
    done = subprocess.run([sys.executable, tool, "--check"], capture_output=True)
    assert done.returncode == 0, done.stderr.decode()


@pytest.mark.parametrize("command", ["demo", "play", "record", "run", "sim", "view"])
def test_every_option_stands_in_the_reference(command: str) -> None:
    context = click.Context(cli)
    found = cli.get_command(context, command)
    assert found is not None
    shown = [p for p in found.params if not getattr(p, "hidden", False)]
    options = [o for parameter in shown for o in parameter.opts if "--" in o]
    assert options
    assert not [option for option in options if f"`{option}" not in REFERENCE]
