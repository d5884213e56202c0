"""Numbered samples: copies, gaps and restarts."""

import pytest

from webmap.agents.gate_messages import SESSIONS, Numbering, Order
from webmap.base.errors import WireError


@pytest.fixture
def order():
    return Order()


def samples(count, numbering=None):
    numbering = numbering or Numbering()
    return [numbering.next(b"%d" % number) for number in range(1, count + 1)]


def bodies(order, arriving):
    return [body for each in arriving if (body := order.take(each)[0]) is not None]


def test_of_two_copies_of_each_sample_the_first_counts(order):
    sent = samples(4)
    arriving = [sent[0], sent[0], sent[1], sent[2], sent[1], sent[2], sent[3], sent[3]]
    assert bodies(order, arriving) == [b"1", b"2", b"3", b"4"]
    assert order.lost == 0


def test_a_connection_that_stalls_and_goes_on_loses_and_repeats_nothing(order):
    sent = samples(9)
    arriving = [*sent[:2], *sent[:6], *sent[2:9], *sent[6:]]
    assert bodies(order, arriving) == [b"%d" % number for number in range(1, 10)]
    assert order.lost == 0


def test_what_comes_over_no_connection_counts_as_lost(order):
    sent = samples(5)
    assert bodies(order, [sent[0], sent[3], sent[1], sent[4]]) == [b"1", b"4", b"5"]
    assert order.lost == 2


def test_the_last_samples_of_an_ended_sender_are_no_restart(order):
    old, new = samples(3), samples(3)
    assert order.take(old[0]) == (b"1", True)
    assert order.take(new[0]) == (b"1", True)
    assert order.take(old[1]) == (None, False)
    assert order.take(new[1]) == (b"2", False)
    assert order.lost == 0


def test_only_a_number_of_ended_senders_is_remembered(order):
    first = samples(2)
    order.take(first[0])
    for _ in range(SESSIONS + 1):
        order.take(samples(1)[0])
    assert order.take(first[1]) == (b"2", True)


@pytest.mark.parametrize("size", [0, 15, (1 << 20) + 1])
def test_bytes_that_are_too_few_or_too_many_are_no_sample(order, size):
    with pytest.raises(WireError, match=f"a sample of {size} bytes"):
        order.take(bytes(size))
