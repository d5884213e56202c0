"""Cameras with video: one subscription for all viewers, and the packets as they are."""

import base64
import time

import pytest
from module_fakes import header

from equipment.videos import packets
from webmap.base.errors import ConfigError
from webmap.core.pictures import Viewing, videos
from webmap.features.cameras.video_camera import FFMPEG, FOXGLOVE, VideoCamera
from webmap.ros.subscriptions import each_counts

TOPIC = "/camera/video"
H264 = packets("h264")


def message(data, type=FOXGLOVE, format="h264"):
    text = base64.b64encode(data).decode()
    if type == FOXGLOVE:
        stamp = {"sec": 3, "nanosec": 5}
        return {"timestamp": stamp, "frame_id": "c", "data": text, "format": format}
    more = {"width": 160, "height": 120, "pts": 3, "flags": 1, "is_bigendian": False}
    return {"header": header(), "encoding": format, "data": text} | more


class Got(list):
    """What a viewer of a camera gets."""

    def __init__(self, camera):
        stream = videos.get(camera.video.rpartition("/")[2])
        self.ended = False
        stream.join(Viewing(self.append, self._end))

    def _end(self):
        self.ended = True

    @property
    def pictures(self):
        return [each for each in self if isinstance(each, bytes)]


@pytest.fixture
def camera(link, robot):
    return robot.add_module(VideoCamera, link, TOPIC, "Front")


@pytest.mark.parametrize("cbor", [False, True])
@pytest.mark.parametrize("type", [FOXGLOVE, FFMPEG])
def test_packets_of_both_types_and_encodings_reach_the_viewers(link, robot, type, cbor):
    camera = robot.add_module("VideoCamera", link, TOPIC, type=type)
    camera.watch(lambda: None)
    assert link.types[TOPIC] == type
    got = Got(camera)
    for data in H264[:3]:
        form = "h264" if type == FOXGLOVE else "libx264;yuv420p;bgr8;bgr8"
        sent = message(data, type, form)
        link.publish(TOPIC, sent | {"data": data} if cbor else sent, cbor=cbor)
    assert all(
        each.endswith(data) for each, data in zip(got.pictures, H264, strict=False)
    )
    assert len(got.pictures) == 3
    assert not robot.problems


def test_every_packet_is_requested_and_none_is_left_out(link, camera):
    camera.watch(lambda: None)
    options = link.options[TOPIC]
    assert (options["encoding"], options["queue_length"]) == ("binary", 10)
    assert not options.get("throttle")
    for type in (FOXGLOVE, FFMPEG, "foxglove_msgs/msg/CompressedVideo"):
        assert each_counts(TOPIC, type)


def test_watchers_share_one_video_that_ends_with_the_last_of_them(link, camera):
    assert camera.video is None
    assert TOPIC not in link.listeners
    first, second = camera.watch(lambda: None), camera.watch(lambda: 1)
    url, got = camera.video, Got(camera)
    assert len(link.listeners[TOPIC]) == 1
    first.remove()
    assert camera.video == url
    assert not got.ended
    second.remove()
    assert got.ended
    assert (camera.video, camera.stamp) == (None, None)
    assert TOPIC not in link.listeners
    camera.watch(lambda: None)
    assert camera.video not in (None, url)


def test_the_age_is_that_of_the_newest_packet_that_can_be_shown(link, camera):
    link.lag = 0.25
    camera.watch(lambda: None)
    link.publish(TOPIC, message(H264[1]))
    assert camera.stamp is None  # it waits for a key picture
    link.publish(TOPIC, message(H264[0]))
    before = camera.stamp
    assert 0.2 < time.monotonic() - before < 2
    link.publish(TOPIC, message(H264[2]))  # one was lost
    assert camera.stamp == before


def test_a_broken_packet_is_a_problem_until_the_next_good_one(link, robot, camera):
    camera.watch(lambda: None)
    got = Got(camera)
    link.publish(TOPIC, message(H264[0]))
    link.publish(TOPIC, message(b"\xff\xd8\xff"))
    assert any("must write Annex B" in text for text in robot.problems.values())
    assert "must write Annex B" in got[-1]
    late = Got(camera)
    assert late.pictures == []
    link.publish(TOPIC, message(H264[1]))
    assert "waiting for a key picture" in got[-1]
    assert not robot.problems
    link.publish(TOPIC, message(H264[8]))
    assert (got[-2], len(late.pictures)) == ("", 1)


def test_a_codec_that_is_not_supported_is_named(link, robot, camera):
    camera.watch(lambda: None)
    link.publish(TOPIC, message(b"x", format="mpeg4"))
    (text,) = robot.problems.values()
    assert text.startswith(
        "/camera/video: a video with the codec 'mpeg4'; supported are"
    )


@pytest.mark.parametrize(
    ("topic", "type"),
    [
        ("/camera/image_raw/ffmpeg", FFMPEG),
        ("/camera/image_raw/foxglove", FOXGLOVE),
        ("/video", FOXGLOVE),
    ],
)
def test_the_type_follows_from_the_name_of_the_topic(link, robot, topic, type):
    assert robot.add_module("VideoCamera", link, topic).type == type


def test_a_type_without_video_is_refused(link, robot):
    with pytest.raises(ConfigError, match="type is foxglove_msgs/CompressedVideo or"):
        VideoCamera(robot, link, TOPIC, type="sensor_msgs/Image")


def test_a_camera_that_is_removed_ends_its_video(link, robot, camera):
    camera.watch(lambda: None)
    got = Got(camera)
    robot.remove_module(camera)
    assert got.ended
    link.publish(TOPIC, message(H264[0]))
    assert got.pictures == []
