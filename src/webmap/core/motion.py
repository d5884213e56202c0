"""The road of one robot's commands to the gate, and the gate's word of it."""

import logging
import time
import zlib
from collections import Counter
from concurrent.futures import Future
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from webmap.core.goal_topics import InitialPoseTopic, MoveTopic
from webmap.core.tasks import spawn
from webmap.core.twist_topic import TWIST_TYPES, TwistTopic, check_twist_type
from webmap.core.type_asking import TypeAsking
from webmap.errors import ConfigError, MotionError
from webmap.gate.hookspecs import checked_hooks
from webmap.gate.limits import PLANE, Axes
from webmap.gate.messages import AssistSpec, RobotReport, RobotSpec
from webmap.gate.specs import checked, checked_assist
from webmap.geometry import Pose, Twist
from webmap.lifecycle import lifecycle
from webmap.ros.bridge import Bridge

if TYPE_CHECKING:
    from webmap.gate.display.client import GateClient

log = logging.getLogger("webmap.robot")

ASK_WRITERS = 10.0
"""Seconds between two questions to rosapi who publishes velocities to a robot."""

BRIDGES = ("rosbridge", "webmap")
"""What is in the names of nodes that publish for their clients, this one too."""

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
        self._twist: TwistTopic | None = None
        self._move: MoveTopic | None = None
        self._pose: InitialPoseTopic | None = None
        self._odometry: tuple[Bridge, str, str | None] | None = None
        self._assist: AssistSpec | None = None
        self._own_map = Pose()
        self._asking: TypeAsking | None = None
        self._ask_writers_at = 0.0
        roads.add(self)

    @property
    def twist_topic(self) -> TwistTopic | None:
        """Where velocity goes, if that is set."""
        return self._twist

    @property
    def axes(self) -> Axes:
        """The axes out of the plane that the robot moves along, and how fast."""
        return PLANE if self._twist is None else self._twist.axes

    @property
    def pose_topic(self) -> InitialPoseTopic | None:
        """Where the robot is told where it is, if that is set."""
        return self._pose

    @property
    def move_topic(self) -> MoveTopic | None:
        """Where goals go, if that is set."""
        return self._move

    def set_twist(self, twist: TwistTopic | None) -> None:
        """Set or clear where velocity goes.

        Raises:
            ConfigError: If the type is none that carries a velocity, or a number or a
                stop hook cannot be meant.

        """
        if twist is not None:
            if twist.type is not None:
                check_twist_type(twist.topic, twist.type)
            hooks = checked_hooks(self._name, twist.stop_hooks, twist.topic)
            twist = replace(twist, stop_hooks=hooks)
            self._check(twist, self._move, self._pose)
            for topic, carried in twist.writes().items():
                twist.bridge.protect(topic, carried)
        if self._asking is not None:
            self._asking.remove()
            self._asking = None
        self._twist = twist
        if twist is not None and twist.type is None:
            self._asking = TypeAsking(twist.bridge, twist.topic, self._take_type)
        self.declare()

    @property
    def assist(self) -> AssistSpec | None:
        """How the robot is slowed down before what its scanner sees, if that is set."""
        return self._assist

    def set_move(self, move: MoveTopic | None) -> None:
        """Set or clear where goals go.

        Raises:
            ConfigError: If the initial pose goes to another bridge, or something in it
                cannot be meant.

        """
        if move is not None:
            self._check(self._twist, move, self._pose)
            move.protect()
        self._move = move
        self.declare()

    def set_pose(self, pose: InitialPoseTopic | None) -> None:
        """Set or clear where the robot is told where it is.

        Raises:
            ConfigError: If its goals go to another bridge.

        """
        if pose is not None:
            self._check(self._twist, self._move, pose)
            for topic, carried in pose.writes().items():
                pose.bridge.protect(topic, carried)
        self._pose = pose
        self.declare()

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

    def set_assist(self, assist: AssistSpec | None) -> None:
        """Set how the robot is slowed down before what its scanner sees.

        Raises:
            ConfigError: If something in it cannot be meant.

        """
        self._assist = assist and checked_assist(self._name, assist)
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
        return self._spec(self._twist, self._move, self._pose)

    def _check(
        self,
        twist: TwistTopic | None,
        move: MoveTopic | None,
        pose: InitialPoseTopic | None,
    ) -> None:
        """Refuse what the gate would refuse, before any of it is kept.

        Who says it hears of it there, and not whoever starts the gate.
        """
        spec = self._spec(twist, move, pose)
        if spec is not None:
            checked(spec)

    def _spec(
        self,
        twist: TwistTopic | None,
        move: MoveTopic | None,
        pose: InitialPoseTopic | None,
    ) -> RobotSpec | None:
        link = twist or move or pose
        if link is None:
            return None
        goals = {
            **(pose.fields(move) if pose else {}),
            **(move.fields() if move else {}),
        }
        odometry = self._odometry
        return RobotSpec(
            id=self.id,
            name=self._name,
            bridge_url=link.bridge.url,
            twist_topic=twist.topic if twist else None,
            twist_type=(twist.type if twist else None) or TWIST_TYPES[0],
            base_frame=self.base_frame,
            twist_type_assumed=twist is not None and twist.type is None,
            stops_within=twist.stops_within if twist else None,
            v_max=twist.v_max if twist else None,
            w_max=twist.w_max if twist else None,
            z_max=twist.z_max if twist else None,
            rx_max=twist.rx_max if twist else None,
            ry_max=twist.ry_max if twist else None,
            a_max=twist.a_max if twist else None,
            holonomic=twist.holonomic if twist else False,
            assist=self._assist if twist else None,
            stop_hooks=tuple(map(dict, twist.stop_hooks)) if twist else (),
            odometry_url=odometry[0].url if odometry else None,
            odometry_topic=odometry[1] if odometry else None,
            odometry_type=odometry[2] if odometry else None,
            own_map=(self._own_map.x, self._own_map.y, self._own_map.yaw),
            **goals,
        )

    def writes(self, url: str) -> dict[str, str]:
        """Return what the gate alone writes over a bridge: topics, and what they carry.

        Args:
            url: The address of the bridge.

        """
        written: dict[str, str] = {}
        for way in (self._pose, self._move, self._twist):
            if way is not None and way.bridge.url == url:
                written.update(way.writes())
        return written

    def close(self) -> None:
        """Let the gate forget the robot; it stops if it was driven."""
        # All at once: without velocity it would be another machine, for its goals.
        self._move = self._pose = self._odometry = None
        self.set_twist(None)
        self.declare()
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
        twist, now = self._twist, time.monotonic()
        if report.other_writer is None or twist is None:
            self._ask_writers_at = now
        elif now >= self._ask_writers_at:
            self._ask_writers_at = now + ASK_WRITERS
            spawn(self._ask_writers(twist))

    async def _ask_writers(self, twist: TwistTopic) -> None:
        nodes = await twist.bridge.publishers(twist.topic)
        if nodes is not None and self.gate is not None and self._twist is twist:
            others = [n for n in nodes if not any(part in n for part in BRIDGES)]
            self.gate.name_writers(self.id, tuple(others))

    def _gate(self) -> "GateClient":
        if self.gate is None or not lifecycle.running:
            raise MotionError(
                f"robot {self._name!r} cannot be moved before webmap.start()"
            )
        if self.spec() is None:
            raise MotionError(
                f"robot {self._name!r} has no twist topic and no move topic"
            )
        return self.gate

    def _take_type(self, found: str) -> None:
        twist = self._twist
        if twist is None or twist.type == found:
            return
        try:
            check_twist_type(twist.topic, found)
        except ConfigError as error:
            self._complain(str(error))
            self.set_twist(None)
            return
        self._twist = replace(twist, type=found)
        self.declare()


roads: set[MotionRoad] = set()
"""The roads of all robots there are; declared anew when the gate starts."""
