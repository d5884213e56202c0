"""The dead-man time is one constant, and every text has its number."""

import re
from pathlib import Path

import pytest

from webmap.gate.process import STEP
from webmap.gate.rules.motion import DEADMAN

ROOT = Path(__file__).parents[2]

TEXTS = [
    ("docs/safety.md", r"A command is valid for (\d+) ms"),
    (
        "docs/explanation/design.md",
        r"stops their robots before, (\d+) ms after the last",
    ),
    (
        "docs/explanation/design.md",
        r"the age of the loop, (\d+) ms of the dead-man time",
    ),
    ("docs/explanation/performance.md", r"robot stops (\d+) ms after the last command"),
    ("docs/reference/glossary.md", r"\| dead-man timeout \| .*?: ([\d.]+) s \|"),
    ("docs/howto/script.md", r"sends no other for ([\d.]+) s"),
    ("src/webmap/core/movable_robot.py", r"which is valid for ([\d.]+) s"),
    ("src/webmap/gate/display/client.py", r"another within (\d+) ms"),
    ("src/webmap/gate/display/program.py", r"another within (\d+) ms"),
    ("src/webmap/agents/displays.py", r"a robot (\d+) ms after the last command"),
]
"""The places with the number, in seconds or in milliseconds."""


@pytest.mark.parametrize(("file", "pattern"), TEXTS)
def test_a_text_has_the_dead_man_time_of_the_gate(file: str, pattern: str) -> None:
    text = " ".join((ROOT / file).read_text("utf-8").split())
    (number,) = re.findall(pattern, text)
    seconds = float(number) if "." in number else int(number) / 1000
    assert seconds == DEADMAN


PROMISES = [
    ("docs/safety.md", r"accepts no more commands, it sends zero within (\d+) ms"),
    ("docs/explanation/design.md", r"Zero leaves the gate at most (\d+) ms after"),
]
"""The places that promise when a zero leaves the gate, in milliseconds."""


@pytest.mark.parametrize(("file", "pattern"), PROMISES)
def test_a_promised_time_allows_for_the_dead_man_time(file: str, pattern: str) -> None:
    text = " ".join((ROOT / file).read_text("utf-8").split())
    (sent,) = re.findall(pattern, text)
    assert int(sent) / 1000 >= DEADMAN + 2 * STEP
