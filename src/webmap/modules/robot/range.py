"""Sonars and other sensors that measure one distance."""

import math
from functools import partial
from typing import TYPE_CHECKING

from webmap.core.from_above import cone
from webmap.core.layer_names import label
from webmap.core.placed import Placed, sector
from webmap.core.refusals import refusing
from webmap.errors import ProtocolError
from webmap.geometry.reach import FARTHEST
from webmap.ros.bridge import Bridge
from webmap.ros.messages_poses import RangeMsg
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot
    from webmap.tf import Transform

LEVEL = 0.02
"""Sine of the angle up or down below which a sensor is said to look ahead."""


class Range:
    """Draws a ``sensor_msgs/Range`` as a cone up to what it measures.

    The cone ends where something is, or at the sensor's reach if nothing is there;
    then it has the class ``clear``. Without a reading there is no cone. A sensor of
    fixed distance says -inf for "something" and +inf for "nothing" (REP 117). One that
    looks up or down has the outline that its cone has from above; how it is turned
    about its own axis does not matter.

    Style it by CSS: ``.range > .cone`` and ``.range > .cone.clear``.

    Args:
        robot: The robot that carries the sensor; the cone is in its frame.
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        x: Where the sensor is on the robot, in metres forward.
        y: In metres to the left.
        angle: Where it looks, in degrees from the robot's x, counter-clockwise.
        throttle: The least time between two messages, in milliseconds.
        age_limit: Seconds after which it is drawn as old.

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
        throttle: int = 200,
        age_limit: float = 1.0,
    ) -> None:
        self.robot = robot
        self.topic = topic
        self.age_limit = age_limit
        self.distance: float | None = None
        """In metres; infinite if nothing is in reach, None if that is not known."""
        self.cone = svg.path(
            class_="cone", fill="#d9822b", fill_opacity=0.35, stroke="none"
        )
        self._placed = Placed(
            robot, self.cone, class_="range", frame="robot", x=x, y=y, angle=angle
        )
        self.svg = self._placed.svg
        label(self.svg, topic, robot)
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_range),
            "sensor_msgs/Range",
            throttle=throttle,
            decode=RangeMsg,
            compression="cbor",  # JSON takes infinity, which is a reading, for none
        )

    def on_range(self, message: RangeMsg) -> None:
        """Draw a reading in place of the one before.

        Raises:
            ProtocolError: If the sensor's own numbers make no sense.

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
                f"a cone is {FARTHEST:g} m long at the most, got a max_range of "
                f"{reach:g} m with nothing nearer"
            )
        draw = partial(self._draw, drawn, view / 2)
        self._placed.stand_in(message.frame_id, message.stamp, draw)
        self.distance = distance
        self.cone.classes.toggle("clear", self.distance == math.inf)
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)

    def _draw(self, reach: float, half: float, tilt: "Transform") -> None:
        if abs(tilt.rows[2][0]) < LEVEL:
            self.cone.set(d=sector(reach, half))
            return
        outline = cone(reach, half, tilt) if reach > 0 else []
        corners = "L".join(f"{x:.4f} {y:.4f}" for x, y in outline)
        self.cone.set(d=f"M{corners}z" if len(outline) > 2 else None)
