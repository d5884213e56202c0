"""A bridge that sends without end: how its socket is read, and when it is dropped."""

import asyncio
import itertools
import time

import pytest
from link_bench import (
    MORE,
    PING,
    PONG,
    TEXT,
    Received,
    frame,
    in_loop,
    noting_bridge,
    noting_lane,
    raw_bridge,
)

from equipment.waiting import until
from webmap.base.errors import BridgeClosed
from webmap.gate.lanes import budget, sockets
from webmap.gate.lanes import lane as waits
from webmap.gate.lanes.budget import Budget
from webmap.gate.lanes.sockets import open_socket

pytestmark = pytest.mark.slow

CHUNK = 1 << 18


def flood(piece, *, reads=True):
    """Return a bridge that repeats some bytes without end."""

    async def talk(link):
        await link.accept()
        reading = asyncio.create_task(link.reader.read()) if reads else None
        try:
            while True:
                link.send(piece * (CHUNK // len(piece)))
                await link.writer.drain()
                await asyncio.sleep(0)
        finally:
            if reading:
                reading.cancel()

    return talk


@pytest.fixture
def patient(monkeypatch):
    """Drop no link because of its rates, which a slow computer may reach first."""
    monkeypatch.setattr(budget, "PATIENCE", 60.0)
    monkeypatch.setattr(budget, "BEHIND", 60.0)


async def longest_wait(seconds):
    """Return how late the loop was for a timer of 5 ms in the worst case."""
    worst, end = 0.0, time.monotonic() + seconds
    while (begun := time.monotonic()) < end:
        await asyncio.sleep(0.005)
        worst = max(worst, time.monotonic() - begun - 0.005)
    return worst


FLOODS = {
    "tiny texts": frame(TEXT, b"{}"),
    "empty texts": frame(TEXT),
    "pings": frame(PING, b"x" * 125),
    "pongs": frame(PONG),
}


@pytest.mark.parametrize("name", FLOODS)
@in_loop
async def test_a_flood_is_read_within_the_budget_and_then_dropped(name):
    seen = Received()
    async with raw_bridge(flood(FLOODS[name])) as url:
        link = await open_socket(url, seen.handlers, Budget())
        begun = time.monotonic()
        await until(lambda: seen.lost, "the drop")
        assert link.flooded
        assert "the bridge sends too much" in seen.lost[0]
        taken = len(seen.texts) + len(seen.pongs)
        most = 4000 * (1 + time.monotonic() - begun) + 100
        assert taken <= most
        await until(lambda: link._transport.is_closing(), "its end")


@pytest.mark.serial
@in_loop
async def test_the_event_loop_responds_while_ten_links_are_flooded():
    from webmap.testing import Sentinel

    seen = Received()
    with Sentinel() as sentinel:
        async with raw_bridge(flood(FLOODS["tiny texts"])) as url:
            links = [await open_socket(url, seen.handlers, Budget()) for _ in range(10)]
            begun = time.monotonic()
            worst = await longest_wait(1.0)
            late = sentinel.worst(begun)
            for link in links:
                link.abort("enough")
    # The bridge runs in the same loop, which also takes some time.
    assert worst < 0.3 + late, (worst, late)


@pytest.mark.parametrize(
    "piece", [frame(MORE, b"x", final=False), frame(MORE, final=False)]
)
@in_loop
async def test_a_message_of_endless_frames_drops_the_link_with_a_reason(patient, piece):
    seen = Received()

    async def talk(link):
        await link.accept(frame(TEXT, b"x", final=False))
        while True:
            link.send(piece * 1000)
            await link.writer.drain()
            await asyncio.sleep(0)

    async with raw_bridge(talk) as url:
        link = await open_socket(url, seen.handlers, Budget())
        await until(lambda: seen.lost, "the drop")
    assert seen.lost == ["a message in more than 4096 frames"]
    assert (seen.texts, link.flooded) == ([], True)


@in_loop
async def test_a_bridge_that_does_not_read_pongs_is_not_read_further(patient):
    seen = Received()
    async with raw_bridge(flood(FLOODS["pings"], reads=False)) as url:
        link = await open_socket(url, seen.handlers, Budget())
        sock = link._transport.get_extra_info("socket")
        sock.setsockopt(sockets.socket.SOL_SOCKET, sockets.socket.SO_SNDBUF, 4096)
        await until(lambda: link._choked, "a full buffer")
        await asyncio.sleep(0.3)
        assert link.unsent < 2 * sockets.MAX_WAITING
        assert link.is_behind
        assert seen.lost == []
        link.abort("enough")


@in_loop
async def test_reading_resumes_when_writing_is_possible_again():
    seen, go_on = Received(), asyncio.Event()

    async def talk(link):
        await link.accept()
        await go_on.wait()
        link.send(frame(TEXT, b"meanwhile"))
        await link.reader.read()

    async with raw_bridge(talk) as url:
        link = await open_socket(url, seen.handlers, Budget())
        link.pause_writing()  # as asyncio does when its buffer is full
        go_on.set()
        await until(lambda: link.is_behind, "a message")
        await asyncio.sleep(0.05)
        assert seen.texts == []
        link.resume_writing()
        await until(lambda: seen.texts == [b"meanwhile"], "the message")
        link.close()


@in_loop
async def test_a_message_that_arrives_byte_by_byte_is_received():
    seen = Received()

    async def talk(link):
        answer = await link.request()
        for byte in answer + frame(TEXT, b"slowly" * 20):
            link.send(bytes([byte]))
            await link.writer.drain()
            await asyncio.sleep(0)
        await link.reader.read()

    async with raw_bridge(talk) as url:
        link = await open_socket(url, seen.handlers, Budget())
        await until(lambda: seen.texts == [b"slowly" * 20], "the message")
        link.close()


@pytest.mark.parametrize("header", [b"X: y\r\n", b"X"])
@in_loop
async def test_endless_headers_are_refused(header):
    async def talk(link):
        await link.request()
        link.send(b"HTTP/1.1 101 Switching Protocols\r\n")
        while True:
            link.send(header * 10_000)
            await link.writer.drain()
            await asyncio.sleep(0)

    async with raw_bridge(talk) as url:
        with pytest.raises(BridgeClosed, match="no WebSocket at this address"):
            await open_socket(url, Received().handlers, Budget())


@in_loop
async def test_messages_sent_before_the_end_of_the_link_are_received():
    seen = Received()

    async def talk(link):
        await link.accept(frame(TEXT, b"{}") * 2000)
        link.writer.close()

    async with raw_bridge(talk) as url:
        await open_socket(url, seen.handlers, Budget())
        await until(lambda: seen.lost, "the end")
    assert len(seen.texts) == 2000


@in_loop
async def test_a_link_over_its_budget_is_read_later():
    seen, waits_left = Received(), [0.01, 0.01]

    class Spent(Budget):
        def wait(self, now):
            return waits_left.pop() if waits_left else 0.0

    async def talk(link):
        await link.accept(frame(TEXT, b"{}"))
        await link.reader.read()

    async with raw_bridge(talk) as url:
        await open_socket(url, seen.handlers, Spent())
        await until(lambda: seen.texts, "the message")
    assert waits_left == []


@in_loop
async def test_an_exception_in_a_handler_drops_the_link_with_a_reason():
    seen = Received()

    def fail(data):
        raise RecursionError("maximum recursion depth exceeded")

    handlers = seen.handlers
    handlers.text = fail

    async def talk(link):
        await link.accept(frame(TEXT, b"{}"))
        await link.reader.read()

    async with raw_bridge(talk) as url:
        link = await open_socket(url, handlers, Budget())
        await until(lambda: seen.lost, "the drop")
    assert link.flooded
    assert seen.lost == [
        "invalid data from the bridge: "
        "RecursionError('maximum recursion depth exceeded')"
    ]


@in_loop
async def test_a_flooded_lane_reconnects_after_growing_waits(monkeypatch, caplog):
    monkeypatch.setattr(waits, "FIRST_FLOOD_WAIT", 0.02)
    happened, opened = [], []
    endless = frame(MORE, final=False) * 5000

    async def talk(link):
        opened.append(time.monotonic())
        await link.accept(frame(TEXT, final=False) + endless)
        await link.reader.read()

    async with raw_bridge(talk) as url:
        with noting_lane(url, happened):
            await until(lambda: len(opened) == 6, "six attempts")
    waited = [b - a for a, b in itertools.pairwise(opened)]
    # The first wait is at most 0.02 s, and the fifth at least 0.16 s. A busy computer
    # may notice the previous attempt late.
    assert waited[4] > 0.05
    assert caplog.text.count("a message in more than 4096 frames") >= 1


@in_loop
async def test_a_lane_that_is_cut_while_behind_counts_as_flooded(caplog):
    happened = []
    async with raw_bridge(flood(FLOODS["tiny texts"])) as url:
        with noting_lane(url, happened) as lane:
            await until(lambda: happened[-1:] == [b"{}"], "the flood")
            link = await until(lambda: lane._socket, "the link")
            await until(lambda: link.is_behind, "data that was not processed")
            lane.cut("no longer used")
            assert link.flooded
            await until(lambda: "more than WebMap can process" in caplog.text, "a line")


@in_loop
async def test_zero_is_written_to_a_flooding_link_while_the_link_is_open():
    """The gate stops reading from the link, but still writes to it."""
    seen, received = Received(), []

    async def talk(link):
        await link.accept()

        async def note():
            while data := await link.reader.read(1 << 16):
                received.append(data)

        noting = asyncio.create_task(note())
        try:
            while True:
                link.send(FLOODS["tiny texts"] * 10_000)
                await link.writer.drain()
                await asyncio.sleep(0)
        finally:
            noting.cancel()

    async with raw_bridge(talk) as url:
        link = await open_socket(url, seen.handlers, Budget())
        await until(lambda: link.is_behind, "data that is not read")
        received.clear()
        assert link.send(b"zero")
        await until(lambda: received, "the zero")
        link.abort("enough")


@in_loop
async def test_a_link_beside_a_flooding_link_is_served_at_once():
    flooded, seen = Received(), Received()
    async with raw_bridge(flood(FLOODS["tiny texts"])) as url, noting_bridge() as good:
        bad = await open_socket(url, flooded.handlers, Budget())
        link = await open_socket(good.url, seen.handlers, Budget())
        waited = []
        for number in range(20):
            begun = time.monotonic()
            link.ping(number.to_bytes(8, "big"))
            await until(lambda: len(seen.pongs) == number + 1, "the pong")  # noqa: B023
            waited.append(time.monotonic() - begun)
        assert sorted(waited)[10] < 0.1, waited
        bad.abort("enough")
        link.close()
