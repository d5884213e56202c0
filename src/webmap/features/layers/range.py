"""Range sensors, such as sonars, that measure one distance."""

import math
from dataclasses import KW_ONLY

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import cone, sector
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import Stamped
from webmap.ros.tf import Transform
from webmap.scene import svg

LEVEL = 0.02
"""Sine of the angle up or down below which a sensor counts as level."""


class RangeMsg(Stamped, frozen=True, kw_only=True):
    """``sensor_msgs/Range``: one distance within a cone."""

    field_of_view: float
    """The whole angle of the cone, in radians."""

    min_range: float
    """In metres."""

    max_range: float
    """In metres."""

    range: float
    """In metres; infinite if nothing is in reach, NaN if unknown."""

    radiation_type: int = 0
    """0 ultrasound, 1 infrared."""


@layer(
    "sensor_msgs/Range",
    view=RangeMsg,
    kinds=[TopicKind("range", most=8)],
    switch="Ranges",
    rank=110,
)
class Range(RobotLayer):
    """A cone up to a range sensor's measured distance, in the robot's frame.

    The cone ends at the detected object, or at the sensor's greatest range if nothing
    is detected; then it has the class ``clear``. Without a reading there is no cone. A
    sensor of fixed distance reports -inf for "object" and +inf for "nothing" (REP 117).
    The cone of a sensor that points up or down is drawn as its outline looks from
    above; the rotation about its own axis does not matter.

    Style it by CSS: ``.range > .cone`` and ``.range > .cone.clear``.
    """

    only_draws = True

    encoding = "binary"  # JSON has no infinity, which is a reading

    frame = "robot"

    x: float = 0.0
    """Position of the sensor on the robot, in metres forward."""

    y: float = 0.0
    """Position of the sensor on the robot, in metres to the left."""

    angle: float = 0.0
    """Direction of the sensor, in degrees from the robot's x, counter-clockwise."""

    _: KW_ONLY

    age_limit: float = 1.0

    def build(self) -> None:
        """Make the cone."""
        self.distance: float | None = None
        """In metres; infinite if nothing is in reach, None if unknown."""
        self.cone = self.add(
            svg.path(class_="cone", fill="#d9822b", fill_opacity=0.35, stroke="none")
        )

    def read(self, message: RangeMsg) -> tuple[float | None, float, float]:
        """Return the distance, and the length and half the angle of the cone.

        Raises:
            ProtocolError: If the sensor's own parameters are not valid.
        """
        reach, nearest = message.max_range, message.min_range
        view = message.field_of_view
        if not (math.isfinite(reach) and reach > 0):
            raise ProtocolError(f"max_range must be metres above 0, got {reach}")
        if not 0 < view < math.tau:
            raise ProtocolError(
                f"field_of_view must be radians from 0 to a whole turn, got {view}"
            )
        measured = message.range
        low = nearest if math.isfinite(nearest) else 0.0
        distance = None
        if measured == -math.inf or low <= measured <= reach:
            distance = max(low, measured)
        elif measured > reach:
            distance = math.inf
        drawn = 0.0 if distance is None else min(distance, reach)
        if drawn > FARTHEST:
            raise ProtocolError(
                f"a cone is at most {FARTHEST:g} m long, got a max_range of "
                f"{reach:g} m with nothing nearer"
            )
        return distance, drawn, view / 2

    def draw(self, found: tuple[float | None, float, float], at: Transform) -> None:
        """Draw the cone as seen from above."""
        self.distance, reach, half = found
        self.cone.classes.toggle("clear", self.distance == math.inf)
        if abs(at.rows[2][0]) < LEVEL:
            self.cone.set(d=sector(reach, half))
            return
        outline = cone(reach, half, at) if reach > 0 else []
        corners = "L".join(f"{x:.4f} {y:.4f}" for x, y in outline)
        self.cone.set(d=f"M{corners}z" if len(outline) > 2 else None)
