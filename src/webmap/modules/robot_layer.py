"""Base class of layers that draw the messages of one topic of a robot."""

from functools import partial
from typing import Any, ClassVar

from webmap.core.registry import robot_modules
from webmap.core.robot import Robot
from webmap.modules.layer_options import Seconds
from webmap.modules.placed import Placed
from webmap.modules.topic_layer import LEVEL, E, TopicLayer, label, origin


class RobotLayer(TopicLayer):
    """A drawing of the messages of one topic of a robot.

    A subclass is declared with :func:`webmap.layer`. It makes its elements in
    :meth:`build` and changes them in :meth:`draw`; this class does the rest. It decodes
    the messages of the topic; an invalid message is skipped and shown as a problem of
    the robot. The drawing stays on the map at the frame of the message at its stamp, is
    shown as stale when it is, has a name in the list of layers, and ends with the
    module.

    Annotated attributes of the class that have a value are options of the module. A
    layer whose messages are in the robot's frame unless they name another sets
    ``frame = "robot"``; ``x``, ``y`` and ``angle`` are then the pose of its sensor on
    the robot, in metres and degrees. Annotated, these are options too.

    The argument ``at`` of :meth:`draw` is the transform from coordinates of the message
    to those of the drawing, which is level: x and y are drawn, and z is metres above
    the robot's base, or above the map's plane with ``frame = "map"``. :meth:`draw` is
    called for each message, and again if the tilt of the frame changes.
    """

    owner: ClassVar = "robot"
    registry: ClassVar = robot_modules

    in_plane: ClassVar[bool] = False
    """Whether the drawing lies in the plane of its frame and tilts with it as a whole,
    so that :meth:`draw` need not transform points in space."""

    robot: Robot

    throttle: int = 200
    """The least time between two messages, in milliseconds."""

    age_limit: Seconds = 60.0
    """Seconds after which it is drawn as stale."""

    name: str = ""
    """A further CSS class, to distinguish several layers."""

    frame = "map"
    x = y = angle = 0.0

    def __init__(self, robot: Robot, *args: Any, **options: Any) -> None:
        self.robot = robot
        self._take_arguments(robot, *args, **options)
        self.placed = Placed(
            robot,
            class_=f"{self.declared.css} {self.name}".strip(),
            frame=self.frame,
            x=self.x,
            y=self.y,
            angle=self.angle,
        )
        """The group of the drawing."""
        self.svg = self.placed.svg
        label(self.svg, self.topic, robot)
        self.build()
        self._subscribe(robot)

    def upright(self, element: E, x: float = 0.0, y: float = 0.0) -> E:
        """Add an element that does not turn with the robot, such as a text.

        Its y points down, as letters need, and its units are centimetres, since
        browsers round the size of letters that are smaller than a unit.

        Args:
            element: The element.
            x: Its distance from the origin of the frame, in metres along the map's x.
            y: Its distance, in metres along the map's y.

        """
        self.placed.keep_upright(self.add(element), x, y)
        return element

    def take(self, message: Any) -> None:
        """Draw a message at the pose of its frame at its stamp.

        Raises:
            ProtocolError: If it cannot be drawn.

        """
        found, at = self.read(message), origin(message)
        if self.in_plane:
            self.draw(found, LEVEL)  # before it is placed, since it may refuse it
            self.placed.stand_in(*at)
        else:
            self.placed.stand_in(*at, partial(self.draw, found))
        self.svg.set_age(self.bridge.lag, limit=self.age_limit)

    def in_map(self, frame_id: str) -> bool:
        """Return whether a frame is that of the robot's poses, so that both compare."""
        tf, frames = self.robot.tf, self.robot.pose_source.frames
        if tf is None or frames is None:
            return frame_id.strip("/") in ("", "map")
        name = frames.buffer.name(frame_id, tf["namespace"])
        return name in ("", tf["map_frame"])
