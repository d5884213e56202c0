"""A recording for Foxglove and Lichtblick, with the bytes that were recorded."""

import asyncio
from collections import deque
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import foxglove
from foxglove.websocket import (
    Capability,
    ChannelView,
    Client,
    PlaybackCommand,
    PlaybackControlRequest,
    PlaybackState,
    PlaybackStatus,
    ServerListener,
)

from webmap.bags.playback import PlaybackStatus as Status
from webmap.bags.recording import Recorded, Recording, is_static
from webmap.bags.times import SECOND
from webmap.base.errors import ConfigError
from webmap.base.text import one_line
from webmap.ros.rosbridge.server.dialect import canonical

if TYPE_CHECKING:
    from rosbags.interfaces import Connection

TICK = 0.05
"""Seconds between two times that are sent, while messages are played."""

KEPT = 100
"""Most messages with static frames that are kept for later subscribers."""


class FoxgloveServer(ServerListener):
    """Sends what is played to Foxglove and Lichtblick, which may pause and seek too.

    It accepts no messages, services or parameters. The bytes, their definitions and
    their times are those of the recording. Except for the callbacks of foxglove-sdk,
    all of it runs in the thread of the event loop.

    Args:
        recording: The recording.
        host: The address to listen at.
        port: The port; 0 lets the system choose.
        obey: Carries out a command to the playback, given as a line.
        status: Returns the status of the playback.

    Raises:
        ConfigError: If it cannot listen there.

    """

    def __init__(
        self,
        recording: Recording,
        host: str,
        port: int,
        obey: Callable[[str], object],
        status: Callable[[], Status],
    ) -> None:
        self._begin = recording.begin
        self._obey, self._status = obey, status
        self._loop = asyncio.get_running_loop()
        self._context = foxglove.Context()
        self._channels: dict[tuple[int, int], foxglove.Channel] = {}
        self._kept: dict[str, deque[Recorded]] = {
            topic.name: deque(maxlen=KEPT if is_static(topic.name) else 1)
            for topic in recording.topics.values()
            if topic.latched
        }
        self._shown: tuple[object, ...] = ()
        self._jumps, self._needs_state = 0, True
        self._time = 0
        self._request: str | None = None
        self._subscribed = False
        known: dict[tuple[str, str, str], foxglove.Channel] = {}
        for connection in recording.connections:
            encoding, schema = _described(recording, connection)
            which = connection.topic, encoding, schema.name
            if which not in known:  # a bag of ROS 1 has one for each publisher
                known[which] = foxglove.Channel(
                    connection.topic,
                    schema=schema,
                    message_encoding=encoding,
                    context=self._context,
                )
            self._channels[_key(connection)] = known[which]
        try:
            self._server = foxglove.start_server(
                name=recording.name,
                host=host,
                port=port,
                capabilities=[Capability.Time],
                server_listener=self,
                context=self._context,
                playback_time_range=(recording.begin, recording.end),
            )
        except (RuntimeError, OverflowError) as error:
            raise ConfigError(
                f"Foxglove cannot be served at {host}:{port}: {one_line(error)}"
            ) from None
        self.url = f"ws://{host}:{self._server.port}"
        """The address for Foxglove and Lichtblick."""

    def stop(self) -> None:
        """Close all connections."""
        self._server.stop()

    def send(self, recorded: Recorded, rate: float) -> None:
        """Send a message that is played, and from time to time its time."""
        if abs(recorded.time - self._time) >= TICK * rate * SECOND:
            self._time = recorded.time
            self._server.broadcast_time(recorded.time)
        self._keep_and_log(recorded)

    def send_state(self, state: Iterable[Recorded]) -> None:
        """Send the state at a position, if the position jumped there."""
        if self._needs_state:
            self._needs_state = False
            for recorded in state:
                self._keep_and_log(recorded)

    def show(self, status: Status) -> None:
        """Send the position, and the state of the playback if it changed."""
        jumped = status.jumps != self._jumps
        if jumped:
            self._jumps, self._needs_state = status.jumps, True
            for kept in self._kept.values():
                kept.clear()
        at = self._begin + round(status.at * SECOND)
        self._server.broadcast_time(at)
        shown = status.playing, status.ended, status.rate, status.jumps
        if shown != self._shown or self._request is not None:
            kind = PlaybackStatus.Playing if status.playing else PlaybackStatus.Paused
            kind = PlaybackStatus.Ended if status.ended else kind
            state = PlaybackState(kind, at, status.rate, jumped, self._request)
            self._server.broadcast_playback_state(state)
            self._shown, self._request = shown, None

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Send the messages that are kept of a topic; called in another thread."""
        self._loop.call_soon_threadsafe(self._on_subscribed, channel.topic)

    def on_playback_control_request(
        self, playback_control_request: PlaybackControlRequest
    ) -> None:
        """Carry out what a person wants; called in another thread."""
        wanted = playback_control_request
        self._loop.call_soon_threadsafe(
            self._control,
            "play" if wanted.playback_command == PlaybackCommand.Play else "pause",
            wanted.playback_speed,
            wanted.seek_time,
            wanted.request_id,
        )

    def _on_subscribed(self, topic: str) -> None:
        first, self._subscribed = not self._subscribed, True
        if first and self._status().jumps == 0:
            self._obey("again")  # the first viewer sees it from its beginning
        for recorded in self._kept.get(topic, ()):
            self._log(recorded)

    def _control(
        self, command: str, speed: float, seek: int | None, request: str
    ) -> None:
        if speed != self._status().rate:
            self._obey(f"rate {speed!r}")
        if seek is not None:
            self._obey(f"seek {max(0, seek - self._begin) / SECOND!r}")
        self._obey(command)
        self._request = request
        self.show(self._status())

    def _keep_and_log(self, recorded: Recorded) -> None:
        if recorded.topic in self._kept:
            self._kept[recorded.topic].append(recorded)
        self._log(recorded)

    def _log(self, recorded: Recorded) -> None:
        channel = self._channels[_key(recorded.connection)]
        channel.log(bytes(recorded.data), log_time=recorded.time)


def _key(connection: "Connection") -> tuple[int, int]:
    return id(connection.owner), connection.id


def _described(
    recording: Recording, connection: "Connection"
) -> tuple[str, foxglove.Schema]:
    """Return the encoding of the messages of a topic, and their type."""
    from webmap.bags.mcap_file import McapFile

    owner = connection.owner
    if isinstance(owner, McapFile):
        channel = owner.channels[connection.id]
        schema = owner.schemas.get(channel.schema_id)
        if schema is None or schema.data:
            return channel.message_encoding, foxglove.Schema(
                name=schema.name if schema else "",
                encoding=schema.encoding if schema else "",
                data=schema.data if schema else b"",
            )
    ros1 = recording.dialect == "ros1"
    encoding, language = ("ros1", "ros1msg") if ros1 else ("cdr", "ros2msg")
    text = recording.definition(connection)
    if text.startswith("=" * 80 + "\nIDL: "):
        language = "ros2idl"
    name = canonical(connection.msgtype) if ros1 else connection.msgtype
    return encoding, foxglove.Schema(name=name, encoding=language, data=text.encode())
