"""The messages of the simulated robots in one dialect of ROS, and the node with topics.

``Messages`` makes messages, ``GraphNode`` publishes them, and ``Feed`` is a topic
that every robot has.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from webmap.base.geometry import Pose, Quaternion
from webmap.ros.rosbridge.server.dialect import Dialect
from webmap.ros.rosbridge.server.graph import Deliver, Graph
from webmap.ros.tf import Transform
from webmap.sim.maps import FloorPlan
from webmap.sim.planner import Point
from webmap.sim.robot import SimRobot
from webmap.sim.scanner import LASER_HEIGHT, ScannerOptions, mount
from webmap.sim.world import World

Message = dict[str, Any]

_COVARIANCE = [0.0] * 36
for _i, _variance in enumerate((0.001, 0.001, 1e6, 1e6, 1e6, 0.01)):
    _COVARIANCE[7 * _i] = _variance
_FULL, _EMPTY = 25.2, 21.0
_DISCHARGING, _LITHIUM_ION, _GOOD = 2, 2, 1


class Messages:
    """Builds messages; headers are numbered by topic if the dialect numbers them.

    Args:
        dialect: The dialect of the graph.
        nan: Whether covariances contain a NaN, as with some drivers.

    """

    def __init__(self, dialect: Dialect, *, nan: bool = False) -> None:
        self.dialect = dialect
        self.mounted = {"base_laser": mount(0.0, LASER_HEIGHT)}
        """Frames of sensors, and their poses on the base."""
        self._covariance = _COVARIANCE.copy()
        if nan:
            self._covariance[1] = math.nan

    def odometry(self, topic: str, stamp: float, robot: SimRobot) -> Message:
        """Return ``nav_msgs/Odometry``."""
        frames = robot.frames
        return {
            "header": self.dialect.header(topic, stamp, f"{frames}odom"),
            "child_frame_id": f"{frames}base_link",
            "pose": {"pose": pose(robot.odometry), "covariance": self._covariance},
            "twist": {
                "twist": {
                    "linear": vector(robot.twist.vx),
                    "angular": vector(z=robot.twist.wz),
                },
                "covariance": self._covariance,
            },
        }

    def scan(
        self,
        topic: str,
        stamp: float,
        robot: SimRobot,
        options: ScannerOptions,
        ranges: NDArray[np.float32],
    ) -> Message:
        """Return ``sensor_msgs/LaserScan``."""
        increment = math.tau / options.beams
        return {
            "header": self.dialect.header(topic, stamp, f"{robot.frames}base_laser"),
            "angle_min": float32(-math.pi),
            "angle_max": float32(-math.pi + (options.beams - 1) * increment),
            "angle_increment": float32(increment),
            "time_increment": 0.0,
            "scan_time": float32(0.1),
            "range_min": float32(options.range_min),
            "range_max": float32(options.range_max),
            "ranges": ranges,
            "intensities": np.empty(0, np.float32),
        }

    def camera(self, topic: str, stamp: float, robot: SimRobot, jpeg: bytes) -> Message:
        """Return ``sensor_msgs/CompressedImage``."""
        return {
            "header": self.dialect.header(topic, stamp, f"{robot.frames}camera"),
            "format": "jpeg",
            "data": jpeg,
        }

    def battery(self, topic: str, stamp: float, robot: SimRobot) -> Message:
        """Return ``sensor_msgs/BatteryState``; unmeasured values are NaN."""
        nothing = np.empty(0, np.float32)
        return {
            "header": self.dialect.header(topic, stamp, f"{robot.frames}base_link"),
            "voltage": float32(_EMPTY + (_FULL - _EMPTY) * robot.charge),
            "temperature": math.nan,
            "current": float32(-0.8 - 2.5 * abs(robot.twist.vx)),
            "charge": math.nan,
            "capacity": math.nan,
            "design_capacity": math.nan,
            "percentage": float32(robot.charge),
            "power_supply_status": _DISCHARGING,
            "power_supply_health": _GOOD,
            "power_supply_technology": _LITHIUM_ION,
            "present": True,
            "cell_voltage": nothing,
            "cell_temperature": nothing,
            "location": "",
            "serial_number": "",
        }

    def path(self, topic: str, stamp: float, points: list[Point]) -> Message:
        """Return ``nav_msgs/Path`` in the map's frame; each pose points to the next."""
        header = self.dialect.header(topic, stamp, "map")
        poses = []
        for i, (x, y) in enumerate(points):
            before, after = points[max(i - 1, 0)], points[min(i + 1, len(points) - 1)]
            yaw = math.atan2(after[1] - before[1], after[0] - before[0])
            poses.append({"header": header, "pose": pose(Pose(x, y, yaw))})
        return {"header": header, "poses": poses}

    def pose_stamped(self, stamp: float, at: Pose) -> Message:
        """Return ``geometry_msgs/PoseStamped`` in the map's frame."""
        return {"header": self.dialect.header("", stamp, "map"), "pose": pose(at)}

    def transforms(
        self, topic: str, stamp: float, robots: list[SimRobot], believed: list[Pose]
    ) -> Message:
        """Return ``tf2_msgs/TFMessage`` of each robot from map to odom to base.

        Args:
            topic: The topic of the message.
            stamp: In seconds.
            robots: The robots.
            believed: The estimated pose of each robot on the map.

        """
        found = []
        for robot, at in zip(robots, believed, strict=True):
            odom, base = f"{robot.frames}odom", f"{robot.frames}base_link"
            map_from_odom = at @ robot.odometry.inverse
            for parent, child, place in (
                ("map", odom, map_from_odom),
                (odom, base, robot.odometry),
            ):
                whole = Transform.from_pose(place)
                found.append(self._transform(topic, stamp, parent, child, whole))
        return {"transforms": found}

    def static_transforms(
        self, topic: str, stamp: float, robots: list[SimRobot]
    ) -> Message:
        """Return the transforms of the sensors on the base."""
        return {
            "transforms": [
                self._transform(
                    topic,
                    stamp,
                    f"{robot.frames}base_link",
                    f"{robot.frames}{name}",
                    at,
                )
                for robot in robots
                for name, at in self.mounted.items()
            ]
        }

    def grid(self, topic: str, stamp: float, plan: FloorPlan) -> Message:
        """Return ``nav_msgs/OccupancyGrid`` of a floor."""
        place = (plan.x, plan.y)
        return self.cells(topic, stamp, "map", plan.occupancy, plan.resolution, place)

    def cells(
        self,
        topic: str,
        stamp: float,
        frame: str,
        cells: NDArray[np.int8],
        resolution: float,
        place: tuple[float, float],
    ) -> Message:
        """Return ``nav_msgs/OccupancyGrid``.

        Args:
            topic: The topic of the message.
            stamp: In seconds.
            frame: The frame of the grid.
            cells: Of shape (rows, columns), the lowest row first.
            resolution: The side of a cell, in metres.
            place: Its lower left corner, in metres.

        """
        rows, columns = cells.shape
        return {
            "header": self.dialect.header(topic, stamp, frame),
            "info": {
                "map_load_time": self.dialect.time(stamp),
                "resolution": float32(resolution),
                "width": columns,
                "height": rows,
                "origin": pose(Pose(*place)),
            },
            "data": cells.ravel(),
        }

    def _transform(
        self, topic: str, stamp: float, parent: str, child: str, at: Transform
    ) -> Message:
        by, turn = at.translation, at.rotation
        return {
            "header": self.dialect.header(f"{topic}:{child}", stamp, parent),
            "child_frame_id": child,
            "transform": {
                "translation": vector(by.x, by.y, by.z),
                "rotation": {"x": turn.x, "y": turn.y, "z": turn.z, "w": turn.w},
            },
        }


def pose(at: Pose) -> Message:
    """Return ``geometry_msgs/Pose``."""
    return {"position": vector(at.x, at.y), "orientation": quaternion(at.yaw)}


def read_pose(message: Message) -> Pose | None:
    """Return a ``geometry_msgs/Pose`` in the plane; None if it is not finite."""
    position, turn = message["position"], message["orientation"]
    rotation = Quaternion(turn["x"], turn["y"], turn["z"], turn["w"])
    at = Pose(position["x"], position["y"], rotation.yaw)
    return at if all(map(math.isfinite, (at.x, at.y, at.yaw))) else None


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Message:
    """Return ``geometry_msgs/Vector3``, which has the fields of ``Point``."""
    return {"x": x, "y": y, "z": z}


def quaternion(yaw: float) -> Message:
    """Return ``geometry_msgs/Quaternion`` of a rotation about z, in radians."""
    turn = Quaternion.from_yaw(yaw)
    return {"x": turn.x, "y": turn.y, "z": turn.z, "w": turn.w}


def float32(value: float) -> float:
    """Return the nearest value that a float32 field can store."""
    return float(np.float32(value))


log = logging.getLogger("webmap.sim")

NODE = "/robots"


class GraphNode:
    """Publishes and subscribes for simulated robots.

    Args:
        world: The robots.
        graph: The ROS graph with their topics.
        tilted: Whether their lasers are mounted upside down, and they have a depth
            camera whose cloud is in its optical frame.

    """

    def __init__(self, world: World, graph: Graph, *, tilted: bool = False) -> None:
        self.world = world
        self.graph = graph
        self.tilted = tilted
        self.messages = Messages(graph.schema.dialect, nan=world.options.scanner.nan)
        self.on_step: list[Callable[[], None]] = []
        """Called five times a second: the actions report the state of their goals."""

    def target(self, pose_stamped: dict[str, Any], index: int) -> Pose | None:
        """Return a goal in the map's frame; None if its frame is unknown."""
        at = read_pose(pose_stamped["pose"])
        frame = pose_stamped["header"]["frame_id"].strip("/")
        robot = self.world.robots[index]
        if at is None or frame in ("", "map"):
            return at
        if frame in ("odom", f"{robot.frames}odom"):
            return robot.pose @ robot.odometry.inverse @ at
        log.warning("%s: a goal in an unknown frame %r", robot.name, frame)
        return None

    def publish(self, topic: str, message: dict[str, Any]) -> None:
        """Deliver a message to all who subscribe to the topic now."""
        self.graph.publish(self, topic, message)

    def advertise(self, topic: str, type_name: str, *, latch: bool = False) -> None:
        """Advertise a topic; with ``latch``, later subscribers get its last message."""
        self.graph.advertise(self, topic, type_name, node=NODE, latch=latch)

    def subscribe(self, topic: str, type_name: str, callback: Deliver) -> None:
        """Call ``callback`` with each message of a topic from now on."""
        self.graph.subscribe(self, topic, callback, type_name, node=NODE)


@dataclass(frozen=True, slots=True)
class Feed:
    """A topic that every robot has, in its own namespace."""

    topic: str
    """The name without the robot's namespace and the slash."""

    type: str
    period: float
    """Seconds between two messages."""

    frame: str
    """The frame of the header: ``map``, or a frame of each robot without its prefix;
    empty if the type has no header."""

    make: Callable[[int], Message | None]
    """Makes the message of the robot with this index, without its header; None if there
    is none. Called only while the topic has subscribers."""
