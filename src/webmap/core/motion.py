"""The road of one robot's commands to the gate, and the gate's word of it."""

import logging
import math
import time
import zlib
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import Future
from typing import TYPE_CHECKING, Any, TypeAlias

import msgspec

from webmap.base.errors import MotionError
from webmap.base.geometry import Pose, Twist
from webmap.base.lifecycle import lifecycle
from webmap.base.tasks import spawn
from webmap.config.checks import Mistakes
from webmap.config.motion import (
    TWIST_TYPES,
    InitialPoseConfig,
    MotionConfig,
    MoveConfig,
    ScanAssistConfig,
    TwistConfig,
)
from webmap.config.reading import Config, read_part
from webmap.gate.limits import PLANE, Axes
from webmap.gate.messages import AssistSpec, RobotReport, RobotSpec
from webmap.gate.rules.assist import polygon_around
from webmap.gate.specs import checked, checked_assist
from webmap.poses.type_asking import TypeAsking
from webmap.ros.bridge import Bridge
from webmap.ros.moving import STOP
from webmap.ros.names import is_type

if TYPE_CHECKING:
    from webmap.gate.display.client import GateClient

log = logging.getLogger("webmap.robot")

ASK_WRITERS = 10.0
"""Seconds between two questions to a bridge who publishes velocities to a robot."""

PARTS: dict[str, type[Config]] = {
    "twist": TwistConfig,
    "move": MoveConfig,
    "initial_pose": InitialPoseConfig,
    "scan_assist": ScanAssistConfig,
}
"""The parts of a robot's motion."""

WRITING = ("twist", "move", "initial_pose")
"""Those for which the gate writes; the first that a robot has names its bridge."""

OF_BASE = sorted(
    set(TwistConfig.__struct_fields__)
    & set(RobotSpec.__struct_fields__) - {"stop_hooks"}
)
"""What the gate knows of a base by the names that the configuration has."""

Links: TypeAlias = dict[str, Bridge | None]
"""The bridge of each part."""

_used: Counter[str] = Counter()


def _id_of(name: str) -> str:
    """Return what pages and gate call a robot of that name.

    It is the same after a restart, in whatever order robots are made: a page may still
    have to say a STOP that it could not get rid of before.
    """
    id = f"r{zlib.crc32(name.encode('utf-8', 'surrogatepass')):08x}"
    _used[id] += 1
    return id if _used[id] == 1 else f"{id}-{_used[id]}"


class MotionRoad:
    """What the gate is told about one robot, kept true as topics come and go.

    Nothing here writes to a robot: everything is handed to the gate, which decides.
    """

    gate: "GateClient | None" = None
    """The one gate of this process, once it is started."""

    def __init__(self, name: str, complain: Any) -> None:
        self.id = _id_of(name)
        self.base_frame = ""
        """The robot's own frame; the gate hears of a change."""
        self._name = name
        self._complain = complain
        self.config = MotionConfig()
        """What moves the robot; :meth:`set` changes it."""
        self._bridges: Links = {}
        self._odometry: tuple[Bridge, str, str | None] | None = None
        self._own_map = Pose()
        self._asking: TypeAsking | None = None
        self._ask_writers_at = 0.0
        roads.add(self)

    @property
    def axes(self) -> Axes:
        """The axes out of the plane that the robot moves along, and how fast."""
        twist = self.config.twist
        if twist is None:
            return PLANE
        return Axes(twist.z_max or 0.0, twist.rx_max or 0.0, twist.ry_max or 0.0)

    def set(
        self, key: str, values: Mapping[str, Any] | None, bridge: Bridge | None = None
    ) -> None:
        """Set or clear one part of the configuration.

        Args:
            key: The part, a field of ``MotionConfig``.
            values: What it says, as plain values; None clears it. What is empty where
                that is the default counts as left out.
            bridge: The bridge that it goes over, if it goes over one.

        Raises:
            ConfigError: If something in it cannot be meant; every mistake is named.

        """
        part = None
        if values is not None:
            url = "" if bridge is None else bridge.url
            part = read_part(PARTS[key], key, values, f"robot {self._name!r}", url)
        config = msgspec.structs.replace(self.config, **{key: part})
        bridges = {**self._bridges, key: bridge}
        if part is not None:
            self._check(config, bridges)
        if part is not None and bridge is not None:
            for topic, carried in _written(part).items():
                bridge.protect(topic, carried)
        self.config, self._bridges = config, bridges
        if key == "twist":
            self._ask_type(config.twist, bridge)
        self.declare()

    def _ask_type(self, twist: TwistConfig | None, bridge: Bridge | None) -> None:
        if self._asking is not None:
            self._asking.remove()
            self._asking = None
        if twist is not None and twist.type is None and bridge is not None:
            self._asking = TypeAsking(bridge, twist.topic, self._take_type)

    def bridge(self, key: str) -> Bridge | None:
        """Return the bridge that a part of the configuration goes over, if any."""
        return self._bridges.get(key)

    def set_odometry(self, bridge: Bridge, topic: str, type: str | None) -> None:
        """Tell where the gate can see for itself how the robot moves.

        Args:
            bridge: The link to the ROS system that has the topic.
            topic: The topic.
            type: Its type; None as long as nobody knows it.

        """
        if self._odometry != (bridge, topic, type):
            self._odometry = (bridge, topic, type)
            self.declare()

    def set_alignment(self, own_map: Pose) -> None:
        """Tell where the robot's own map lies on the common one: goals need it."""
        if own_map != self._own_map:
            self._own_map = own_map
            self.declare()

    def clear_odometry(self) -> None:
        """Tell that there is no such topic any more."""
        if self._odometry is not None:
            self._odometry = None
            self.declare()

    def declare(self) -> None:
        """Tell the gate what it needs to know of this robot, as it is now."""
        if self.gate is None:
            return
        spec = self.spec()
        if spec is None:
            self.gate.forget(self.id)
        else:
            self.gate.declare(spec)

    def declare_or_complain(self) -> None:
        """Tell the gate likewise; what it does not take is said of this robot alone."""
        try:
            self.declare()
        except Exception as error:
            log.exception("robot %r was not declared to the gate", self._name)
            self._complain(f"it cannot be moved: {error}")

    def spec(self) -> RobotSpec | None:
        """Return what the gate needs to know, or None if nothing moves the robot."""
        return self._spec(self.config, self._bridges)

    def _check(self, config: MotionConfig, bridges: "Links") -> None:
        """Refuse what the gate would refuse, before any of it is kept.

        The error is raised where the part is set, not where the gate is started.
        """
        mistakes = Mistakes()
        config.check((), mistakes)
        mistakes.refuse(f"robot {self._name!r}")
        if config.scan_assist is not None:
            checked_assist(self._name, _assist(config.scan_assist))
        spec = self._spec(config, bridges)
        if spec is not None:
            checked(spec)

    def _spec(self, config: MotionConfig, bridges: "Links") -> RobotSpec | None:
        twist, move, pose = config.twist, config.move, config.initial_pose
        first = next((key for key in WRITING if getattr(config, key) is not None), None)
        link = None if first is None else bridges[first]
        if link is None:
            return None
        driven: dict[str, Any] = {}
        if twist is not None:
            driven = {name: getattr(twist, name) for name in OF_BASE}
            driven["stop_hooks"] = tuple(map(msgspec.to_builtins, twist.stop_hooks))
            driven["twist_topic"] = twist.topic
            if config.scan_assist is not None:
                driven["assist"] = _assist(config.scan_assist)
        goals: dict[str, Any] = {}
        if move is not None:
            goals = {
                "goal_topic": move.topic or None,
                "goal_type": _goal_type(move, "PoseStamped"),
                "cancel_topic": move.cancel_topic,
                "action": move.action,
                "action_type": move.action_type,
                "on_operator_loss": move.on_operator_loss,
            }
        if pose is not None:
            goals["pose_topic"] = pose.topic
            goals["pose_covariance"] = pose.covariance
            goals["pose_type"] = _goal_type(move, "PoseWithCovarianceStamped")
        told = move or pose
        if told is not None:
            goals |= {"goal_url": told.bridge, "goal_frame": told.frame}
        odometry = self._odometry
        return RobotSpec(
            id=self.id,
            name=self._name,
            bridge_url=link.url,
            twist_type=(twist.type if twist else None) or TWIST_TYPES[0],
            base_frame=self.base_frame,
            twist_type_assumed=twist is not None and twist.type is None,
            odometry_url=odometry[0].url if odometry else None,
            odometry_topic=odometry[1] if odometry else None,
            odometry_type=odometry[2] if odometry else None,
            own_map=(self._own_map.x, self._own_map.y, self._own_map.yaw),
            **driven,
            **goals,
        )

    def writes(self, url: str) -> dict[str, str]:
        """Return what the gate alone writes over a bridge: topics, and what they carry.

        Args:
            url: The address of the bridge.

        """
        written: dict[str, str] = {}
        for key in reversed(WRITING):
            part, bridge = getattr(self.config, key), self._bridges.get(key)
            if part is not None and bridge is not None and bridge.url == url:
                written.update(_written(part))
        return written

    def close(self) -> None:
        """Let the gate forget the robot; it stops if it was driven."""
        # All at once: without velocity it would be another machine, for its goals.
        self.config, self._odometry = MotionConfig(), None
        self.set("twist", None)
        roads.discard(self)

    def take(self) -> "Future[int]":
        """Ask for the lease on behalf of this program."""
        return self._gate().take(self.id)

    def release(self) -> None:
        """Give the program's lease back; the robot is stopped."""
        self._gate().release(self.id)

    def twist(self, twist: Twist) -> None:
        """Hand one velocity to the gate, as this program.

        Raises:
            MotionError: If the twist topic states no limit for an axis that it names.

        """
        gate = self._gate()
        if why := self.axes.refusal(twist):
            raise MotionError(f"robot {self._name!r} was not told to move: {why}")
        gate.twist(self.id, twist)

    def move(self, x: float, y: float, yaw: float) -> None:
        """Hand one goal to the gate, as this program."""
        self._gate().move(self.id, x, y, yaw)

    def locate(self, x: float, y: float, yaw: float) -> None:
        """Hand to the gate where the robot is, as this program."""
        self._gate().locate(self.id, x, y, yaw)

    def cancel(self) -> None:
        """Have the gate call off the robot's goals."""
        self._gate().cancel(self.id)

    def stop(self) -> None:
        """Have the gate stop the robot, whoever drives it."""
        self._gate().stop_robot(self.id)

    def reset_stop(self, report: RobotReport | None) -> None:
        """Have the gate end the STOP that a report tells of."""
        gate = self._gate()
        stop = None if report is None else report.stop
        if stop is None:
            raise MotionError(
                f"robot {self._name!r}: its report tells of no STOP that could be "
                "reset; after stop() wait until report.stop is there"
            )
        gate.reset(self.id, stop.id)

    def heed(self, report: RobotReport) -> None:
        """Ask who else publishes velocities to the robot, while somebody does."""
        twist, now = self.config.twist, time.monotonic()
        if report.other_writer is None or twist is None:
            self._ask_writers_at = now
        elif now >= self._ask_writers_at:
            self._ask_writers_at = now + ASK_WRITERS
            spawn(self._ask_writers(twist))

    async def _ask_writers(self, twist: TwistConfig) -> None:
        bridge = self._bridges.get("twist")
        others = None if bridge is None else await bridge.other_publishers(twist.topic)
        if others is not None and self.gate is not None and self.config.twist is twist:
            self.gate.name_writers(self.id, tuple(others))

    def _gate(self) -> "GateClient":
        if self.gate is None or not lifecycle.running:
            raise MotionError(
                f"robot {self._name!r} cannot be moved before webmap.start()"
            )
        if not any(getattr(self.config, key) for key in WRITING):
            raise MotionError(
                f"robot {self._name!r} has no twist topic and no move topic"
            )
        return self.gate

    def _take_type(self, found: str) -> None:
        twist = self.config.twist
        if twist is None or twist.type == found:
            return
        if not is_type(found, *TWIST_TYPES):
            self._complain(
                f"topic {twist.topic!r} has type {found}; velocity goes to "
                f"{TWIST_TYPES[0]} or {TWIST_TYPES[1]}"
            )
            self.set("twist", None)
            return
        typed = msgspec.structs.replace(twist, type=found)
        self.config = msgspec.structs.replace(self.config, twist=typed)
        self.declare()


def _written(part: object) -> dict[str, str]:
    """Return what the gate alone writes for a part: topics, and what each carries."""
    match part:
        case TwistConfig():
            hooks = {hook.topic: STOP for hook in part.stop_hooks if hook.topic}
            return {**hooks, part.topic: "a velocity"}
        case MoveConfig():
            action = part.action
            names = (
                (part.topic, "a goal"),
                (part.cancel_topic, "the end of a goal"),
                (action and f"{action}/goal", "a goal"),
                (action and f"{action}/cancel", "the end of a goal"),
            )
            return {name: carried for name, carried in names if name}
        case InitialPoseConfig():
            return {part.topic: "an initial pose"}
    return {}


def _goal_type(move: MoveConfig | None, name: str) -> str:
    """Return a type of ``geometry_msgs`` as the dialect of the action has it."""
    ros2 = move is not None and move.action and "/action/" in move.action_type
    return f"geometry_msgs/msg/{name}" if ros2 else f"geometry_msgs/{name}"


def _assist(config: ScanAssistConfig) -> AssistSpec:
    """Return scan assist as the gate takes it: a radius becomes corners."""
    size = config.footprint
    corners = polygon_around(size) if isinstance(size, float) else tuple(size)
    return AssistSpec(
        topic=config.topic,
        footprint=corners,
        sensor=(config.x, config.y, math.radians(config.angle)),
        upside_down=config.upside_down,
        frame=config.frame,
        stop_distance=config.stop_distance,
        brake=config.brake,
        blind=config.blind,
        creep=config.creep,
    )


roads: set[MotionRoad] = set()
"""The roads of all robots there are; declared anew when the gate starts."""
