"""Cameras: one subscription for all viewers."""

import asyncio
import base64
import io
import time

import numpy as np
import pytest
from module_fakes import header
from PIL import Image

from equipment.waiting import until
from webmap.base.errors import ConfigError, ProtocolError
from webmap.core.pictures import pictures
from webmap.features.cameras.camera import Camera, JpegAnyImageMsg, JpegImageMsg
from webmap.ros.messages_image import CompressedImageMsg, ImageMsg, size_of

TOPIC = "/camera/image_raw/compressed"


def a_jpeg(colour=(200, 30, 30)) -> bytes:
    file = io.BytesIO()
    Image.new("RGB", (16, 12), colour).save(file, "JPEG")
    return file.getvalue()


def compressed(data: bytes, **more) -> dict:
    text = base64.b64encode(data).decode()
    return {"header": header(), "format": "jpeg", "data": text, **more}


def shown(camera) -> Image.Image:
    published = pictures.get(camera.url.rpartition("/")[2])
    return Image.open(io.BytesIO(published.data)).convert("RGB")


def test_watchers_share_one_subscription_that_ends_with_the_last_watcher(link, robot):
    camera = robot.add_module(Camera, link, TOPIC)
    assert TOPIC not in link.listeners
    first, second = camera.watch(lambda: None), camera.watch(lambda: 1)
    assert len(link.listeners[TOPIC]) == 1
    first.remove()
    assert TOPIC in link.listeners
    second.remove()
    assert TOPIC not in link.listeners


@pytest.mark.parametrize("cbor", [False, True])
def test_a_compressed_picture_is_published_unchanged(link, robot, cbor):
    camera = robot.add_module(Camera, link, TOPIC)
    received = []
    camera.watch(lambda: received.append(camera.url))
    data = a_jpeg()
    message = compressed(data)
    if cbor:
        message["data"] = data
    link.publish(TOPIC, message, cbor=cbor)
    assert received == [camera.url]
    picture = pictures.get(camera.url.rpartition("/")[2])
    assert picture == (data, "image/jpeg", True)
    assert link.options[TOPIC]["throttle"] == 200


@pytest.mark.parametrize(
    ("topic", "asked"),
    [
        ("/camera/image_raw/compressed", "sensor_msgs/CompressedImage"),
        ("/camera/image_raw", "sensor_msgs/Image"),
        ("/camera/image_rect_color", "sensor_msgs/Image"),
        ("/unity/image_compressed", None),
        ("/thermal/jpeg", None),
        ("/color/video", None),
    ],
)
def test_the_type_is_derived_from_the_topic_name_or_left_to_the_bridge(
    link, robot, topic, asked
):
    robot.add_module(Camera, link, topic).watch(lambda: None)
    assert link.types[topic] == asked


@pytest.mark.parametrize("type", [None, "sensor_msgs/msg/CompressedImage"])
def test_a_compressed_picture_is_shown_for_any_topic_name(link, robot, type):
    camera = robot.add_module(Camera, link, "/thermal/jpeg", type=type)
    camera.watch(lambda: None)
    link.publish("/thermal/jpeg", compressed(a_jpeg()))
    assert shown(camera).getpixel((4, 4))[0] > 180
    assert not robot.problems


def test_a_message_type_without_pictures_is_refused(link, robot):
    with pytest.raises(ValueError, match="type: expected"):
        robot.add_module("Camera", link, TOPIC, type="sensor_msgs/LaserScan")
    with pytest.raises(ConfigError, match="is sensor_msgs/CompressedImage or"):
        Camera(robot, link, TOPIC, type="sensor_msgs/LaserScan")


def test_kept_pictures_are_limited_and_removed_after_the_last_watcher(
    link, robot, monkeypatch
):
    before = len(pictures)
    camera = robot.add_module(Camera, link, TOPIC)
    watching = camera.watch(lambda: None)
    for red in range(0, 250, 2):
        link.publish(TOPIC, compressed(a_jpeg((red, 0, 0))))
    assert len(pictures) <= before + 64
    for number in range(8):
        large = a_jpeg((number, 0, 0)) + bytes(3 << 20)
        link.publish(TOPIC, compressed(large) | {"data": large}, cbor=True)
    assert len(pictures) <= before + 3
    link.publish(TOPIC, compressed(a_jpeg()))
    last = camera.url
    watching.remove()
    assert len(pictures) == before
    assert pictures.get(last.rpartition("/")[2]), (
        "a page may still load the last picture"
    )
    later = time.monotonic() + 3.1
    with monkeypatch.context() as then:
        then.setattr(time, "monotonic", lambda: later)
        assert pictures.get(last.rpartition("/")[2]) is None
    assert camera.url is None


def test_invalid_picture_data_is_a_problem_and_the_last_picture_stays(link, robot):
    camera = robot.add_module(Camera, link, TOPIC)
    camera.watch(lambda: None)
    link.publish(TOPIC, compressed(a_jpeg()))
    good = camera.url
    link.publish(TOPIC, compressed(b"<svg onload=alert(1)>", format="svg"))
    assert camera.url == good
    assert any("not JPEG, PNG or WebP" in text for text in robot.problems.values())
    link.publish(TOPIC, compressed(a_jpeg((0, 0, 9))))
    assert not robot.problems


def raw(encoding: str, pixels: np.ndarray, pad: int = 0) -> ImageMsg:
    height, width = pixels.shape[:2]
    rows = pixels.reshape(height, -1).view(np.uint8)
    padded = np.pad(rows, ((0, 0), (0, pad)))
    return ImageMsg(height, width, encoding, padded.shape[1], padded.tobytes())


def test_raw_pixels_are_in_rgb_order_without_row_padding():
    red = np.zeros((4, 5, 3), np.uint8)
    red[..., 0] = 255
    assert (raw("rgb8", red, pad=7).pixels() == red).all()
    assert (raw("bgr8", red[..., ::-1].copy(), pad=3).pixels() == red).all()
    with_alpha = np.dstack([red, np.full((4, 5), 9, np.uint8)])
    assert (raw("rgba8", with_alpha).pixels() == red).all()
    assert (raw("8UC4", with_alpha[..., [2, 1, 0, 3]]).pixels() == red).all()


# White, black, red and blue in BT.601: Y, U and V.
YUV = [(235, 128, 128), (16, 128, 128), (81, 90, 240), (41, 240, 110)]
RGB = [(255, 255, 255), (0, 0, 0), (255, 0, 0), (0, 0, 255)]


@pytest.mark.parametrize(
    ("encoding", "order"),
    [("yuv422_yuy2", "yuyv"), ("yuyv", "yuyv"), ("yuv422", "uyvy"), ("uyvy", "uyvy")],
)
def test_yuv422_pixels_share_a_colour_but_keep_their_own_brightness(encoding, order):
    row = []
    for y, u, v in YUV:
        row += [y, u, y, v] if order == "yuyv" else [u, y, v, y]
    row[2 if order == "yuyv" else 3] = 126  # the second pixel is darker
    pixels = raw(encoding, np.array([row, row], np.uint8), pad=3)
    pixels.width = 8
    seen = pixels.pixels()
    assert seen.shape == (2, 8, 3)
    assert seen[1, 1].tolist() == [128, 128, 128]
    for number, colour in enumerate(RGB):
        assert np.allclose(seen[1, 2 * number], colour, atol=3), number


@pytest.mark.parametrize(("pad", "step"), [(0, 8), (5, 13), (0, 12)])
@pytest.mark.parametrize(("encoding", "swapped"), [("nv12", 0), ("nv21", 1)])
def test_yuv420_pixels_of_two_rows_share_a_colour(encoding, swapped, pad, step):
    luma = [y for y, _, _ in YUV for _ in range(2)]
    dark = [126, *luma[1:]]
    chroma = [c for _, u, v in YUV for c in ((v, u) if swapped else (u, v))]
    rows = np.array([luma, dark, luma, chroma, chroma], np.uint8)
    image = raw(encoding, rows, pad=pad)
    image.height, image.step = 3, step
    seen = image.pixels()
    assert seen.shape == (3, 8, 3)
    assert seen[1, 0].tolist() == [128, 128, 128]
    for number, colour in enumerate(RGB):
        assert np.allclose(seen[:, 2 * number + 1], colour, atol=3), number
    image.data = image.data[:-1]
    with pytest.raises(ProtocolError, match="too few for 5 rows of 8 in nv"):
        image.pixels()


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("filters", ["rggb", "bggr", "gbrg", "grbg"])
def test_a_bayer_picture_becomes_a_colour_picture_of_half_its_size(filters, bits):
    values = {"r": [200], "g": [90, 110], "b": [0]}
    square = [values[letter].pop() for letter in filters]
    mosaic = np.tile(np.array(square).reshape(2, 2), (2, 3))
    mosaic = np.pad(mosaic, ((0, 1), (0, 1)))  # half a square is dropped
    kind = np.uint8 if bits == 8 else np.uint16
    seen = raw(f"bayer_{filters}{bits}", mosaic.astype(kind)).pixels()
    stretched = 1.0 if bits == 8 else 255 / 200
    assert seen.shape == (2, 3, 3)
    wanted = np.array([200, 100, 0]) * stretched
    assert np.allclose(seen, wanted, atol=1)


def test_depth_is_scaled_to_grey_values_and_nan_is_black():
    depth = np.array([[0.0, 1.0], [2.0, np.nan]], np.float32)
    assert raw("32FC1", depth).pixels().tolist() == [[0, 127], [255, 0]]


def test_big_endian_pixels_are_decoded():
    values = np.array([[0, 256], [512, 768]], ">u2")
    image = raw("mono16", values)
    image.is_bigendian = 1
    assert image.pixels().tolist() == [[0, 85], [170, 255]]


@pytest.mark.parametrize(
    ("image", "expected"),
    [
        (ImageMsg(10, 10, "rgb8", 30, b"\0" * 299), "too few"),
        (ImageMsg(10, 10, "rgb8", 29, b"\0" * 300), "too few"),
        (ImageMsg(100000, 100000, "rgb8", 300000, b""), "at most"),
        (ImageMsg(0, 10, "rgb8", 30, b""), "at most"),
        (ImageMsg(1, 1, "nv24", 2, b"\0\0"), "known are"),
        (ImageMsg(1, 1, "yuv422", 2, b"\0\0"), "width must be even, got 1"),
        (ImageMsg(1, 9, "bayer_rggb8", 9, b"\0" * 9), "9 x 1, 2 x 2 at least"),
    ],
)
def test_an_invalid_raw_picture_is_refused_with_a_reason(image, expected):
    with pytest.raises(ProtocolError, match=expected):
        image.pixels()


def test_a_picture_that_is_too_large_is_refused():
    with pytest.raises(ProtocolError, match="at most"):
        _ = CompressedImageMsg(b"\xff\xd8\xff" + b"\0" * (5 << 20)).media_type


@pytest.mark.parametrize("topic", ["/camera/image_raw", "/color/video"])
def test_the_newest_raw_picture_is_shown(link, robot, topic):
    async def scenario():
        camera = robot.add_module(Camera, link, topic)
        camera.watch(lambda: None)
        for value in (10, 100, 200):
            pixels = np.full((8, 8, 3), value, np.uint8)
            data = base64.b64encode(pixels.tobytes()).decode()
            message = {
                "header": header(),
                "height": 8,
                "width": 8,
                "encoding": "rgb8",
                "is_bigendian": 0,
                "step": 24,
                "data": data,
            }
            link.publish(topic, message)
        await until(lambda: camera.url and shown(camera).getpixel((4, 4))[0] >= 190)

    asyncio.run(scenario())


def packed(form, size, **options):
    file = io.BytesIO()
    Image.new("RGB", size).save(file, form, **options)
    return file.getvalue()


@pytest.mark.parametrize(
    ("form", "options"),
    [
        ("JPEG", {}),
        ("JPEG", {"progressive": True, "exif": b"Exif\0\0" + bytes(9000)}),
        ("PNG", {}),
        ("WEBP", {}),
        ("WEBP", {"lossless": True}),
        ("WEBP", {"exif": b"Exif\0\0" + bytes(90)}),
    ],
)
def test_the_size_of_a_picture_is_read_from_its_header(form, options):
    data = packed(form, (321, 123), **options)
    assert size_of(data) == (321, 123)
    assert CompressedImageMsg(data).media_type == f"image/{form.lower()}"


@pytest.mark.parametrize("form", ["JPEG", "PNG", "WEBP"])
def test_a_small_file_with_too_many_pixels_is_refused_before_decoding(form):
    data = packed(form, (4001, 4000))
    assert len(data) < 1 << 20
    with pytest.raises(ProtocolError, match="4001 x 4000, 16000000 pixels at most"):
        _ = CompressedImageMsg(data).media_type


@pytest.mark.parametrize(
    "data",
    [
        b"\xff\xd8\xff",
        b"\xff\xd8\xff\xd9" + bytes(20),
        b"\xff\xd8\xff\xe0\x00\x04\0\0" + b"junk" + packed("JPEG", (9, 9))[2:],
        b"\xff\xd8" + b"\xff\xe0\x00\x02" * 2000 + packed("JPEG", (9, 9))[2:],
        b"\x89PNG\r\n\x1a\n" + bytes(30),
        packed("PNG", (9, 9))[:20],
        b"RIFF\0\0\0\0WEBPVP8 " + bytes(20),
        packed("WEBP", (9, 9))[:24],
    ],
)
def test_a_picture_without_a_size_in_its_header_is_refused(data):
    with pytest.raises(ProtocolError, match="without a size in its header"):
        _ = CompressedImageMsg(data).media_type


@pytest.mark.parametrize("view", [JpegImageMsg, JpegAnyImageMsg])
def test_the_camera_shows_the_digest_of_a_raw_picture(link, robot, view):
    raw = view(
        height=8, width=8, encoding="rgb8", step=24, data=bytes([9, 200, 9]) * 64
    )
    made = raw.digest()
    camera = robot.add_module(Camera, link, "/camera/image_raw")
    camera.watch(lambda: None)
    camera.on_picture(made)
    red, green, blue = shown(camera).getpixel((4, 4))
    assert max(red, blue) < 40 < 160 < green
    packed_one = JpegAnyImageMsg(data=a_jpeg())
    assert packed_one.digest() is packed_one
