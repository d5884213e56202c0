"""The charge of a robot's battery."""

import math
import time

from webmap.base.audience import RARELY
from webmap.base.scope import Removal, keep
from webmap.core.registry import robot_modules
from webmap.core.robot import Robot
from webmap.ros.bridge import Bridge
from webmap.ros.messages import BatteryStateMsg

FULL = 1.2
"""Greatest charge of a full battery; uncalibrated gauges report more than 1."""


@robot_modules.register
class Battery:
    """Follows a ``sensor_msgs/BatteryState`` and fires ``on_battery_update``.

    It fires on modules of the robot, and on those of maps that have the robot selected.

    The message defines a percentage from 0 to 1, but some drivers publish 0 to 100.
    After one value above 1.2, the layer treats all values of the topic as 0 to 100.

    Args:
        robot: The robot of the battery.
        bridge: The bridge of the ROS system that has the topic.
        topic: The topic.
        throttle: The least time between two messages, in milliseconds.
    """

    def __init__(
        self, robot: Robot, bridge: Bridge, topic: str, throttle: int = 1000
    ) -> None:
        self.robot = robot
        self.charge: float | None = None
        """Between 0 and 1; None if unknown."""
        self.voltage: float | None = None
        """In volts; None if unknown."""
        self.stamp: float | None = None
        """Time when the newest message was sent, in monotonic seconds."""
        self._topic = topic
        self._hundredths = False
        self._bridge = bridge
        keep(Removal(lambda: robot.clear_problem(self)))
        bridge.subscribe(
            topic,
            self.on_message,
            "sensor_msgs/BatteryState",
            throttle=throttle,
            decode=BatteryStateMsg,
            unwatched=RARELY,
        )

    def on_message(self, message: BatteryStateMsg) -> None:
        """Store the newest charge; a value that is not a number is unknown."""
        voltage = message.voltage
        self.charge = self._charge_of(message.percentage)
        self.voltage = voltage if math.isfinite(voltage) else None
        self.stamp = time.monotonic() - self._bridge.lag
        self.robot.notify_modules("on_battery_update", self)
        for map in tuple(self.robot.maps):
            if map.selected is self.robot:
                map.notify_modules("on_battery_update", self)

    def _charge_of(self, percentage: float) -> float | None:
        """Return a charge from 0 to 1; None if it is unknown or impossible."""
        if math.isnan(percentage):  # "not measured" by the message's definition
            self.robot.clear_problem(self)
            return None
        if not 0 <= percentage <= 100:
            self.robot.set_problem(
                self,
                f"{self._topic}: a battery has a percentage of 0 to 1, or of 0 to 100, "
                f"got {percentage:g}; the charge is not known",
            )
            return None
        self.robot.clear_problem(self)
        self._hundredths |= percentage > FULL
        return percentage / 100 if self._hundredths else min(percentage, 1.0)
