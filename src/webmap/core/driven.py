"""What a robot can be told to do: its verbs of motion, all of which the gate obeys."""

import asyncio
import time
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from webmap.base.errors import ConfigError, MotionError
from webmap.base.geometry import Quaternion, Twist
from webmap.base.scope import no_scope
from webmap.config.motion import COVARIANCE, NAVIGATE_TO_POSE
from webmap.config.robot import LINKED, MOTION
from webmap.core.call_arguments import sets_part
from webmap.core.extendable import Extendable
from webmap.core.given_pose import Orientation, Position
from webmap.core.motion import MotionRoad
from webmap.core.registry import Namespace
from webmap.gate.messages import RobotReport
from webmap.gate.rules.goals import OVER
from webmap.ros.bridge import Bridge


class Driven(Extendable):
    """An extendable that is moved, through the gate: what every robot is.

    It says where velocity and goals go and hands them over; nothing here writes to a
    robot, and nothing here knows where one is or how it looks.

    Args:
        name: What people call it.
        namespace: Where its modules are looked up.

    """

    def __init__(self, name: str, namespace: Namespace) -> None:
        super().__init__(namespace)
        self.name = str(name)
        self.motion = MotionRoad(self.name, self.report_error)
        self.report: RobotReport | None = None
        self.goal_ended_at: float | None = None
        """When the newest goal ended, in seconds of ``time.monotonic()``; None if none
        has."""
        self._report_is_old = False

    @property
    def id(self) -> str:
        """What the gate and the page call this robot; unique in the process."""
        return self.motion.id

    # Where velocity and goals go.

    @sets_part("twist")
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
        z_max: float | None = None,
        rx_max: float | None = None,
        ry_max: float | None = None,
    ) -> None:
        """Say where velocity goes, and what the base behind it does and can.

        A robot that moves in the plane has no ``z_max``, ``rx_max`` and ``ry_max``.
        State them for one that flies or dives: :meth:`twist` then takes ``z``, ``rx``
        and ``ry``.

        Args:
            bridge: The link to the robot's ROS system.
            topic: The topic, of ``geometry_msgs`` Twist or TwistStamped.
            type: The message type; asked of the bridge, or Twist, if not given.
            stops_within: The time in seconds within which the base stops by itself
                when velocity ceases. Without it nobody knows whether the robot stops
                when WebMap cannot tell it to, and it is driven at no more than
                0.3 m/s and 0.6 rad/s.
            v_max: The highest speed, in metres per second, whatever the direction.
            w_max: The highest rate of turn, in radians per second, whatever the axis.
            a_max: The highest acceleration, in metres per second squared. Slowing
                down is never delayed by it.
            holonomic: Whether the base can move sideways.
            stop_hooks: What else ``bridge`` is told on STOP:
                ``{"topic": "/lock", "type": "std_msgs/Bool"}`` publishes true, and
                false on reset; ``{"service": "/e_stop", "type": "std_srvs/Trigger"}``
                calls the service.
            z_max: The highest speed upward and downward, in metres per second. Without
                it the robot takes no ``z``.
            rx_max: The highest rate of turn about the forward axis, in radians per
                second. Without it the robot takes no ``rx``.
            ry_max: The highest rate of turn about the left axis, in radians per
                second. Without it the robot takes no ``ry``.

        Raises:
            ConfigError: If ``type`` carries no velocity, or a number or a stop hook
                cannot be meant.

        """

    def configure(
        self,
        key: str,
        values: Mapping[str, Any] | None,
        bridge: Bridge | None = None,
    ) -> None:
        """Set or clear one part of the robot's configuration.

        Args:
            key: Its name in a fleet file, such as ``"twist"``.
            values: What it says there; None clears it.
            bridge: The link that it goes over, if it goes over one of its own.

        Raises:
            ConfigError: If something in it cannot be meant; every mistake is named.

        """
        what = f"robot {self.name!r}"
        if key not in MOTION:
            raise ConfigError(
                f'{what}: there is no key "{key}" here; there are {", ".join(MOTION)}'
            )
        if key in LINKED and values is not None and bridge is None:
            raise ConfigError(f"{what}: {key}: a bridge is missing")
        with no_scope():
            self.motion.set(key, values, bridge)
        twist = self.motion.config.twist
        self._show_base(holonomic=twist is not None and twist.holonomic)

    def _show_base(self, *, holonomic: bool) -> None:
        """Let pages know what the base can."""

    @sets_part("scan_assist")
    def set_scan_assist(
        self,
        topic: str,
        footprint: Sequence[tuple[float, float]] | float,
        *,
        x: float = 0.0,
        y: float = 0.0,
        angle: float = 0.0,
        upside_down: bool = False,
        frame: str = "",
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
            angle: Where it looks, in degrees from the robot's x, counter-clockwise as
                seen from above.
            upside_down: Whether it hangs head down, so that its rays go round the other
                way; frames are not asked.
            frame: The frame that its scans must name; the robot is blind by a scan of
                another. Left out, any will do, but not two on one topic.
            stop_distance: What stays free before the robot, in metres.
            brake: How hard the robot slows down, in metres per second squared.
            blind: Whether it stops or creeps while the scan is older than 0.3 s, is
                empty or mostly unknown.
            creep: How fast it creeps, in metres per second.

        Raises:
            ConfigError: If something of that cannot be meant.

        """

    def clear_scan_assist(self) -> None:
        """Let the robot be driven as before; nothing happens if nothing was set."""
        self.configure("scan_assist", None)

    def unadvertise_twist_topic(self) -> None:
        """Give up the twist topic; does nothing if there is none."""
        self.configure("twist", None)

    @sets_part("move")
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
            ConfigError: If there is neither a topic nor an action, or something else
                cannot be meant.

        """

    @sets_part("initial_pose")
    def set_initial_pose_topic(
        self,
        bridge: Bridge,
        topic: str = "/initialpose",
        *,
        covariance: Sequence[float] = COVARIANCE,
        frame: str = "map",
    ) -> None:
        """Say where the robot is told where it is.

        Args:
            bridge: The link to its localisation; the bridge of its goals.
            topic: A topic of ``geometry_msgs/PoseWithCovarianceStamped``.
            covariance: How sure one is: the variances of x and y in m², of yaw in
                rad². RViz's are given if not said.
            frame: The frame of the map that it is told in. A robot that takes goals is
                told in the frame of those.

        Raises:
            ConfigError: If the covariance is not three numbers from 0 on, or goals go
                to another bridge.

        """

    def unadvertise_move_topic(self) -> None:
        """Give up the move topic; does nothing if there is none."""
        self.configure("move", None)

    # What a program says.

    async def acquire_lease(self, *, timeout: float = 5.0) -> int:
        """Take the right to drive this robot, on behalf of this program.

        Any operator takes it away by driving.

        Args:
            timeout: Seconds to wait until the robot can be driven: the gate may have
                been started a moment ago, the links over which the robot is driven
                open now, and its odometry must be heard.

        Returns:
            The lease's epoch.

        Raises:
            NoLease: If somebody else drives.
            MotionError: If the robot cannot be driven, and why.

        """
        deadline = time.monotonic() + timeout
        while self._may_be_had_soon():
            if time.monotonic() > deadline:
                break  # the gate says why not
            await asyncio.sleep(0.02)
        epoch = await asyncio.wrap_future(self.motion.take())
        while (why := self._not_drivable(epoch)) is not None:
            if time.monotonic() > deadline:
                self.release_lease()
                raise MotionError(f"robot {self.name!r} cannot be driven: {why}")
            await asyncio.sleep(0.02)
        return epoch

    def _may_be_had_soon(self) -> bool:
        """Tell whether it cannot be taken yet, and nobody's word is against it."""
        gate, report = self.motion.gate, self.report
        if gate is None or self.motion.spec() is None:
            return False
        if not gate.ready or report is None or self._report_is_old:
            return True
        return not (report.armable or report.latched or report.holder)

    def _not_drivable(self, epoch: int) -> str | None:
        report = self.report
        if report is None or report.epoch != epoch:
            return "the gate has not said that it can"
        if self.motion.config.twist is None:  # it takes goals alone
            return None if report.armable else report.reason
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
        20 Hz, say. What comes less than 10 ms after the last velocity that went to the
        gate is left out, but a zero after motion never is.

        Args:
            x: Metres per second forward.
            y: Metres per second to the left.
            z: Metres per second upward, for a robot that has a ``z_max``.
            rx: Radians per second about the forward axis, for a robot that has an
                ``rx_max``.
            ry: Radians per second about the left axis, for a robot that has an
                ``ry_max``.
            rz: Radians per second, counter-clockwise.

        Raises:
            NoLease: If the program does not hold the lease.
            MotionError: If ``z``, ``rx`` or ``ry`` is not 0 and the twist topic states
                no limit for it, or a number is not finite.

        """
        self.motion.twist(Twist(x, y, rz, z, rx, ry))

    def move(self, position: Position, orientation: Orientation) -> None:
        """Send the robot to a pose in the plane, by its own navigation.

        Args:
            position: Where the base link is to be, in metres on the common map; ``z``
                is left out.
            orientation: Its orientation there, of which the heading counts.

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
        """End the STOP that ``report`` tells of; moves nothing, gives nobody the robot.

        The gate refuses that if somebody pressed STOP since then: look at ``report``,
        which tells of the newer STOP, and call this again.

        Raises:
            MotionError: If ``report`` tells of no STOP. After :meth:`stop`, wait until
                ``report.stop`` is there.

        """
        self.motion.reset_stop(self.report)

    # What the gate says.

    def on_gate_down(self) -> None:
        """Wait for the next gate's word before a lease; pages show the last one."""
        self._report_is_old = True

    def on_gate_report(self, report: RobotReport) -> None:
        """Keep what the gate says of this robot and fire ``on_report``."""
        self.report, self._report_is_old = report, False
        if report.goal is None or report.goal.state not in OVER:
            self.goal_ended_at = None
        elif self.goal_ended_at is None:
            self.goal_ended_at = time.monotonic()
        self.motion.heed(report)
        self.notify_modules("on_report", report)

    def expect_jump(self) -> None:
        """Expect that the robot is somewhere else from here on."""

    def on_written(self, kind: str, message: dict[str, Any]) -> None:
        """Fire ``on_send_twist`` or ``on_send_move`` for what the gate wrote.

        Args:
            kind: ``"twist"`` or ``"move"``.
            message: As :func:`webmap.core.runtime.twist_message` or
                :func:`webmap.core.runtime.goal_message` has it.

        """
        self.notify_modules(f"on_send_{kind}", message)
