"""Clouds of points, seen from above."""

import math
from typing import TYPE_CHECKING

from webmap.core.placed import Placed
from webmap.core.refusals import refusing
from webmap.errors import ConfigError
from webmap.ros.bridge import Bridge
from webmap.ros.messages_cloud import PointCloud2Msg
from webmap.scene import svg
from webmap.scene.element import Element

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from webmap.core.robot import Robot

UNIT = 0.001
"""Metres per unit of the dots on the wire, as long as they fit in 16 bits."""

MANY = 100_000
"""Points of which no more are looked at one by one."""

COLOURS = (
    "#30318f", "#2f6fde", "#1aa5c8", "#1fbf7a", "#8fcf2f", "#e8c51c", "#f08a1d",
    "#d02f2f",
)  # fmt: skip
"""From low to high."""


class PointCloud:
    """Draws a ``sensor_msgs/PointCloud2``, flattened, as dots.

    Of points above one another one dot is drawn. With ``colour_by`` the dots are in
    eight bands of a field's values, each with a class: ``band-0`` is the lowest.

    Style it by CSS: ``.pointcloud > .dot``, ``.pointcloud > .dot.band-7``; the dots'
    size is the custom property ``--dot-size``, in metres.

    Args:
        robot: The robot that carries the sensor.
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        x: Where the sensor is on the robot, in metres forward.
        y: In metres to the left.
        angle: Where it looks, in degrees from the robot's x, counter-clockwise.
        z_min: The lowest point that is drawn, in metres in the sensor's frame.
        z_max: The highest.
        cell: Of points in one square of this side, in metres, one is drawn; 0 for
            all.
        max_points: How many dots are drawn at the most, evenly chosen.
        colour_by: The name of the field whose values give the colours, such as
            ``"z"`` or ``"intensity"``.
        low: The value that begins the lowest band; the least of a cloud if not given.
        high: The value that ends the highest band; the greatest if not given.
        frame: ``"robot"``, or ``"map"`` for a cloud that is given in the map's.
        throttle: The least time between two clouds, in milliseconds.
        age_limit: Seconds after which a cloud is drawn as old.

    Raises:
        ConfigError: If a number makes no sense.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        x: float = 0.0,
        y: float = 0.0,
        angle: float = 0.0,
        *,
        z_min: float = -math.inf,
        z_max: float = math.inf,
        cell: float = 0.05,
        max_points: int = 3000,
        colour_by: str | None = None,
        low: float | None = None,
        high: float | None = None,
        frame: str = "robot",
        throttle: int = 500,
        age_limit: float = 2.0,
    ) -> None:
        if not z_min < z_max:
            raise ConfigError(f"z_min must be below z_max, got {z_min} and {z_max}")
        if not (cell >= 0 and math.isfinite(cell)):
            raise ConfigError(f"cell must be metres of at least 0, got {cell}")
        if max_points < 1:
            raise ConfigError(f"max_points must be at least 1, got {max_points}")
        self.robot = robot
        self.window = (z_min, z_max)
        self.cell = cell
        self.max_points = max_points
        self.colour_by = colour_by
        self.range = (low, high)
        self.age_limit = age_limit
        self.dots: list[Element] = [
            svg.path(class_=f"dot band-{number}", fill=colour)
            for number, colour in enumerate(COLOURS)
        ]
        if colour_by is None:
            self.dots = [svg.path(class_="dot", fill="#c2410c")]
        self._placed = Placed(
            robot,
            *self.dots,
            class_="pointcloud",
            frame=frame,
            x=x,
            y=y,
            angle=angle,
        )
        self.svg = self._placed.svg
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_cloud),
            "sensor_msgs/PointCloud2",
            throttle=throttle,
            decode=PointCloud2Msg,
        )

    def on_cloud(self, cloud: PointCloud2Msg) -> None:
        """Draw a cloud in place of the one before; one without points draws nothing.

        Raises:
            ProtocolError: If its sizes do not fit, or it has not the fields.

        """
        points, values = self._flat(cloud)
        bands = self._bands(values)
        self._placed.stand_in(cloud.frame_id, cloud.stamp)
        center, unit = (0.0, 0.0), UNIT
        if len(points):
            middle = (points.min(axis=0) + points.max(axis=0)) / 2
            center = (float(round(middle[0])), float(round(middle[1])))
            points = points - center
            unit = max(UNIT, float(abs(points).max()) / 32767)
        packed = (points / unit).round().astype("<i2")
        for number, path in enumerate(self.dots):
            path.set_pose(*center, 0.0)
            mine = packed if bands is None else packed[bands == number]
            path.set_dots(mine.tobytes(), unit)
        self.svg.set_age(0.0, limit=self.age_limit)

    def on_odometry_update(self) -> None:
        """Keep a cloud in the map's frame where it is while the robot goes along."""
        self._placed.follow()

    def _flat(
        self, cloud: PointCloud2Msg
    ) -> "tuple[NDArray[np.float64], NDArray[np.float64] | None]":
        """Return what is to be drawn, of shape (N, 2), and the values for colours."""
        import numpy as np

        names = ["x", "y"]
        for name in ("z", self.colour_by):
            if name is not None and name not in names:
                if name == "z" != self.colour_by and not cloud.has("z"):
                    continue
                names.append(name)
        columns = dict(zip(names, cloud.columns(*names), strict=True))
        keep = np.isfinite(columns["x"]) & np.isfinite(columns["y"])
        # What a sensor of depth puts farther than a planet is no point.
        keep &= (abs(columns["x"]) < 1e7) & (abs(columns["y"]) < 1e7)
        z_min, z_max = self.window
        if "z" in columns:
            with np.errstate(invalid="ignore"):
                keep &= (columns["z"] >= z_min) & (columns["z"] <= z_max)
        chosen = np.flatnonzero(keep)
        chosen = chosen[:: 1 + len(chosen) // MANY]
        points = np.column_stack((columns["x"][chosen], columns["y"][chosen]))
        if self.cell and len(points):
            kept = one_a_cell(points, self.cell)
            points, chosen = points[kept], chosen[kept]
        if len(points) > self.max_points:
            step = len(points) / self.max_points
            kept = (np.arange(self.max_points) * step).astype(int)
            points, chosen = points[kept], chosen[kept]
        values = None if self.colour_by is None else columns[self.colour_by][chosen]
        return points, values

    def _bands(
        self, values: "NDArray[np.float64] | None"
    ) -> "NDArray[np.int64] | None":
        import numpy as np

        if values is None:
            return None
        known = values[np.isfinite(values)]
        low, high = self.range
        if low is None:
            low = float(known.min()) if len(known) else 0.0
        if high is None:
            high = float(known.max()) if len(known) else 1.0
        width = high - low if high > low else 1.0
        share = np.nan_to_num((values - low) / width, nan=0.0, posinf=1.0, neginf=0.0)
        last = len(COLOURS) - 1
        return np.clip((share * len(COLOURS)).astype(np.int64), 0, last)


def one_a_cell(points: "NDArray[np.float64]", cell: float) -> "NDArray[np.int64]":
    """Return which points to keep so that each square of a side has one at the most.

    Args:
        points: Of shape (N, 2), in metres, N above 0.
        cell: The side, in metres.

    """
    import numpy as np

    cells = np.floor(points / cell).astype(np.int64)
    cells -= cells.min(axis=0)
    width = int(cells[:, 0].max()) + 1
    _, first = np.unique(cells[:, 1] * width + cells[:, 0], return_index=True)
    return np.sort(first)
