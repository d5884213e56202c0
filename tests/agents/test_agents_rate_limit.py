"""What each user of a router may send, and how it comes to the event loop."""

import asyncio

import pytest

from webmap.agents.address import data_in
from webmap.agents.rate_limit import Receiver, UserRateLimit
from webmap.base.errors import BridgeClosed, WireError

KEY = data_in("bay3", "ann", "4f", "1")


def test_a_user_that_sends_too_much_is_left_out_and_others_are_not():
    limit = UserRateLimit("messages", pieces=100, size=1000)
    flood = [limit.admits("ann", 1, 0.0) for _ in range(2000)]
    assert flood.count(True) == pytest.approx(1000, abs=1)
    assert limit.admits("ben", 1, 0.0)
    assert limit.admits("ann", 5000, 0.5)  # a large piece is taken whole
    assert not limit.admits("ann", 1, 4.0)
    assert limit.admits("ann", 1, 5.1)


def test_a_receiver_passes_messages_to_its_loop_and_logs_those_that_are_wrong(caplog):
    def process(sender, piece, now):
        got.append((sender.user, piece))
        if piece != b"well":
            raise (WireError if piece == b"wire" else BridgeClosed)(piece.decode())

    async def receive():
        receiver.start(asyncio.get_running_loop())
        for piece in (b"wire", b"bridge", b"well"):
            await asyncio.to_thread(receiver.receive, KEY, piece)
        await asyncio.sleep(0)

    got = []
    receiver = Receiver("messages", process)
    receiver.receive(KEY, b"before it started")
    asyncio.run(receive())
    receiver.receive(KEY, b"after the loop was closed")
    assert got == [("ann", b"wire"), ("ann", b"bridge"), ("ann", b"well")]
    words = ["display ann.4f: wire", "display ann.4f: bridge"]
    assert [record.getMessage() for record in caplog.records] == words


def test_a_receiver_drops_what_one_user_sends_too_much():
    async def receive():
        receiver.start(asyncio.get_running_loop())
        for _ in range(12):
            receiver.receive(KEY, bytes(1 << 20))
        receiver.receive(data_in("bay3", "ben", "5a", "1"), b"")
        await asyncio.sleep(0)

    got = []
    receiver = Receiver("messages", lambda sender, *_: got.append(sender.user))
    asyncio.run(receive())
    assert (got.count("ann"), got.count("ben")) in ((10, 1), (11, 1))
