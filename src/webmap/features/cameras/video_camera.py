"""A camera that sends video: its packets reach the pages as they are."""

import time
from typing import TYPE_CHECKING, Literal, TypeAlias

from webmap.base.errors import ConfigError, ProtocolError
from webmap.core.pictures import VideoStream, videos
from webmap.core.problems import draw_or_report
from webmap.core.registry import robot_modules
from webmap.features.cameras.camera import TopicCamera
from webmap.features.cameras.video import VideoReader
from webmap.ros.bridge import Bridge
from webmap.ros.messages_image import CompressedVideoMsg, FfmpegPacketMsg
from webmap.ros.names import VIDEO, split_type

if TYPE_CHECKING:
    from webmap.core.robot import Robot

VideoType: TypeAlias = Literal[
    "ffmpeg_image_transport_msgs/FFMPEGPacket",
    "ffmpeg_image_transport_msgs/msg/FFMPEGPacket",
    "foxglove_msgs/CompressedVideo",
    "foxglove_msgs/msg/CompressedVideo",
]
"""The types of video, in both dialects."""

FOXGLOVE, FFMPEG = VIDEO

VIEWS: dict[str, type[CompressedVideoMsg] | type[FfmpegPacketMsg]] = {
    FOXGLOVE: CompressedVideoMsg,
    FFMPEG: FfmpegPacketMsg,
}

QUEUE = 10
"""Packets that a bridge may queue: each one counts, and they may come in bursts."""


@robot_modules.register
class VideoCamera(TopicCamera):
    """Passes the video of a camera on to all pages that watch it.

    Browsers decode it, and only over HTTPS or on this computer. The robot sends the
    video only while a page watches, and once for all pages.

    Args:
        robot: The robot that carries the camera.
        bridge: The bridge of the ROS system that has the topic.
        topic: A topic of type ``foxglove_msgs/CompressedVideo`` or
            ``ffmpeg_image_transport_msgs/FFMPEGPacket`` with H.264 or VP9.
        name: The camera's name, for people.
        type: The type of the topic. If not given, it is ``FFMPEGPacket`` for names that
            end in ``/ffmpeg``, and ``CompressedVideo`` for all others.

    Raises:
        ConfigError: If the type is not a type of video.
    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        name: str = "Camera",
        *,
        type: VideoType | None = None,
    ) -> None:
        super().__init__(robot, bridge, topic, name)
        by_name = FFMPEG if topic.endswith("/ffmpeg") else FOXGLOVE
        self.type = by_name if type is None else str(split_type(type))
        """The type, without a dialect."""
        if self.type not in VIEWS:
            raise ConfigError(f"type is {FOXGLOVE} or {FFMPEG}, got {type!r}")
        self.video: str | None = None
        """The URL of the video, while a page watches."""
        self._reader = VideoReader()
        self._stream: VideoStream | None = None

    def subscribe(self) -> None:
        """Subscribe to the video, and open the URL for its viewers."""
        self._reader = VideoReader()
        self._stream = videos.open()
        self.video = self._stream.url
        self._bridge.on_open(self._reader.lose)
        self._bridge.subscribe(
            self.topic,
            draw_or_report(self.robot, self.topic, self.on_packet),
            self.type,
            decode=VIEWS[self.type],
            encoding="binary",
            queue_length=QUEUE,
        )

    def end(self) -> None:
        """Unsubscribe, and end the video for its viewers."""
        super().end()
        if self._stream is not None:
            self._stream.end()
        self._stream = self.video = None

    def on_packet(self, packet: CompressedVideoMsg | FfmpegPacketMsg) -> None:
        """Pass a packet on.

        Raises:
            ProtocolError: If it cannot be shown.
        """
        stream, reader = self._stream, self._reader
        if stream is None:
            return
        now = time.monotonic()
        try:
            picture = reader.read(packet.format, packet.data, now)
        except ProtocolError as error:
            stream.lose()
            stream.tell(str(error))
            raise
        stream.tell(reader.note)
        if picture is None:
            return
        self.stamp = now - self._bridge.lag
        stream.show(picture.data, picture.config, self.stamp)
