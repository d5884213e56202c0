"""What the documentation says is shown is shown: every test that it names is there."""

import ast
import re

from safety_figures import DOCS

PAGE = (DOCS / "safety.md").read_text()
TESTS = DOCS.parent / "tests"


def functions():
    """Return the names of all tests."""
    trees = (ast.parse(path.read_text()) for path in TESTS.rglob("test_*.py"))
    nodes = (node for tree in trees for node in ast.walk(tree))
    return {
        node.name
        for node in nodes
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and node.name.startswith("test_")
    }


def test_every_test_that_the_page_names_exists():
    named = set(re.findall(r"`(test_\w+)`", PAGE))
    assert len(named) > 30, "the page names hardly any test"
    assert named - functions() == set()


def test_every_file_that_the_page_names_exists():
    named = set(re.findall(r"`((?:tests/[\w/]+/)?test_\w+\.py)`", PAGE))
    assert named
    there = {path.name for path in TESTS.rglob("test_*.py")}
    assert {name.rsplit("/", 1)[-1] for name in named} - there == set()


def test_every_promise_names_a_test():
    """Each is a term and what holds, and ends with where that is shown."""
    begin = PAGE.index("## What is promised")
    promised = PAGE[begin : PAGE.index("## What is not", begin)]
    promises = re.findall(r"\n([A-Z][^\n]+)\n: (.*?)(?=\n\n)", promised, re.DOTALL)
    assert len(promises) >= 12
    without = [term for term, text in promises if not re.search("`test_", text)]
    assert without == []
