"""The bytes of a WebSocket are cut into pieces, and links take turns."""

import asyncio
import itertools
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.ros.rosbridge.pieces import PIECE, Pieces
from webmap.ros.sockets.turns import Turn, turns


def frame(length):
    if length < 126:
        return bytes([0x81, length]) + b"x" * length
    if length < 1 << 16:
        return b"\x81\x7e" + length.to_bytes(2, "big") + b"x" * length
    return b"\x81\x7f" + length.to_bytes(8, "big") + b"x" * length


def cut(chunks):
    """Return the pieces of bytes that arrive in chunks."""
    pieces, waiting, cutting = [], bytearray(), Pieces()
    for chunk in chunks:
        waiting += chunk
        while length := cutting.next(waiting, handshake_done=True):
            pieces.append(bytes(waiting[:length]))
            del waiting[:length]
    assert not waiting
    return pieces


def test_each_frame_is_a_piece():
    frames = [frame(length) for length in (0, 1, 125, 126, 1000, 60_000)]
    assert cut([b"".join(frames)]) == frames


def test_a_long_frame_is_cut_and_the_next_frame_starts_a_new_piece():
    long = frame(200_000)
    pieces = cut([long + frame(0) * 3])
    assert b"".join(pieces[:-3]) == long
    assert all(len(piece) <= PIECE for piece in pieces)
    assert pieces[-3:] == [frame(0)] * 3


def test_the_head_of_a_frame_may_come_byte_by_byte():
    long = frame(1000)
    *heads, body = (long[:1], long[1:2], long[2:3], long[3:4], long[4:])
    assert b"".join(cut([*heads, body])) == long


@given(st.lists(st.sampled_from([0, 1, 125, 126, 127, 70_000]), max_size=5), st.data())
def test_no_piece_contains_the_ends_of_two_frames_for_any_chunk_sizes(lengths, data):
    stream = b"".join(map(frame, lengths))
    ends = {0}
    for length in lengths:
        ends.add(max(ends) + len(frame(length)))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    bounds = [0, *cuts, len(stream)]
    pieces = cut(stream[a:b] for a, b in itertools.pairwise(bounds))
    assert b"".join(pieces) == stream
    at = 0
    for piece in pieces:
        assert len([end for end in ends if at < end <= at + len(piece)]) <= 1
        at += len(piece)


def test_during_the_handshake_each_line_is_a_piece():
    cutting = Pieces()
    assert (
        cutting.next(bytearray(b"HTTP/1.1 101 OK\r\nX: y\r\n"), handshake_done=False)
        == 17
    )
    assert cutting.next(bytearray(b"no end"), handshake_done=False) == 6
    assert cutting.next(bytearray(), handshake_done=False) == 0


class Greedy:
    """A link that always has more to do."""

    def __init__(self, noted, name, times):
        self.noted, self.name, self.times = noted, name, times

    def take(self, turn):
        while not turn.is_over:
            pass
        self.noted.append(self.name)
        self.times -= 1
        return 0.0 if self.times else None


def test_links_take_turns_and_the_event_loop_runs_between_them():
    async def story():
        noted, others = [], []
        for name in "abc":
            taker = Greedy(noted, name, 20)
            turns().ask(taker)
            turns().ask(taker)
        while len(noted) < 60:
            others.append(len(noted))
            await asyncio.sleep(0)
        return noted, others

    noted, others = asyncio.run(story())
    assert "".join(noted) == "abc" * 20
    steps = [b - a for a, b in itertools.pairwise(others)]
    assert max(steps) <= 5, "the loop continues after a few turns"


def test_a_turn_asks_for_processor_time_only_when_it_may_be_over(monkeypatch):
    clock, used, asked = [100.0], [5.0], []

    def thread_time():
        asked.append(clock[0])
        return used[0]

    monkeypatch.setattr("webmap.ros.sockets.turns.time.monotonic", lambda: clock[0])
    monkeypatch.setattr("webmap.ros.sockets.turns.time.thread_time", thread_time)
    turn = Turn(5.0, 0.5)
    clock[0] = 100.4
    assert not turn.is_over
    assert asked == []
    clock[0], used[0] = 100.6, 5.25  # the thread was interrupted
    assert not turn.is_over
    assert asked == [100.6]
    clock[0] = 100.8
    assert not turn.is_over
    assert asked == [100.6]
    clock[0], used[0] = 100.9, 5.5
    assert turn.is_over


@pytest.mark.parametrize(("links", "times"), [(1, 1), (3, 3)])
def test_a_step_asks_for_processor_time_once_for_each_link(monkeypatch, links, times):
    asked = []

    class Brief:
        def take(self, turn):
            assert not any(turn.is_over for _ in range(100))

    def thread_time():
        asked.append(True)
        return 5.0

    async def story():
        monkeypatch.setattr("webmap.ros.sockets.turns.time.thread_time", thread_time)
        # On a busy machine the clock may show that the turn could be over.
        monkeypatch.setattr("webmap.ros.sockets.turns.time.monotonic", lambda: 100.0)
        for _ in range(links):
            turns().ask(Brief())
        await asyncio.sleep(0)
        await asyncio.sleep(0)

    asyncio.run(story())
    assert len(asked) == times


@pytest.mark.parametrize("longest", [0.001, 0.5])
def test_the_rest_after_a_step_is_as_long_as_the_step_but_at_most_the_longest(longest):
    async def story():
        begun, turns_taken, rests = time.thread_time(), [], []

        class Long:
            def take(self, turn):
                turns_taken.append(turn)
                if len(turns_taken) == 2:
                    return None
                while time.thread_time() < begun + 0.05:
                    pass
                return 0.0

        loop = asyncio.get_running_loop()
        call_later = loop.call_later

        def noted(delay, callback, *args, **options):
            if getattr(callback, "__name__", "") == "_step":
                rests.append(delay)
            return call_later(delay, callback, *args, **options)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(loop, "call_later", noted)
            turns().longest_rest = longest
            turns().ask(Long())
            while len(turns_taken) < 2:
                await asyncio.sleep(0.001)
        return rests

    (rest,) = asyncio.run(story())
    assert rest == longest if longest < 0.04 else 0.04 <= rest < longest


def test_a_link_that_asks_for_a_delay_gets_its_next_turn_after_the_delay():
    async def story():
        noted, ended = [], asyncio.Event()

        class Waiting:
            def take(self, turn):
                noted.append(asyncio.get_running_loop().time())
                if len(noted) == 2:
                    ended.set()
                    return None
                return 0.05

        turns().ask(Waiting())
        await ended.wait()
        return noted

    first, second = asyncio.run(story())
    assert second - first >= 0.05
