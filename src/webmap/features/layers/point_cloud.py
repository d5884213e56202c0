"""Point clouds, seen from above."""

import binascii
import math
from array import array
from dataclasses import KW_ONLY
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import msgspec

from webmap.base.errors import ConfigError, ProtocolError
from webmap.base.geometry import FARTHEST
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import in_units, levelled
from webmap.modules.layer_options import Count, Frame, Limit
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import Numbers, Stamped
from webmap.ros.tf import Transform
from webmap.scene import svg
from webmap.scene.element import Element

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Found: TypeAlias = tuple[NDArray[np.float64], NDArray[np.float64] | None]

MAX_POINTS = 1 << 23
"""Greatest number of points of a cloud."""

MANY = 100_000
"""Greatest number of points that are processed one by one."""

MOST = 2 * MANY
"""Points of a large cloud that the worker process returns, evenly chosen."""

COLOURS = (
    "#30318f", "#2f6fde", "#1aa5c8", "#1fbf7a", "#8fcf2f", "#e8c51c", "#f08a1d",
    "#d02f2f",
)  # fmt: skip
"""From low to high."""


# Indexed by the constants of sensor_msgs/PointField.
_FORMATS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


class Octets(Numbers):
    """Bytes of ``uint8[]``: in JSON base64, or a list of numbers."""

    typecode = "B"
    __slots__ = ()

    @classmethod
    def _numbers(cls, value: object) -> "array[Any]":
        if isinstance(value, str):
            try:
                value = binascii.a2b_base64(value)
            except binascii.Error as error:
                raise ValueError(f"it is not base64: {error}") from None
        return super()._numbers(value)

    def array(self) -> "NDArray[np.uint8]":
        """Return the bytes as a read-only array of shape (N,), without a copy."""
        import numpy as np

        return np.frombuffer(memoryview(self.values).toreadonly(), np.uint8)


class PointFieldMsg(msgspec.Struct, frozen=True):
    """``sensor_msgs/PointField``: one number of each point."""

    name: str
    offset: int
    """Offset from the point's beginning, in bytes."""

    datatype: int
    """1 to 8: int8, uint8, int16, uint16, int32, uint32, float32, float64."""

    count: int = 1


class PointCloud2Msg(Stamped, frozen=True, kw_only=True):
    """``sensor_msgs/PointCloud2``."""

    height: int
    width: int
    fields: list[PointFieldMsg]
    point_step: int
    """Bytes per point."""

    row_step: int
    """Bytes per row; more than its points take, if rows are padded."""

    data: Octets
    is_bigendian: bool = False

    def columns(self, *names: str) -> "list[NDArray[np.float64]]":
        """Return fields of all points, each of shape (N,).

        Args:
            *names: The fields' names.

        Raises:
            ProtocolError: If there is no such field, or the sizes do not match.
        """
        import numpy as np

        row_step = self._row_step
        self._check_sizes(row_step)
        order = ">" if self.is_bigendian else "<"
        formats, offsets = [], []
        for name in names:
            field = self._field(name)
            formats.append(order + _FORMATS[field.datatype])
            offsets.append(field.offset)
        try:
            layout = np.dtype(
                {
                    "names": list(names),
                    "formats": formats,
                    "offsets": offsets,
                    "itemsize": self.point_step,
                }
            )
        except (ValueError, OverflowError) as error:
            raise ProtocolError(
                f"the fields {', '.join(names)} do not fit into points of "
                f"{self.point_step} bytes: {error}"
            ) from None
        used = self.width * self.point_step
        rows = self.data.array()[: self.height * row_step]
        rows = rows.reshape(self.height, row_step)[:, :used]
        points = np.ascontiguousarray(rows).reshape(-1).view(layout)
        return [points[name].astype(np.float64) for name in names]

    def digest(self) -> "PointCloud2Msg":
        """Return the drawable part of the cloud; called in the worker process."""
        return self.thinned(MOST)

    def thinned(self, most: int) -> "PointCloud2Msg":
        """Return the cloud with at most ``most`` points, evenly chosen, in one row.

        Raises:
            ProtocolError: If the sizes do not match.
        """
        row_step = self._row_step
        self._check_sizes(row_step)
        if self.width * self.height <= most:
            return self
        used = self.width * self.point_step
        rows = self.data.array()[: self.height * row_step]
        rows = rows.reshape(self.height, row_step)[:, :used]
        step = 1 + (self.width * self.height - 1) // most
        kept = rows.reshape(-1, self.point_step)[::step]
        return msgspec.structs.replace(
            self,
            height=1,
            width=len(kept),
            row_step=len(kept) * self.point_step,
            data=Octets(array("B", kept.tobytes())),
        )

    def has(self, name: str) -> bool:
        """Return whether points have a field of this name."""
        return any(field.name == name for field in self.fields)

    def _field(self, name: str) -> PointFieldMsg:
        for field in self.fields:
            if field.name == name:
                if field.datatype not in _FORMATS or field.offset < 0:
                    raise ProtocolError(
                        f"the field {name!r} has the datatype {field.datatype} at byte "
                        f"{field.offset}; datatypes are 1 to 8"
                    )
                return field
        known = ", ".join(repr(field.name) for field in self.fields) or "none"
        raise ProtocolError(f"points have no field {name!r}; they have {known}")

    @property
    def _row_step(self) -> int:
        """Bytes per row; some drivers leave this out of a cloud of a single row."""
        if self.row_step == 0 and self.height == 1:
            return self.width * self.point_step
        return self.row_step

    def _check_sizes(self, row_step: int) -> None:
        size = f"a cloud of {self.width} x {self.height} points"
        if self.width < 0 or self.height < 0:
            raise ProtocolError(f"got {size}, expected 0 or more each way")
        if self.width * self.height > MAX_POINTS:
            raise ProtocolError(f"got {size}, expected at most {MAX_POINTS} in all")
        if self.point_step < 1 or row_step < self.width * self.point_step:
            raise ProtocolError(
                f"{size} of {self.point_step} bytes does not fit into rows of "
                f"{row_step} bytes"
            )
        if len(self.data) < row_step * self.height:
            raise ProtocolError(
                f"{size} has rows of {row_step} bytes, but came with "
                f"{len(self.data)} bytes in all"
            )


@layer(
    "sensor_msgs/PointCloud2",
    view=PointCloud2Msg,
    kinds=[
        TopicKind(
            "cloud",
            {r"points|cloud": "named points or a cloud", "": "its type alone"},
            most=2,
            options={"throttle": 1000, "colour_by": "z"},
            role="cloud",
        )
    ],
    switch="Clouds",
    rank=30,
)
class PointCloud(RobotLayer):
    """A cloud of points as dots, seen from above.

    Points are first transformed from the cloud's frame to the map, both at the cloud's
    stamp, with all rotations and the height: a lidar may be tilted or upside down, and
    z of a camera's optical frame points forward. Then heights are checked, and only
    then is the cloud flattened.

    Heights are in metres above the robot's base frame (``base_link``, or the frame of
    ``base_frame``), straight up even if the robot is tilted: 0 is the floor if that
    frame is on the floor. In a cloud with ``frame="map"`` they are above the map's
    plane. Without frames for the sensor, its z is assumed to point up and to begin at
    the base frame.

    A cloud of one row may have a ``row_step`` of 0. Of points above one another one dot
    is drawn. With ``colour_by`` the dots are in eight bands of a field's values, each
    with a class: ``band-0`` is the lowest.

    Style it by CSS: ``.pointcloud > .dot``, ``.pointcloud > .dot.band-7``; the dots'
    size is the custom property ``--dot-size``, in metres.
    """

    only_draws = True

    x: float = 0.0
    """Position of the sensor on the robot, in metres forward."""

    y: float = 0.0
    """Position of the sensor on the robot, in metres to the left."""

    angle: float = 0.0
    """Direction of the sensor, in degrees from the robot's x, counter-clockwise."""

    _: KW_ONLY

    z_min: float = -math.inf
    """The least height of a drawn point, in metres above the base frame."""

    z_max: float = math.inf
    """The greatest height of a drawn point, in metres above the base frame."""

    cell: Annotated[
        float, Limit("metres of at least 0", lambda side: 0 <= side < math.inf)
    ] = 0.05
    """One point is drawn in each square of this side, in metres; 0 for all."""

    max_points: Count = 3000
    """The greatest number of dots, evenly chosen."""

    colour_by: str | None = None
    """The name of the field whose values give the colours, such as ``"intensity"``;
    ``"z"`` is the height above the base frame.
    """

    low: float | None = None
    """The lower limit of the lowest band; the cloud's least value if not given."""

    high: float | None = None
    """The upper limit of the highest band; the cloud's greatest value if not given."""

    frame: Frame = "robot"
    """``"map"`` for a cloud in the map's frame."""

    throttle: int = 500
    age_limit: float = 2.0

    def build(self) -> None:
        """Make a path of dots, or one for each band of colours.

        Raises:
            ConfigError: If ``z_min`` is not below ``z_max``.
        """
        if not self.z_min < self.z_max:
            raise ConfigError(
                f"z_min must be below z_max, got {self.z_min} and {self.z_max}"
            )
        self.dots: list[Element] = [
            svg.path(class_=f"dot band-{number}", fill=colour)
            for number, colour in enumerate(COLOURS)
        ]
        if self.colour_by is None:
            self.dots = [svg.path(class_="dot", fill="#c2410c")]
        self.svg.append(*self.dots)

    def read(self, message: PointCloud2Msg) -> "Found":
        """Return points in the cloud's frame, and a field's values.

        Points are of shape (N, 3), or (N, 2) if the cloud has no heights.

        Raises:
            ProtocolError: If the sizes of a cloud do not match, or a field is missing.
        """
        import numpy as np

        high = message.has("z") or self.colour_by == "z"
        axes = ["x", "y", "z"] if high else ["x", "y"]
        names = list(axes)
        if self.colour_by is not None and self.colour_by not in names:
            names.append(self.colour_by)
        columns = dict(zip(names, message.columns(*names), strict=True))
        keep = np.ones(len(columns["x"]), dtype=bool)
        for axis in axes:
            keep &= abs(columns[axis]) < FARTHEST  # also false if not finite
        points = np.column_stack([columns[axis][keep] for axis in axes])
        if self.colour_by in (None, "z"):
            return points, None
        return points, columns[str(self.colour_by)][keep]

    def draw(self, found: "Found", at: Transform) -> None:
        """Draw the remaining points after flattening."""
        points, values = found
        places, heights = levelled(points, at)
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
        """Return the indices of the points to draw."""
        import numpy as np

        chosen = np.arange(len(places))
        if heights is not None:
            seen = (heights >= self.z_min) & (heights <= self.z_max)
            chosen = np.flatnonzero(seen)
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
        low, high = self.low, self.high
        if low is None:
            low = float(known.min()) if len(known) else 0.0
        if high is None:
            high = float(known.max()) if len(known) else 1.0
        # Differences of finite but extreme numbers may be infinite.
        with np.errstate(over="ignore", invalid="ignore"):
            width = np.subtract(high, low) if high > low else 1.0
            share = (values - low) / width
        share = np.nan_to_num(share, nan=0.0, posinf=1.0, neginf=0.0).clip(0.0, 1.0)
        last = len(COLOURS) - 1
        return np.minimum((share * len(COLOURS)).astype(np.int64), last)


def one_a_cell(points: "NDArray[np.float64]", cell: float) -> "NDArray[np.int64]":
    """Return the indices of points to keep, so that each square has at most one.

    Args:
        points: Points of shape (N, 2), in metres, N above 0.
        cell: The side of a square, in metres.
    """
    import numpy as np

    cells = np.floor(points / cell).astype(np.int64)
    cells -= cells.min(axis=0)
    width = int(cells[:, 0].max()) + 1
    _, first = np.unique(cells[:, 1] * width + cells[:, 0], return_index=True)
    return np.sort(first)
