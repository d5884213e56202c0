"""Robots: who they are, where they are and how they are moved."""

import asyncio
import logging
import math
import time
import weakref
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, Protocol

from webmap.core.alignment import alignment
from webmap.core.extendable import Extendable
from webmap.core.frames import Frames, frames_of
from webmap.core.goal_topics import (
    COVARIANCE,
    NAVIGATE_TO_POSE,
    InitialPoseTopic,
    MoveTopic,
)
from webmap.core.motion import MotionRoad, TwistTopic
from webmap.core.odometry import OdometryFeed, PoseReading
from webmap.core.placing import Placing
from webmap.core.pose_troubles import PoseTroubles
from webmap.core.registry import Namespace, robot_modules
from webmap.core.whereabouts import Whereabouts
from webmap.errors import MotionError
from webmap.gate.assist import AssistSpec, polygon_around
from webmap.gate.messages import RobotReport
from webmap.geometry import Quaternion, Twist, Vector3
from webmap.ros.bridge import Bridge
from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.fragment import Fragment
from webmap.scope import Removal, keep, no_scope

if TYPE_CHECKING:
    from webmap.core.map import Map

log = logging.getLogger("webmap.robot")

POSE_LIMIT = 1.0
"""Seconds after which a pose is drawn as old."""

TF_PERIOD = 0.05
"""Least seconds between two poses that are taken from frames alone."""


class Position(Protocol):
    """Anything with ``x`` and ``y`` in metres."""

    @property
    def x(self) -> float:
        """Metres along x."""

    @property
    def y(self) -> float:
        """Metres along y."""


class Orientation(Protocol):
    """Anything with the components of a quaternion."""

    @property
    def x(self) -> float:
        """The component along x."""

    @property
    def y(self) -> float:
        """The component along y."""

    @property
    def z(self) -> float:
        """The component along z."""

    @property
    def w(self) -> float:
        """The real component."""


robots: "weakref.WeakValueDictionary[str, Robot]" = weakref.WeakValueDictionary()
"""All robots that were made and not destroyed, by their id."""


class Robot(Extendable):
    """One robot: its name, its pose, how it looks and how it is moved.

    A robot may be shown on any number of maps, and used without any.

    Args:
        name: What people call it. A label: it need not be unique.
        model: How it looks from above, in metres, x forward; a plain arrow if not
            given. It becomes part of the robot's own group, :attr:`svg`.
        base_link: The frame that the navigation stack calls the robot's own.
        namespace: Where its modules are looked up.

    """

    def __init__(
        self,
        name: str,
        model: Element | None = None,
        *,
        base_link: str = "base_link",
        namespace: Namespace = robot_modules,
    ) -> None:
        super().__init__(namespace)
        self.name = str(name)
        self.base_link = base_link
        self.model = default_model() if model is None else model
        self.maps: list[Map] = []
        self.selected = False
        self.position = Vector3()
        self.orientation = Quaternion()
        self.measured_twist: Twist | None = None
        self.valid = False
        self.pose_stamp: float | None = None
        self.problems: dict[object, str] = {}
        """What fails for now, in sentences, by what they are about."""
        self.report: RobotReport | None = None
        self._destroyed = False
        self._feed: OdometryFeed | None = None
        self._frames: Frames | None = None
        self._placing: Placing | None = None
        self._troubles = PoseTroubles(self)
        self._says_placing = True
        self.whereabouts = Whereabouts()
        """Where it is and was, on its own map and on the common one."""
        self._hears_frames = Removal(lambda: None)
        self.motion = MotionRoad(self.name, self.report_error)
        self.svg = svg.g(svg.title(text=self.name), self.model, class_="robot unplaced")
        self.svg.set("data-name", self.name)
        self.svg.set("data-robot", self.motion.id)
        self.fragment = Fragment(self.svg)
        robots[self.id] = self
        keep(Removal(self.destroy))

    def __repr__(self) -> str:
        return f"<Robot {self.name!r}>"

    @property
    def id(self) -> str:
        """What the gate and the page call this robot; unique in the process."""
        return self.motion.id

    @property
    def feed(self) -> OdometryFeed | None:
        """Where the poses come from, if that is set."""
        return self._feed

    @property
    def yaw(self) -> float:
        """The heading, in radians in ``[-pi, pi]``, counter-clockwise from x."""
        return self.orientation.yaw

    @property
    def angle(self) -> float:
        """The heading, in degrees, counter-clockwise from x."""
        return math.degrees(self.yaw)

    @property
    def pose_age(self) -> float | None:
        """Seconds since the newest pose came in; None if there was none yet."""
        return None if self.pose_stamp is None else time.monotonic() - self.pose_stamp

    def destroy(self) -> None:
        """Stop all communication, remove the modules, leave every map."""
        if self._destroyed:
            return
        self._destroyed = True
        for map in tuple(self.maps):
            map.remove_robot(self)
        self.remove_modules()
        self.unsubscribe_odometry_topic()
        self.unset_tf()
        self.motion.close()
        robots.pop(self.id, None)

    # Where it is.

    def set_odometry_topic(
        self,
        bridge: Bridge,
        topic: str,
        throttle: int = 100,
        *,
        type: str | None = None,
    ) -> None:
        """Follow the poses on a topic, in place of the one before.

        The topic may carry ``geometry_msgs`` Pose, PoseStamped,
        PoseWithCovarianceStamped or Pose2D, or ``nav_msgs/Odometry``. If ``type`` is
        not given, rosapi is asked, and where there is no rosapi the shape of the first
        message tells. The bridge need not be open yet.

        Args:
            bridge: The link to the ROS system that has the topic.
            topic: The topic.
            throttle: The least time between two messages, in milliseconds.
            type: The message type.

        Raises:
            ConfigError: If ``type`` has no pose.

        """
        self.unsubscribe_odometry_topic()
        with no_scope():
            self._feed = OdometryFeed(
                bridge, topic, throttle, type, self._on_pose, self._on_odometry_problem
            )
        self._find_bridge()

    def unsubscribe_odometry_topic(self) -> None:
        """Stop following poses; does nothing if there is no topic."""
        if self._feed is not None:
            self._feed.remove()
            self._feed = None
            self.clear_problem("odometry")
            self.motion.clear_odometry()
            self._find_bridge()

    def set_tf(
        self,
        bridge: Bridge,
        *,
        map_frame: str = "map",
        base_frame: str | None = None,
        namespace: str = "",
        quiet: bool = False,
    ) -> None:
        """Draw the robot in the frame of the map, by the frames of ``/tf``.

        A pose of the odometry topic is taken from its own frame to ``map_frame`` as
        the frames were at its stamp. Without an odometry topic the robot is drawn
        where the frames have its base. Robots of one bridge share what they hear.

        Args:
            bridge: The link to the ROS system that has the frames.
            map_frame: The frame that robots are drawn in.
            base_frame: The robot's own frame; ``base_link`` of the robot if not given.
            namespace: ``/robot_0`` where the topics are ``/robot_0/tf`` and
                ``/robot_0/tf_static``; the names of frames get it in front, but for
                ``map``, ``world`` and ``earth``, which are everybody's.
            quiet: Whether poses that stay in the odometry's frame, because nobody
                tells of ``map_frame``, are no problem to be shown.

        """
        self.unset_tf()
        frames = frames_of(bridge, namespace)
        self._frames = frames
        self._placing = Placing(
            frames.buffer, map_frame, base_frame or self.base_link, frames.namespace
        )
        self._says_placing = not quiet
        self._hears_frames = frames.join(self._on_frames)
        self._find_bridge()

    def unset_tf(self) -> None:
        """Draw the robot where its odometry has it; does nothing if it is so."""
        self._hears_frames.remove()
        self._frames = self._placing = None
        self._find_bridge()

    @property
    def tf(self) -> Mapping[str, Any] | None:
        """The arguments of :meth:`set_tf`, None if it is not set."""
        if self._frames is None or self._placing is None:
            return None
        return {
            "bridge": self._frames.bridge,
            "map_frame": self._placing.map_frame,
            "base_frame": self._placing.base_frame,
            "namespace": self._frames.namespace,
            "quiet": not self._says_placing,
        }

    def set_alignment(self, x: float, y: float, angle: float) -> None:
        """Lay the robot's own map onto the common one: its poses, data and goals.

        Args:
            x: Where its map's origin is, in metres along the common map's x.
            y: In metres along its y.
            angle: How its map is turned, in degrees, counter-clockwise.

        Raises:
            ConfigError: If a number makes no sense.

        """
        self.whereabouts.align(alignment(x, y, angle))
        self._on_alignment()

    def unset_alignment(self) -> None:
        """Let the robot lie where its bridge's alignment has it."""
        self.whereabouts.align(None)
        self._on_alignment()

    # How it is moved.

    def set_twist_topic(
        self,
        bridge: Bridge,
        topic: str,
        *,
        type: str | None = None,
        stops_within: float | None = None,
        v_max: float | None = None,
        w_max: float | None = None,
        a_max: float | None = None,
        holonomic: bool = False,
        stop_hooks: Sequence[Mapping[str, str]] = (),
    ) -> None:
        """Say where velocity goes, and what the base behind it does and can.

        Args:
            bridge: The link to the robot's ROS system.
            topic: The topic, of ``geometry_msgs`` Twist or TwistStamped.
            type: The message type; asked of rosapi, or Twist, if not given.
            stops_within: The time in seconds within which the base stops by itself
                when velocity ceases. Without it nobody knows whether the robot stops
                when WebMap cannot tell it to, and it is driven at no more than
                0.3 m/s and 0.6 rad/s.
            v_max: The highest speed, in metres per second.
            w_max: The highest rate of turn, in radians per second.
            a_max: The highest acceleration, in metres per second squared. Slowing
                down is never delayed by it.
            holonomic: Whether the base can move sideways.
            stop_hooks: What else ``bridge`` is told on STOP:
                ``{"topic": "/lock", "type": "std_msgs/Bool"}`` publishes true, and
                false on reset; ``{"service": "/e_stop", "type": "std_srvs/Trigger"}``
                calls the service.

        Raises:
            ConfigError: If ``type`` carries no velocity, or a stop hook cannot be
                meant.

        """
        with no_scope():
            self.motion.set_twist(
                TwistTopic(
                    bridge,
                    topic,
                    type,
                    stops_within,
                    v_max,
                    w_max,
                    a_max,
                    holonomic,
                    stop_hooks,
                )
            )

    def set_scan_assist(
        self,
        topic: str,
        footprint: Sequence[tuple[float, float]] | float,
        *,
        x: float = 0.0,
        y: float = 0.0,
        angle: float = 0.0,
        stop_distance: float = 0.15,
        brake: float = 0.5,
        blind: Literal["stop", "creep"] = "stop",
        creep: float = 0.1,
    ) -> None:
        """Have the robot slowed down, when driven, before what a laser scan sees.

        It assists a driver and is no safety function: a planar scanner does not see
        glass, stairs or a table's edge, and what it says comes over a network.

        Args:
            topic: Of ``sensor_msgs/LaserScan``, on the bridge of the twist topic.
            footprint: The robot's corners in its own frame, in order, or its radius,
                in metres.
            x: Where the scanner is on the robot, in metres forward.
            y: In metres to the left.
            angle: Where it looks, in degrees from the robot's x, counter-clockwise.
            stop_distance: What stays free before the robot, in metres.
            brake: How hard the robot slows down, in metres per second squared.
            blind: Whether it stops or creeps while the scan is older than 0.3 s, is
                empty or mostly unknown.
            creep: How fast it creeps, in metres per second.

        Raises:
            ConfigError: If something of that cannot be meant.

        """
        corners = (
            polygon_around(footprint)
            if isinstance(footprint, int | float)
            else tuple((float(cx), float(cy)) for cx, cy in footprint)
        )
        self.motion.set_assist(
            AssistSpec(
                topic=topic,
                footprint=corners,
                sensor=(x, y, math.radians(angle)),
                stop_distance=stop_distance,
                brake=brake,
                blind=blind,
                creep=creep,
            )
        )

    def clear_scan_assist(self) -> None:
        """Let the robot be driven as before; nothing happens if nothing was set."""
        self.motion.set_assist(None)

    def unadvertise_twist_topic(self) -> None:
        """Give up the twist topic; does nothing if there is none."""
        self.motion.set_twist(None)

    def set_move_topic(
        self,
        bridge: Bridge,
        topic: str = "",
        *,
        frame: str = "map",
        cancel_topic: str | None = None,
        on_operator_loss: str = "continue",
        action: str | None = None,
        action_type: str = NAVIGATE_TO_POSE,
    ) -> None:
        """Say where goals go.

        They go to the action, if there is one: it says how they go and how they end.

        Args:
            bridge: The link to the ROS system of the robot's navigation.
            topic: A topic of ``geometry_msgs/PoseStamped``; besides an action it is
                for bridges that take no goals of actions.
            frame: The frame of the goals.
            cancel_topic: actionlib's topic by which goals are called off.
            on_operator_loss: ``"continue"`` if a goal goes on when its operator is
                lost, ``"cancel"`` if it is called off.
            action: The name of the action, such as ``"/navigate_to_pose"``.
            action_type: ``"nav2_msgs/action/NavigateToPose"``, of ROS 2, or
                ``"move_base_msgs/MoveBaseAction"``, of ROS 1.

        Raises:
            ConfigError: If there is neither a topic nor an action.

        """
        with no_scope():
            self.motion.set_move(
                MoveTopic(
                    bridge,
                    topic,
                    frame,
                    cancel_topic,
                    on_operator_loss,
                    action,
                    action_type,
                )
            )

    def set_initial_pose_topic(
        self,
        bridge: Bridge,
        topic: str = "/initialpose",
        *,
        covariance: Sequence[float] = COVARIANCE,
    ) -> None:
        """Say where the robot is told where it is, in the frame of its goals.

        Args:
            bridge: The link to its localisation; the bridge of its goals.
            topic: A topic of ``geometry_msgs/PoseWithCovarianceStamped``.
            covariance: How sure one is: the variances of x and y in m², of yaw in
                rad². RViz's are given if not said.

        Raises:
            ConfigError: If the covariance is not three numbers from 0 on, or goals go
                to another bridge.

        """
        with no_scope():
            self.motion.set_pose(InitialPoseTopic.of(bridge, topic, covariance))

    def unadvertise_move_topic(self) -> None:
        """Give up the move topic; does nothing if there is none."""
        self.motion.set_move(None)

    async def acquire_lease(self, *, timeout: float = 5.0) -> int:
        """Take the right to drive this robot, on behalf of this program.

        Any operator takes it away by driving.

        Args:
            timeout: Seconds to wait until the robot can be driven: the links over
                which it is driven open now, and its odometry must be heard.

        Returns:
            The lease's epoch.

        Raises:
            NoLease: If somebody else drives.
            MotionError: If the robot cannot be driven, and why.

        """
        epoch = await asyncio.wrap_future(self.motion.take())
        deadline = time.monotonic() + timeout
        while (why := self._not_drivable(epoch)) is not None:
            if time.monotonic() > deadline:
                self.release_lease()
                raise MotionError(f"robot {self.name!r} cannot be driven: {why}")
            await asyncio.sleep(0.02)
        return epoch

    def _not_drivable(self, epoch: int) -> str | None:
        report = self.report
        if report is None or report.epoch != epoch:
            return "the gate has not said that it can"
        return report.reason

    def release_lease(self) -> None:
        """Give the right to drive back; the robot is stopped if it moves."""
        self.motion.release()

    def twist(
        self,
        x: float,
        y: float = 0.0,
        z: float = 0.0,
        rx: float = 0.0,
        ry: float = 0.0,
        rz: float = 0.0,
    ) -> None:
        """Give one velocity, which holds until it is old: 0.2 s at the most.

        It goes through the gate like every other, so the program needs the lease, and
        the speed in force bounds it. Whoever wants the robot to go on calls again, at
        20 Hz, say.

        Args:
            x: Metres per second forward.
            y: Metres per second to the left.
            z: Upward; the gate moves robots in the plane and leaves it out.
            rx: About x; left out likewise.
            ry: About y; left out likewise.
            rz: Radians per second, counter-clockwise.

        Raises:
            NoLease: If the program does not hold the lease.

        """
        self.motion.twist(Twist(x, y, rz))

    def move(self, position: Position, orientation: Orientation) -> None:
        """Send the robot to a pose, by its own navigation.

        Args:
            position: Where the base link is to be, in metres on the common map.
            orientation: Its orientation there.

        Raises:
            NoLease: If the program does not hold the lease.

        """
        o = orientation
        self.motion.move(position.x, position.y, Quaternion(o.x, o.y, o.z, o.w).yaw)

    def locate(self, position: Position, orientation: Orientation) -> None:
        """Tell the robot where it is, while it neither moves nor follows a goal.

        Args:
            position: Where the base link is, in metres on the common map.
            orientation: Its orientation there.

        Raises:
            NoLease: If the program does not hold the lease.

        """
        o = orientation
        self.motion.locate(position.x, position.y, Quaternion(o.x, o.y, o.z, o.w).yaw)

    def cancel(self) -> None:
        """Call off the robot's goals."""
        self.motion.cancel()

    def stop(self) -> None:
        """Stop the robot, whoever drives it, and call off its goals.

        It stays stopped, for everybody and also after a restart, until
        :meth:`reset_stop` or a person's reset.
        """
        self.motion.stop()

    def reset_stop(self) -> None:
        """End a STOP that stands; moves nothing and gives nobody the robot."""
        self.motion.reset_stop()

    # Plain data.

    @classmethod
    def from_dict(
        cls, data: Mapping[str, Any], bridges: Mapping[str, Bridge] | None = None
    ) -> "Robot":
        """Make a robot with its topics and modules from plain data.

        Args:
            data: As :meth:`to_dict` returns it, or a table of a TOML file.
            bridges: Bridges by name or URL, to be shared; others are made.

        Raises:
            ConfigError: If a key or a value is not understood; it is named.

        """
        from webmap.core.plain import robot_from_dict

        return robot_from_dict(cls, data, bridges)

    def to_dict(self) -> dict[str, Any]:
        """Return the robot, its topics and its modules as plain data."""
        from webmap.core.plain import robot_to_dict

        return robot_to_dict(self)

    # What others tell it.

    def report_error(self, text: str) -> None:
        """Log a failure and show it on every page that has the robot."""
        message = f"{self.name}: {text}"
        log.warning("%s", message)
        for map in self.maps:
            map.show_error(message)

    def set_problem(self, about: object, text: str) -> None:
        """Note what fails until :meth:`clear_problem`; later viewers see it too.

        Args:
            about: What the sentence is about; a new one takes its place.
            text: A sentence for people.

        """
        if self.problems.get(about) != text:
            self.problems[about] = text
            self.report_error(text)

    def clear_problem(self, about: object) -> None:
        """Note that what was said of ``about`` is true no more."""
        self.problems.pop(about, None)

    def on_map(self, map: "Map", shown: bool) -> None:
        """Note that a map shows this robot, or does so no more; fire ``on_map``."""
        if shown:
            self.maps.append(map)
            for text in self.problems.values():
                map.show_error(f"{self.name}: {text}")
        else:
            self.maps.remove(map)
        self.update_selected()
        self.notify_modules("on_map", map, shown)

    def update_selected(self) -> None:
        """Look whether any map has the robot selected and fire ``on_select``."""
        selected = any(map.selected is self for map in self.maps)
        if selected != self.selected:
            self.selected = selected
            self.notify_modules("on_select", selected)

    def on_gate_report(self, report: RobotReport) -> None:
        """Keep what the gate says of this robot and fire ``on_report``."""
        self.report = report
        self.notify_modules("on_report", report)

    def on_written(self, kind: str, message: dict[str, Any]) -> None:
        """Fire ``on_send_twist`` or ``on_send_move`` for what the gate wrote."""
        self.notify_modules(f"on_send_{kind}", message)

    def _on_odometry_problem(self, text: str | None) -> None:
        if text is None:
            self.clear_problem("odometry")
        else:
            self.set_problem("odometry", text)

    def _on_pose(self, reading: PoseReading) -> None:
        self.pose_stamp = time.monotonic()
        self.svg.set_age(0.0, limit=POSE_LIMIT)
        if self._feed is not None and self._feed.type == "nav_msgs/Odometry":
            self.motion.set_odometry(
                self._feed.bridge, self._feed.topic, self._feed.type
            )
        if self._placing is not None:
            reading = self._placing.of_reading(reading, self.pose_stamp)
        self._place(reading)
        self._tell_trouble()

    def _on_frames(self) -> None:
        """Look where the frames have the base, if no topic says where it is."""
        now = time.monotonic()
        soon = self.pose_stamp is not None and now - self.pose_stamp < TF_PERIOD
        if self._feed is None and self._placing is not None and not soon:
            reading = self._placing.of_base(now)
            if reading is not None:
                self.pose_stamp = now
                self.svg.set_age(0.0, limit=POSE_LIMIT)
                self._place(reading)
        self._tell_trouble()
        self.whereabouts.tell()

    def _on_alignment(self) -> None:
        """Go where a new alignment has the robot, and all that it knows."""
        if self.whereabouts.newest is not None:
            self._show(self.whereabouts.on_map(self.whereabouts.newest))
        self.motion.set_alignment(self.whereabouts.alignment)
        self.whereabouts.tell()

    def _find_bridge(self) -> None:
        """Note where poses come from now: the alignment of that bridge holds."""
        self.whereabouts.forget()
        self._troubles.forget()
        source = self._frames if self._feed is None else self._feed
        bridge = None if source is None else source.bridge
        if bridge is not self.whereabouts.bridge:
            self.whereabouts.come_from(bridge, self._on_alignment)
            self._on_alignment()

    def _tell_trouble(self) -> None:
        """Say what is wrong with the frames or the poses; take back what is mended."""
        self._troubles.look(
            self._placing,
            self._frames,
            self.whereabouts.jumps,
            quiet=not self._says_placing,
        )

    def _place(self, reading: PoseReading) -> None:
        """Take the newest pose, in the robot's own map."""
        period = 0.0 if self._feed is None else self._feed.throttle / 1000
        self.whereabouts.jumps.look(reading, time.monotonic())
        self._show(self.whereabouts.take(reading, period))
        self.whereabouts.tell()

    def _show(self, reading: PoseReading) -> None:
        """Draw the robot at a pose on the common map, if that is news."""
        changed = (
            reading.position != self.position
            or reading.orientation != self.orientation
            or reading.twist != self.measured_twist
            or not self.valid
        )
        if not changed:
            return
        self.position, self.orientation = reading.position, reading.orientation
        self.measured_twist = reading.twist
        self.svg.set_pose(self.position.x, self.position.y, self.yaw)
        if not self.valid:
            self.valid = True
            self.svg.classes.remove("unplaced")
        self.notify_modules("on_odometry_update")


def default_model() -> Element:
    """Return an arrowhead of 0.5 m that points along x."""
    return svg.path(d="M0.25 0L-0.2 0.18L-0.1 0L-0.2 -0.18Z", class_="model")
