"""The pose and the drawing of a robot, and what lists of robots show."""

import asyncio
import logging
import math
import time
import weakref
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from webmap.base.audience import audience
from webmap.base.geometry import Pose, Quaternion, Twist, Vector3
from webmap.base.scope import Removal, keep
from webmap.config.motion import MOTION
from webmap.config.robot import BATTERY_LOW, OdometryConfig, TfConfig
from webmap.core.movable_robot import MovableRobot, sets_part
from webmap.core.pose_source import PoseSource
from webmap.core.problems import Problems
from webmap.core.registry import Namespace, robot_modules
from webmap.core.robot_model import ModelImages, checked_model
from webmap.core.robot_state import (
    Facts,
    RobotState,
    named,
    since_when,
    state_of,
    state_rounds,
)
from webmap.core.world_view import WorldView
from webmap.gate.protocol import RobotReport
from webmap.gate.rules.goals import OVER
from webmap.poses.alignment import alignment
from webmap.poses.odometry import OdometryFeed
from webmap.poses.placing import PoseReading
from webmap.ros.bridge import Bridge
from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.node import Fragment

log = logging.getLogger("webmap.robot")

POSE_LIMIT = 1.0
"""Seconds after which a pose is drawn as stale."""

KEYS = ("tags", "battery_low", "odometry", "tf", "alignment", *MOTION)
"""The keys of a robot's configuration that :meth:`VisibleRobot.configure` sets."""

robots: "weakref.WeakValueDictionary[str, VisibleRobot]" = weakref.WeakValueDictionary()
"""All robots that were created and not destroyed, by their id."""


class VisibleRobot(MovableRobot):
    """A robot with a pose, a drawing on maps, tags and a battery; base of every robot.

    The arguments are those of :class:`webmap.Robot`.
    """

    _keys = KEYS

    def __init__(
        self,
        name: str,
        model: Element | None = None,
        *,
        base_link: str = "base_link",
        namespace: Namespace = robot_modules,
    ) -> None:
        model = checked_model(name, model, robots)
        super().__init__(name, namespace)
        self.base_link = self.motion.base_frame = base_link
        self.model = model
        self.tags: tuple[str, ...] = ()
        """Words by which lists group the robot; the first one is its group."""
        self.battery_low = BATTERY_LOW
        """The charge below which the battery is low, from 0 to 1."""
        self._shown_problems = Problems(log, lambda text: f"{self.name}: {text}")
        self.problems: dict[object, str] = self._shown_problems.current
        """Current problems, as sentences, by subject."""
        self.maps: list[WorldView] = []
        """The maps that show the robot."""
        self.selected = False
        self.position = Vector3()
        self.orientation = Quaternion()
        self.measured_twist: Twist | None = None
        self.valid = False
        self._state_shown: RobotState | None = None
        self._looked_at_in: asyncio.AbstractEventLoop | None = None
        """The event loop that regularly updates the shown state, since a lost robot
        sends nothing."""
        self.pose_stamp: float | None = None
        """When the newest pose was sent, in seconds of ``time.monotonic()``; None
        before the first one."""
        self.pose_source = PoseSource(self, self.show_pose)
        """The source of its poses, on its own map and on the common one."""
        self.svg = svg.g(svg.title(text=self.name), self.model, class_="robot unplaced")
        self.svg.set(data_name=self.name, data_robot=self.motion.id)
        self.fragment = Fragment(self.svg)
        self.model_images = ModelImages(self.svg)
        robots[self.id] = self
        audience.follow(self)
        keep(Removal(self.destroy))

    def __repr__(self) -> str:
        return f"<Robot {self.name!r}>"

    @property
    def state(self) -> RobotState:
        """What the robot is doing.

        Its element in the scene has the state's name as ``data-state``, and if there
        are conditions, ``data-conditions`` and the activity as ``data-activity``.
        """
        feed, ended = self.feed, self.goal_ended_at
        return state_of(
            Facts(
                self.report,
                None if feed is None else feed.bridge,
                self.pose_source.period,
                self.silent_for,
                self.pose_age,
                self.motion.axes.seen(self.measured_twist),
                None if ended is None else time.monotonic() - ended,
                self.goal_failed,
                self.charge,
                self.battery_low,
                self.has_own_goal,
                self.motion.writers,
            )
        )

    @property
    def shown_state(self) -> RobotState:
        """The state that all parts of all pages show.

        It is :attr:`state` when the gate last reported, or at the last of the regular
        looks, so two parts of a page never show different states.
        """
        return self._state_shown or self.state

    @property
    def has_own_goal(self) -> bool:
        """Whether a layer shows an active goal or plan of its own navigation.

        WebMap did not send this goal: for a goal of WebMap see ``report.goal``.
        """
        return any(getattr(module, "shows_own_goal", False) for module in self.modules)

    @property
    def feed(self) -> OdometryFeed | None:
        """The feed of the odometry topic; None if none is set."""
        return self.pose_source.feed

    @property
    def yaw(self) -> float:
        """The heading, in radians in ``[-pi, pi]``, counter-clockwise from x."""
        return self.orientation.yaw

    @property
    def angle(self) -> float:
        """The heading, in degrees, counter-clockwise from x."""
        return math.degrees(self.yaw)

    @property
    def pose(self) -> Pose:
        """The pose in the plane: ``x`` and ``y`` in metres, ``yaw`` in radians."""
        return Pose(self.position.x, self.position.y, self.yaw)

    @property
    def pose_age(self) -> float | None:
        """Seconds since the newest pose was sent; None if there was none yet."""
        stamp = self.pose_stamp
        return None if stamp is None else time.monotonic() - stamp

    @property
    def silent_for(self) -> float | None:
        """Seconds since the newest pose from a source that also sends at rest.

        None if there was none: AMCL, for example, sends a pose only after motion.
        """
        received = self.pose_source.expected_at
        return None if received is None else time.monotonic() - received

    def hears_poses(self, within: float) -> bool:
        """Return whether a pose of any age arrived in the last ``within`` seconds."""
        return self.pose_source.received_within(within)

    def destroy(self) -> None:
        """Stop all communication, remove the modules, leave every map."""
        if self._destroyed:
            return
        self._destroyed = True
        audience.forget(self)
        state_rounds.leave(self._show_state)
        for map in tuple(self.maps):
            map.remove_robot(self)
        self.remove_modules()
        self.pose_source.end()
        self.motion.close()
        robots.pop(self.id, None)

    # Pose.

    @sets_part("odometry")
    def set_odometry_topic(
        self,
        bridge: Bridge,
        topic: str,
        throttle: int | None = None,
        *,
        type: str | None = None,
    ) -> None:
        """Receive poses from a topic, in place of the one before.

        The topic may have type ``geometry_msgs`` Pose, PoseStamped,
        PoseWithCovarianceStamped or Pose2D, or ``nav_msgs/Odometry``. If ``type`` is
        not given, the bridge is queried; if the bridge does not know the type, the
        first message determines it. The connection need not be open yet.

        Args:
            bridge: The connection to the ROS system that has the topic.
            topic: The topic.
            throttle: The least time between two messages, in milliseconds; if not
                given, 16 for up to 6 robots, 33 up to 13, 50 up to 20, 100 up to 1,000
                and behind an agent, else 200.
            type: The message type.

        Raises:
            ConfigError: If ``type`` has no pose, or another value is not valid.

        """

    def unsubscribe_odometry_topic(self) -> None:
        """Stop receiving poses; does nothing if there is no topic."""
        self.pose_source.unfollow()

    @sets_part("tf")
    def set_tf(
        self,
        bridge: Bridge,
        *,
        map_frame: str = "map",
        base_frame: str | None = None,
        namespace: str = "",
        quiet: bool = False,
    ) -> None:
        """Draw the robot in the frame of the map, using ``/tf``.

        A pose of the odometry topic is transformed from its own frame to ``map_frame``
        with the transforms at its stamp. Without an odometry topic the robot is drawn
        at the pose of its base in TF. Robots of one bridge share the subscription.

        Args:
            bridge: The connection to the ROS system that has the frames.
            map_frame: The frame that robots are drawn in.
            base_frame: The robot's own frame; ``base_link`` of the robot if not given.
            namespace: ``/robot_0`` if the topics are ``/robot_0/tf`` and
                ``/robot_0/tf_static``. It is put before the names of frames, except
                ``map``, ``world`` and ``earth``, which all robots share.
            quiet: Whether to show no problem when poses stay in the odometry's frame
                because ``map_frame`` is missing in TF.

        Raises:
            ConfigError: If a value is not valid.

        """

    def _set(self, key: str, part: Any, bridge: Bridge | None) -> None:
        source = self.pose_source
        if isinstance(part, OdometryConfig) and bridge is not None:
            source.follow(bridge, part)
        elif isinstance(part, TfConfig) and bridge is not None:
            source.place(bridge, part, self.base_link)
        elif key == "odometry":
            source.unfollow()
        elif key == "tf":
            source.unplace()
        elif key == "alignment":
            source.align(None if part is None else alignment(*part))
        elif key == "tags":
            self.tags = tuple(part)
            self.motion.set_tags(self.tags)
        elif key == "battery_low":
            self.battery_low = part
        else:
            super()._set(key, part, bridge)
            twist = self.motion.config.twist
            holonomic = twist is not None and twist.holonomic
            self.svg.set("data-holonomic", "" if holonomic else None)

    def unset_tf(self) -> None:
        """Stop drawing the robot by TF; does nothing if TF is not set."""
        self.pose_source.unplace()

    @property
    def tf(self) -> Mapping[str, Any] | None:
        """The arguments of :meth:`set_tf`; None if it is not set."""
        tf, frames = self.pose_source.tf, self.pose_source.frames
        if tf is None or frames is None:
            return None
        return {**msgspec.structs.asdict(tf), "bridge": frames.bridge}

    def set_alignment(self, x: float, y: float, angle: float) -> None:
        """Align the robot's own map, its poses, data and goals, on the common map.

        Args:
            x: The position of its map's origin on the common map, in metres along x.
            y: The position, in metres along y.
            angle: The rotation of its map in degrees, counter-clockwise.

        Raises:
            ConfigError: If a number is not valid.

        """
        self.pose_source.align(alignment(x, y, angle))

    def unset_alignment(self) -> None:
        """Use the alignment of the robot's bridge."""
        self.pose_source.align(None)

    # Lists of robots.

    def set_tags(self, tags: Sequence[str]) -> None:
        """Set the words by which the list of robots is grouped, and rights are given.

        Args:
            tags: The words, such as ``["bay 3"]``; the first one is the group.

        Raises:
            ConfigError: If a tag is no text of one line with at most 100 characters.

        """
        self.configure("tags", tags)

    def set_battery_low(self, charge: float) -> None:
        """Set the charge below which the battery is low.

        Args:
            charge: From 0 to 1; 0 is never low.

        Raises:
            ConfigError: If it is no number from 0 to 1.

        """
        self.configure("battery_low", charge)

    @property
    def charge(self) -> float | None:
        """The least charge of its batteries, from 0 to 1; None if unknown."""
        least: float | None = None
        for module in self.modules:
            charge = getattr(module, "charge", None)
            if isinstance(charge, float) and (least is None or charge < least):
                least = charge
        return least

    # Display.

    def report_error(self, text: str) -> None:
        """Log a failure and show it on every page that has the robot."""
        self._shown_problems.report(text)

    def set_problem(self, about: object, text: str) -> None:
        """Show a problem until :meth:`clear_problem`, also to pages opened later.

        Args:
            about: The subject of the problem; a new sentence replaces the old one.
            text: A sentence for people.

        """
        self._shown_problems.set(about, text)

    def clear_problem(self, about: object) -> None:
        """Remove the problem of ``about``; does nothing if there is none."""
        self._shown_problems.clear(about)

    def on_map(self, map: WorldView, shown: bool) -> None:
        """Set whether a map shows this robot, and fire ``on_map``."""
        if shown:
            self.model_images.show(map.page)
            self.maps.append(map)
            self._shown_problems.join(map)
            self._look_regularly()
        else:
            self.maps.remove(map)
            self._shown_problems.leave(map)
            if not self.maps:
                self.model_images.end()
        self.update_selected()
        self.notify_modules("on_map", map, shown)

    def update_selected(self) -> None:
        """Update whether any map has the robot selected, and fire ``on_select``."""
        selected = any(map.selected is self for map in self.maps)
        if selected != self.selected:
            self.selected = selected
            self.notify_modules("on_select", selected)

    def on_gate_report(self, report: RobotReport) -> None:
        """Store the gate's report on this robot and fire ``on_report``."""
        super().on_gate_report(report)
        self._show_state()

    def expect_jump(self) -> None:
        """Accept that the robot's pose jumps: an operator or a program set it.

        A jump of its poses within the next seconds is then no problem.
        """
        self.pose_source.pipeline.jumps.expect(time.monotonic())

    def audience_changed(self) -> None:
        """Show the pose and the state of now to who begins to look."""
        if not audience.present:
            self.pose_source.expect_fewer()
            return
        if self.valid:
            self._draw_pose()
        if self.pose_stamp is not None:
            self._draw_age(self.pose_stamp)
            self._show_state()
        self.pose_source.draw()

    def _look_regularly(self) -> None:
        loop = self._looked_at_in
        if loop is None or loop.is_closed():  # it ends when WebMap stops
            self._show_state()
            self._looked_at_in = state_rounds.join(self._show_state)

    def _show_state(self) -> None:
        self.pose_source.keep_on(self._needs_poses())
        state, shown = self.state, self._state_shown
        if state == shown:
            return
        if shown is not None and shown[1:3] == state[1:3] == ("gone", ()):
            return  # since the same time, however it is rounded
        self._state_shown = state
        is_moved = "other" in (state.activity, *state.conditions)
        self.svg.set(
            data_state=state.name,
            data_since=since_when(self.silent_for) if state.name == "gone" else None,
            data_activity=None if state.activity == state.name else state.activity,
            data_conditions=" ".join(state.conditions) or None,
            data_program=named(self.motion.writers) if is_moved else None,
        )
        self.notify_modules("on_state", state)

    def _needs_poses(self) -> bool:
        """Return whether somebody needs all poses also while no page is open.

        That is who has control of the robot, such as a program, and a module of the
        user that gets each pose.
        """
        report = self.report
        if report is not None:
            goes = report.goal is not None and report.goal.state not in OVER
            if goes or report.holder is not None:
                return True
        for module in self.modules:
            own = type(module).__module__.startswith("webmap.")
            if not own and hasattr(module, "on_odometry_update"):
                return True
        return False

    def show_pose(self, pose: PoseReading, stamp: float | None = None) -> None:
        """Draw the robot at a pose on the common map, and fire ``on_odometry_update``.

        Args:
            pose: The pose; nothing fires if it is the same as before.
            stamp: When it was sent, in seconds of :func:`time.monotonic`; None if the
                robot's map was moved and no pose arrived.

        """
        if stamp is not None:
            self.pose_stamp = stamp
            if audience.present:
                self._draw_age(stamp)
            self._look_regularly()
        if (
            self.valid
            and pose.position == self.position
            and pose.orientation == self.orientation
            and pose.twist == self.measured_twist
        ):
            return
        self.position, self.orientation = pose.position, pose.orientation
        self.measured_twist = pose.twist
        if audience.present:
            self._draw_pose()
        if not self.valid:
            self.valid = True
            self.svg.classes.remove("unplaced")
        self.notify_modules("on_odometry_update")

    def _draw_age(self, stamp: float) -> None:
        self.svg.set_age(time.monotonic() - stamp, limit=POSE_LIMIT)

    def _draw_pose(self) -> None:
        self.svg.set_pose(self.position.x, self.position.y, self.yaw)
