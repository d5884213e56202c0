"""A lane to a bridge: its link is opened, checked, cut, handed over and reopened."""

import asyncio

from link_bench import (
    CLOSE,
    PONG,
    TEXT,
    frame,
    in_loop,
    noting_bridge,
    noting_lane,
    raw_bridge,
)

from equipment.waiting import until
from webmap.gate.lanes import lane as lanes
from webmap.gate.lanes import lane as waits
from webmap.gate.lanes.sockets import SocketHandlers


def advertise(topic):
    return f'{{"op": "advertise", "topic": "{topic}"}}'.encode()


def unadvertise(topic):
    return f'{{"op": "unadvertise", "topic": "{topic}"}}'.encode()


async def forever(link):
    while await link.reader.read(1 << 16):
        pass


@in_loop
async def test_held_topics_are_advertised_on_every_link_and_unadvertised_once():
    happened = []
    async with noting_bridge() as bridge:
        with noting_lane(bridge.url, happened) as lane:
            lane.hold("a", advertise("/a"), unadvertise("/a"))
            lane.hold("a", advertise("/a"), unadvertise("/a"))
            lane.hold("silent")
            await until(lambda: happened == ["up"], "the link")
            lane.hold("b", advertise("/b"))
            await until(lambda: len(bridge.received) == 2, "both topics")
            bridge.transport_of(1).abort()
            await until(lambda: happened == ["up", "down", "up"], "another link")
            await until(lambda: len(bridge.received) == 4, "both topics again")
            assert [t.topic for t in bridge.received] == ["/a", "/b", "/a", "/b"]
            lane.release_hold("a")
            lane.release_hold("b")
            lane.release_hold("silent")
            assert lane.wanted, "it was held twice"
            lane.release_hold("a")
            assert not lane.wanted
            await until(
                lambda: bridge.of("unadvertise", "/a"), "the unadvertise message"
            )
            assert len(bridge.received) == 5


@in_loop
async def test_a_velocity_is_dropped_while_earlier_data_waits_in_the_socket():
    happened = []

    async def talk(link):
        await link.accept()
        link.writer.transport.pause_reading()

    async with raw_bridge(talk) as url:
        with noting_lane(url, happened) as lane:
            assert not lane.write(b"early", only_if_clear=False), "there is no link"
            await until(lambda: happened == ["up"], "the link")
            assert lane.write(b"first", only_if_clear=True)
            while not lane._socket.unsent:
                lane.write(b"x" * (1 << 20), only_if_clear=False)
            assert not lane.write(b"a velocity", only_if_clear=True)
            assert lane.write(b"zero", only_if_clear=False)


@in_loop
async def test_a_link_without_ping_answers_is_cut_and_opened_again(monkeypatch, caplog):
    monkeypatch.setattr(lanes, "DEAD", 0.1)
    happened = []

    async def talk(link):
        await link.accept()
        await forever(link)

    async with raw_bridge(talk) as url:
        with noting_lane(url, happened) as lane:
            lane.ping_every(0.02)
            await until(lambda: happened[:3] == ["up", "down", "up"], "another link")
    assert "no answer for 0.1 s" in caplog.text


@in_loop
async def test_only_the_answer_to_an_own_ping_proves_that_the_link_is_alive():
    pings, pongs, go_on = [], [], asyncio.Event()
    unasked = [(0).to_bytes(8, "big"), (99).to_bytes(8, "big"), b"", b"nonsense, long"]

    async def talk(link):
        await link.accept()
        await until(lambda: pings, "a ping")
        for data in unasked:
            link.send(frame(PONG, data))
        link.send(frame(TEXT, b"said"))
        await go_on.wait()
        link.send(frame(PONG, (1).to_bytes(8, "big")) * 2)
        await forever(link)

    happened = []
    async with raw_bridge(talk) as url:
        notes = {"pinged": pings.append, "pong": pongs.append}
        with noting_lane(url, happened, **notes) as lane:
            lane.ping_every(60.0)
            await until(lambda: happened == ["up", b"said"], "all unrequested messages")
            assert (pings, pongs) == ([1], [])
            go_on.set()
            await until(lambda: pongs, "the answer")
            assert pongs == [1], "the second answer does not count"


@in_loop
async def test_a_shorter_ping_period_sends_a_ping_at_once():
    pings = []
    async with noting_bridge() as bridge:
        with noting_lane(bridge.url, [], pinged=pings.append) as lane:
            lane.ping_every(60.0)
            await until(lambda: pings == [1], "the first ping")
            lane.ping_every(0.01)
            await until(lambda: len(pings) >= 5, "more pings")
            await until(lambda: not lane._changed.is_set(), "a ping under way")
            lane.ping_every(30.0)
            assert not lane._changed.is_set(), "a longer period sends no ping now"


@in_loop
async def test_a_lane_that_is_cut_without_a_link_continues_to_reconnect(
    monkeypatch, caplog
):
    monkeypatch.setattr(waits, "FIRST_WAIT", 0.01)
    happened = []
    async with noting_bridge() as bridge:
        await bridge.stop()
        with noting_lane(bridge.url, happened) as lane:
            await until(lambda: "no connection" in caplog.text, "an attempt")
            lane.cut("no longer used")
            assert happened == []
            await bridge.start()
            await until(lambda: happened == ["up"], "the link")
            lane.cut("no longer used")
            assert happened == ["up", "down"]
            await until(lambda: happened == ["up", "down", "up"], "another")


@in_loop
async def test_each_reason_for_a_failed_connection_is_logged_once(monkeypatch, caplog):
    monkeypatch.setattr(waits, "FIRST_WAIT", 0.01)
    monkeypatch.setattr(waits, "LONGEST_WAIT", 0.01)
    attempts = []

    async def talk(link):
        attempts.append(link)
        await link.request()
        status = b"403 Forbidden" if len(attempts) < 4 else b"404 Not Found"
        link.send(b"HTTP/1.1 " + status + b"\r\nContent-Length: 0\r\n\r\n")

    async with raw_bridge(talk) as url:
        with noting_lane(url, []):
            await until(lambda: len(attempts) > 6, "seven attempts")
    complaints = [
        r.getMessage() for r in caplog.records if "no connection" in r.getMessage()
    ]
    assert ["HTTP 403" in text for text in complaints] == [True, False]


@in_loop
async def test_a_lane_waits_before_reconnecting_to_a_bridge_that_closes_at_once():
    times, happened = [], []

    async def talk(link):
        times.append(asyncio.get_running_loop().time())
        await link.accept(frame(CLOSE, b"\x03\xe9"))
        await forever(link)

    async with raw_bridge(talk) as url:
        with noting_lane(url, happened):
            await until(lambda: len(times) == 3, "three attempts")
    assert "up" not in happened
    assert times[2] - times[0] >= waits.FIRST_WAIT


@in_loop
async def test_a_stalled_socket_is_cut_before_the_lane_opens_a_new_socket():
    """Data that waits in the old socket would arrive beside data of the new socket."""
    links, happened = [], []

    async def talk(link):
        links.append(link)
        await link.accept()
        if len(links) > 1:
            await forever(link)
        link.writer.transport.pause_reading()
        await until(lambda: b"full" in happened, "a full link")
        link.send(frame(CLOSE, b"\x03\xe9"))

    async with raw_bridge(talk) as url:
        with noting_lane(url, happened) as lane:
            await until(lambda: happened == ["up"], "the link")
            first = lane._socket
            while not first.unsent:
                lane.write(b"x" * (1 << 20), only_if_clear=False)
            happened.append(b"full")
            lane.ping_every(0.01)
            await until(lambda: len(links) == 2, "another link")
            assert first.unsent == 0, "the waiting data was dropped"
            await until(lambda: happened[-1] == "up", "the report of the link")
            assert happened == ["up", b"full", "down", "up"]


@in_loop
async def test_a_socket_that_is_handed_over_stays_open_and_the_lane_reconnects():
    happened, texts = [], []
    async with noting_bridge() as bridge:
        with noting_lane(bridge.url, happened) as lane:
            await until(lambda: happened == ["up"], "the link")
            lane.write(b'{"op": "subscribe", "topic": "/t"}', only_if_clear=True)
            link = lane.spend(
                SocketHandlers(texts.append, lambda _: None, lambda _: None)
            )
            assert happened == ["up", "down"]
            await until(lambda: happened == ["up", "down", "up"], "another")
            await until(lambda: bridge.received, "the subscription")
            await bridge.publish("/t", {"data": 1})
            await until(lambda: texts, "the message on the first socket")
            assert link.is_open
            assert len(bridge.links) == 2
            link.close()
            await until(lambda: len(bridge.links) == 1, "its end")


@in_loop
async def test_a_closed_lane_stays_closed_with_or_without_a_link():
    happened = []
    async with noting_bridge() as bridge:
        with noting_lane(bridge.url, happened) as lane:
            lane.close()  # before it was open
            await until(lane._task.done, "its end")
            assert (happened, bridge.links) == ([], set())
        with noting_lane(bridge.url, happened) as lane:
            await until(lambda: happened == ["up"], "the link")
            lane.close()
            await until(lambda: not bridge.links, "its end")
            assert not lane.write(b"{}", only_if_clear=False)
            await until(lane._task.done, "the end of all attempts")
        assert (happened, bridge.links) == (["up"], set())
