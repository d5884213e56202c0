"""The charge of a robot's battery."""

import math
import time
from typing import TYPE_CHECKING

from webmap.ros.bridge import Bridge
from webmap.ros.messages import BatteryStateMsg

if TYPE_CHECKING:
    from webmap.core.robot import Robot


class Battery:
    """Follows a ``sensor_msgs/BatteryState`` and fires ``on_battery_update``.

    Args:
        robot: The robot that runs on the battery.
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        throttle: The least time between two messages, in milliseconds.

    """

    def __init__(
        self, robot: "Robot", bridge: Bridge, topic: str, throttle: int = 1000
    ) -> None:
        self.robot = robot
        self.charge: float | None = None
        """Between 0 and 1; None if the robot does not know."""
        self.voltage: float | None = None
        """In volts; None if the robot does not know."""
        self.stamp: float | None = None
        """When the newest message came, in monotonic seconds."""
        bridge.subscribe(
            topic,
            self.on_message,
            "sensor_msgs/BatteryState",
            throttle=throttle,
            decode=BatteryStateMsg,
        )

    def on_message(self, message: BatteryStateMsg) -> None:
        """Take the newest charge; what is not a number is unknown."""
        charge, voltage = message.percentage, message.voltage
        known = math.isfinite(charge) and 0 <= charge <= 1
        self.charge = charge if known else None
        self.voltage = voltage if math.isfinite(voltage) else None
        self.stamp = time.monotonic()
        self.robot.notify_modules("on_battery_update", self)
