"""The commands of one robot to the gate, and the gate's reports on it."""

import hashlib
import logging
import time
from collections import Counter
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, TypeAlias

import msgspec
from msgspec import structs

from webmap.base.errors import ConfigError, MotionError
from webmap.base.geometry import Pose
from webmap.base.lifecycle import lifecycle
from webmap.base.tasks import spawn
from webmap.config.checks import Mistakes, same_name
from webmap.config.motion import (
    TWIST_TYPES,
    WRITING,
    InitialPoseConfig,
    MotionConfig,
    MoveConfig,
    TwistConfig,
)
from webmap.config.reading import Config
from webmap.core.operators import named_robots
from webmap.gate.protocol import RobotReport, RobotSpec
from webmap.gate.rules.obedience import MOST_NAME, MOST_NODES
from webmap.gate.specs import PLANE, axes_of, resolved
from webmap.poses.odometry import TypeQuery
from webmap.ros.bridge import Bridge
from webmap.ros.motion_topics import STOP
from webmap.ros.names import is_agent_url, is_type

if TYPE_CHECKING:
    from webmap.agents.gates import Gates
    from webmap.gate.display.client import GateClient

log = logging.getLogger("webmap.robot")

ASK_WRITERS = 10.0
"""Seconds between two queries of a bridge for other publishers of velocities."""

PartBridges: TypeAlias = dict[str, Bridge | None]
"""The bridge of each part."""

_used: Counter[str] = Counter()


agent_robot_id: ContextVar[str | None] = ContextVar("agent_robot_id", default=None)
"""The identifier of the robot that a display makes, if it is a robot of an agent."""


def id_at_agent(agent: str, name: str) -> str:
    """Return the identifier of a robot of an agent.

    Agent and displays derive it, so nobody sends it. It begins with the agent's name,
    which the router's access rules protect, and "/", which no other robot's has.

    Args:
        agent: The name of the agent.
        name: The name of the robot at the agent.

    """
    return f"{agent}/{_digest(name)}"


def _digest(name: str) -> str:
    """Return a part of an identifier; nobody finds a second name with the same one."""
    data = name.encode("utf-8", "surrogatepass")
    return f"r{hashlib.sha256(data).hexdigest()[:16]}"


def _id_of(name: str) -> str:
    """Return the identifier of a robot for pages and gate.

    It is the same after a restart, in whatever order robots are created: a page may
    still have to send a STOP that it could not deliver before.

    Raises:
        ConfigError: If it is that of a robot of an agent which exists already.

    """
    given = agent_robot_id.get()
    if given is None and RobotMotion.agent:
        given = id_at_agent(RobotMotion.agent, name)
    if given is not None:
        if any(each.id == given for each in robot_motions):
            raise ConfigError("its agent has another robot of this name")
        return given
    id = _digest(name)
    _used[id] += 1
    return id if _used[id] == 1 else f"{id}-{_used[id]}"


def shown_name(name: str, agent: str) -> str:
    """Return the name of a robot on every display, and in the reports of its gate.

    It contains the name of its agent, whichever agents a display knows: operators of
    several displays mean the same robot by the same name.

    Args:
        name: The name of the robot.
        agent: The name of its agent; "" for none.

    """
    if not agent or same_name(name) == same_name(agent):
        return name
    return f"{name} ({agent})"


class RobotMotion:
    """The gate's description of one robot, updated as topics change.

    The robot's commands go to the gate of :meth:`commands`. Nothing here writes to a
    robot; the gate decides.
    """

    agent: str = ""
    """The agent that this process is; "" for a display."""

    gate: "Gates | GateClient | None" = None
    """The gates of this process, once they are started."""

    def __init__(self, name: str, complain: Any) -> None:
        self.id = _id_of(name)
        self.base_frame = ""
        """The robot's own frame; a change is sent to the gate."""
        self._name = name
        self._complain = complain
        self.config = MotionConfig()
        """The configuration of the robot's motion; changed by :meth:`set`."""
        self.axes = PLANE
        """The axes out of the plane along which the robot moves, with their limits."""
        self._bridges: PartBridges = {}
        self._odometry: tuple[Bridge, str, str | None] | None = None
        self._own_map = Pose()
        self._type_query: TypeQuery | None = None
        self._ask_writers_at = 0.0
        self.writers: tuple[str, ...] = ()
        """Other nodes that publish the robot's velocity, as far as they are known."""
        robot_motions.add(self)
        self.set_tags(())

    def set_tags(self, tags: tuple[str, ...]) -> None:
        """Set the tags of the robot, by which people may have rights."""
        named_robots[self.id] = self._name, tags

    @property
    def is_far(self) -> bool:
        """Whether the gate of an agent moves the robot, not that of this process."""
        links = (self._bridges.get(key) for key in WRITING)
        return any(link is not None and is_agent_url(link.url) for link in links)

    def set(self, key: str, part: Config | None, bridge: Bridge | None = None) -> None:
        """Set or clear one part of the configuration.

        Args:
            key: The part, a field of ``MotionConfig``.
            part: The part, whose values are valid; None clears the part.
            bridge: The bridge of the part, if it has one.

        Raises:
            ConfigError: If the part does not fit the others, or the gate cannot move
                robots behind the bridge.

        """
        config = msgspec.structs.replace(self.config, **{key: part})
        bridges = {**self._bridges, key: bridge}
        if part is not None:
            self._check(config, bridges)
        if part is not None and bridge is not None:
            for topic, carried in _written(part).items():
                bridge.protect(topic, carried)
        self.config, self._bridges = config, bridges
        if key == "twist":
            self.axes = axes_of([config.twist]) if config.twist else PLANE
            self._ask_type(config.twist, bridge)
        self.declare()

    def _ask_type(self, twist: TwistConfig | None, bridge: Bridge | None) -> None:
        if self._type_query is not None:
            self._type_query.remove()
            self._type_query = None
        if twist is not None and twist.type is None and bridge is not None:
            self._type_query = TypeQuery(bridge, twist.topic, self._take_type)

    def bridge(self, key: str) -> Bridge | None:
        """Return the bridge of a part of the configuration, or None."""
        return self._bridges.get(key)

    def set_odometry(self, bridge: Bridge, topic: str, type: str | None) -> None:
        """Set the odometry in which the gate observes the robot's motion.

        Args:
            bridge: The connection to the ROS system that has the topic.
            topic: The topic.
            type: Its type; None while it is unknown.

        """
        if self._odometry != (bridge, topic, type):
            self._odometry = (bridge, topic, type)
            self.declare()

    def set_alignment(self, own_map: Pose) -> None:
        """Set the alignment of the robot's own map, which goals need."""
        if own_map != self._own_map:
            self._own_map = own_map
            self.declare()

    def clear_odometry(self) -> None:
        """Declare the robot to the gate without odometry, if it had one."""
        if self._odometry is not None:
            self._odometry = None
            self.declare()

    def declare(self) -> None:
        """Send the gate its current description of this robot."""
        if self.gate is None:
            return
        spec = self.spec()
        if spec is None:
            self.gate.forget(self.id)
        else:
            self.gate.declare(spec)

    def declare_or_complain(self) -> None:
        """Send the description; an error is shown for this robot only."""
        try:
            self.declare()
        except Exception as error:
            log.exception("robot %r was not declared to the gate", self._name)
            self._complain(f"it cannot be moved: {error}")

    def spec(self) -> RobotSpec | None:
        """Return the gate's description, or None if nothing moves the robot."""
        return self._spec(self.config, self._bridges)

    def _check(self, config: MotionConfig, bridges: "PartBridges") -> None:
        """Raise what the gate would refuse, before any of it is stored.

        The error is raised where the part is set, not where the gate is started.
        """
        mistakes = Mistakes()
        config.check((), mistakes)
        mistakes.refuse(f"robot {self._name!r}")
        spec = self._spec(config, bridges)
        if spec is not None:
            resolved(spec)

    def _spec(self, config: MotionConfig, bridges: "PartBridges") -> RobotSpec | None:
        parts, odometry = structs.asdict(config), self._odometry
        first = next((key for key in WRITING if parts[key] is not None), None)
        if first is None or bridges[first] is None:
            return None
        twist = config.twist
        if twist is None:
            parts["scan_assist"] = None
        elif twist.type is None:
            parts["twist"] = structs.replace(twist, type=TWIST_TYPES[0])
        return RobotSpec(
            **parts,
            id=self.id,
            name=shown_name(self._name, self.agent),
            base_frame=self.base_frame,
            twist_type_assumed=twist is not None and twist.type is None,
            odometry_url=odometry[0].url if odometry else None,
            odometry_topic=odometry[1] if odometry else None,
            odometry_type=odometry[2] if odometry else None,
            own_map=(self._own_map.x, self._own_map.y, self._own_map.yaw),
        )

    def writes(self, url: str) -> dict[str, str]:
        """Return the topics that only the gate writes over a bridge, with contents.

        Args:
            url: The URL of the bridge.

        """
        written: dict[str, str] = {}
        for key in reversed(WRITING):
            part, bridge = getattr(self.config, key), self._bridges.get(key)
            if part is not None and bridge is not None and bridge.url == url:
                written.update(_written(part))
        return written

    def close(self) -> None:
        """Remove the robot from the gate; it stops if it was driven."""
        # All at once: for its goals, a robot without velocity would be another one.
        self.config, self._odometry = MotionConfig(), None
        self.set("twist", None)
        robot_motions.discard(self)
        named_robots.pop(self.id, None)

    def commands(self) -> "Gates | GateClient":
        """Return the gate, for a command to this robot.

        Raises:
            MotionError: If WebMap is not started, or nothing moves the robot.

        """
        if self.gate is None or not lifecycle.running:
            raise MotionError(
                f"robot {self._name!r} cannot be moved before webmap.start()"
            )
        if not any(getattr(self.config, key) for key in WRITING):
            raise MotionError(
                f"robot {self._name!r} has no twist topic and no move topic"
            )
        return self.gate

    def on_report(self, report: RobotReport) -> None:
        """Query the names of other publishers while another program is driving."""
        twist, now = self.config.twist, time.monotonic()
        if report.other_writer is None or twist is None:
            self._ask_writers_at, self.writers = now, ()
        elif now >= self._ask_writers_at:
            self._ask_writers_at = now + ASK_WRITERS
            spawn(self._ask_writers(twist))

    async def _ask_writers(self, twist: TwistConfig) -> None:
        bridge = self._bridges.get("twist")
        others = None if bridge is None else await bridge.other_publishers(twist.topic)
        if others is not None and self.gate is not None and self.config.twist is twist:
            sound = [name[:MOST_NAME] for name in others if name.isprintable()]
            self.writers = tuple(sound[:MOST_NODES])
            self.gate.name_writers(self.id, tuple(others))

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
    """Return the topics that only the gate writes for a part, with their contents."""
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


robot_motions: set[RobotMotion] = set()
"""The motion of all robots; declared again when the gate starts."""
