"""Keys, gamepads and the on-screen stick drive the selected robot."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

from webmap.base.roles import Role
from webmap.core.map import Map
from webmap.core.registry import map_modules


@map_modules.register
class Teleop:
    """W, A, S and D, or the arrow keys, drive the selected robot of this map.

    The browser sends the state of its inputs 20 times a second; the gate decides the
    velocity. A released key, a hidden page and a lost connection each stop the robot.

    Args:
        map: The map.
        speed: Greatest speed in m/s, forward and backward.
        rotation_speed: Greatest rotation speed in rad/s.
        holonomic: Whether Q and E move the robot sideways; None to use the setting of
            :meth:`Robot.set_twist_topic` of each robot.
        stop_place: A CSS selector of the page's element for the STOP button of the
            selected robot; by default STOP is in the panel over the map.

    Raises:
        ValueError: If a speed is not a number above 0.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {"active": "viewer"}

    def __init__(
        self,
        map: Map,
        speed: float,
        rotation_speed: float,
        *,
        holonomic: bool | None = False,
        stop_place: str = "",
    ) -> None:
        for name, value in (("speed", speed), ("rotation_speed", rotation_speed)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"Teleop: {name} must be above 0, got {value}")
        self.map = map
        self.speed = speed
        self.rotation_speed = rotation_speed
        map.page.set_speeds(self, speed, rotation_speed)
        self.browser_part = map.add_browser_part(
            self,
            "features/drive/teleop.js",
            {
                "holonomic": holonomic,
                "stopPlace": stop_place,
                "looks": map.page.viewer.role == "viewer",
            },
            "features/drive/teleop.css",
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Record whether this map receives the page's keys now."""
        self.map.page.set_driving(self, message.get("active") is True)

    def destroy(self) -> None:
        """Stop driving from this map."""
        self.map.page.clear_speeds(self)
