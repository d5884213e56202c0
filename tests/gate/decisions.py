"""Records the decisions of the gate in a test, and compares them with a record.

The record of a test is a digest of every event, the time and the actions that followed.
It shows that a refactoring changes no decision. ``decisions.json`` has the digests of
the tests whose decisions are the same in every run.

To record them again, run the tests twice and keep the tests that are equal::

    PYTHONHASHSEED=1 WEBMAP_DECISIONS=/tmp/one pytest tests/gate
    PYTHONHASHSEED=2 WEBMAP_DECISIONS=/tmp/two pytest tests/gate
    python tests/gate/decisions.py /tmp/one /tmp/two

The orders of sets differ between the two runs, so that a test whose decisions depend
on them is left out. Each run writes every decision of every test to its folder, so
that two versions of the code can be compared line by line.
"""

import hashlib
import itertools
import json
import os
import re
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from webmap.gate.protocol import RobotSpec
from webmap.gate.rules import stop
from webmap.gate.rules.gate import Gate

FILE = Path(__file__).with_name("decisions.json")
FOLDER = os.environ.get("WEBMAP_DECISIONS", "")

REPORT = "SendToDisplay(message=RobotReport"

HOOK = re.compile(r"StopHook\((\w+)='([^']*)', type='([^']*)'\)")
"""A stop hook; the record has it as a table."""

UNRECORDED = (
    ", check=None",
    ", checked=None",
    ", check_every=None",
    ", only_echoes=False",
    ", drive_without_proof=False",
)
"""What most robots do not have is not part of the record."""

LENGTH = 12
"""Hexadecimal digits of a digest."""


class Decisions:
    """Listens to all gates of a test.

    Args:
        name: The test, as pytest names it.

    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.count = 0
        self._digest = hashlib.sha256()
        self._lines: list[str] = []
        self._ids: dict[str, str] = {}

    def listen(self, monkeypatch: Any) -> None:
        """Record decisions from now on; the identities of STOPs become numbers."""
        numbers = itertools.count(1)
        known = SimpleNamespace(token_hex=lambda size: f"{next(numbers):0{2 * size}x}")
        monkeypatch.setattr(stop, "secrets", known)
        if not FOLDER and self.name not in RECORDED:
            return
        handle, step = Gate.handle, Gate.step

        def handled(gate: Gate, event: Any, now: float) -> Any:
            actions = handle(gate, event, now)
            self._note(event, now, actions)
            return actions

        def stepped(gate: Gate, now: float) -> Any:
            actions = step(gate, now)
            self._note(None, now, actions)
            return actions

        monkeypatch.setattr(RobotSpec, "__repr__", _declared)
        monkeypatch.setattr(Gate, "handle", handled)
        monkeypatch.setattr(Gate, "step", stepped)

    def _note(self, event: Any, now: float, actions: Any) -> None:
        line = f"{now:.6f} {event!r} {text_of(actions)}"
        for text in UNRECORDED:
            line = line.replace(text, "")
        if "StopHook(" in line:
            line = HOOK.sub(r"{'\1': '\2', 'type': '\3'}", line)
        if "WebMap-" in line:
            line = re.sub(r"WebMap-\w+-\d+", lambda match: self._number(match[0]), line)
        self.count += 1
        self._digest.update(line.encode())
        if FOLDER:
            self._lines.append(line)

    def _number(self, id: str) -> str:
        """Number the goals of a test: their ids depend on the tests before."""
        return self._ids.setdefault(id, f"id {len(self._ids) + 1}")

    @property
    def digest(self) -> str:
        """The digest of all decisions so far; empty if there were none."""
        return self._digest.hexdigest()[:LENGTH] if self.count else ""

    def end(self) -> None:
        """Compare the record, or write it.

        Raises:
            AssertionError: If the decisions differ from the recorded decisions.

        """
        if FOLDER:
            file = Path(FOLDER) / hashlib.sha256(self.name.encode()).hexdigest()
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text("\n".join([self.name, self.digest, *self._lines]))
        elif recorded := RECORDED.get(self.name):
            assert recorded == self.digest, (
                f"got {self.count} decisions that differ from those recorded: see "
                f"tests/gate/decisions.py"
            )


def _declared(spec: RobotSpec) -> str:
    """Return a declaration in short: its parts may change, and no decision with them.

    The topics and addresses of a checked one are in the key of its machine.
    """
    return f"RobotSpec({spec.id!r}, {spec.name!r})"


def text_of(actions: Any) -> str:
    """Return the actions as text that does not depend on the order of a set."""
    if not actions:
        return ""
    texts = []
    for is_report, found in itertools.groupby(
        map(repr, actions), lambda text: text.startswith(REPORT)
    ):
        group = list(found)
        texts += sorted(group) if is_report else group
    text = "; ".join(texts)
    if "frozenset({" not in text:
        return text
    return re.sub(
        r"(?<=frozenset\(\{)[^}]*",
        lambda match: ", ".join(sorted(match[0].split(", "))),
        text,
    )


def of_run(folder: Path) -> dict[str, str]:
    """Return the digests of a run of the tests, by the name of the test."""
    heads = (file.read_text().split("\n", 2)[:2] for file in folder.iterdir())
    return {name: digest for name, digest in heads if digest}


def keep_equal(folders: list[Path]) -> None:
    """Record the tests whose decisions are the same in all runs."""
    first, *others = map(of_run, folders)
    same = {
        name: digest
        for name, digest in sorted(first.items())
        if all(other.get(name) == digest for other in others)
    }
    FILE.write_text(json.dumps(same, indent=0) + "\n")
    print(f"{len(same)} tests recorded; {len(first) - len(same)} differ between runs")


RECORDED: dict[str, str] = json.loads(FILE.read_text()) if FILE.exists() else {}

if __name__ == "__main__":
    keep_equal([Path(folder) for folder in sys.argv[1:]])
