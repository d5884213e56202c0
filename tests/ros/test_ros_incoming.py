"""WebSocket messages are found in bytes that arrive in chunks of any size."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.errors import ProtocolError
from webmap.ros.limits import MAX_FRAME
from webmap.ros.sockets.frame_reader import (
    KEPT,
    MOST_FRAGMENTS,
    PIECE,
    SHORTENED,
    FrameReader,
)


def frame(data, first=0x81):
    length = len(data)
    if length < 126:
        return bytes([first, length]) + data
    if length < 1 << 16:
        return bytes([first, 126]) + length.to_bytes(2, "big") + data
    return bytes([first, 127]) + length.to_bytes(8, "big") + data


class Reader:
    """Keeps the messages that are read, in order."""

    def __init__(self, handshake_done=True):
        self.messages, self.others = [], b""
        self.incoming = FrameReader(self.other)
        self.incoming.message = self.messages.append
        self.incoming.handshake_done = handshake_done
        self.steps = 0

    def other(self, data):
        assert len(data) <= PIECE
        self.others += data

    def read(self, *chunks):
        for chunk in chunks:
            self.incoming.feed(chunk)
            while self.incoming.step():
                self.steps += 1
        return self


def cut(stream, data):
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    bounds = [0, *cuts, len(stream)]
    return [stream[a:b] for a, b in itertools.pairwise(bounds)]


SIZES = st.sampled_from([0, 1, 125, 126, 127, 65_535, 65_536, 65_537, 200_000])


@given(st.lists(st.tuples(SIZES, st.integers(1, 3)), max_size=4), st.data())
def test_each_message_is_read_whole_for_any_chunks_and_fragments(sent, data):
    stream, expected = b"", []
    for number, (size, parts) in enumerate(sent):
        message = bytes([number]) * size
        at = [size * part // parts for part in range(parts + 1)]
        for part, (a, b) in enumerate(itertools.pairwise(at)):
            first = (0 if part else 1) | (0x80 if part == parts - 1 else 0)
            stream += frame(message[a:b], first) + frame(b"ping", 0x89)
        expected.append(message)
    reader = Reader().read(*cut(stream, data))
    assert reader.messages == expected
    assert reader.others.count(frame(b"ping", 0x89)) == sum(p for _, p in sent)
    assert len(reader.incoming) == 0


def test_websockets_sees_the_heads_of_fragments_and_nothing_of_whole_messages():
    long = frame(b"x" * 70_000)
    reader = Reader().read(
        frame(b"whole") + frame(b"a", 0x01) + frame(b"b", 0) + frame(b"c", 0x80) + long
    )
    assert reader.messages == [b"whole", b"abc", b"x" * 70_000]
    assert reader.others == b"\x01\0" + b"\0\0" + b"\x80\0" + b"\x81\0"


def test_a_message_within_another_is_not_read_but_its_head_is_passed_on():
    reader = Reader().read(frame(b"a", 0x01) + frame(b"new", 0x81))
    assert reader.others == b"\x01\0\x81\0"


def test_a_long_message_is_read_in_steps_and_its_length_is_noted():
    reader = Reader().read(frame(bytes(10 * PIECE + 1)))
    assert reader.steps == 12  # the head, and 11 parts
    assert reader.incoming.came_long == 10 * PIECE + 1


@given(st.data())
def test_only_the_beginning_of_a_message_that_is_too_long_is_kept(data):
    begins = bytes(range(250)) * 5
    length = MAX_FRAME + data.draw(st.integers(1, 200_000))
    stream = frame(b"before") + b"\x82\x7f" + length.to_bytes(8, "big") + begins
    reader = Reader().read(*cut(stream, data))
    left, size = length - len(begins), data.draw(st.integers(1 << 20, 1 << 23))
    for at in range(0, left, size):
        reader.read(bytes(min(size, left - at)))
        assert len(reader.incoming) == 0, "the remaining bytes are not kept"
    reader.read(frame(b"after"))
    short = SHORTENED + length.to_bytes(8, "big") + begins[:KEPT]
    assert reader.messages == [b"before", short, b"after"]


@pytest.mark.parametrize(
    ("sent", "why"),
    [
        (frame(b"x", 0x01) + frame(b"x", 0) * MOST_FRAGMENTS, "too many fragments"),
        (b"\x02\x7f" + (MAX_FRAME + 1).to_bytes(8, "big"), "a message of more than"),
        (
            frame(b"x", 0x02) + b"\x80\x7f" + MAX_FRAME.to_bytes(8, "big"),
            "a message of more than",
        ),
    ],
    ids=["many", "one long fragment", "long together"],
)
def test_a_message_in_too_many_or_too_long_fragments_is_refused(sent, why):
    reader = Reader()
    with pytest.raises(ProtocolError, match=why):
        reader.read(sent)
    reader.read(frame(b"after"))
    assert reader.messages == [], (
        "the remaining bytes go to websockets, which drops them"
    )
    assert reader.others.endswith(frame(b"after"))


@pytest.mark.parametrize(
    "invalid",
    [
        b"\x82\xff" + (100_000).to_bytes(8, "big") + bytes(200),
        b"\xc1\x05hello",
        b"\x83\x05hello",
        b"\x89\x7e\x01\x00" + bytes(256),
    ],
    ids=["masked", "reserved bit", "unknown kind", "long ping"],
)
def test_websockets_gets_a_frame_that_is_not_allowed_to_refuse_it(invalid):
    reader = Reader().read(frame(b"before") + invalid)
    assert reader.messages[0] == b"before"
    assert reader.others[:2] == invalid[:2]


def test_during_the_handshake_each_line_is_a_step():
    reader = Reader(handshake_done=False).read(
        b"HTTP/1.1 101 OK\r\nX: y\r\n", b"no end"
    )
    assert reader.others == b"HTTP/1.1 101 OK\r\nX: y\r\nno end"
    assert reader.steps == 3


def test_bytes_that_wait_are_not_copied_again_for_each_that_comes():
    incoming = FrameReader(bytes)
    incoming.shaken = True
    incoming.feed(bytes(1 << 20))
    incoming.feed(b"x")
    kept = incoming._data
    for _ in range(100):
        incoming.feed(b"x")
    assert incoming._data is kept
    assert len(incoming) == (1 << 20) + 101
