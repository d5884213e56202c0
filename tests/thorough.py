"""The tests that only ``make test-all`` runs: ``thorough.toml`` lists them."""

import tomllib
from pathlib import Path

THOROUGH: dict[str, dict[str, str]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)
"""For each file, its tests, and the tests that cover their subjects."""


def is_thorough(test: str) -> bool:
    """Return whether only ``make test-all`` runs a test, by its id."""
    file = test.partition("::")[0]
    return not keys(test).isdisjoint(THOROUGH.get(file, ()))


def keys(test: str) -> set[str]:
    """Return the keys of the list that mean a test, by its id."""
    name = test.partition("::")[2]
    function, bracket, parameters = name.partition("[")
    return {"*", name, function, bracket + parameters}
