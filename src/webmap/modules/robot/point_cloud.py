"""Clouds of points, seen from above."""

import math
from functools import partial
from typing import TYPE_CHECKING

from webmap.core.dots import in_units
from webmap.core.from_above import levelled
from webmap.core.layer_names import label
from webmap.core.placed import Placed
from webmap.core.refusals import refusing
from webmap.errors import ConfigError
from webmap.geometry.reach import FARTHEST
from webmap.ros.bridge import Bridge
from webmap.ros.messages_cloud import PointCloud2Msg
from webmap.scene import svg
from webmap.scene.element import Element

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from webmap.core.robot import Robot
    from webmap.tf import Transform

MANY = 100_000
"""Points of which no more are looked at one by one."""

MOST = 2 * MANY
"""Points of a large cloud that the worker process hands over, evenly chosen."""

COLOURS = (
    "#30318f", "#2f6fde", "#1aa5c8", "#1fbf7a", "#8fcf2f", "#e8c51c", "#f08a1d",
    "#d02f2f",
)  # fmt: skip
"""From low to high."""


class ShownCloudMsg(PointCloud2Msg, frozen=True, kw_only=True):
    """A cloud of which no more is handed over than can be drawn."""

    def digest(self) -> PointCloud2Msg:
        """Return what is to be drawn; called in the worker process."""
        return self.thinned(MOST)


class PointCloud:
    """Draws a ``sensor_msgs/PointCloud2`` as dots, as it looks from above.

    Points are first taken from the cloud's frame to the map as both were at its stamp,
    with all of its turns and its height: a lidar may be tilted or hang upside down, and
    a camera's optical frame has z forward. Then heights are looked at, and only then
    is the cloud flattened.

    Heights are in metres above the robot's base frame (``base_link``, or what
    ``base_frame`` says), straight up whatever way the robot leans: 0 is the floor where
    that frame is on the floor. In a cloud with ``frame="map"`` they are above the map's
    plane. Where no frames tell how the sensor is mounted, its z is taken to point up
    and to begin at the base.

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
        z_min: The height of the lowest point that is drawn, in metres above the base.
        z_max: The height of the highest.
        cell: Of points in one square of this side, in metres, one is drawn; 0 for
            all.
        max_points: How many dots are drawn at the most, evenly chosen.
        colour_by: The name of the field whose values give the colours, such as
            ``"intensity"``; ``"z"`` is the height above the base.
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
        self.topic = topic
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
        label(self.svg, topic, robot)
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_cloud),
            "sensor_msgs/PointCloud2",
            throttle=throttle,
            decode=ShownCloudMsg,
        )

    def on_cloud(self, cloud: PointCloud2Msg) -> None:
        """Draw a cloud in place of the one before; one without points draws nothing.

        Raises:
            ProtocolError: If its sizes do not fit, or it has not the fields.

        """
        points, values = self._read(cloud)
        draw = partial(self._draw, points, values)
        self._placed.stand_in(cloud.frame_id, cloud.stamp, draw)
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)

    def on_odometry_update(self) -> None:
        """Keep a cloud in the map's frame where it is while the robot goes along."""
        self._placed.follow()

    def _read(
        self, cloud: PointCloud2Msg
    ) -> "tuple[NDArray[np.float64], NDArray[np.float64] | None]":
        """Return points of the cloud's frame, and a field's values.

        Points are of shape (N, 3), or (N, 2) if the cloud has no heights.
        """
        import numpy as np

        high = cloud.has("z") or self.colour_by == "z"
        axes = ["x", "y", "z"] if high else ["x", "y"]
        names = list(axes)
        if self.colour_by is not None and self.colour_by not in names:
            names.append(self.colour_by)
        columns = dict(zip(names, cloud.columns(*names), strict=True))
        keep = np.ones(len(columns["x"]), dtype=bool)
        for axis in axes:
            keep &= abs(columns[axis]) < FARTHEST  # nor is what is not finite
        points = np.column_stack([columns[axis][keep] for axis in axes])
        if self.colour_by in (None, "z"):
            return points, None
        return points, columns[str(self.colour_by)][keep]

    def _draw(
        self,
        points: "NDArray[np.float64]",
        values: "NDArray[np.float64] | None",
        tilt: "Transform",
    ) -> None:
        """Draw what is left of the points when they are flat."""
        places, heights = levelled(points, tilt)
        if self.colour_by == "z":
            values = heights
        chosen = self._choose(places, heights if points.shape[1] == 3 else None)
        places = places[chosen]
        bands = None if values is None else self._bands(values[chosen])
        center = (0.0, 0.0)
        if len(places):
            middle = (places.min(axis=0) + places.max(axis=0)) / 2
            center = (float(round(middle[0])), float(round(middle[1])))
            places = places - center
        dots, unit = in_units(places)
        for number, path in enumerate(self.dots):
            path.set_pose(*center, 0.0)
            mine = dots if bands is None else dots[bands == number]
            path.set_dots(mine.tobytes(), unit)

    def _choose(
        self, places: "NDArray[np.float64]", heights: "NDArray[np.float64] | None"
    ) -> "NDArray[np.int64]":
        """Return which points to draw."""
        import numpy as np

        chosen = np.arange(len(places))
        if heights is not None:
            z_min, z_max = self.window
            chosen = np.flatnonzero((heights >= z_min) & (heights <= z_max))
        chosen = chosen[:: 1 + len(chosen) // MANY]
        if self.cell and len(chosen):
            chosen = chosen[one_a_cell(places[chosen], self.cell)]
        if len(chosen) > self.max_points:
            step = len(chosen) / self.max_points
            chosen = chosen[(np.arange(self.max_points) * step).astype(int)]
        return chosen

    def _bands(self, values: "NDArray[np.float64]") -> "NDArray[np.int64]":
        import numpy as np

        known = values[np.isfinite(values)]
        low, high = self.range
        if low is None:
            low = float(known.min()) if len(known) else 0.0
        if high is None:
            high = float(known.max()) if len(known) else 1.0
        # Differences of numbers that are finite and absurd may be infinite.
        with np.errstate(over="ignore", invalid="ignore"):
            width = np.subtract(high, low) if high > low else 1.0
            share = (values - low) / width
        share = np.nan_to_num(share, nan=0.0, posinf=1.0, neginf=0.0).clip(0.0, 1.0)
        last = len(COLOURS) - 1
        return np.minimum((share * len(COLOURS)).astype(np.int64), last)


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
