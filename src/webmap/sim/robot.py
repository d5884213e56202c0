"""A differential-drive base: its motion and its command timeout.

A base with a ``z_max`` also moves upward and downward, like an aerial robot.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from webmap.base.geometry import Pose, Twist, normalize_angle

_HOLD = 0.5
_STILL = Twist()
_DRAIN_IDLE = 1 / 14_400
_DRAIN_MOVING = 1 / 7_200
_LOWEST_CHARGE = 0.05


@dataclass(frozen=True, slots=True)
class BaseOptions:
    """The properties of a base: what it accepts, and how it moves."""

    radius: float = 0.25
    """Radius of its round footprint, in metres."""

    v_max: float = 1.2
    """Metres per second, forward and backward."""

    w_max: float = 2.5
    """Radians per second."""

    z_max: float = 0.0
    """Metres per second upward and downward; 0 for a base on wheels."""

    acceleration: float = 2.0
    """Metres per second squared, speeding up and slowing down."""

    turn_acceleration: float = 8.0
    """Radians per second squared."""

    timeout: float | None = 0.25
    """Seconds without a command until it stops by itself; None if it never does."""

    refuse_nan: bool = True
    """Whether a twist with NaN or infinity is ignored, as a good driver does."""

    drift: float = 0.0
    """Growth of the odometry error: metres (and half as many radians) per metre."""


class SimRobot:
    """One simulated robot, moved in steps."""

    def __init__(
        self, name: str, pose: Pose, options: BaseOptions, seed: int = 0
    ) -> None:
        self.name = name
        """Empty if it is the only robot and its names have no prefix."""
        self.topics = f"/{name}" if name else ""
        """Prefix of its topics."""
        self.frames = f"{name}/" if name else ""
        """Prefix of its frames."""
        self.options = options
        self.pose = pose
        """True pose in the map's frame."""
        self.height = 0.0
        """Metres above the floor, which odometry reports without error."""
        self.odometry = pose
        """Pose by its odometry."""
        self.twist = _STILL
        """True velocity."""
        self.charge = 0.94 - 0.07 * (seed % 7)
        """Charge of the battery, 0 to 1."""
        self.autonomous: Twist | None = None
        """Velocity from its own navigation, if that is active."""
        self.bumped = False
        """Whether an obstacle stopped it in the last step."""
        self.travelled = 0.0
        """Metres driven since the start."""
        self._command: Twist | None = None
        self._commanded_at = 0.0
        self._random = Random(seed)  # noqa: S311 - a simulation's noise

    def command(self, twist: Twist, now: float) -> bool:
        """Accept a velocity command; return False if it was refused.

        Args:
            twist: The velocity.
            now: Seconds on the world's clock.

        """
        if not twist.is_finite and self.options.refuse_nan:
            return False
        self._command = twist
        self._commanded_at = now
        return True

    def release(self) -> None:
        """Drop the client's command, so that the navigation may drive."""
        self._command = None

    def stop(self) -> None:
        """Stop until the next command."""
        self._command = None
        self.autonomous = None

    def step(
        self, dt: float, now: float, is_blocked: Callable[[float, float], bool]
    ) -> None:
        """Advance by ``dt`` seconds.

        Args:
            dt: The length of the step, in seconds.
            now: The world's clock at its end.
            is_blocked: Returns whether an obstacle blocks the base at a position.

        """
        target_twist = self._commanded(now)
        limits = self.options
        before = self.twist
        vx = _towards(
            before.vx, target_twist.vx, limits.v_max, limits.acceleration * dt
        )
        wz = _towards(
            before.wz, target_twist.wz, limits.w_max, limits.turn_acceleration * dt
        )
        vz = _towards(
            before.vz, target_twist.vz, limits.z_max, limits.acceleration * dt
        )
        self.height += (before.vz + vz) / 2 * dt
        # The mean of a ramp: a command of 1 m/s for 1 s moves 1 m, ramps included.
        ahead = (before.vx + vx) / 2 * dt
        turn = (before.wz + wz) / 2 * dt
        target = self.pose @ _arc(ahead, turn)
        self.bumped = bool(ahead) and is_blocked(target.x, target.y)
        if self.bumped:
            ahead, vx = 0.0, 0.0
            target = self.pose @ Pose(yaw=turn)
        self.pose = target
        self.twist = Twist(vx=vx, wz=wz, vz=vz)
        self._measure(ahead, turn)
        self._drain(dt)

    def _commanded(self, now: float) -> Twist:
        if self._command is not None:
            if now - self._commanded_at <= self._holds_for(self._command):
                return self._command
            self._command = None
        return self.autonomous or _STILL

    def _holds_for(self, command: Twist) -> float:
        if self.options.timeout is not None:
            return self.options.timeout
        return _HOLD if command.is_zero else math.inf

    def _measure(self, ahead: float, turn: float) -> None:
        drift = self.options.drift
        if not drift:
            self.odometry = self.pose
            return
        distance = abs(ahead)
        ahead += distance * drift * self._random.gauss(0.5, 1)
        turn += distance * drift / 2 * self._random.gauss(0.5, 1)
        self.odometry = self.odometry @ _arc(ahead, turn)

    def _drain(self, dt: float) -> None:
        moved = abs(self.twist.vx) * dt
        self.travelled += moved
        used = dt * _DRAIN_IDLE + moved * _DRAIN_MOVING
        self.charge = max(self.charge - used, _LOWEST_CHARGE)


def _towards(now: float, target: float, limit: float, change: float) -> float:
    target = max(-limit, min(limit, target))
    return max(now - change, min(now + change, target))


def _arc(ahead: float, turn: float) -> Pose:
    """Return the pose after ``ahead`` metres with a constant turn."""
    if abs(turn) < 1e-9:
        return Pose(ahead, 0.0, turn)
    radius = ahead / turn
    return Pose(
        radius * math.sin(turn), radius * (1 - math.cos(turn)), normalize_angle(turn)
    )
