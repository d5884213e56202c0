import asyncio
import threading

from hypothesis import given
from hypothesis import strategies as st

from webmap.server.outbox import (
    FRAME_BYTES,
    FRAMES,
    MESSAGES,
    BatchedCalls,
    BatchedCallsByLoop,
    DriveQueue,
    FrameQueue,
)
from webmap.server.page_socket import (
    COME_BACK,
    DRIVE,
    MOST_VIEWERS,
    OPENS_AT_ONCE,
    REPLACED,
    SCENE,
    Allowance,
    Opens,
    OpenSockets,
    SocketLimits,
    short,
)

TICK = '{"op":"tick","tick":%d,"ack":-1}'


def test_messages_up_to_the_size_limit_are_accepted_and_larger_ones_refused():
    for bounds in (SCENE, DRIVE):
        allowance = Allowance(bounds, 0.0)
        assert allowance.spend("x" * bounds.max_bytes, 0.0) is None
        assert "bytes" in allowance.spend("x" * (bounds.max_bytes + 1), 0.0)


def test_size_is_counted_in_bytes_not_in_characters():
    bounds = SocketLimits(max_bytes=3, rate=1.0, burst=9.0)
    assert Allowance(bounds, 0.0).spend("é€", 0.0) is not None
    assert Allowance(bounds, 0.0).spend("€", 0.0) is None
    assert Allowance(bounds, 0.0).spend("\ud800", 0.0) is None


def test_sixty_messages_per_second_are_always_accepted_and_more_are_refused():
    allowance = Allowance(DRIVE, 0.0)
    assert all(allowance.spend("x", n / 60) is None for n in range(6000))
    hasty = Allowance(DRIVE, 0.0)
    refused = [n for n in range(6000) if hasty.spend("x", n / 66) is not None]
    assert "60 messages a second" in hasty.spend("x", 1.0)
    assert refused


def test_a_burst_of_120_messages_after_a_stalled_link_is_accepted():
    allowance = Allowance(DRIVE, 0.0)
    assert all(allowance.spend("x", 6.0) is None for _ in range(120))
    assert allowance.spend("x", 6.0) is not None


def test_frames_keep_their_order():
    queue = FrameQueue()
    assert queue.put(b"a")
    assert queue.put(b"b")
    assert [queue.pop(), queue.pop(), queue.pop()] == [b"a", b"b", None]


def test_a_full_frame_queue_accepts_no_frame():
    queue = FrameQueue()
    assert all(queue.put(b"x") for _ in range(FRAMES))
    assert not queue.put(b"x")
    queue.pop()
    assert queue.put(b"x")


def test_a_frame_above_the_size_limit_is_accepted_only_by_an_empty_queue():
    queue = FrameQueue()
    assert queue.put(bytes(2 * FRAME_BYTES))
    assert not queue.put(b"x")
    queue.pop()
    assert queue.put(b"x")
    assert not queue.put(bytes(FRAME_BYTES))


def test_the_newest_tick_is_sent_first_and_replaces_older_ticks():
    queue = DriveQueue()
    for item in ("robot 1", TICK % 1, "robot 2", TICK % 2):
        assert queue.put(item)
    sent = [queue.pop() for _ in range(4)]
    assert sent == [TICK % 2, "robot 1", "robot 2", None]


def test_a_full_drive_queue_accepts_a_tick():
    queue = DriveQueue()
    while queue.put("robot"):
        pass
    assert queue.put(TICK % 1)
    assert queue.pop() == TICK % 1
    assert sum(queue.pop() is not None for _ in range(MESSAGES + 1)) == MESSAGES


@given(st.lists(st.one_of(st.integers(0, 99), st.none()), max_size=200))
def test_no_robot_message_of_the_gate_is_lost_or_reordered(steps):
    queue, put, popped = DriveQueue(), [], []
    for step in steps:
        if step is None:
            popped.append(queue.pop())
        elif step % 3 == 0:
            queue.put(TICK % step)
        else:
            queue.put(f"robot {step}")
            put.append(f"robot {step}")
    while (item := queue.pop()) is not None:
        popped.append(item)
    assert [item for item in popped if item and item.startswith("robot")] == put


class Guest:
    def __init__(self):
        self.received = []

    def end(self, code, reason):
        self.received.append(code)


def test_a_page_that_reconnects_replaces_its_own_socket():
    sockets, old, new = OpenSockets(1), Guest(), Guest()
    assert sockets.add(("v", "p"), old)
    assert sockets.add(("v", "p"), new)
    assert (old.received, new.received) == ([REPLACED], [])
    sockets.remove(("v", "p"), old)
    assert len(sockets) == 1
    sockets.remove(("v", "p"), new)
    assert len(sockets) == 0


def test_a_socket_above_the_limit_is_refused():
    sockets, first, second = OpenSockets(1), Guest(), Guest()
    assert sockets.add(("v", "p"), first)
    assert not sockets.add(("w", "p"), second)
    sockets.remove(("w", "p"), second)
    sockets.remove(("v", "p"), first)
    assert sockets.add(("w", "p"), second)


def test_the_viewer_with_the_most_pages_yields_the_newest_one():
    sockets, guests = OpenSockets(3), {n: Guest() for n in range(5)}
    for number in range(3):
        assert sockets.add(("v", f"p{number}"), guests[number])
    assert sockets.add(("w", "p"), guests[3])
    assert [guest.received for guest in guests.values()] == [
        [],
        [],
        [COME_BACK],
        [],
        [],
    ]
    # Two and one would become one and two.
    assert not sockets.add(("w", "q"), guests[4])
    assert len(sockets) == 3


def test_pages_that_always_get_a_place_replace_the_oldest_of_the_most():
    sockets, guests = OpenSockets(3, always=True), [Guest() for _ in range(5)]
    for number, guest in enumerate(guests[:4]):
        assert sockets.add(("v", f"p{number}"), guest)
    assert sockets.add(("w", "p"), guests[4])
    assert [guest.received for guest in guests] == [
        [COME_BACK],
        [COME_BACK],
        [],
        [],
        [],
    ]


def test_each_viewer_may_open_many_pages_at_once_and_then_two_a_second():
    opens = Opens(OPENS_AT_ONCE)
    assert all(opens.may_open("v", 0.0) for _ in range(OPENS_AT_ONCE))
    assert not any(opens.may_open("v", 0.0) for _ in range(100))
    assert opens.may_open("w", 0.0)
    # Attempts that were refused cost nothing.
    assert [opens.may_open("v", 1.0) for _ in range(3)] == [True, True, False]
    for number in range(MOST_VIEWERS):
        opens.may_open(f"x{number}", 1.0)
    assert len(opens._until) == MOST_VIEWERS


def test_batched_calls_from_another_thread_run_in_order():
    async def scenario():
        seen = []
        calls = BatchedCallsByLoop().of_this_loop()
        thread = threading.Thread(
            target=lambda: [calls.call(seen.append, n) for n in range(1000)]
        )
        thread.start()
        thread.join()
        assert seen == []
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        return seen

    assert asyncio.run(scenario()) == list(range(1000))


def test_a_batched_call_that_raises_does_not_stop_the_next(caplog):
    async def scenario():
        seen = []
        calls = BatchedCallsByLoop().of_this_loop()
        calls.call(lambda: 1 / 0)
        calls.call(seen.append, 1)
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        return seen

    assert asyncio.run(scenario()) == [1]
    assert "ZeroDivisionError" in caplog.text


def test_a_batched_call_into_a_closed_loop_is_dropped():
    loop = asyncio.new_event_loop()
    calls = BatchedCalls(loop)
    loop.close()
    calls.call(print, "never")
    calls.call(print, "never")
    assert not calls._calls


def test_each_event_loop_has_its_own_batched_calls():
    hops = BatchedCallsByLoop()

    async def same():
        assert hops.of_this_loop() is hops.of_this_loop()
        return hops.of_this_loop()

    assert asyncio.run(same()) is not asyncio.run(same())


def test_close_reasons_are_shortened_to_fit_into_a_close_frame():
    assert short("short") == "short"
    assert len(short("€" * 100).encode()) <= 123
