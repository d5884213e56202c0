"""The names of the glossary exist in Python, in JavaScript and on the page."""

import importlib
import inspect
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, get_type_hints

import pytest

import webmap

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "docs" / "reference" / "glossary.md"
HEAD = ["term", "meaning", "Python", "JavaScript", "on the page"]


def rows() -> Iterator[list[str]]:
    """Yield the cells of each term."""
    for line in GLOSSARY.read_text("utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("|") and cells != HEAD and set(line) != {"|", "-"}:
            yield cells


def column(number: int, form: str) -> list[str]:
    """Return the names in one column, each once."""
    return sorted({name for row in rows() for name in re.findall(form, row[number])})


PYTHON = column(2, r"`([^`]+)`")
JAVASCRIPT = column(3, r"`([^`]+)`")
PAGE = column(4, r"\*([^*]+)\*")


@cache
def sources(*suffixes: str) -> str:
    """Return all files of the package with these suffixes."""
    files = (each for each in (ROOT / "src").rglob("*") if each.suffix in suffixes)
    return "\n".join(each.read_text("utf-8") for each in sorted(files))


def found(name: str) -> Any:
    """Return the object of a dotted name; raise AttributeError if there is none."""
    first, *others = name.split(".")
    if first == "report":
        value = get_type_hints(webmap.Robot.on_gate_report)["report"]
    elif first == "state":
        value = get_type_hints(webmap.Robot.state.fget)["return"]
    else:
        value = importlib.import_module(first)
    for other in others:
        if inspect.ismodule(value) and not hasattr(value, other):
            importlib.import_module(f"{value.__name__}.{other}")
        value = member(value, other)
    return value


def member(owner: Any, name: str) -> Any:
    """Return an attribute, or the annotation of an attribute of each instance."""
    if hasattr(owner, name):
        return getattr(owner, name)
    for each in getattr(owner, "__mro__", ()):
        if name in inspect.get_annotations(each):
            return inspect.get_annotations(each)[name]
        if each is object:
            break
        if re.search(rf"\bself\.{name}(: .+)? = ", inspect.getsource(each)):
            return name
    raise AttributeError(f"{owner!r} has no {name}")


def test_each_row_has_a_term_a_meaning_and_five_cells() -> None:
    terms = [row[0] for row in rows()]
    assert len(terms) == len(set(terms)) > 30
    for row in rows():
        assert len(row) == len(HEAD)
        assert row[0]
        assert row[1]


@pytest.mark.parametrize("name", PYTHON)
def test_each_python_name_of_the_glossary_exists(name: str) -> None:
    dotted, _, argument = name.removesuffix("=)").partition("(")
    value = found(dotted)
    if argument:
        assert argument in inspect.signature(value).parameters


def is_identifier(name: str) -> bool:
    """Return whether a JavaScript file has an identifier of this name."""
    found = re.search(rf"(?<![\w$]){re.escape(name)}(?![\w$])", sources(".js"))
    return found is not None


def is_shown(word: str) -> bool:
    """Return whether a string or the text of an element has this text."""
    begins = r"""["'`>](?:[^"'`<>\n]*[^"'`<>\n\w])?"""
    source = sources(".js", ".py", ".html")
    return re.search(rf"{begins}{re.escape(word)}\b", source) is not None


@pytest.mark.parametrize("name", JAVASCRIPT)
def test_each_javascript_name_of_the_glossary_exists(name: str) -> None:
    assert is_identifier(name)


@pytest.mark.parametrize("word", PAGE)
def test_each_page_text_of_the_glossary_exists(word: str) -> None:
    assert is_shown(word)
