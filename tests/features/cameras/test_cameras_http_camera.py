"""HTTP cameras: one connection for all viewers, over real sockets."""

import asyncio
import io
import ssl
import threading
import time

import pytest
from PIL import Image

from equipment.camera_server import BOUNDARY, CameraServer, part
from equipment.waiting import until
from webmap import Robot
from webmap.base.errors import ConfigError
from webmap.base.lifecycle import Lifecycle
from webmap.base.scope import Scope, current_scope
from webmap.core.pictures import pictures
from webmap.features.cameras import camera as camera_module
from webmap.features.cameras.camera import HttpCamera
from webmap.ros import image_pull
from webmap.ros.backoff import Backoff
from webmap.ros.image_address import parse_address

STREAM = "/stream?topic=/camera/image_raw&type=mjpeg"


def run(scenario) -> None:
    """Run a scenario with a server and a robot."""

    async def whole():
        robot = Robot("Bob")
        camera_module.lifecycle.begin(asyncio.get_running_loop())
        try:
            async with CameraServer() as server:
                await scenario(server, robot)
                robot.destroy()
                await until(lambda: server.open == 0)
        finally:
            robot.destroy()
            await camera_module.lifecycle.end()

    asyncio.run(whole())


@pytest.fixture(autouse=True)
def own_process(monkeypatch):
    """Start only the objects that a test made."""
    monkeypatch.setattr(camera_module, "lifecycle", Lifecycle())


@pytest.fixture(autouse=True)
def quickly_again(monkeypatch):
    """Wait only a short time before the next attempt."""
    monkeypatch.setattr(Backoff, "next", lambda self, lasted=0.0: 0.02)


def shown(camera) -> Image.Image:
    published = pictures.get(camera.url.rpartition("/")[2])
    assert published.media_type == "image/jpeg"
    return Image.open(io.BytesIO(published.data))


def test_watchers_share_one_stream_that_closes_after_the_last_watcher():
    async def scenario(server, robot):
        camera = robot.add_module("HttpCamera", server.at(STREAM), throttle=0)
        assert not server.asked
        seen = []
        first = camera.watch(lambda: seen.append(camera.url))
        others = [camera.watch(lambda: None) for _ in range(20)]
        await until(lambda: len(set(seen)) > 3)
        assert shown(camera).size == (16, 12)
        assert (server.open, len(server.asked)) == (1, 1)
        assert server.asked[0].startswith(f"GET {STREAM} HTTP/1.0\r\n")
        first.remove()
        assert camera.watched
        for watching in others:
            watching.remove()
        await until(lambda: server.open == 0)
        assert camera.url is None

    run(scenario)


def test_pictures_continue_after_the_scope_of_the_first_watcher_closed():
    async def scenario(server, robot):
        camera = robot.add_module("HttpCamera", server.at(STREAM), throttle=0)
        first, scopes = Scope("first"), []
        with first.active():
            camera.watch(lambda: None)
            camera.watch(lambda: None).remove()
        assert len(first) == 1
        camera.watch(lambda: scopes.append(current_scope()))
        first.close()
        await until(lambda: len(scopes) > 2)
        assert set(scopes) == {None}

    run(scenario)


def test_a_watcher_added_before_the_start_gets_pictures_after_the_start(robot):
    async def scenario():
        async with CameraServer() as server:
            camera = HttpCamera(robot, server.at(STREAM), throttle=0)
            camera.watch(lambda: None)
            for _ in range(2):  # a process may end and start again
                camera_module.lifecycle.begin(asyncio.get_running_loop())
                await until(lambda last=camera.stamp: camera.stamp != last)
                await camera_module.lifecycle.end()
                await until(lambda: server.open == 0)
            camera.destroy()

    asyncio.run(scenario())


def test_a_single_picture_is_requested_again_at_the_throttle_rate():
    async def scenario(server, robot):
        camera = robot.add_module("HttpCamera", server.at("/snapshot"), throttle=50)
        seen = []
        began = time.monotonic()
        camera.watch(lambda: seen.append(shown(camera).size))
        await until(lambda: len(seen) >= 5)
        assert time.monotonic() - began >= 4 * 0.05 - 0.01
        assert len(server.asked) <= 6

    run(scenario)


def test_a_throttled_stream_shows_its_newest_pictures():
    async def scenario(server, robot):
        camera = robot.add_module("HttpCamera", server.at(STREAM), throttle=200)
        seen = []
        camera.watch(lambda: seen.append(shown(camera).getpixel((8, 6))[0]))
        await until(lambda: len(seen) >= 3 and server.pictures > 2 * len(seen))
        newest = server.pictures * 5
        assert newest - seen[-1] < 15 * 5

    run(scenario)


def test_the_last_picture_of_a_burst_is_shown():
    async def scenario(server, robot):
        server.frozen = True
        head = (
            f"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;"
            f"boundary={BOUNDARY}\r\n\r\n--{BOUNDARY}\r\n"
        )
        server.pictures = 1
        first = part(server.picture())
        server.pictures = 40
        server.scripts["/burst"] = (
            head.encode() + first + part(server.picture()),
            False,
        )
        camera = robot.add_module("HttpCamera", server.at("/burst"), throttle=100)
        camera.watch(lambda: None)
        await until(lambda: camera.url and shown(camera).getpixel((8, 6))[0] > 190)

    run(scenario)


@pytest.mark.parametrize(
    ("path", "answer", "expected"),
    [
        ("/a", b"HTTP/1.1 404 No\r\n\r\n", "answers 404"),
        ("/b", b"HTTP/1.1 302 No\r\nLocation: /stream\r\n\r\n", "not followed"),
        ("/c", b"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\nhi", "text/html"),
        ("/d", b"", "without an answer"),
        (
            "/e",
            b"HTTP/1.1 200 OK\r\nContent-Type: image/jpeg\r\n\r\n<svg onload=x>",
            "not JPEG, PNG or WebP",
        ),
    ],
)
def test_an_invalid_camera_answer_is_a_problem_until_pictures_arrive(
    path, answer, expected
):
    async def scenario(server, robot):
        server.scripts[path] = (answer, True)
        camera = robot.add_module("HttpCamera", server.at(path), "Front", throttle=20)
        camera.watch(lambda: None)
        await until(lambda: robot.problems)
        (text,) = robot.problems.values()
        assert text.startswith(f"Front at {server.at(path)}: ")
        assert expected in text
        # The redirect was not followed.
        assert {line.split()[1] for line in server.asked} == {path}
        del server.scripts[path]
        await until(lambda: camera.url is not None)
        assert not robot.problems

    run(scenario)


def test_a_closed_stream_is_opened_again():
    async def scenario(server, robot):
        head = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=b"
        server.scripts[STREAM] = (head + b"\r\n\r\n", True)
        camera = robot.add_module("HttpCamera", server.at(STREAM))
        camera.watch(lambda: None)
        await until(lambda: len(server.asked) >= 3)
        assert "it closed the connection" in next(iter(robot.problems.values()))
        del server.scripts[STREAM]
        await until(lambda: camera.url is not None)

    run(scenario)


def test_a_connection_without_pictures_times_out_and_is_retried():
    async def scenario(server, robot):
        server.scripts["/drip"] = (b"HTTP/1.1 200 OK\r\nContent-Type: ima", False)
        problems = []
        pull = image_pull.Pull(
            image_pull.Address("127.0.0.1", server.port, False, "/drip", "x"),
            0.0,
            lambda picture: None,
            problems.append,
            patience=0.1,
            backoff=Backoff(),
        )
        pull.start(asyncio.get_running_loop())
        await until(lambda: len(server.asked) >= 2)
        await pull.stop()
        assert problems[0] == "no picture came for 0.1 s"

    run(scenario)


def test_a_refused_connection_is_a_problem():
    async def scenario(server, robot):
        server._server.close()
        camera = robot.add_module("HttpCamera", server.at("/stream"))
        camera.watch(lambda: None)
        await until(lambda: robot.problems)
        assert "nothing listens there" in next(iter(robot.problems.values()))

    run(scenario)


@pytest.mark.parametrize("name", ["cam..local", ".local", f"{'c' * 64}.local"])
def test_an_invalid_host_name_is_a_problem_and_is_retried(robot, name):
    async def scenario():
        problems = []
        pull = image_pull.Pull(
            parse_address(f"http://{name}/stream"),
            0.0,
            lambda picture: None,
            problems.append,
        )
        pull.start(asyncio.get_running_loop())
        await until(lambda: len(problems) >= 2)
        await pull.stop()
        assert set(problems) == {"there is no such host"}

    asyncio.run(scenario())


def test_the_ssl_context_is_created_once_in_a_thread(monkeypatch):
    read_in = []
    create = ssl.create_default_context

    def reading():
        read_in.append(threading.current_thread())
        return create()

    monkeypatch.setattr(ssl, "create_default_context", reading)

    async def scenario(server, robot):
        problems = []
        address = parse_address(server.at("/snapshot").replace("http:", "https:"))
        pull = image_pull.Pull(address, 0.0, lambda picture: None, problems.append)
        pull.start(asyncio.get_running_loop())
        await until(lambda: len(problems) >= 3)
        await pull.stop()

    run(scenario)
    (thread,) = read_in
    assert thread is not threading.main_thread()


def test_a_new_watcher_restarts_a_camera_that_failed_to_start(monkeypatch):
    async def scenario(server, robot):
        camera = robot.add_module("HttpCamera", server.at(STREAM), throttle=0)

        def failing(*args):
            raise RuntimeError("not now")

        with monkeypatch.context() as patch:
            patch.setattr(camera_module, "Pull", failing)
            with pytest.raises(RuntimeError, match="not now"):
                camera.watch(lambda: None)
        assert not camera.watched
        camera.watch(lambda: None)
        await until(lambda: camera.url is not None)

    run(scenario)


def test_a_server_without_tls_is_a_problem():
    async def scenario(server, robot):
        address = server.at("/").replace("http:", "https:")
        camera = robot.add_module("HttpCamera", address)
        camera.watch(lambda: None)
        await until(lambda: robot.problems)
        assert "does not speak TLS" in next(iter(robot.problems.values()))

    run(scenario)


@pytest.mark.parametrize("throttle", [-1, 0.5, "100", None])
def test_an_invalid_throttle_is_refused(robot, throttle):
    with pytest.raises(ConfigError, match="milliseconds"):
        HttpCamera(robot, "http://cam/", throttle=throttle)


def test_an_rtsp_address_is_refused(robot):
    with pytest.raises(ConfigError, match="begins with http"):
        robot.add_module("HttpCamera", "rtsp://cam/")
