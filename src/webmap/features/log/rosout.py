"""The log of nodes: of one robot, and of all bridges in a panel over the map."""

import asyncio
import itertools
import time
import weakref
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass
from typing import Any, ClassVar

from webmap.base.errors import ConfigError
from webmap.base.roles import Role
from webmap.base.scope import Removable, Removal, keep, no_scope
from webmap.core.map import Map
from webmap.core.problems import draw_or_report
from webmap.core.registry import map_modules, robot_modules
from webmap.core.robot import Robot
from webmap.ros.bridge import Bridge
from webmap.ros.messages import LOG_LEVELS, LogMsg
from webmap.scene import html
from webmap.scene.element import Element

MAX_TEXT = 2000
"""Greatest number of characters that are kept of one line."""


@dataclass(frozen=True, slots=True)
class RobotLogLine:
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
        robot: Robot,
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
        self.lines: deque[RobotLogLine] = deque(maxlen=lines)
        """The lines, the newest last."""
        self._lists: list[Element] = []
        # The type depends on the dialect, and the topic always exists.
        bridge.subscribe(
            topic,
            draw_or_report(robot, topic, self.on_log),
            decode=LogMsg,
            queue_length=100,
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
        line = RobotLogLine(
            level, name[:MAX_TEXT], text, message.stamp, time.monotonic()
        )
        self.lines.append(line)
        for element in self._lists:
            element.append(_row(line))
            for old in element.children[: -len(self.lines)]:
                old.remove()
        self.robot.notify_modules("on_rosout", line)


def _row(line: RobotLogLine) -> Element:
    return html.li(
        html.span(line.name, class_="name"),
        html.span(line.text, class_="message"),
        class_=line.level,
    )


TOPIC = "/rosout"

MOST = 200
"""Number of lines that are kept of one bridge."""

LONGEST = 500
"""Number of characters that are kept of a line."""


@dataclass(slots=True)
class BridgeLogLine:
    """A log message of a node, once or several times in a row."""

    number: int
    level: str
    """``"debug"``, ``"info"``, ``"warn"``, ``"error"`` or ``"fatal"``."""

    name: str
    """Name of the node or logger."""

    text: str
    count: int
    received_at: float
    """Time of the last receipt, in monotonic seconds."""

    version: int
    """Increases with every change of any line."""


class BridgeLog:
    """The newest lines of one bridge, shared by all pages.

    The topic is subscribed to only while a page has the panel open, because logs are
    frequent. Lines received before are kept.
    """

    def __init__(self, bridge: Bridge) -> None:
        self.lines: deque[BridgeLogLine] = deque(maxlen=MOST)
        """The lines, the newest last."""
        self.total = 0
        """Number of all messages received."""
        self.version = 0
        self._bridge = weakref.ref(bridge)
        self._numbers = itertools.count(1)
        self._watchers = 0
        self._subscription: Removable | None = None

    def watch(self) -> Removal:
        """Subscribe until the returned removal, unless other pages watch."""
        self._watchers += 1
        bridge = self._bridge()
        if self._subscription is None and bridge is not None:
            with no_scope():
                # The type depends on the dialect, and the topic always exists.
                self._subscription = bridge.subscribe(
                    TOPIC, self.on_log, decode=LogMsg, queue_length=100
                )
        return Removal(self._leave)

    def on_log(self, message: LogMsg) -> None:
        """Keep a line; repetitions are counted."""
        self.total += 1
        self.version += 1
        level, name = message.level_name, message.name[:LONGEST]
        text, now = message.msg[:LONGEST], time.monotonic()
        last = self.lines[-1] if self.lines else None
        if last is not None and (last.level, last.name, last.text) == (
            level,
            name,
            text,
        ):
            last.count += 1
            last.received_at, last.version = now, self.version
            return
        number = next(self._numbers)
        self.lines.append(
            BridgeLogLine(number, level, name, text, 1, now, self.version)
        )

    def since(self, version: int) -> list[BridgeLogLine]:
        """Return the lines that changed after a version, the newest last."""
        return [line for line in self.lines if line.version > version]

    def _leave(self) -> None:
        self._watchers -= 1
        if self._watchers == 0 and self._subscription is not None:
            self._subscription.remove()
            self._subscription = None


_logs: weakref.WeakKeyDictionary[Bridge, BridgeLog] = weakref.WeakKeyDictionary()


def log_of(bridge: Bridge) -> BridgeLog:
    """Return the log of a bridge, shared by all pages."""
    return _logs.setdefault(bridge, BridgeLog(bridge))


PERIOD = 0.25
"""Seconds between two checks for new lines, while the panel is open."""


@map_modules.register
class RosoutPanel:
    """A panel that unfolds into the newest lines of ``/rosout``, of each bridge.

    It receives ``rosgraph_msgs/Log`` of ROS 1 and ``rcl_interfaces/Log`` of ROS 2 while
    a page has the panel open. Repetitions are counted, and each page chooses the least
    level of the lines that it shows.

    Style it by CSS: ``.webmap-rosout-line[data-level="error"]``.

    Args:
        map: The map.
        bridges: The bridges of the ROS systems; more may be added to the list later.
        level: The least level that is shown until the page chooses another:
            ``"debug"``, ``"info"``, ``"warn"``, ``"error"`` or ``"fatal"``.
        lines: The number of lines of each bridge that are shown.

    Raises:
        ConfigError: If there is no such level, or ``lines`` is less than 1.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {"open": "viewer"}

    def __init__(
        self,
        map: Map,
        bridges: Sequence[Bridge],
        *,
        level: str = "info",
        lines: int = 100,
    ) -> None:
        if level not in LOG_LEVELS:
            raise ConfigError(f"level is one of {', '.join(LOG_LEVELS)}, got {level!r}")
        if not 1 <= lines <= 200:
            raise ConfigError(f"lines must be 1 to 200, got {lines}")
        self.map = map
        self._bridges = bridges
        self._lines = lines
        self._sent: dict[Bridge, tuple[int, str]] = {}
        self._watching: dict[Bridge, Removal] = {}
        self._task: asyncio.Task[None] | None = None
        self.browser_part = map.add_browser_part(
            self,
            "features/log/rosout_panel.js",
            {"level": level, "levels": list(LOG_LEVELS), "lines": lines},
            "features/log/rosout_panel.css",
        )
        keep(Removal(self._close))

    def on_message(self, message: dict[str, Any]) -> None:
        """Subscribe while the page has the panel open."""
        if message.get("open") is True:
            self._open()
        elif message.get("open") is False:
            self._close()

    def send_new_lines(self) -> None:
        """Send the page the new lines, also of bridges that are new."""
        for number, bridge in enumerate(self._bridges):
            log, state = log_of(bridge), bridge.state
            version, sent_state = self._sent.get(bridge, (0, ""))
            if (log.version, state) == (version, sent_state):
                continue
            self._sent[bridge] = (log.version, state)
            # All fields but the version.
            lines = [
                list(astuple(line)[:-1]) for line in log.since(version)[-self._lines :]
            ]
            self.browser_part.send(
                {
                    "bridge": number,
                    "name": bridge.name or bridge.url,
                    "lines": lines,
                    "total": log.total,
                    "state": state,
                }
            )

    def _open(self) -> None:
        # A page that was loaded again knows none of the earlier lines.
        self._sent = {}
        self._watch()
        if self._task is None:
            self._task = asyncio.get_running_loop().create_task(self._send_regularly())

    def _watch(self) -> None:
        for bridge in self._bridges:
            if bridge not in self._watching:
                self._watching[bridge] = log_of(bridge).watch()

    def _close(self) -> None:
        if self._task is not None:
            self._task.cancel()
            self._task = None
        for watching in self._watching.values():
            watching.remove()
        self._watching = {}

    async def _send_regularly(self) -> None:
        while True:
            self._watch()
            self.send_new_lines()
            await asyncio.sleep(PERIOD)
