"""A long run that checks whether memory or the age of frames and poses grows.

Run as ``python -m benchmarks.soak [--seconds N]``. Robots send odometry and scans to a
display with viewers. The display and its gate must not need more memory at the end
than after the warm-up, and frames and poses must not be older. The run prints a table,
writes a plot to ``results/soak.svg``, and exits with status 1 if something grew.
"""

import json
import statistics
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import click
import psutil

from benchmarks.display import Display, bridged
from benchmarks.harness import Comparison, Figures, report
from benchmarks.plot import Curve, Plot, save

ROBOTS = 50
BEAMS = 360
VIEWERS = 20

SAMPLES = 120
"""Samples of an hour; a shorter run has fewer samples, each of at least 2 s."""

WARM = 0.25
"""The fraction of the time in which memory may grow: the warm-up."""

GROWTH = 2.0
"""Percent by which memory may grow after the warm-up."""

OLDER = 50.0
"""Milliseconds by which the age of frames and poses may grow: one tick of the display.
The noise of the machine is smaller, and the delay of a queue is larger."""

FEWER = 5.0
"""Percent by which the frames of the viewer that gets the fewest may decrease."""

DISPLAY, GATE = "display (MB)", "gate (MB)"
FRAME, POSE = "frame age, 50 (ms)", "pose age, 50 (ms)"
FRAMES = "frames of the slowest viewer (a second)"
MEMORY, AGES = (DISPLAY, GATE), (FRAME, POSE)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The change of one figure after the warm-up."""

    name: str
    begin: float
    end: float
    passed: bool

    @property
    def text(self) -> str:
        """Return the verdict as a line of a table."""
        change = 100 * (self.end / self.begin - 1) if self.begin else 0.0
        passed = "pass" if self.passed else "FAIL"
        values = f"{self.begin:.1f} | {self.end:.1f} | {change:+.1f} %"
        return f"| {self.name} | {values} | {passed} |"


def judged(samples: Sequence[Figures]) -> list[Verdict]:
    """Return the verdicts about memory, ages and frames.

    The values of the begin and the end are medians of a fifth of the samples after the
    warm-up.
    """
    after = samples[int(len(samples) * WARM) :]
    fifth = max(1, len(after) // 5)
    found = []
    for name in (*MEMORY, *AGES, FRAMES):
        begin, end = (
            statistics.median(sample[name] for sample in part)
            for part in (after[:fifth], after[-fifth:])
        )
        if name == FRAMES:
            passed = end > begin * (1 - FEWER / 100) > 0
        elif name in AGES:
            passed = end <= begin + OLDER
        else:
            passed = end <= begin * (1 + GROWTH / 100)
        found.append(Verdict(name, begin, end, passed))
    return found


def _memory(process: psutil.Process) -> float:
    """Return the memory of a process in MB."""
    return float(process.memory_info().rss) / 1e6


def watched(
    shown: Display, viewers: int, seconds: float, count: int
) -> Iterator[Figures]:
    """Yield samples of a display with viewers, one for each period of ``seconds``."""
    command = [sys.executable, "-m", "benchmarks.watchers", shown.url]
    with subprocess.Popen(
        [*command, str(viewers), str(seconds), str(count)],
        stdout=subprocess.PIPE,
        text=True,
    ) as watching:
        assert watching.stdout is not None
        if watching.stdout.readline().strip() != "ready":
            raise RuntimeError("the viewers saw no frame")
        for line in islice(watching.stdout, count):
            seen = json.loads(line)
            yield {
                DISPLAY: _memory(shown.process),
                GATE: _memory(shown.gate),
                FRAME: seen["frame age, 50"],
                "frame age, 99 (ms)": seen["frame age, 99"],
                POSE: seen["pose age, 50"],
                "pose age, 99 (ms)": seen["pose age, 99"],
                FRAMES: seen["least frames"],
            }


def plots(samples: Sequence[Figures], period: float, title: str) -> tuple[Plot, Plot]:
    """Return the plots of memory and of ages."""

    def curves(names: Sequence[str]) -> list[Curve]:
        return [
            Curve(name, [(n * period / 60, s[name]) for n, s in enumerate(samples)])
            for name in names
        ]

    return (
        Plot(f"Memory: {title}", "minutes", "MB", curves(MEMORY)),
        Plot(f"Ages: {title}", "minutes", "ms", curves(AGES)),
    )


@click.command()
@click.option("--seconds", default=3600.0, show_default=True, help="The duration.")
@click.option("--robots", default=ROBOTS, show_default=True, help="How many.")
@click.option("--viewers", default=VIEWERS, show_default=True, help="How many.")
def main(seconds: float, robots: int, viewers: int) -> None:
    """Run for a time, and exit with 1 if memory or ages grew."""
    period = max(2.0, seconds / SAMPLES)
    samples = []
    with bridged(robots, BEAMS) as shown:
        for sample in watched(shown, viewers, period, round(seconds / period)):
            samples.append(sample)
            line = ", ".join(f"{name} {value:.1f}" for name, value in sample.items())
            click.echo(f"{len(samples) * period:.0f} s: {line}", err=True)
    title = f"{robots} robots with scans, {viewers} viewers"
    memory, ages = plots(samples, period, title)
    save("soak", memory)
    save("soak-ages", ages)
    path = report("soak", [Comparison(title, {"samples": samples})])
    verdicts = judged(samples)
    click.echo("| after the warm-up | begin | end | change | |\n|---|---|---|---|---|")
    for verdict in verdicts:
        click.echo(verdict.text)
    click.echo(f"written to {path}", err=True)
    sys.exit(0 if all(verdict.passed for verdict in verdicts) else 1)


if __name__ == "__main__":
    main()
