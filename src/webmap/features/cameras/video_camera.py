"""A camera that sends video: its packets reach the pages as they are.

Only the heads of packets are read, in ``video_codecs``: they show from which packet on
a browser can decode the video.
"""

import time
from typing import Literal, TypeAlias

from webmap.base.errors import ConfigError, ProtocolError
from webmap.core.pictures import VideoStream, videos
from webmap.core.problems import draw_or_report
from webmap.core.registry import robot_modules
from webmap.core.robot import Robot
from webmap.features.cameras.camera import TopicCamera
from webmap.features.cameras.video_codecs import H264, Picture, Vp9
from webmap.ros.bridge import Bridge
from webmap.ros.messages_image import MAX_PIXELS, CompressedVideoMsg, FfmpegPacketMsg
from webmap.ros.names import VIDEO, split_type

MOST_BYTES = 2 << 20
"""Most bytes of a packet."""

PATIENCE = 5.0
"""Seconds without a key picture after which that is a problem."""

WAITS = "waiting for a key picture (IDR) of the video"
LOST = "a message of the video was lost: waiting for a key picture (IDR)"
NO_KEY = (
    f"no key picture (IDR) came for {PATIENCE:g} s, and a video is shown from a key "
    "picture on: let the encoder make one every second or two (gop_size, or the "
    "keyframe interval)"
)
B_PICTURES = (
    "this video is late because it has B-pictures: turn them off in the encoder "
    "(max_b_frames 0, or tune zerolatency)"
)


class VideoReader:
    """Decides which packets of a video are shown: those from a key picture on.

    After a packet that is lost or not valid, pictures refer to one that a decoder does
    not have, so none is shown until the next key picture.
    """

    def __init__(self) -> None:
        self.note = ""
        """What a viewer should know now: a clause, empty if all is well."""
        self._name = ""
        self._codec: H264 | Vp9 | None = None
        self._waits_since: float | None = None
        self._starts = False

    def read(self, format: str, data: bytes, now: float) -> Picture | None:
        """Return the picture of the next packet; None if it is not shown.

        Args:
            format: The codec as the message names it, such as ``h264``.
            data: The packet.
            now: Seconds, monotonic.

        Raises:
            ProtocolError: If the packet is not valid, or no key picture came for long.
        """
        try:
            picture = self._read(codec_name(format), data)
        except ProtocolError:
            self._starts = False
            raise
        if picture is None:
            return None
        if picture.config is not None:
            self._starts, self._waits_since = True, None
            if self.note != B_PICTURES:
                self.note = ""
        elif not picture.follows and self._starts:
            self._starts, self.note = False, LOST
        if self._starts:
            self.note = B_PICTURES if picture.is_late else self.note
            return picture
        self.note = LOST if self.note == LOST else WAITS
        if self._waits_since is None:
            self._waits_since = now
        if now - self._waits_since >= PATIENCE:
            raise ProtocolError(NO_KEY)
        return None

    def lose(self) -> None:
        """Note that packets may be lost: the connection was opened again."""
        self._starts = False

    def _read(self, name: str, data: bytes) -> Picture | None:
        if self._codec is None or name != self._name:
            self._name, self._codec = name, CODECS[name]()
            self._starts, self.note = False, ""
        if len(data) > MOST_BYTES:
            raise ProtocolError(
                f"a video packet of {len(data)} bytes, {MOST_BYTES} at most: lower the "
                "bit rate of the encoder"
            )
        picture = self._codec.read(data)
        if picture is not None and picture.config is not None:
            _, width, height = picture.config
            if not 0 < width * height <= MAX_PIXELS:
                raise ProtocolError(
                    f"a video of {width} x {height}, {MAX_PIXELS} pixels at most: "
                    "configure the camera for a smaller one"
                )
        return picture


CODECS: dict[str, type[H264] | type[Vp9]] = {"h264": H264, "vp9": Vp9}
"""The codecs by the names of ``foxglove_msgs/CompressedVideo``."""


def codec_name(format: str) -> str:
    """Return the key of :data:`CODECS` for a codec or an encoder of FFmpeg.

    Args:
        format: Such as ``h264``, ``libx264`` or ``h264_nvenc;yuv420p;bgr8;bgr8``.

    Raises:
        ProtocolError: If it is another codec.
    """
    first = format.partition(";")[0].strip().lower()
    for name in CODECS:
        if name.removeprefix("h") in first:  # libx264 encodes H.264
            return name
    raise ProtocolError(
        f"a video with the codec {first[:40]!r}; supported are {' and '.join(CODECS)}: "
        "let the encoder write H.264"
    )


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
        robot: Robot,
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
