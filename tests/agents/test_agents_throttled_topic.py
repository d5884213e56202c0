"""Messages of a topic for a display, while other displays need them more often."""

import asyncio
import time

import pytest

from webmap.agents import data_messages
from webmap.agents.link import AgentConnection, ThrottledTopic
from webmap.ros.rosbridge import ops


class Clock:
    """An event loop with a clock that the test advances."""

    def __init__(self, monkeypatch):
        self.now = 100.0
        self.timers = []
        self.calls = 0
        monkeypatch.setattr(time, "monotonic", lambda: self.now)

    def is_closed(self):
        return False

    def call_soon_threadsafe(self, fn, *args):
        self.calls += 1
        fn(*args)

    def call_later(self, after, fn):
        loop = asyncio.new_event_loop()
        loop.close()
        handle = asyncio.TimerHandle(self.now + after, fn, (), loop)
        self.timers.append((self.now + after, fn, handle))
        return handle

    def advance(self, seconds):
        self.now += seconds
        due = [each for each in self.timers if each[0] <= self.now]
        self.timers = [each for each in self.timers if each[0] > self.now]
        for _, fn, handle in due:
            if not handle.cancelled():
                fn()


@pytest.fixture
def clock(monkeypatch):
    return Clock(monkeypatch)


def test_what_is_needed_often_is_passed_on_at_once(clock):
    taken = []
    heard = ThrottledTopic(taken.append, clock)
    heard.subscribe("1", 100)
    for piece in (b"a", b"b", b"c"):
        heard.arrived("key", piece)
    assert taken == [b"a", b"b", b"c"]


def test_of_what_is_needed_rarely_only_the_newest_piece_is_read(clock):
    taken = []
    heard = ThrottledTopic(taken.append, clock)
    heard.subscribe("1", 5000)
    for number in range(150):
        heard.arrived("key", b"%d" % number)
        clock.advance(0.0625)
    assert taken == [b"0", b"80"]  # at once, and after five seconds
    assert clock.calls < 10  # the model's thread is rarely called
    clock.advance(5.0)
    assert taken[-1] == b"149"  # the last piece is passed on too
    clock.advance(60.0)
    assert len(taken) == 3


def test_what_waits_comes_at_once_when_it_is_needed_more_often(clock):
    taken = []
    heard = ThrottledTopic(taken.append, clock)
    heard.subscribe("1", 5000)
    heard.arrived("key", b"a")
    clock.advance(0.0)
    heard.arrived("key", b"b")
    assert taken == [b"a"]
    heard.subscribe("2", 100)
    assert taken == [b"a", b"b"]
    heard.unsubscribe("1")
    heard.arrived("key", b"c")
    assert taken == [b"a", b"b", b"c"]
    clock.advance(60.0)
    assert len(taken) == 3


def test_what_waits_is_dropped_with_the_subscription(clock):
    taken = []
    heard = ThrottledTopic(taken.append, clock)
    heard.subscribe("1", 5000)
    heard.arrived("key", b"a")
    clock.advance(0.0)
    heard.arrived("key", b"b")
    heard.forget()
    clock.advance(60.0)
    assert taken == [b"a"]


def test_nothing_is_passed_to_a_loop_that_has_ended(clock):
    taken = []
    heard = ThrottledTopic(taken.append, clock)
    clock.is_closed = lambda: True
    heard.subscribe("1", 100)
    heard.arrived("key", b"a")
    assert taken == []


class Peer:
    """A session that keeps the listeners and the sent data."""

    trouble = None

    def __init__(self):
        self.listeners = {}
        self.sent = []

    def listen(self, key, fn):
        self.listeners[len(self.sent) + 1] = (key, fn)
        return len(self.sent) + 1

    def unlisten(self, number):
        del self.listeners[number]

    def put_data(self, key, piece, *, all):
        self.sent.append(piece)


def test_a_connection_listens_to_a_topic_until_its_last_subscription_ends(clock):
    taken = []
    lane = AgentConnection(
        "zenoh://router/bay3",
        opened=print,
        received=taken.append,
        closed=print,
        failed=print,
    )
    lane._peer, lane._loop, lane._key_in, lane.state = Peer(), clock, "key", "open"
    lane._task = "runs"
    peer = lane._peer
    lane.send(ops.subscribe("/scan", id="1", throttle_rate=100))
    ((key, arrived),) = peer.listeners.values()
    lane.send(ops.subscribe("/scan", id="2", throttle_rate=5000))
    lane.send(ops.unsubscribe("/scan", id="1"))
    assert len(peer.listeners) == 1  # it remains for the second subscription
    arrived(key, data_messages.pack_frame(b"{}"))
    clock.advance(0.0)
    arrived(key, data_messages.pack_frame(b"[]"))
    assert taken == [b"{}"]
    lane.send(ops.unsubscribe("/other", id="9"))
    lane.send(ops.unsubscribe("/scan", id="2"))
    assert peer.listeners == {}
    clock.advance(60.0)
    assert taken == [b"{}"]
    assert len(peer.sent) == 5  # the agent gets each operation


def test_a_new_agent_is_noticed_though_a_ping_to_the_old_one_has_no_answer(
    clock, monkeypatch
):
    class Restarted(Peer):
        def put_data(self, key, piece, *, all):
            if not 101.0 < clock.now < 103.0:
                session = "old" if clock.now < 102.0 else "new"
                number = data_messages.unpack(piece).number
                lane._take(data_messages.pack_note(data_messages.Pong(number, session)))

    async def sleep(seconds):
        clock.now += seconds
        lane._take(data_messages.pack_frame(b"{}"))  # of what another display shows

    lane = AgentConnection(
        "zenoh://router/bay3",
        opened=lambda: None,
        received=lambda frame: None,
        closed=print,
        failed=print,
    )
    lane._peer, lane._loop, lane._key_in = Restarted(), clock, "in"
    lane._session = "old"
    monkeypatch.setattr(asyncio, "sleep", sleep)
    assert asyncio.run(lane._keep_open()) == "the agent has connected again"
    assert clock.now <= 104.0
