"""The simulator's cameras over HTTP, at web_video_server's addresses."""

import asyncio
import contextlib
import io
import re
import signal
import socket
import subprocess
import sys

import pytest
from PIL import Image
from simulated import Bench
from websockets.sync.client import connect

from equipment.waiting import until
from webmap import Robot
from webmap.base.errors import ConfigError
from webmap.base.lifecycle import Lifecycle
from webmap.core.pictures import pictures
from webmap.features.cameras import camera as camera_module
from webmap.ros.image_pull import HttpResponseParser
from webmap.sim import run_simulator, web_video
from webmap.sim.web_video import (
    HttpError,
    NoPicture,
    PictureFormat,
    PictureRequest,
    WebVideoServer,
    read_request,
)

TOPIC = "/robot_0/camera/image_raw"
STREAM = f"/stream?topic={TOPIC}&type=mjpeg"


def asked(target):
    return read_request(f"GET {target} HTTP/1.1\r\nHost: x\r\n\r\n".encode())


@pytest.mark.parametrize(
    ("target", "request_"),
    [
        ("/", PictureRequest("list")),
        (STREAM, PictureRequest("stream", TOPIC)),
        (f"/stream?topic={TOPIC}", PictureRequest("stream", TOPIC)),
        (
            f"/stream?topic={TOPIC}&width=-1&qos_profile=sensor",
            PictureRequest("stream", TOPIC),
        ),
        (f"/stream?topic={TOPIC[1:]}&topic=/b", PictureRequest("stream", TOPIC)),
        (
            f"/snapshot?topic={TOPIC.replace('/', '%2F')}",
            PictureRequest("snapshot", TOPIC),
        ),
        (
            f"/snapshot?topic={TOPIC}&quality=7&width=64&height=48&invert",
            PictureRequest("snapshot", TOPIC, PictureFormat(7, 64, 48, inverted=True)),
        ),
        (
            f"/stream?topic={TOPIC}&type=ros_compressed&quality=7",
            PictureRequest("stream", TOPIC),
        ),
    ],
)
def test_the_addresses_of_web_video_server_are_accepted(target, request_):
    assert asked(target) == request_


@pytest.mark.parametrize(
    ("target", "status", "expected"),
    [
        ("/stream", 400, "the topic of the camera is missing, as in /stream?topic="),
        ("/snapshot?topic=/", 400, "the topic of the camera is missing"),
        (
            f"{STREAM[:-5]}vp8",
            400,
            "type must be mjpeg or ros_compressed here, got 'vp8'",
        ),
        (f"{STREAM}&quality=101", 400, "quality must be a whole number from 1 to 100"),
        (f"{STREAM}&quality=", 400, "from 1 to 100, got ''"),
        (f"{STREAM}&width=0", 400, "width must be a whole number from 1 to 4096"),
        (f"{STREAM}&height=99999999999", 400, "height must be a whole number"),
        (f"{STREAM}&height=²", 400, "height must be a whole number"),
        (f"{STREAM}{'&a=b' * 40}", 400, "not an address with parameters"),
        ("http://[", 400, "not an address with parameters"),
        ("/stream_viewer", 404, "there is nothing at '/stream_viewer'; there are /"),
        ("/../etc/passwd", 404, "there is nothing at"),
    ],
)
def test_an_invalid_request_target_is_refused_with_a_reason(target, status, expected):
    with pytest.raises(HttpError) as refused:
        asked(target)
    assert refused.value.status == status
    assert expected in str(refused.value)
    assert len(str(refused.value)) < 250


@pytest.mark.parametrize(
    ("head", "status"),
    [
        (b"\x16\x03\x01\r\n\r\n", 400),
        (b"GET /\r\n\r\n", 400),
        (b"GET / HTTP/2\r\n\r\n", 400),
        (b"POST / HTTP/1.1\r\n\r\n", 405),
    ],
)
def test_a_malformed_or_non_get_request_is_refused(head, status):
    with pytest.raises(HttpError) as refused:
        read_request(head)
    assert refused.value.status == status
    assert str(refused.value).isprintable()


def a_picture(size=(32, 20), colour=(200, 30, 30)):
    """A JPEG that is blue in its lower half."""
    image = Image.new("RGB", size, colour)
    image.paste((0, 0, 255), (0, size[1] // 2, *size))
    file = io.BytesIO()
    image.save(file, "JPEG", quality=90)
    return file.getvalue()


def opened(jpeg):
    image = Image.open(io.BytesIO(jpeg))
    assert image.format == "JPEG"
    return image


def test_a_picture_gets_the_requested_size_quality_and_orientation():
    shown = opened(PictureFormat(width=64, height=10, inverted=True).apply(a_picture()))
    assert shown.size == (64, 10)
    red, _, blue = shown.getpixel((5, 1))
    assert blue > 200 > 50 > red
    assert opened(PictureFormat(width=64).apply(a_picture())).size == (64, 20)
    least, most = (len(PictureFormat(quality=q).apply(a_picture())) for q in (1, 100))
    assert least < most


@pytest.mark.parametrize(
    "data", [b"\xff\xd8\xff", a_picture()[:200], b"", a_picture((5000, 8))]
)
def test_unreadable_or_too_large_image_data_is_refused(data):
    with pytest.raises(NoPicture):
        PictureFormat(quality=50).apply(data)


class Served:
    """A server with a graph whose cameras send the pictures of the test."""

    def __init__(self):
        self.bench = Bench(robots=1)
        self.graph = self.bench.graph
        self.server = WebVideoServer(self.graph)

    @property
    def watchers(self):
        return len(self.graph.topics[f"{TOPIC}/compressed"].subscribers)

    def send(self, data):
        header = self.bench.node.messages.dialect.header("", 12.5, "camera")
        message = {"header": header, "format": "jpeg", "data": data}
        self.bench.node.publish(f"{TOPIC}/compressed", message)

    async def connect(self, target, sock=None):
        if sock is None:
            sock = socket.create_connection(("127.0.0.1", self.port))
        reader, writer = await asyncio.open_connection(sock=sock)
        writer.write(f"GET {target} HTTP/1.1\r\nHost: x\r\n\r\n".encode())
        return reader, writer

    async def answer(self, target):
        reader, writer = await self.connect(target)
        async with asyncio.timeout(10):
            data = await reader.read()
        writer.close()
        head, _, body = data.partition(b"\r\n\r\n")
        return head.decode(), body


def serving(scenario):
    async def whole():
        served = Served()
        url = await served.server.start("127.0.0.1", 0)
        served.port = int(url.rpartition(":")[2])
        try:
            await scenario(served)
        finally:
            await served.server.stop()
        assert served.watchers == 0
        assert not served.server._clients

    asyncio.run(whole())


def test_the_display_parser_reads_a_stream_and_the_server_notices_the_end():
    async def scenario(served):
        reader, writer = await served.connect(STREAM)
        answer, seen = HttpResponseParser(), []
        for picture in (a_picture(), a_picture(colour=(0, 255, 0))):
            await until(lambda: served.watchers == 1)
            served.send(picture)
            while not (found := answer.feed(await reader.read(1 << 16))):
                pass
            seen += found
            assert seen[-1] == picture
        assert answer.streams
        # The end is noticed without a further picture.
        writer.close()
        await until(lambda: served.watchers == 0)

    serving(scenario)


def test_a_snapshot_is_the_next_picture_with_its_stamp():
    async def scenario(served):
        asks = asyncio.create_task(served.answer(f"/snapshot?topic={TOPIC}"))
        await until(lambda: served.watchers == 1)
        served.bench.time = 12.5
        served.send(a_picture())
        head, body = await asks
        assert head.startswith("HTTP/1.0 200 OK\r\n")
        assert "\r\nContent-type: image/jpeg\r\n" in head
        assert head.endswith("\r\nX-Timestamp: 12.500000")
        assert body == a_picture()

    serving(scenario)


def test_invalid_pictures_of_a_camera_are_skipped(caplog):
    async def scenario(served):
        target = f"/snapshot?topic={TOPIC}&width=64"
        asks = asyncio.create_task(served.answer(target))
        await until(lambda: served.watchers == 1)
        served.send(b"\x89PNG")
        served.send(b"\xff\xd8\xff and no more")
        await until(lambda: "a picture is skipped" in caplog.text)
        served.send(a_picture())
        assert opened((await asks)[1]).size == (64, 20)
        assert "a picture that is not JPEG is skipped" in caplog.text

    serving(scenario)


def test_a_slow_reader_gets_the_newest_picture_and_few_old_pictures():
    size, count = 20_000, 500

    async def scenario(served):
        slow = socket.socket()
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.connect(("127.0.0.1", served.port))
        # A stream reader pauses after its limit of bytes.
        reader, writer = await asyncio.open_connection(sock=slow, limit=4096)
        writer.write(f"GET {STREAM} HTTP/1.0\r\n\r\n".encode())
        await until(lambda: served.watchers == 1)
        for number in range(count):
            served.send(b"\xff\xd8\xff" + number.to_bytes(2) + bytes(size))
            await asyncio.sleep(0)
        answer, numbers = HttpResponseParser(), []
        async with asyncio.timeout(10):
            while not numbers or numbers[-1] != count - 1:
                found = answer.feed(await reader.read(1 << 16))
                numbers += [int.from_bytes(picture[3:5]) for picture in found]
        assert len(numbers) < 20
        writer.close()

    serving(scenario)


def test_a_reader_that_reads_nothing_is_disconnected(monkeypatch):
    async def scenario(served):
        stuck = socket.socket()
        stuck.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        stuck.connect(("127.0.0.1", served.port))
        stuck.sendall(f"GET {STREAM} HTTP/1.0\r\n\r\n".encode())
        await until(lambda: served.watchers == 1)
        monkeypatch.setattr(web_video, "PATIENCE", 0.05)
        served.send(b"\xff\xd8\xff" + bytes(1 << 20))
        await until(lambda: served.watchers == 0)
        stuck.close()

    serving(scenario)


@pytest.mark.parametrize(
    ("sent", "status", "expected"),
    [
        (b"GET /stream HTTP/1.1\r\n\r\n", 400, "the topic of the camera is missing"),
        (b"PUT / HTTP/1.1\r\n\r\n", 405, "use GET for pictures, got 'PUT'"),
        (b"GET /" + b"x" * 100_000, 431, "at most 8192 bytes"),
        (b"GET / HTTP/1.1\r\n", 408, "no complete request came within 0.1 s"),
        (
            b"GET /stream?topic=/robot_7/camera/image_raw HTTP/1.0\r\n\r\n",
            404,
            f"no camera on '/robot_7/camera/image_raw'; there are: {TOPIC}",
        ),
        (
            f"GET /snapshot?topic={TOPIC} HTTP/1.0\r\n\r\n".encode(),
            503,
            f"no picture came on {TOPIC} for 0.1 s",
        ),
    ],
)
def test_a_refusal_is_sent_to_the_client(monkeypatch, sent, status, expected):
    if "0.1 s" in expected:  # the others must be in time on a busy machine, too
        monkeypatch.setattr(web_video, "PATIENCE", 0.1)

    async def scenario(served):
        reader, writer = await asyncio.open_connection("127.0.0.1", served.port)
        writer.write(sent)
        async with asyncio.timeout(10):
            answer = (await reader.read()).decode()
        assert answer.startswith(f"HTTP/1.0 {status} ")
        assert expected in answer.partition("\r\n\r\n")[2]
        writer.close()

    serving(scenario)


def test_a_client_above_the_connection_limit_is_refused(monkeypatch):
    monkeypatch.setattr(web_video, "MOST_CONNECTIONS", 2)

    async def scenario(served):
        writers = [(await served.connect(STREAM))[1] for _ in range(2)]
        await until(lambda: served.watchers == 2)
        head, body = await served.answer("/")
        assert head.startswith("HTTP/1.0 503 ")
        assert b"2 clients are connected" in body
        writers[0].close()
        await until(lambda: served.watchers == 1)
        assert (await served.answer("/"))[0].startswith("HTTP/1.0 200 ")
        writers[1].close()

    serving(scenario)


def test_the_camera_list_links_every_camera_and_escapes_html():
    async def scenario(served):
        odd = "/<b>'&"
        served.graph.advertise("x", f"{odd}/compressed", "sensor_msgs/CompressedImage")
        head, body = await served.answer("/")
        assert "text/html" in head
        assert f"<a href='{STREAM.replace('&', '&amp;')}'>".encode() in body
        assert b"/&lt;b&gt;&#x27;&amp;" in body
        assert odd.encode() not in body

    serving(scenario)


def test_a_client_that_disconnects_at_once_leaves_no_connection():
    async def scenario(served):
        for sent in (b"", b"GET / HT", f"GET {STREAM} HTTP/1.0\r\n\r\n".encode()):
            with socket.create_connection(("127.0.0.1", served.port)) as client:
                client.sendall(sent)
        await until(lambda: not served.server._clients)

    serving(scenario)


@contextlib.contextmanager
def simulator():
    """Run ``webmap sim``; yield the addresses of its rosbridge and its camera."""
    command = [sys.executable, "-m", "webmap", "sim", "--port", "0", "--robots", "1"]
    with subprocess.Popen(
        [*command, "--http-camera", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            ready = process.stdout.readline()
            bridge = re.fullmatch(r"rosbridge is ready at (ws://\S+)\n", ready)
            camera = re.search(r"cameras are at (\S+)", process.stderr.readline())
            assert bridge
            assert camera
            yield bridge[1], camera[1]
        finally:
            process.send_signal(signal.SIGTERM)
            out, err = process.communicate(timeout=20)
    assert (process.returncode, out) == (0, "")
    assert "Traceback" not in err


def test_the_display_shows_the_picture_of_a_simulated_camera(monkeypatch):
    monkeypatch.setattr(camera_module, "lifecycle", Lifecycle())

    def shown(camera):
        published = pictures.get(camera.url.rpartition("/")[2])
        return opened(published.data)

    def turn(bridge):
        with connect(bridge) as client:
            client.send(
                '{"op": "publish", "topic": "/robot_0/cmd_vel", '
                '"msg": {"angular": {"z": 2.0}}}'
            )

    async def scenario(bridge, stream):
        robot = Robot("Bob")
        camera_module.lifecycle.begin(asyncio.get_running_loop())
        snapshot = stream.replace("/stream", "/snapshot") + "&width=64"
        cameras = [
            robot.add_module("HttpCamera", address, throttle=0)
            for address in (stream, snapshot)
        ]
        try:
            for camera, size in zip(cameras, [(320, 200), (64, 200)], strict=True):
                camera.watch(lambda: None)
                await until(lambda camera=camera: camera.url)
                assert shown(camera).size == size
            before = shown(cameras[0]).tobytes()
            await asyncio.to_thread(turn, bridge)
            await until(lambda: shown(cameras[0]).tobytes() != before)
            assert not robot.problems
        finally:
            robot.destroy()
            await camera_module.lifecycle.end()

    with simulator() as (bridge, stream):
        assert stream.endswith(STREAM)
        asyncio.run(scenario(bridge, stream))


def test_a_camera_port_in_use_is_an_error():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = listener.getsockname()[1]
        with pytest.raises(ConfigError, match=f"{port}.*in use"):
            asyncio.run(run_simulator(http_camera=port))
