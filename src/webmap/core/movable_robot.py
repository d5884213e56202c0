"""The motion methods of a robot; all of them go through the gate."""

import asyncio
import functools
import inspect
import time
from collections.abc import Callable, Mapping, Sequence
from typing import (
    Any,
    ClassVar,
    Concatenate,
    Literal,
    ParamSpec,
    TypeVar,
)

import msgspec

from webmap.base.errors import ConfigError, MotionError
from webmap.base.geometry import Orientation, Position, Quaternion, Twist
from webmap.base.scope import no_scope
from webmap.config.motion import COVARIANCE, MOTION, NAVIGATE_TO_POSE
from webmap.config.reading import read_key
from webmap.config.robot import LINKED, RobotConfig
from webmap.core.base_page import BasePage
from webmap.core.extendable import Extendable
from webmap.core.module_arguments import WrongArguments, check_arguments
from webmap.core.motion import RobotMotion
from webmap.core.registry import Namespace
from webmap.gate.protocol import RobotReport
from webmap.gate.rules.goals import OVER
from webmap.ros.bridge import Bridge

P = ParamSpec("P")
D = TypeVar("D", bound="MovableRobot")
Method = Callable[Concatenate[D, P], None]


def sets_part(key: str) -> Callable[[Method[D, P]], Method[D, P]]:
    """Make a method set one part of the configuration (decorator).

    The method has a signature and a docstring but no code. Its arguments are passed to
    ``configure`` under the names of its parameters. Unknown arguments and a bridge that
    is not a ``Bridge`` are refused here; ``configure`` checks the rest.

    Args:
        key: The name of the part.

    """

    def decorate(method: Method[D, P]) -> Method[D, P]:
        signature = inspect.signature(method)
        # The check asks for it again for each robot.
        setattr(method, "__signature__", signature)  # noqa: B010
        _, *parameters = signature.parameters.values()
        defaults = {p.name: p.default for p in parameters if p.default is not p.empty}

        @functools.wraps(method)
        def setter(owner: D, /, *args: P.args, **kwargs: P.kwargs) -> None:
            try:
                check_arguments(method, args, kwargs)
            except WrongArguments as error:
                wrong = [each for each in error.wrong if each.name in ("", "bridge")]
                if wrong:
                    called = f"robot {owner.name!r}: {method.__name__}"
                    raise WrongArguments(called, wrong) from None
            given = signature.bind(owner, *args, **kwargs)
            _, *values = given.arguments.items()
            part = {**defaults, **dict(values)}
            for name, default in defaults.items():
                if default == "" and part[name] == "":  # it counts as left out
                    del part[name]
            bridge = part.pop("bridge", None)
            owner.configure(key, part, bridge)

        return setter

    return decorate


class MovableRobot(Extendable):
    """An extendable object that moves through the gate; base class of every robot.

    It configures the topics for velocity and goals and passes commands to the gate. It
    never writes to a robot, and has no pose and no drawing.

    Args:
        name: The displayed name.
        namespace: The namespace of its modules.

    """

    _keys: ClassVar[tuple[str, ...]] = MOTION
    """The keys of its configuration that :meth:`configure` sets."""

    def __init__(self, name: str, namespace: Namespace) -> None:
        super().__init__(namespace)
        self.name = str(name)
        self.motion = RobotMotion(self.name, self.report_error)
        self.report: RobotReport | None = None
        self.goal_ended_at: float | None = None
        """When the newest goal ended, in seconds of ``time.monotonic()``; None if there
        is no goal or it has not ended."""
        self.goal_failed = False
        """Whether the newest goal failed, and the robot was neither driven nor stopped
        since."""
        self._failed_goal = ""
        self._report_is_old = False

    @property
    def id(self) -> str:
        """The robot's identifier for the gate and the page; unique in the process."""
        return self.motion.id

    # Topics for velocity and goals.

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
        check_every: float | str | None = None,
        drive_without_proof: bool = False,
    ) -> None:
        """Set the topic for velocity, with the limits and the behaviour of the base.

        A robot that moves in the plane has no ``z_max``, ``rx_max`` and ``ry_max``. Set
        them for a robot that flies or dives: :meth:`twist` then takes ``z``, ``rx`` and
        ``ry``.

        Args:
            bridge: The connection to the robot's ROS system.
            topic: A topic of type ``geometry_msgs`` Twist or TwistStamped.
            type: The message type; if not given, the type that the bridge reports, or
                Twist.
            stops_within: The command timeout of the base: the time in seconds within
                which the base stops by itself when velocities end. Without it, the
                robot may not stop when WebMap cannot reach it, and the speed limits are
                0.3 m/s and 0.6 rad/s.
            v_max: The greatest speed in metres per second, in any direction.
            w_max: The greatest rate of turn in radians per second, about any axis.
            a_max: The greatest acceleration in metres per second squared. It never
                delays slowing down.
            holonomic: Whether the base can move sideways.
            stop_hooks: What else is sent over ``bridge`` on STOP:
                ``{"topic": "/lock", "type": "std_msgs/Bool"}`` publishes true, and
                false on Reset; ``{"service": "/e_stop", "type": "std_srvs/Trigger"}``
                calls the service.
            z_max: The greatest speed upward and downward in metres per second. Without
                it, the robot takes no ``z``.
            rx_max: The greatest rate of turn about the forward axis in radians per
                second. Without it, the robot takes no ``rx``.
            ry_max: The greatest rate of turn about the left axis in radians per second.
                Without it, the robot takes no ``ry``.
            check_every: How long a check before driving counts, in seconds or as in
                ``"12h"``. Without such a check, the speed limits are 0.3 m/s and
                0.6 rad/s. If left out, no check is demanded.
            drive_without_proof: Whether the robot may be moved through a
                ``foxglove_bridge`` older than version 3. Dangerous: any client of such
                a bridge can hold back every velocity, zero and STOP included, without a
                limit, and WebMap learns what has arrived only from the velocities that
                come back.

        Raises:
            ConfigError: If ``type`` carries no velocity, or a number or a stop hook is
                not valid.

        """

    def configure(
        self,
        key: str,
        value: Any,
        bridge: Bridge | None = None,
    ) -> None:
        """Set or clear one key of the robot's configuration.

        Args:
            key: The key in a fleet file, such as ``"twist"``.
            value: The value, as in a fleet file; None clears the key.
            bridge: The bridge of a part that has one of its own.

        Raises:
            ConfigError: If a value is not valid; the message lists every mistake.

        """
        what = f"robot {self.name!r}"
        if key not in self._keys:
            keys = ", ".join(self._keys)
            raise ConfigError(f'{what}: there is no key "{key}" here; there are {keys}')
        self.set_part(key, read_key(RobotConfig, key, value, what), bridge)

    def set_part(self, key: str, part: Any, bridge: Bridge | None = None) -> None:
        """Set or clear one key of the configuration; the value was checked before.

        Args:
            key: The key.
            part: The value of this field in a ``RobotConfig``.
            bridge: The bridge of a part that has one of its own.

        Raises:
            ConfigError: If the value does not fit the robot's other values, or the
                bridge is missing.

        """
        if key in LINKED and part is not None:
            if bridge is None:
                raise ConfigError(f"robot {self.name!r}: {key}: a bridge is missing")
            part = msgspec.structs.replace(part, bridge=bridge.url)
        self._set(key, part, bridge)

    def _set(self, key: str, part: Any, bridge: Bridge | None) -> None:
        with no_scope():
            self.motion.set(key, part, bridge)

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
        """Slow the robot down before obstacles in a laser scan while it is driven.

        Scan assist is no safety function: a planar scanner does not see glass, stairs
        or the edge of a table, and its data comes over a network.

        Args:
            topic: A topic of type ``sensor_msgs/LaserScan``, on the bridge of the twist
                topic.
            footprint: The robot's corners in its own frame, in order, or its radius, in
                metres.
            x: The scanner's position on the robot, in metres forward.
            y: The scanner's position, in metres to the left.
            angle: The scanner's direction in degrees from the robot's x axis,
                counter-clockwise as seen from above.
            upside_down: Whether the scanner is mounted upside down, so that its rays
                turn the other way; frames are not used.
            frame: The frame that the scans must have; a scan with another frame is not
                used, and the robot is then blind. If left out, any frame is accepted,
                but not two on one topic.
            stop_distance: The distance that stays free before the robot, in metres.
            brake: The deceleration of the robot, in metres per second squared.
            blind: Whether the robot stops or creeps while the scan is older than 0.3 s,
                is empty or mostly unknown.
            creep: The speed when creeping, in metres per second.

        Raises:
            ConfigError: If a value is not valid.

        """

    def clear_scan_assist(self) -> None:
        """Clear scan assist; does nothing if none was set."""
        self.configure("scan_assist", None)

    def unadvertise_twist_topic(self) -> None:
        """Clear the twist topic; does nothing if none was set."""
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
        """Set the topic or the action for goals.

        If there is an action, goals go to the action, which reports their progress and
        their end.

        Args:
            bridge: The connection to the ROS system of the robot's navigation.
            topic: A topic of type ``geometry_msgs/PoseStamped``; together with an
                action it is for bridges that take no goals of actions.
            frame: The frame of the goals.
            cancel_topic: The topic of actionlib that cancels goals.
            on_operator_loss: ``"continue"`` if a goal continues when its operator is
                lost, ``"cancel"`` if it is cancelled.
            action: The name of the action, such as ``"/navigate_to_pose"``.
            action_type: ``"nav2_msgs/action/NavigateToPose"``, of ROS 2, or
                ``"move_base_msgs/MoveBaseAction"``, of ROS 1.

        Raises:
            ConfigError: If there is neither a topic nor an action, or another value is
                not valid.

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
        """Set the topic for the robot's initial pose.

        Args:
            bridge: The connection to the robot's localisation; must be the bridge of
                its goals.
            topic: A topic of type ``geometry_msgs/PoseWithCovarianceStamped``.
            covariance: The variances of x and y in m², and of yaw in rad². The default
                is that of RViz.
            frame: The map frame of the pose. For a robot that takes goals, it is the
                frame of the goals.

        Raises:
            ConfigError: If the covariance is not three numbers of 0 or more, or goals
                go to another bridge.

        """

    def unadvertise_move_topic(self) -> None:
        """Clear the move topic; does nothing if none was set."""
        self.configure("move", None)

    # Commands of a program.

    async def acquire_lease(self, *, timeout: float = 5.0) -> int:
        """Take control of this robot for this program.

        Any operator takes control away by driving.

        Args:
            timeout: Seconds to wait until the robot can be driven: the gate may be
                starting, the connections for commands may be opening, and odometry must
                arrive first.

        Returns:
            The lease's epoch.

        Raises:
            NoLease: If another operator or program has control, or the robot's agent
                cannot be reached or does not let this display drive.
            MotionError: If the robot cannot be driven; the message has the reason.

        """
        deadline = time.monotonic() + timeout
        while self._may_be_free_soon():
            if time.monotonic() > deadline:
                break  # the gate gives the reason
            await asyncio.sleep(0.02)
        epoch = await asyncio.wrap_future(self.motion.commands().take(self.id))
        while (why := self._not_drivable(epoch)) is not None:
            if time.monotonic() > deadline:
                self.release_lease()
                raise MotionError(f"robot {self.name!r} cannot be driven: {why}")
            await asyncio.sleep(0.02)
        return epoch

    def _may_be_free_soon(self) -> bool:
        """Return whether the robot cannot be taken yet but probably can be soon."""
        gate, report = self.motion.gate, self.report
        if gate is None or self.motion.spec() is None:
            return False
        if not gate.ready or report is None or self._report_is_old:
            return True
        return not (report.armable or report.latched or report.holder)

    def _not_drivable(self, epoch: int) -> str | None:
        report = self.report
        if report is None or report.epoch != epoch:
            return "the gate has not confirmed that this program has control"
        if self.motion.config.twist is None:  # takes goals only
            return None if report.armable else report.reason
        return report.reason

    def release_lease(self) -> None:
        """Release control; a moving robot is stopped."""
        self.motion.commands().release(self.id)

    def twist(
        self,
        x: float,
        y: float = 0.0,
        z: float = 0.0,
        rx: float = 0.0,
        ry: float = 0.0,
        rz: float = 0.0,
    ) -> None:
        """Send one velocity command, which is valid for 0.2 s at most.

        The command goes through the gate like every other, so the program needs
        control, and the speed limit applies. To keep the robot moving, call this again,
        for example at 20 Hz. A command less than 10 ms after the last one that went to
        the gate is dropped, except a zero after motion.

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
            NoLease: If the program does not have control.
            MotionError: If ``z``, ``rx`` or ``ry`` is not 0 and the twist topic has no
                limit for it, or a number is not finite.

        """
        gate, twist = self.motion.commands(), Twist(x, y, rz, z, rx, ry)
        if why := self.motion.axes.refusal(twist):
            raise MotionError(f"robot {self.name!r}: the velocity was not sent: {why}")
        gate.twist(self.id, twist)

    def move(
        self,
        position: Position,
        orientation: Orientation,
        *,
        by: BasePage | None = None,
    ) -> None:
        """Send the robot to a goal in the plane, by its own navigation.

        If the gate refuses the goal, ``on_refused`` of the robot's modules is called
        with the reason, which the page of ``by`` shows too.

        Args:
            position: The goal of the base link, in metres on the common map; ``z`` is
                ignored.
            orientation: The orientation at the goal; only the heading is used.
            by: The page whose viewer has asked for this, such as ``event.page`` of a
                press. The goal is then one of this viewer, who keeps control, or gets
                it if the robot is free. Without it the program needs control itself.

        Raises:
            NoLease: If the program does not have control, without ``by``.
            MotionError: If the page, or the gate, is not connected.

        """
        o = orientation
        yaw = Quaternion(o.x, o.y, o.z, o.w).yaw
        gate = self.motion.commands()
        if by is None:
            gate.move(self.id, position.x, position.y, yaw)
        else:
            by.move(self.id, position.x, position.y, yaw)

    def locate(self, position: Position, orientation: Orientation) -> None:
        """Send the robot its own pose, while it neither moves nor follows a goal.

        Args:
            position: The position of the base link, in metres on the common map.
            orientation: The orientation of the base link.

        Raises:
            NoLease: If the program does not have control.

        """
        o = orientation
        yaw = Quaternion(o.x, o.y, o.z, o.w).yaw
        self.motion.commands().locate(self.id, position.x, position.y, yaw)

    def cancel(self) -> None:
        """Cancel the robot's goals, whoever sent them; this needs no control."""
        self.motion.commands().cancel(self.id)

    def stop(self) -> None:
        """Stop the robot, no matter who has control, and cancel its goals.

        The STOP stays active for all operators and programs, also after a restart,
        until :meth:`reset_stop` or Reset on a page.
        """
        self.motion.commands().stop_robot(self.id)

    def reset_stop(self) -> None:
        """End the STOP in ``report``; nothing moves, and control does not change.

        The gate refuses this if STOP was pressed again since then. Read the newer STOP
        from ``report`` and call this again.

        Raises:
            MotionError: If ``report`` has no STOP. After :meth:`stop`, wait until
                ``report.stop`` is set.

        """
        gate, report = self.motion.commands(), self.report
        stop = None if report is None else report.stop
        if stop is None:
            raise MotionError(
                f"robot {self.name!r}: its report has no STOP to reset; after stop(), "
                "wait until report.stop is set"
            )
        gate.reset(self.id, stop.id)

    # Reports of the gate.

    def on_gate_down(self) -> None:
        """Mark the report as old: taking control needs one of the next gate."""
        self._report_is_old = True

    def on_gate_report(self, report: RobotReport) -> None:
        """Store the gate's report on this robot and fire ``on_report``."""
        self.report, self._report_is_old = report, False
        if report.goal is None or report.goal.state not in OVER:
            self.goal_ended_at = None
        elif self.goal_ended_at is None:
            self.goal_ended_at = time.monotonic()
        self._note_failure(report)
        self.motion.on_report(report)
        self.notify_modules("on_report", report)

    def _note_failure(self, report: RobotReport) -> None:
        goal = report.goal
        if goal is None or goal.state != "failed":
            self.goal_failed = False
        elif goal.id != self._failed_goal:
            self._failed_goal, self.goal_failed = goal.id, True
        elif report.state not in ("free", "held"):
            self.goal_failed = False

    def expect_jump(self) -> None:
        """Accept that the robot's pose jumps from here on."""

    def on_written(self, kind: str, message: dict[str, Any]) -> None:
        """Fire ``on_send_twist`` or ``on_send_move`` for a message that the gate wrote.

        Args:
            kind: ``"twist"`` or ``"move"``.
            message: The result of :func:`webmap.core.runtime.twist_message` or
                :func:`webmap.core.runtime.goal_message`.

        """
        self.notify_modules(f"on_send_{kind}", message)
