"""Which packets of a video are shown, and what viewers get to know about the others."""

import contextlib
import random

import pytest

from equipment.videos import EVERY, packets
from webmap.base.errors import ProtocolError
from webmap.features.cameras import video_camera
from webmap.features.cameras.video_camera import VideoReader, codec_name
from webmap.features.cameras.video_codecs import (
    MOST_PARAMETERS,
    Bits,
    VideoConfig,
    nal_units,
    read_sps,
)

H264 = packets("h264")
START = b"\0\0\1"


class Reading:
    """A reader of one video, with a clock."""

    def __init__(self, format="h264"):
        self.format, self.now, self.reader = format, 0.0, VideoReader()

    def __call__(self, *given):
        """Read packets; return the numbers of those that are shown."""
        shown = []
        for number, data in enumerate(given):
            self.now += 1 / 15
            if self.reader.read(self.format, data, self.now) is not None:
                shown.append(number)
        return shown


@pytest.fixture
def read():
    return Reading()


def parts(data):
    """Return the NAL units of a packet."""
    return [data[begin:end].rstrip(b"\0") for begin, end in nal_units(data)]


def joined(*units):
    return b"".join(b"\0\0\0\1" + unit for unit in units)


def test_every_packet_of_a_whole_video_is_shown_unchanged(read):
    for number, data in enumerate(H264):
        picture = read.reader.read("h264", data, 0.0)
        assert picture.data == data
        assert (picture.config is not None) == (number % EVERY == 0)
        assert read.reader.note == ""


def test_the_codec_and_the_size_come_from_the_parameters_of_the_video():
    config = VideoReader().read("h264", H264[0], 0.0).config
    assert config == VideoConfig("avc1.42c00a", 160, 128)  # in whole macroblocks


def test_vp9_begins_with_its_key_picture():
    first, *rest = packets("vp9")
    reader = Reading("vp9")
    assert reader(*rest) == []
    assert "waiting for a key picture" in reader.reader.note
    config = VideoConfig("vp09.00.51.08", 160, 120)
    assert reader.reader.read("vp9", first, 1.0).config == config
    assert reader(*rest) == [0, 1, 2]


def test_a_viewer_in_the_middle_waits_for_the_next_key_picture(read):
    assert read(*H264[3:8]) == []
    assert read.reader.note == video_camera.WAITS
    assert read(*H264[8:]) == list(range(8))
    assert read.reader.note == ""


def test_after_a_lost_message_nothing_is_shown_until_the_next_key_picture(read):
    assert read(*H264[:3], *H264[4:8]) == [0, 1, 2]
    assert read.reader.note == video_camera.LOST
    assert read(*H264[8:]) == list(range(8))
    assert read.reader.note == ""


def test_after_a_new_connection_the_reader_waits_for_a_key_picture(read):
    assert read(*H264[:3]) == [0, 1, 2]
    read.reader.lose()
    assert read(*H264[3:9]) == [5]


def test_a_video_without_key_pictures_is_a_problem_after_some_seconds(read):
    with pytest.raises(ProtocolError, match=r"no key picture .* for 5 s.*gop_size"):
        read(*H264[1:8] * 20)
    assert read.now == pytest.approx(video_camera.PATIENCE, abs=0.5)
    assert read(*H264[8:]) == list(range(8))


def test_parameters_in_messages_of_their_own_are_put_before_key_pictures(read):
    sps, pps, key = parts(H264[0])
    assert read(joined(sps), joined(pps)) == []
    picture = read.reader.read("h264", joined(key), 0.0)
    assert parts(picture.data) == [sps, pps, key]
    again = read.reader.read("h264", joined(key), 0.0)
    assert parts(again.data) == [sps, pps, key]


def test_a_key_picture_without_parameters_is_refused_with_advice(read):
    key = joined(parts(H264[0])[-1])
    with pytest.raises(ProtocolError, match="without SPS and PPS: let the encoder"):
        read(key)


def test_a_new_size_comes_with_the_key_picture_that_has_it(read):
    read(*H264)
    sps, pps, key = parts(H264[0])
    # Another level: the parameters before the sizes have whole bytes.
    other = bytes([*sps[:3], 0x1F, *sps[4:]])
    picture = read.reader.read("h264", joined(other, pps, key), 0.0)
    assert picture.config.codec == "avc1.42c01f"


def test_another_codec_in_the_middle_begins_with_its_own_key_picture(read):
    assert read(*H264[:3]) == [0, 1, 2]
    read.format = "vp9"
    assert read(*packets("vp9")) == [0, 1, 2, 3]
    read.format = "libx264"
    assert read(*H264[3:9]) == [5]


def slice_with(type, *numbers, frame_bits=4, frame=1):
    """Return a slice header with numbers in the code ue(v), and the frame's number."""
    bits = (
        "".join("0" * (len(f"{n + 1:b}") - 1) + f"{n + 1:b}" for n in numbers)
        + f"{frame:0{frame_bits}b}"
    )
    bits = bits.ljust(80, "0")
    return bytes([type]) + int(bits, 2).to_bytes(10, "big")


def test_b_pictures_are_shown_with_a_note_that_they_are_late(read):
    frame_bits = read_sps(parts(H264[0])[0]).frame_bits
    read(H264[0])
    b_picture = slice_with(0x01, 0, 6, 0, frame_bits=frame_bits)
    assert read(joined(b_picture)) == [0]
    assert "late because it has B-pictures" in read.reader.note
    assert read(H264[1]) == [0]


def test_a_part_of_a_picture_is_refused(read):
    read(H264[0])
    with pytest.raises(ProtocolError, match="one whole picture"):
        read(joined(slice_with(0x61, 20, 5, 0)))
    assert read(H264[1]) == []
    assert read(H264[8]) == [0]


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "begin with a start code"),
        (b"\xff\xd8\xff\xe0", "begin with a start code"),
        (b"\0\0\0\x1d" + H264[0][4:], "begin with a start code"),  # AVCC
        (START, "empty NAL unit"),
        (START + b"\x67\x42", "ends too early"),
        (START + b"\x67\x42\0\x1f" + bytes(600), "more than 32 bits"),
        (START + b"\x65", "ends too early"),
        (START * 600, "empty NAL unit"),
        ((START + b"\x09") * 600, "more than 512 NAL units"),
        (START + b"\x68\xff" + b"\xff" * MOST_PARAMETERS, "bytes of parameters"),
        (START + b"\x62\xff", "data partitions"),
        (bytes(video_camera.MOST_BYTES + 1), "lower the bit rate"),
    ],
)
def test_a_broken_packet_is_refused_and_the_video_goes_on_with_a_key_picture(
    read, data, says
):
    assert read(*H264[:3]) == [0, 1, 2]
    with pytest.raises(ProtocolError, match=says):
        read(data)
    assert read(*H264[3:]) == list(range(5, 13))


def test_a_picture_of_too_many_pixels_is_refused(read, monkeypatch):
    monkeypatch.setattr(video_camera, "MAX_PIXELS", 160 * 120)
    with pytest.raises(ProtocolError, match="a video of 160 x 128, 19200 pixels"):
        read(H264[0])


@pytest.mark.parametrize(
    ("format", "name"),
    [
        ("h264", "h264"),
        ("libx264;yuv420p;bgr8;bgr8", "h264"),
        ("h264_nvenc", "h264"),
        ("H264", "h264"),
        ("libvpx-vp9", "vp9"),
    ],
)
def test_codecs_are_known_by_their_names_and_by_those_of_ffmpeg(format, name):
    assert codec_name(format) == name


@pytest.mark.parametrize(
    ("format", "codec"),
    [
        ("", ""),
        ("vp8", "vp8"),
        ("H265", "h265"),
        ("hevc_vaapi;nv12;bgr8;bgr8", "hevc_vaapi"),
        ("libaom-av1", "libaom-av1"),
    ],
)
def test_another_codec_is_refused_with_the_supported_ones(format, codec):
    says = f"a video with the codec '{codec}'; supported are h264 and vp9"
    with pytest.raises(ProtocolError, match=says):
        VideoReader().read(format, H264[0], 0.0)


def test_bits_end_with_an_error():
    bits = Bits(b"\xa5")
    assert (bits.take(4), bits.take(4)) == (10, 5)
    with pytest.raises(ProtocolError, match="ends too early"):
        bits.take(1)


@pytest.mark.parametrize("format", ["h264", "vp9"])
def test_random_packets_raise_nothing_but_the_error_of_the_protocol(format):
    random.seed(format)
    source = packets(format)
    reader = Reading(format)
    for _ in range(3000):
        data = bytearray(random.choice(source))
        for _ in range(random.randrange(6)):
            data[random.randrange(len(data))] = random.randrange(256)
        if random.random() < 0.3:
            del data[random.randrange(len(data)) :]
        with contextlib.suppress(ProtocolError):
            reader(bytes(data))
