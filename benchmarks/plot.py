"""Line plots as plain SVG, small enough to read."""

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.harness import RESULTS

WIDTH, HEIGHT = 640, 360
LEFT, RIGHT, TOP, BOTTOM = 56, 16, 36, 44
LINE = 16
"""Height of a line of the legend, which is below the plot."""
COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf")
DASHES = ("", "6 3", "2 3")


@dataclass(frozen=True, slots=True)
class Curve:
    """One line of a plot."""

    name: str
    points: Sequence[tuple[float, float]]
    """Points, sorted by x; the plot omits points with NaN."""


@dataclass(frozen=True, slots=True)
class Plot:
    """Curves over two axes that begin at 0."""

    title: str
    x: str
    """The label of the horizontal axis, with its unit."""
    y: str
    """The label of the vertical axis, with its unit."""
    curves: Sequence[Curve]

    def svg(self) -> str:
        """Return the picture."""
        points = [point for curve in self.curves for point in _whole(curve)]
        most_x, step_x = _ticks(max((x for x, _ in points), default=1.0))
        most_y, step_y = _ticks(max((y for _, y in points), default=1.0))
        right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM

        def at(x: float, y: float) -> tuple[float, float]:
            across = LEFT + (right - LEFT) * x / most_x
            return across, bottom - (bottom - TOP) * y / most_y

        height = HEIGHT + LINE * len(self.curves) + 8
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
            'font-family="sans-serif" font-size="12">',
            f'<rect width="{WIDTH}" height="{height}" fill="white"/>',
            _text(WIDTH / 2, 20, self.title, "middle"),
            _text((LEFT + right) / 2, HEIGHT - 8, self.x, "middle"),
            _text(8, TOP - 8, self.y, "start"),
        ]
        for number in range(round(most_x / step_x) + 1):
            across, _ = at(number * step_x, 0)
            parts.append(_text(across, bottom + 16, f"{number * step_x:g}", "middle"))
        for number in range(round(most_y / step_y) + 1):
            _, down = at(0, number * step_y)
            parts.append(
                f'<path d="M{LEFT} {down:.1f}H{right}" stroke="#ddd" fill="none"/>'
            )
            parts.append(_text(LEFT - 6, down + 4, f"{number * step_y:g}", "end"))
        for number, curve in enumerate(self.curves):
            look = (
                f'stroke="{COLOURS[number % len(COLOURS)]}" '
                f'stroke-dasharray="{DASHES[number % len(DASHES)]}" '
                'stroke-width="2" fill="none"'
            )
            placed = " ".join(
                "{:.1f},{:.1f}".format(*at(*point)) for point in _whole(curve)
            )
            parts.append(f'<polyline points="{placed}" {look}/>')
            down = HEIGHT + LINE * (number + 1)
            parts.append(f'<path d="M{LEFT} {down - 4}h32" {look}/>')
            parts.append(_text(LEFT + 40, down, curve.name, "start"))
        return "\n".join([*parts, "</svg>", ""])


def save(name: str, plot: Plot) -> Path:
    """Write a plot to ``results/NAME.svg``, and return the file."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.svg"
    path.write_text(plot.svg(), encoding="utf-8")
    return path


def _whole(curve: Curve) -> list[tuple[float, float]]:
    return [point for point in curve.points if not any(map(math.isnan, point))]


def _ticks(most: float) -> tuple[float, float]:
    """Return the end of an axis and the distance of its marks."""
    if most <= 0:
        return 1.0, 0.5
    power = 10 ** math.floor(math.log10(most))
    step = next(part * power for part in (0.2, 0.5, 1, 2) if most / (part * power) <= 6)
    return math.ceil(most / step) * step, step


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">'
        f"{html.escape(text)}</text>"
    )
