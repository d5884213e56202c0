"""What the nodes behind bridges log, in a panel over the map."""

import asyncio
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from webmap.core.bridge_log import BridgeLog, log_of
from webmap.errors import ConfigError
from webmap.ros.messages_log import LEVELS
from webmap.scope import Removal, keep

if TYPE_CHECKING:
    from webmap.core.map import Map
    from webmap.ros.bridge import Bridge

PERIOD = 0.25
"""Seconds between two looks for new lines, while the panel is open."""


class RosoutPanel:
    """A panel that unfolds into the newest lines of ``/rosout``, of each bridge.

    It hears ``rosgraph_msgs/Log`` of ROS 1 and ``rcl_interfaces/Log`` of ROS 2, while
    somebody has it open. What is said again and again is counted, and each viewer
    chooses from which level on lines are shown.

    Style it by CSS: ``.webmap-rosout-line[data-level="error"]``.

    Args:
        map: The map.
        bridges: The links to the ROS systems.
        level: The least level that is shown until the viewer chooses: ``"debug"``,
            ``"info"``, ``"warn"``, ``"error"`` or ``"fatal"``.
        lines: How many lines of each bridge are shown.

    Raises:
        ConfigError: If there is no such level, or no line is to be shown.

    """

    def __init__(
        self,
        map: "Map",
        bridges: Iterable["Bridge"],
        *,
        level: str = "info",
        lines: int = 100,
    ) -> None:
        if level not in LEVELS:
            raise ConfigError(f"level is one of {', '.join(LEVELS)}, got {level!r}")
        if not 1 <= lines <= 200:
            raise ConfigError(f"lines must be 1 to 200, got {lines}")
        self.map = map
        self._bridges = list(bridges)
        self._lines = lines
        self._logs: list[BridgeLog] = [log_of(bridge) for bridge in self._bridges]
        self._told: list[tuple[int, str]] = []
        self._watching: list[Removal] = []
        self._task: asyncio.Task[None] | None = None
        self.half = map.add_browser_half(
            self,
            "modules/rosout_panel.js",
            {
                "bridges": [bridge.name or bridge.url for bridge in self._bridges],
                "level": level,
                "levels": list(LEVELS),
                "lines": lines,
            },
            "modules/rosout_panel.css",
        )
        keep(Removal(self._close))

    def on_message(self, message: dict[str, Any]) -> None:
        """Listen while the viewer has the panel open."""
        if message.get("open") is True:
            self._open()
        elif message.get("open") is False:
            self._close()

    def tell(self) -> None:
        """Send the page what is new."""
        for number, log in enumerate(self._logs):
            state = self._bridges[number].state
            version, told = self._told[number]
            if (log.version, state) == (version, told):
                continue
            self._told[number] = (log.version, state)
            said = [
                [line.number, line.level, line.name, line.text, line.count, line.heard]
                for line in log.since(version)[-self._lines :]
            ]
            self.half.send(
                {"bridge": number, "said": said, "total": log.total, "state": state}
            )

    def _open(self) -> None:
        # A page that was loaded anew knows nothing of what was said before.
        self._told = [(0, "") for _ in self._logs]
        if not self._watching:
            self._watching = [log.watch() for log in self._logs]
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._tell_on())

    def _close(self) -> None:
        if self._task is not None:
            self._task.cancel()
            self._task = None
        for watching in self._watching:
            watching.remove()
        self._watching = []

    async def _tell_on(self) -> None:
        while True:
            self.tell()
            await asyncio.sleep(PERIOD)
