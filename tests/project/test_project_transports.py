"""The simulation of a link that loses packets: delays, and stops of the robot."""

import itertools
import random

import pytest

from benchmarks.transports import NEVER, Gate, Link, arrivals, drive, losses

SENT = [number * 0.05 for number in range(10)]


class Losing(random.Random):
    """Loses only the third packet, at the first attempt."""

    def __init__(self):
        super().__init__()
        self.asked = 0

    def random(self):
        self.asked += 1
        return 0.0 if self.asked == 3 else 0.9


def received(transport, round_trip=0.1):
    link = Link(round_trip, loss=0.01, jitter=0.0)
    return arrivals(SENT, link, transport, Losing())


def test_without_losses_each_packet_takes_half_of_a_round_trip():
    link = Link(0.1, jitter=0.0)
    for transport in ("tcp", "quic", "datagrams"):
        came = arrivals(SENT, link, transport, random.Random(1))
        assert came == pytest.approx([at + 0.05 for at in SENT])


def test_a_lost_packet_holds_up_those_behind_it_until_a_later_one_was_answered():
    for transport in ("tcp", "quic"):
        came = received(transport)
        # Sent at 100 ms; the next packet is sent at 150 ms and answered at 250 ms.
        assert came[2] == pytest.approx(0.25 + 0.05)
        assert came[3:5] == [came[2]] * 2
        assert came[:2] + came[6:] == pytest.approx(
            [at + 0.05 for at in SENT[:2] + SENT[6:]]
        )


def test_tcp_waits_a_quarter_of_a_long_round_trip_and_quic_less():
    assert received("tcp", 0.4)[2] == pytest.approx(0.1 + 0.5 + 0.2)
    assert received("quic", 0.4)[2] == pytest.approx(0.1 + 0.45 + 0.2)


def test_of_two_connections_the_one_that_lost_nothing_is_in_time():
    assert received("two") == pytest.approx([at + 0.05 for at in SENT])


def test_a_burst_holds_up_both_of_two_connections():
    sent = [number * 0.05 for number in range(2000)]
    link = Link(0.05, loss=0.2, burst=0.5, jitter=0.0)
    came = arrivals(sent, link, "two", random.Random(2))
    late = sum(there - at > 0.1 for there, at in zip(came, sent, strict=True))
    assert late > 200


def test_a_lost_datagram_holds_up_nothing():
    came = received("datagrams")
    assert came[2] == NEVER
    assert came[3] == pytest.approx(SENT[3] + 0.05)


def test_bursts_lose_the_stated_share_in_long_pieces():
    lost = losses(Link(0.1, loss=0.1, burst=0.2), random.Random(1))
    found = [lost(number * 0.01) for number in range(100_000)]
    begins = sum(now and not before for before, now in itertools.pairwise(found))
    assert sum(found) / len(found) == pytest.approx(0.1, rel=0.15)
    assert sum(found) / begins * 0.01 == pytest.approx(0.2, rel=0.15)


def test_a_robot_without_losses_is_driven_at_150_ms_and_never_at_300():
    assert drive(Link(0.15), "tcp", 60.0, seed=1).stops == 0
    assert drive(Link(0.15), "tcp", 60.0, seed=1).seconds > 58.0
    assert drive(Link(0.3), "datagrams", 60.0, seed=1).seconds == 0.0


def test_a_lost_packet_stops_a_robot_at_150_ms_over_tcp_and_not_by_datagrams():
    link = Link(0.15, loss=0.01)
    assert drive(link, "tcp", 60.0, seed=1).stops > 5
    assert drive(link, "datagrams", 60.0, seed=1).stops == 0


def test_the_same_seed_gives_the_same_drive():
    link = Link(0.15, loss=0.02)
    assert drive(link, "tcp", 30.0, seed=3) == drive(link, "tcp", 30.0, seed=3)
    assert drive(link, "tcp", 30.0, seed=3) != drive(link, "tcp", 30.0, seed=4)


def test_the_gate_counts_a_stop_only_while_the_robot_is_driven():
    gate = Gate()
    for number in range(40):
        now = number * 0.05001
        gate.take(number, gate.issue(now), number > 10, now + 0.001)
    assert gate.driven.stops == 0
    for number in range(40, 60):  # no more commands arrive
        gate.issue(number * 0.05001)
    assert gate.driven.stops == 1
    assert gate.driven.seconds == pytest.approx(29 * 0.05 + 0.2, abs=0.05)
