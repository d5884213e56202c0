"""Run the parts of the tests, and end with a summary.

A part is a target of the Makefile. If a part fails, the other parts run all the same.
The output of each part is also in ``test-results/log``.

Usage: run_tests.py RUN...

A run is ``test`` or ``rest``: what the first leaves out.
"""

import json
import os
import shlex
import shutil
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from heapq import nlargest
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "test-results" / "log"

RUNS = {
    "test": (
        ("test-motion", "test-load", "test-time", "test-browser"),
        ("lint", "test-web", "test-gate", "test-plain", "types", "contracts"),
    ),
    "rest": (("test-motion", "test-time", "test-browser"), ("test-plain", "docs")),
}
"""The parts of each run. Those of the second row use only the time of the processors
that those of the first row leave."""

VARIABLES = {
    "test": ("PICK=not thorough", "TRIALS=1"),
    "rest": ("PICK=thorough", "TRIALS=1"),
}
"""The variables of ``make`` in each run."""

PROCESSORS = 2
"""The number of processors that the tests are made for."""

LOOP, LOOP_SECONDS = 3_000_000, 0.3
"""The rounds of a loop, and its longest time on a machine that is fast enough.

The machines on which the times of the tests were chosen need 0.07 to 0.12 s.
"""

AT_RISK = "Tests that measure whether a robot stops in time may fail here."

SHOWN = 20
"""The number of failed tests, and of reasons for skipping, that the summary lists."""

LONGEST = 10
"""The number of the longest tests that the summary lists."""


@dataclass
class Part:
    """A part of the tests and its results.

    Attributes:
        target: The target of the Makefile.
        run_name: The run that it belongs to.
        seconds: The time that it took.
        processor: The time of the processors that it used, in seconds.
        status: The exit status of ``make``.
        outcomes: The last outcome of each test, by its id.
        reasons: Why a test was skipped, by its id.
        again: The tests that failed first and passed when they ran again.
        times: The time of each test with its fixtures, in seconds, by its id.

    """

    target: str
    run_name: str = "test"
    seconds: float = 0.0
    processor: float = 0.0
    status: int = 0
    outcomes: dict[str, str] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    again: list[str] = field(default_factory=list)
    times: dict[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The target, and the run if it is another one than ``test``."""
        return self.target + ("" if self.run_name == "test" else f" {self.run_name}")

    @property
    def log(self) -> Path:
        """The file with the output."""
        return FOLDER / f"{self.name}.log"

    @property
    def results(self) -> Path:
        """The file with a line of JSON for each test that ended."""
        return FOLDER / f"{self.name}.jsonl"

    def run(self, *, first: bool) -> None:
        """Run the part, and print its output meanwhile if it is of the first row."""
        variables = (*VARIABLES[self.run_name], f"RESULTS={self.results}")
        command = ["make", "--no-print-directory", self.target, *variables]
        if not first and shutil.which("chrt"):
            command = ["chrt", "--idle", "0", *command]
        begin = time.monotonic()
        with (
            self.log.open("wb") as log,
            subprocess.Popen(
                command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
            ) as process,
        ):
            assert process.stdout is not None
            while chunk := os.read(process.stdout.fileno(), 65536):
                log.write(chunk)
                if first:
                    sys.stdout.buffer.write(chunk)
                    sys.stdout.flush()
            _, status, used = os.wait4(process.pid, 0)
            self.status = process.returncode = os.waitstatus_to_exitcode(status)
        self.processor = used.ru_utime + used.ru_stime
        self.seconds = time.monotonic() - begin
        if self.results.exists():
            for line in self.results.read_text(encoding="utf-8").splitlines():
                self.add(**json.loads(line))

    def add(self, test: str, outcome: str, why: str, seconds: float = 0) -> None:
        """Record the outcome of a test; the outcome of a second run counts."""
        self.times[test] = seconds
        if self.outcomes.get(test) == "failed" and outcome == "passed":
            self.again.append(test)
        self.outcomes[test] = outcome
        if outcome == "skipped":
            self.reasons[test] = why

    @property
    def failures(self) -> Iterator[tuple[str, str]]:
        """What failed, each with the command that repeats it alone."""
        failed = [
            test for test, outcome in self.outcomes.items() if outcome == "failed"
        ]
        yield from ((test, repeat(test)) for test in failed)
        if self.status and not failed:
            yield self.name, f"make {self.target}"


def repeat(test: str) -> str:
    """Return the command that runs one test alone."""
    file, _, name = test.partition("::")
    if file.endswith(".js"):
        return (
            f"node --test --test-name-pattern {shlex.quote(name)} {shlex.quote(file)}"
        )
    return f".venv/bin/pytest {shlex.quote(test)}"


def run(name: str) -> list[Part]:
    """Run the parts of a run; return them."""
    first, second = ([Part(target, name) for target in row] for row in RUNS[name])
    names = ", ".join(part.name for part in [*first, *second])
    print(f"\nRunning {names}", flush=True)
    beside = threading.Thread(target=_run_row, args=(second, False), daemon=True)
    beside.start()
    _run_row(first, True)
    beside.join()
    for part in second:
        sys.stdout.buffer.write(part.log.read_bytes())
    return [*first, *second]


def _run_row(row: list[Part], first: bool) -> None:
    for part in row:
        part.run(first=first)


def summary(parts: list[Part], seconds: float) -> str:
    """Return what a reader needs to know at the end of a run.

    Args:
        parts: The parts, after they ran.
        seconds: The time of the whole run.

    """
    counts = {part.name: Counter(part.outcomes.values()) for part in parts}
    total = sum(counts.values(), Counter())
    failures = [failure for part in parts for failure in part.failures]
    width = max(len(part.name) for part in parts)
    lines = [f"{'part':{width}}  {'time':>6}  processor  passed  failed  skipped"]
    for part in parts:
        count = counts[part.name]
        row = f"{part.name:{width}}  {minutes(part.seconds):>6}"
        row += f"  {minutes(part.processor):>9}"
        if part.outcomes:
            row += "".join(
                f"  {count[outcome]:{len(outcome)}}"
                for outcome in ("passed", "failed", "skipped")
            )
        else:
            row += "  failed" if part.status else "  passed"
        lines.append(row)
    lines += _listed(
        "Skipped:",
        [
            f"{why} ({tests} test{'s' * (tests > 1)})"
            for why, tests in Counter(
                why for part in parts for why in part.reasons.values()
            ).most_common()
        ],
    )
    times = [(time, test) for part in parts for test, time in part.times.items()]
    lines += _listed(
        "The longest:",
        [f"{time:5.1f} s  {test}" for time, test in nlargest(LONGEST, times)],
    )
    lines += _listed(
        "Failed at first and passed when they ran again, alone:",
        [test for part in parts for test in part.again],
    )
    lines += _listed(
        "Failed, each with the command that repeats it alone:",
        [f"{name}\n      {command}" for name, command in failures],
    )
    if failures:
        lines.append(f"\nThe output of each part is in {FOLDER.relative_to(ROOT)}.")
    # A part without tests that failed counts as one failure.
    lines += [
        "",
        f"{'Failed' if failures else 'Passed'} in {minutes(seconds)} min.",
        f"tests: {total['passed']} passed, {len(failures)} failed, "
        f"{total['skipped']} skipped",
    ]
    return "\n".join(lines)


def _listed(title: str, lines: list[str]) -> list[str]:
    if not lines:
        return []
    more = [f"... and {len(lines) - SHOWN} more"] if len(lines) > SHOWN else []
    return ["", title, *(f"  {line}" for line in [*lines[:SHOWN], *more])]


def minutes(seconds: float) -> str:
    """Return a time as minutes and seconds, such as ``31:05``."""
    whole, rest = divmod(round(seconds), 60)
    return f"{whole}:{rest:02}"


def complaints(processors: int, loop_seconds: float) -> list[str]:
    """Return a sentence for each thing that this machine lacks.

    Args:
        processors: The number of processors that the tests may use.
        loop_seconds: The time of :func:`loop`.

    """
    found = []
    if processors < PROCESSORS:
        found.append(
            f"The tests may use {processors} processor and are made for {PROCESSORS}: "
            "they take twice as long"
        )
    if loop_seconds > LOOP_SECONDS:
        found.append(
            f"This machine is slow or busy: a loop took {loop_seconds:.1f} s, at most "
            f"{LOOP_SECONDS} s were expected; end other programs"
        )
    return [f"{each}. {AT_RISK}" for each in found]


def loop() -> float:
    """Return how long this machine takes for a loop, in seconds."""
    begin = time.perf_counter()
    for _ in range(LOOP):
        pass
    return time.perf_counter() - begin


def main(*names: str) -> int:
    """Run all parts of the named runs; return the exit status."""
    begin = time.monotonic()
    shutil.rmtree(FOLDER, ignore_errors=True)
    FOLDER.mkdir(parents=True)
    for line in complaints(len(os.sched_getaffinity(0)), loop()):
        print(f"webmap: {line}", flush=True)
    parts = [part for name in names for part in run(name)]
    print("\n" + summary(parts, time.monotonic() - begin), flush=True)
    return int(any(part.status for part in parts))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
