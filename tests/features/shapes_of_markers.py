"""Markers of every type that is drawn, and which points they cover.

Each is described twice, as a message and in plain numbers in the frame of the marker,
so that tests can compare the drawing with the numbers.
"""

import math
from dataclasses import dataclass, field

from module_fakes import header, pose

Point = tuple[float, float]

RED, BLUE = (255, 0, 0), (0, 0, 255)
YAW = 0.5
"""The rotation of all markers."""


@dataclass(frozen=True)
class Shape:
    """One marker."""

    type: int
    at: Point
    """The place of the marker in the world."""

    scale: tuple[float, float, float]
    blue: tuple[Point, ...]
    """Points that the marker covers, in its own frame; :attr:`red` too."""

    beside: tuple[Point, ...]
    """Points near the marker that it does not cover."""

    points: tuple[Point, ...] = ()
    red: tuple[Point, ...] = ()
    colours: tuple[tuple[int, int, int], ...] = field(default=())

    def message(self, number: int) -> dict:
        """Return the shape as a ``visualization_msgs/Marker``."""
        return {
            "header": header(),
            "ns": "shapes",
            "id": number,
            "type": self.type,
            "action": 0,
            "pose": pose(*self.at, YAW),
            "scale": dict(zip("xyz", self.scale, strict=True)),
            "color": {"r": 0, "g": 0, "b": 1, "a": 1},
            "lifetime": {"secs": 0, "nsecs": 0},
            "points": [{"x": x, "y": y, "z": 0.0} for x, y in self.points],
            "colors": [
                {"r": r / 255, "g": g / 255, "b": b / 255, "a": 1}
                for r, g, b in self.colours
            ],
            "text": "",
        }

    def in_world(self, points: tuple[Point, ...]) -> list[Point]:
        """Return points of the marker's frame in the world."""
        cos, sin = math.cos(YAW), math.sin(YAW)
        x, y = self.at
        return [(x + cos * u - sin * v, y + sin * u + cos * v) for u, v in points]


SHAPES = {
    "arrow": Shape(
        0,
        (-3.0, 1.5),
        (0.8, 0.2, 0.2),
        blue=((0.1, 0.0), (0.3, 0.07), (0.72, 0.0), (0.64, 0.14)),
        beside=((0.3, 0.15), (0.9, 0.0), (-0.1, 0.0)),
    ),
    "an arrow between two points": Shape(
        0,
        (-1.4, 1.5),
        (0.1, 0.3, 0.2),
        points=((0.0, 0.0), (0.0, 0.7)),
        blue=((0.0, 0.2), (0.03, 0.4), (0.1, 0.52)),
        beside=((0.1, 0.3), (0.0, 0.8), (0.12, 0.65)),
    ),
    "cube": Shape(
        1,
        (0.0, 1.7),
        (0.6, 0.2, 0.4),
        blue=((0.27, 0.07), (-0.27, 0.07), (0.27, -0.07), (-0.27, -0.07)),
        beside=((0.0, 0.14), (0.34, 0.0), (-0.34, 0.0), (0.0, -0.14)),
    ),
    "sphere": Shape(
        2,
        (1.4, 1.7),
        (0.6, 0.3, 0.4),
        blue=((0.26, 0.0), (-0.26, 0.0), (0.0, 0.12), (0.0, -0.12)),
        beside=((0.26, 0.12), (-0.26, -0.12), (0.35, 0.0), (0.0, 0.19)),
    ),
    "cylinder": Shape(
        3,
        (2.7, 1.7),
        (0.5, 0.3, 1.0),
        blue=((0.21, 0.0), (0.0, -0.12)),
        beside=((0.22, 0.12), (0.0, 0.2)),
    ),
    "line-strip": Shape(
        4,
        (-3.0, -0.2),
        (0.1, 0.0, 0.0),
        points=((0.0, 0.0), (0.6, 0.0), (0.6, 0.5)),
        blue=((0.03, 0.0), (0.3, 0.03), (0.6, 0.3), (0.58, 0.47)),
        beside=((0.3, 0.2), (0.0, 0.3), (0.3, -0.1), (0.75, 0.3)),
    ),
    "line-list": Shape(
        5,
        (-1.5, -0.2),
        (0.1, 0.0, 0.0),
        points=((0.0, 0.0), (0.6, 0.0), (0.0, 0.4), (0.6, 0.4)),
        colours=(BLUE, BLUE, RED, RED),
        blue=((0.05, 0.0), (0.55, 0.02)),
        red=((0.05, 0.4), (0.55, 0.42)),
        beside=((0.3, 0.2), (0.6, 0.2), (0.0, 0.2)),
    ),
    "cube-list": Shape(
        6,
        (0.0, -0.2),
        (0.3, 0.2, 0.2),
        points=((0.0, 0.0), (0.5, 0.3)),
        colours=(RED, BLUE),
        red=((0.12, 0.07), (-0.12, -0.07)),
        blue=((0.62, 0.37), (0.38, 0.23)),
        beside=((0.25, 0.15), (0.0, 0.14), (0.2, 0.0), (0.5, 0.14)),
    ),
    "sphere-list": Shape(
        7,
        (1.4, -0.2),
        (0.3, 0.3, 0.3),
        points=((0.0, 0.0), (0.5, 0.2)),
        colours=(RED, BLUE),
        red=((0.11, 0.0), (0.0, -0.11)),
        blue=((0.61, 0.2), (0.5, 0.31)),
        beside=((0.13, 0.13), (-0.13, 0.13), (0.25, 0.1)),
    ),
    "points": Shape(
        8,
        (2.6, -0.2),
        (0.2, 0.1, 0.0),
        points=((0.0, 0.0), (0.4, 0.2)),
        blue=((0.07, 0.02), (0.47, 0.22), (0.33, 0.18)),
        beside=((0.0, 0.1), (0.2, 0.1), (0.4, 0.1), (0.15, 0.0)),
    ),
    "triangle-list": Shape(
        11,
        (-3.0, -2.0),
        (1.0, 1.0, 1.0),
        points=((0, 0), (0.6, 0), (0, 0.6), (0.9, 0), (1.5, 0), (0.9, 0.6)),
        colours=(BLUE, BLUE, BLUE, RED, RED, RED),
        blue=((0.05, 0.05), (0.5, 0.04), (0.05, 0.5), (0.25, 0.25)),
        red=((0.95, 0.05), (1.4, 0.04), (1.15, 0.25)),
        beside=((0.4, 0.4), (0.75, 0.1), (-0.1, 0.2), (1.4, 0.3)),
    ),
}
"""The shapes by name: the class, if there is only one of its type."""
