"""What the nodes of a robot log."""

import time
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from webmap.base.errors import ConfigError
from webmap.base.scope import Removal, keep
from webmap.core.problems import refusing
from webmap.core.registry import robot_modules
from webmap.ros.bridge import Bridge
from webmap.ros.messages_log import LEVELS, LogMsg
from webmap.scene import html
from webmap.scene.element import Element

if TYPE_CHECKING:
    from webmap.core.robot import Robot

MAX_TEXT = 2000
"""The most characters that are kept of one line."""


@dataclass(frozen=True, slots=True)
class Line:
    """One thing that a node said."""

    level: str
    """``"debug"``, ``"info"``, ``"warn"``, ``"error"`` or ``"fatal"``."""

    name: str
    """The node's or the logger's."""

    text: str
    stamp: float
    """When it was said, in seconds of the robot's clock."""

    heard: float
    """When it came, in monotonic seconds."""


@robot_modules.register
class Rosout:
    """Follows what nodes log, keeps the newest lines, and fires ``on_rosout(line)``.

    Style the rows of :meth:`show_in` by CSS: ``li.warn``, ``li.error``, ``li.fatal``.

    Args:
        robot: The robot.
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        level: The least level that is kept: ``"debug"``, ``"info"``, ``"warn"``,
            ``"error"`` or ``"fatal"``.
        prefix: Only nodes whose names begin with this are heard, where robots share a
            topic; a slash in front counts for nothing.
        lines: How many lines are kept.

    Raises:
        ConfigError: If there is no such level, or no line is to be kept.

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
        if level not in LEVELS:
            raise ConfigError(f"level is one of {', '.join(LEVELS)}, got {level!r}")
        if lines < 1:
            raise ConfigError(f"lines must be at least 1, got {lines}")
        self.robot = robot
        self.level = level
        self.prefix = prefix.lstrip("/")
        self.lines: deque[Line] = deque(maxlen=lines)
        """What was said, the newest last."""
        self._lists: list[Element] = []
        # The type is another in each dialect, and the topic is always there.
        bridge.subscribe(
            topic, refusing(robot, topic, self.on_log), decode=LogMsg, queue_length=100
        )

    def show_in(self, element: Element) -> None:
        """List the lines in an element of a page until the current scope ends.

        Args:
            element: An ``ol``, or whatever takes ``li``; what is in it goes.

        """
        element.clear()
        for line in self.lines:
            element.append(_row(line))
        self._lists.append(element)
        keep(Removal(lambda: self._lists.remove(element)))

    def on_log(self, message: LogMsg) -> None:
        """Keep a line, if it is one of those that are wanted."""
        level, name = message.level_name, message.name
        if LEVELS.index(level) < LEVELS.index(self.level):
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
