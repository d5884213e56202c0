"""The player bar of a recording, and the commands of a page to the replay."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, ClassVar, TypeVar
from weakref import WeakKeyDictionary

import msgspec

from webmap.bags.playback import (
    MARKS,
    STATUS,
    TYPE,
    Marks,
    PlaybackCommand,
    PlaybackStatus,
    StringMessage,
    command_of,
)
from webmap.base.errors import ConfigError
from webmap.base.roles import Role
from webmap.core.map import Map
from webmap.core.robot import Robot
from webmap.ros.bridge import Bridge

T = TypeVar("T")

_newest_marks: WeakKeyDictionary[Bridge, Marks] = WeakKeyDictionary()
"""The newest marks of each recording, for pages that are opened later: the bridge sends
marks that were found in several parts to its first listener only."""


class RecordingPlayer:
    """Shows the position of a replay, and passes a page's commands to it.

    All pages show one playback. A page with this module has a coloured frame.

    Args:
        map: The map.
        bridge: The bridge to the replay.
        send_command: Sends the replay a command.
    """

    MAY_SEND: ClassVar[Mapping[str, Role]] = {
        "command": "operator",
        "value": "operator",
    }

    def __init__(
        self,
        map: Map,
        bridge: Bridge,
        send_command: Callable[[PlaybackCommand], object],
    ) -> None:
        self.map = map
        self._send_command = send_command
        self._status: PlaybackStatus | None = None
        self._bridge = bridge
        self.browser_part = map.add_browser_part(
            self,
            "features/player/player_bar.js",
            style="features/player/player_bar.css",
        )
        bridge.subscribe(STATUS, self._on_status, TYPE, decode=StringMessage)
        bridge.subscribe(MARKS, self._on_marks, TYPE, decode=StringMessage)

    def on_ready(self) -> None:
        """Send the newest status to a page that was loaded."""
        if self._status is not None:
            self._send("status", self._status)
        marks = _newest_marks.get(self._bridge)
        if marks is not None:
            self._send("marks", marks)

    def on_message(self, message: dict[str, Any]) -> None:
        """Pass a command to the replay, or report that it is not valid."""
        try:
            command = command_of(message.get("command"), message.get("value"))
        except ConfigError as error:
            self.map.report_error(str(error))
            return
        self._send_command(command)

    def _on_status(self, text: StringMessage) -> None:
        status = _read(text, PlaybackStatus)
        if status is None:
            return
        before, self._status = self._status, status
        self._send("status", status)
        if before is None and status.jumps == 0:
            # The first page sees it from its beginning.
            self._send_command(PlaybackCommand("again"))

    def _on_marks(self, text: StringMessage) -> None:
        marks = _read(text, Marks)
        if marks is not None:
            _newest_marks[self._bridge] = marks
            self._send("marks", marks)

    def _send(self, kind: str, value: PlaybackStatus | Marks) -> None:
        self.browser_part.send({kind: msgspec.to_builtins(value)})


def expect_jumps(bridge: Bridge, robots: Callable[[], Iterable[Robot]]) -> None:
    """Fire ``on_seek()`` on each robot whenever the position of a replay jumps.

    Args:
        bridge: The bridge to the replay.
        robots: Returns the robots of the recording.
    """
    known: int | None = None

    def on_status(text: StringMessage) -> None:
        nonlocal known
        status = _read(text, PlaybackStatus)
        if status is None or status.jumps == known:
            return
        known = status.jumps
        for robot in robots():
            robot.expect_jump()
            robot.notify_modules("on_seek")

    bridge.subscribe(STATUS, on_status, TYPE, decode=StringMessage)


def _read(text: StringMessage, type_: type[T]) -> T | None:
    """Return the content of a message; None if another program has sent it."""
    try:
        return msgspec.json.decode(text.data, type=type_)
    except msgspec.MsgspecError:
        return None
