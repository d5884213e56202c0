"""The buttons of a robot in a fleet file."""

from typing import Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.checks import Mistakes
from webmap.cli.fleet.lines import Path
from webmap.core.button_spec import ButtonMistake, read_button


def read_buttons(value: Any, path: Path, mistakes: Mistakes) -> list[dict[str, Any]]:
    """Return the tables ``[[robots.buttons]]`` of a robot; mistakes are noted."""
    if not isinstance(value, list):
        got = checks.show(value)
        mistakes.add(path, f"got {got}, expected a table [[robots.buttons]] for each")
        return []
    first: dict[str, int] = {}
    for index, each in enumerate(value):
        where = (*path, index)
        try:
            label = read_button(each).label
        except ButtonMistake as error:
            key = tuple(part for part in error.key.split(".") if part)
            mistakes.add((*where, *key), error.words)
            continue
        if first.setdefault(label, index) != index:
            words = f'got "{label}", expected a label that no other button has'
            mistakes.add((*where, "label"), words)
    return [each for each in value if isinstance(each, dict)]
