"""The keys drive the selected robot."""

import math
from typing import TYPE_CHECKING, Any

from webmap.core.registry import map_modules

if TYPE_CHECKING:
    from webmap.core.map import Map


@map_modules.register
class Teleop:
    """W, A, S and D, or the arrows, drive the selected robot of this map.

    The browser sends how the hands are, twenty times a second; the gate decides what
    becomes of it. A key that is let go, a page that is hidden and a link that is lost
    all stop the robot.

    Args:
        map: The map.
        speed: Metres per second at most, forward and back.
        rotation_speed: Radians per second at most.
        holonomic: Whether Q and E move sideways, for bases that can; None if for
            those of which :meth:`Robot.set_twist_topic` says so.
        stop_place: A CSS selector of the page's element that the STOP button of the
            selected robot goes into; in the panel over the map if not given.

    Raises:
        ValueError: If a speed is not a number above 0.

    """

    def __init__(
        self,
        map: "Map",
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
        self.half = map.add_browser_half(
            self,
            "features/drive/teleop.js",
            {"holonomic": holonomic, "stopPlace": stop_place},
            "features/drive/teleop.css",
        )

    def on_message(self, message: dict[str, Any]) -> None:
        """Note whether the page's keys belong to this map now."""
        self.map.page.set_driving(self, message.get("active") is True)

    def destroy(self) -> None:
        """Drive no more from this map."""
        self.map.page.clear_speeds(self)
