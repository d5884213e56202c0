"""How the bytes of a WebSocket are cut, and how links take turns."""

import asyncio
import itertools
import time

from hypothesis import given
from hypothesis import strategies as st

from webmap.ros.limits import MAX_FRAME
from webmap.ros.rosbridge.pieces import KEPT, PIECE, SHORTENED, Pieces
from webmap.ros.rosbridge.turns import turns


def frame(length):
    if length < 126:
        return bytes([0x81, length]) + b"x" * length
    if length < 1 << 16:
        return b"\x81\x7e" + length.to_bytes(2, "big") + b"x" * length
    return b"\x81\x7f" + length.to_bytes(8, "big") + b"x" * length


def cut(chunks):
    """Return the pieces of what comes in chunks."""
    pieces, waiting, cutting = [], bytearray(), Pieces()
    for chunk in chunks:
        waiting += chunk
        while length := cutting.next(waiting, shaken=True):
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


def frames_of(stream):
    """Return the frames in a stream: first byte and payload."""
    frames = []
    while stream:
        length, head = stream[1], 2
        if length == 126:
            length, head = int.from_bytes(stream[2:4], "big"), 4
        elif length == 127:
            length, head = int.from_bytes(stream[2:10], "big"), 10
        frames.append((stream[0], stream[head : head + length]))
        assert len(frames[-1][1]) == length
        stream = stream[head + length :]
    return frames


def taken(chunks):
    """Return the pieces that are taken of what comes in chunks."""
    pieces, waiting, cutting = [], bytearray(), Pieces()
    for chunk in chunks:
        waiting += chunk
        while piece := cutting.take(waiting, shaken=True):
            pieces.append(piece)
    assert not waiting
    return pieces


@given(st.data())
def test_a_long_frame_is_split_into_fragments_of_one_message(data):
    long = bytes(data.draw(st.integers(65_530, 200_000)))
    stream = b"\x01\x01x" + b"\x80\x7f" + len(long).to_bytes(8, "big") + long + frame(3)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    pieces = taken(stream[a:b] for a, b in itertools.pairwise([0, *cuts, len(stream)]))
    assert all(len(piece) <= PIECE + 4 for piece in pieces)
    frames = frames_of(b"".join(pieces))
    assert [first for first, _ in frames[:-2]] == [1] + [0] * (len(frames) - 3)
    assert frames[-2][0] == 0x80  # the last fragment ends the message
    assert b"".join(payload for _, payload in frames[1:-1]) == long
    assert frames[-1] == (0x81, b"xxx")


@given(st.data())
def test_only_the_beginning_of_a_frame_that_is_too_long_is_passed_on(data):
    begins = bytes(range(250)) * 5
    length = MAX_FRAME + data.draw(st.integers(1, 200_000))
    head = b"\x82\x7f" + length.to_bytes(8, "big")
    stream = frame(5) + head + begins
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    pieces, waiting, cutting = [], bytearray(), Pieces()

    def give(chunk):
        waiting.extend(chunk)
        while piece := cutting.take(waiting, shaken=True):
            pieces.append(piece)

    for a, b in itertools.pairwise([0, *cuts, len(stream)]):
        give(stream[a:b])
    left, size = length - len(begins), data.draw(st.integers(1 << 20, 1 << 23))
    for at in range(0, left, size):
        assert len(waiting) == 0, "nothing of the rest is kept"
        give(bytes(min(size, left - at)))
    give(frame(7))
    _, (first, short), after = frames_of(b"".join(pieces))
    assert (first, after) == (0x82, (0x81, b"x" * 7))
    assert short == SHORTENED + length.to_bytes(8, "big") + begins[:KEPT]


def test_the_head_of_a_masked_frame_or_a_too_long_fragment_is_passed_on_unchanged():
    too_long = b"\x02\x7f" + (MAX_FRAME + 1).to_bytes(8, "big")
    masked = b"\x82\xff" + (100_000).to_bytes(8, "big")
    for head in (too_long, masked):
        assert Pieces().take(bytearray(head + b"data"), shaken=True)[:10] == head


def test_during_the_handshake_each_line_is_a_piece():
    cutting = Pieces()
    assert cutting.next(bytearray(b"HTTP/1.1 101 OK\r\nX: y\r\n"), shaken=False) == 17
    assert cutting.next(bytearray(b"no end"), shaken=False) == 6
    assert cutting.next(bytearray(), shaken=False) == 0


class Greedy:
    """Wants a turn as often as it is asked."""

    def __init__(self, noted, name, times):
        self.noted, self.name, self.times = noted, name, times

    def take(self, until):
        while time.thread_time() < until:
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
    assert max(steps) <= 5, "the loop goes on after a few turns"


def test_a_link_that_asks_for_a_delay_gets_its_next_turn_after_the_delay():
    async def story():
        noted, ended = [], asyncio.Event()

        class Waiting:
            def take(self, until):
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
