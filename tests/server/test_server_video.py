"""Videos: what a viewer gets who comes in the middle, is late, or has no rights."""

import asyncio
import contextlib
import struct
import threading
import time

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from equipment.server_fakes import (
    TOKEN,
    FakeGate,
    FakeModel,
    FakePage,
    FakeSite,
    running,
)
from equipment.waiting import wait_for
from webmap.core import pictures
from webmap.core.pictures import VideoStream, Viewing, videos
from webmap.server.access import Settings
from webmap.server.app import WebApp
from webmap.server.outbox import LATE_S, VideoQueue
from webmap.server.page_socket import BROKEN_RULE

CONFIG = ("avc1.42c01f", 640, 480)


def key_of(message):
    return message[0] == 1


def body(message):
    """Return the packet in a message, and check what is before it."""
    key, stamp = struct.unpack_from("<Bd", message)
    assert stamp == 5.5
    if not key:
        return message[9:]
    width, height, length = struct.unpack_from("<IIB", message, 9)
    assert (message[18 : 18 + length].decode(), width, height) == CONFIG
    return message[18 + length :]


class Viewer:
    def __init__(self, stream):
        self.got, self.ended = [], 0
        self.leaving = stream.join(Viewing(self.got.append, self._end))

    def _end(self):
        self.ended += 1

    @property
    def packets(self):
        return [body(each) for each in self.got if isinstance(each, bytes)]


def show(stream, *packets):
    """Show packets; those that begin with K are key pictures."""
    for each in packets:
        stream.show(each, CONFIG if each.startswith(b"K") else None, 5.5)


@pytest.fixture
def stream():
    stream = videos.open()
    yield stream
    stream.end()


def test_a_viewer_in_the_middle_gets_the_packets_since_the_last_key_picture(stream):
    first = Viewer(stream)
    show(stream, b"K1", b"a", b"K2", b"b", b"c")
    second = Viewer(stream)
    show(stream, b"d")
    assert first.packets == [b"K1", b"a", b"K2", b"b", b"c", b"d"]
    assert second.packets == [b"K2", b"b", b"c", b"d"]
    second.leaving.remove()
    show(stream, b"e")
    assert second.packets[-1] == b"d"


def test_the_kept_packets_are_limited_in_number_and_size(stream, monkeypatch):
    monkeypatch.setattr(pictures, "MOST_PACKETS", 10)
    show(stream, b"K1", *[b"x"] * 50)
    late = Viewer(stream)
    assert late.packets == []
    show(stream, b"y", b"K2")
    assert Viewer(stream).packets == [b"K2"]
    monkeypatch.setattr(pictures, "MOST_PACKET_BYTES", 1000)
    show(stream, b"K3", bytes(990))
    assert Viewer(stream).packets == []
    assert late.packets == [b"y", b"K2", b"K3", bytes(990)]


def test_after_a_lost_packet_a_new_viewer_waits_for_the_next_key_picture(stream):
    show(stream, b"K1", b"a")
    stream.lose()
    show(stream, b"b")
    assert Viewer(stream).packets == []


def test_a_note_reaches_all_viewers_once_and_new_ones_too(stream):
    first = Viewer(stream)
    for _ in range(3):
        stream.tell("it is late")
    assert first.got == ["", "it is late"]
    assert Viewer(stream).got == ["it is late"]
    stream.tell("")
    assert first.got == ["", "it is late", ""]


def test_the_end_of_a_video_is_told_to_its_viewers_and_later_ones(stream):
    first = Viewer(stream)
    stream.end()
    stream.end()
    assert first.ended == 1
    assert Viewer(stream).ended == 1
    assert videos.get(stream.url.rpartition("/")[2]) is None


def test_two_threads_that_show_and_join_leave_no_gap(stream):
    viewers, done = [], threading.Event()

    def joins():
        while not done.is_set():
            viewers.append(Viewer(stream))
            time.sleep(0.001)

    thread = threading.Thread(target=joins)
    thread.start()
    number = -1
    while len(viewers) < 20 or number % 20:
        number += 1
        letter = b"K" if number % 20 == 0 else b"p"
        show(stream, letter + b"%d" % number)
    done.set()
    thread.join()
    show(stream, b"p%d" % (number + 1))
    for viewer in viewers:
        numbers = [int(each[1:]) for each in viewer.packets]
        assert numbers == list(range(numbers[0], number + 2))
        assert viewer.packets[0].startswith(b"K")


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def queue(clock):
    return VideoQueue(clock)


def put(queue, *names):
    """Add pictures; those in capitals are key pictures."""
    for name in names:
        assert queue.put((b"\1" if name.isupper() else b"\0") + name.encode())


def popped(queue):
    found = []
    while (item := queue.pop()) is not None:
        found.append(item if isinstance(item, str) else item[1:].decode())
    return found


def test_a_page_that_answers_gets_every_picture(queue, clock):
    for number, name in enumerate("KabcKde", 1):
        put(queue, name)
        assert popped(queue) == [name]
        clock.now += LATE_S - 0.01
        queue.answer(str(number))


def test_a_late_page_gets_nothing_until_it_answers_and_then_the_next_key_picture(
    queue, clock
):
    put(queue, "K", "a")
    assert popped(queue) == ["K", "a"]
    clock.now += LATE_S + 0.01
    put(queue, "b", "c")
    assert popped(queue) == []
    put(queue, "L", "d")
    assert popped(queue) == []
    queue.answer("2")
    assert popped(queue) == ["L", "d"]


def test_a_page_that_was_late_for_a_moment_gets_what_waited(queue, clock):
    put(queue, "K")
    assert popped(queue) == ["K"]
    clock.now += LATE_S + 0.01
    put(queue, "a", "b")
    queue.answer("1")
    assert popped(queue) == ["a", "b"]


def test_too_many_waiting_pictures_are_dropped_up_to_the_next_key_picture(queue):
    put(queue, "K", *["a"] * (pictures.MOST_PACKETS + 1))
    assert popped(queue) == []
    put(queue, "b")
    assert popped(queue) == []
    put(queue, "L", "c")
    assert popped(queue) == ["L", "c"]


def test_the_newest_note_comes_first_and_waits_for_no_answer(queue, clock):
    put(queue, "K")
    popped(queue)
    clock.now += 1
    put(queue, "a")
    assert queue.put("one")
    assert queue.put("two")
    assert popped(queue) == ["two"]


@pytest.mark.parametrize("text", ["", "x", "-1", "1e9", "9" * 30, "²", "99"])
def test_an_answer_that_is_no_number_or_too_high_is_harmless(queue, clock, text):
    put(queue, "K", "a")
    popped(queue)
    queue.answer(text)
    queue.answer("2")
    clock.now += 10
    put(queue, "b")
    assert popped(queue) == ["b"]


@pytest.fixture(scope="module")
def server():
    site = FakeSite(FakePage("/"))
    app = WebApp(site, FakeModel(), FakeGate(), Settings(token=TOKEN, max_pages=1))
    with running(app) as server:
        yield server


@pytest.fixture
def open_video(server):
    """Open the socket of a video as a browser does."""
    browser = server.sign_in()

    def opened(url, **options):
        return connect(
            server.socket_url(url.removeprefix("/_webmap/")),
            **{
                "origin": server.origin,
                "additional_headers": {"cookie": browser.cookie},
                "subprotocols": browser.protocols,
                "max_size": None,
            }
            | options,
        )

    return opened


def viewers(stream: VideoStream) -> int:
    return len(stream._viewers)


def test_a_video_reaches_a_browser_and_ends_with_a_reason(stream, open_video):
    async def scenario():
        show(stream, b"K1", b"a")
        async with open_video(stream.url) as socket:
            assert await socket.recv() == ""
            assert [body(await socket.recv()) for _ in range(2)] == [b"K1", b"a"]
            await socket.send("2")
            show(stream, b"b")
            assert body(await socket.recv()) == b"b"
            await asyncio.to_thread(stream.end)
            with contextlib.suppress(ConnectionClosed):
                await socket.recv()
            assert socket.close_code == BROKEN_RULE
            assert socket.close_reason == "this video has ended"

    asyncio.run(scenario())


def test_a_browser_that_does_not_answer_skips_to_a_key_picture(stream, open_video):
    async def scenario():
        show(stream, b"K1")
        async with open_video(stream.url) as socket:
            assert await socket.recv() == ""
            assert body(await socket.recv()) == b"K1"
            await asyncio.sleep(LATE_S + 0.1)
            show(stream, b"a", b"K2", b"b")
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.3):
                    await socket.recv()
            await socket.send("1")
            assert [body(await socket.recv()) for _ in range(2)] == [b"K2", b"b"]

    asyncio.run(scenario())


def test_a_viewer_that_leaves_is_forgotten(stream, open_video):
    async def scenario():
        async with open_video(stream.url) as socket:
            await socket.recv()
            assert viewers(stream) == 1

    asyncio.run(scenario())
    wait_for(lambda: viewers(stream) == 0)


def test_a_browser_that_sends_too_much_is_refused_and_nobody_else(stream, open_video):
    async def scenario():
        async with open_video(stream.url) as good, open_video(stream.url) as bad:
            assert (await good.recv(), await bad.recv()) == ("", "")
            await bad.send("1" * 1000)
            with contextlib.suppress(ConnectionClosed):
                await bad.recv()
            assert bad.close_code == BROKEN_RULE
            show(stream, b"K1")
            assert body(await good.recv()) == b"K1"

    asyncio.run(scenario())


def test_an_unknown_video_is_refused(open_video):
    async def scenario():
        async with open_video("/_webmap/video/0123") as socket:
            with contextlib.suppress(ConnectionClosed):
                await socket.recv()
            assert socket.close_reason == "this video has ended"

    asyncio.run(scenario())


@pytest.mark.parametrize("without", ["subprotocols", "origin"])
def test_a_video_needs_the_key_of_a_page_and_its_origin(stream, open_video, without):
    async def scenario():
        with pytest.raises(InvalidStatus):
            async with open_video(stream.url, **{without: None}):
                pass

    asyncio.run(scenario())
    assert viewers(stream) == 0


def test_the_number_of_open_videos_is_limited(stream, open_video):
    async def scenario():
        async with contextlib.AsyncExitStack() as opened:
            for _ in range(8):
                socket = await opened.enter_async_context(open_video(stream.url))
                await socket.recv()
            one_more = await opened.enter_async_context(open_video(stream.url))
            with contextlib.suppress(ConnectionClosed):
                await one_more.recv()
            assert one_more.close_reason == "too many open videos"

    asyncio.run(scenario())
