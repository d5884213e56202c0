"""The log of a robot's nodes."""

import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from webmap.base.errors import ConfigError
from webmap.base.scope import Removal, keep
from webmap.core.problems import refusing
from webmap.core.registry import robot_modules
from webmap.ros.bridge import Bridge
from webmap.ros.messages import LOG_LEVELS, LogMsg
from webmap.scene import html
from webmap.scene.element import Element

if TYPE_CHECKING:
    from webmap.core.robot import Robot

MAX_TEXT = 2000
"""Greatest number of characters that are kept of one line."""


@dataclass(frozen=True, slots=True)
class Line:
    """One log message of a node."""

    level: str
    """``"debug"``, ``"info"``, ``"warn"``, ``"error"`` or ``"fatal"``."""

    name: str
    """Name of the node or logger."""

    text: str
    stamp: float
    """Time of the message, in seconds of the robot's clock."""

    received_at: float
    """Time of receipt, in monotonic seconds."""


@robot_modules.register
class Rosout:
    """Follows the log of nodes, keeps the newest lines, and fires ``on_rosout(line)``.

    Style the rows of :meth:`show_in` by CSS: ``li.warn``, ``li.error``, ``li.fatal``.

    Args:
        robot: The robot.
        bridge: The bridge of the ROS system that has the topic.
        topic: The topic.
        level: The least level that is kept: ``"debug"``, ``"info"``, ``"warn"``,
            ``"error"`` or ``"fatal"``.
        prefix: Only nodes whose names begin with this prefix are used, where robots
            share a topic; a leading slash is ignored.
        lines: The number of lines that are kept.

    Raises:
        ConfigError: If there is no such level, or ``lines`` is less than 1.
    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str = "/rosout",
        *,
        level: str = "warn",
        prefix: str = "",
        lines: int = 100,
    ) -> None:
        if level not in LOG_LEVELS:
            raise ConfigError(f"level is one of {', '.join(LOG_LEVELS)}, got {level!r}")
        if lines < 1:
            raise ConfigError(f"lines must be at least 1, got {lines}")
        self.robot = robot
        self.level = level
        self.prefix = prefix.lstrip("/")
        self.lines: deque[Line] = deque(maxlen=lines)
        """The lines, the newest last."""
        self._lists: list[Element] = []
        # The type depends on the dialect, and the topic always exists.
        bridge.subscribe(
            topic, refusing(robot, topic, self.on_log), decode=LogMsg, queue_length=100
        )

    def show_in(self, element: Element) -> None:
        """List the lines in an element of a page until the current scope ends.

        Args:
            element: An ``ol``, or another element that accepts ``li``; its content is
                removed.
        """
        element.clear()
        for line in self.lines:
            element.append(_row(line))
        self._lists.append(element)
        keep(Removal(lambda: self._lists.remove(element)))

    def on_log(self, message: LogMsg) -> None:
        """Keep a line, if it passes the filters."""
        level, name = message.level_name, message.name
        if LOG_LEVELS.index(level) < LOG_LEVELS.index(self.level):
            return
        if not name.lstrip("/").startswith(self.prefix):
            return
        text = message.msg[:MAX_TEXT]
        line = Line(level, name[:MAX_TEXT], text, message.stamp, time.monotonic())
        self.lines.append(line)
        for element in self._lists:
            element.append(_row(line))
            for old in element.children[: -len(self.lines)]:
                old.remove()
        self.robot.notify_modules("on_rosout", line)


def _row(line: Line) -> Element:
    return html.li(
        html.span(line.name, class_="name"),
        html.span(line.text, class_="message"),
        class_=line.level,
    )
