"""Which connections without a sign-in are closed, without any I/O."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.server.connections import Waiting, origin_of

HERE = ""
THERE, ELSEWHERE = "192.0.2.1", "192.0.2.2"


def test_a_new_connection_replaces_the_oldest_one_at_the_limit():
    waiting = Waiting(2, 2)
    assert [waiting.add(n, HERE) for n in range(4)] == [None, None, 0, 1]
    assert len(waiting) == 2


def test_an_address_at_its_limit_replaces_only_its_own_connections():
    waiting = Waiting(100, 2)
    waiting.add("other", ELSEWHERE)
    assert [waiting.add(n, THERE) for n in range(4)] == [None, None, 0, 1]
    assert len(waiting) == 3


def test_connections_from_this_machine_have_no_limit_per_address():
    waiting = Waiting(100, 2)
    assert {waiting.add(n, HERE) for n in range(100)} == {None}


def test_the_address_with_the_most_connections_loses_its_oldest_one():
    waiting = Waiting(4, 4)
    waiting.add("one", THERE)
    for number in range(3):
        waiting.add(number, HERE)
    assert waiting.add("two", ELSEWHERE) == 0
    assert waiting.add("three", HERE) == 1


def test_a_removed_connection_frees_its_place():
    waiting = Waiting(2, 1)
    assert waiting.add("a", THERE) is None
    waiting.remove("a", THERE)
    assert waiting.add("b", THERE) is None
    assert len(waiting) == 1


@given(st.lists(st.tuples(st.booleans(), st.sampled_from([HERE, THERE, ELSEWHERE]))))
def test_the_limits_are_never_exceeded_and_no_connection_is_lost(steps):
    waiting, inside = Waiting(5, 3), {}
    for number, (comes, address) in enumerate(steps):
        if comes:
            gone = waiting.add(number, address)
            inside[number] = address
            if gone is not None:
                del inside[gone]
        elif inside:
            oldest = next(iter(inside))
            waiting.remove(oldest, inside.pop(oldest))
        assert len(waiting) == len(inside) <= 5
        for one in (THERE, ELSEWHERE):
            assert list(inside.values()).count(one) <= 3


@pytest.mark.parametrize(
    ("address", "origin"),
    [
        ("127.0.0.1", ""),
        ("127.9.9.9", ""),
        ("::1", ""),
        ("::ffff:127.0.0.1", ""),
        ("", ""),
        ("/run/webmap.sock", ""),
        ("192.0.2.1", "192.0.2.1"),
        ("::ffff:192.0.2.1", "192.0.2.1"),
        ("2001:db8::1", "2001:db8::/64"),
        ("2001:db8::ffff:1", "2001:db8::/64"),
        ("2001:db8:0:1::1", "2001:db8:0:1::/64"),
        ("fe80::1%eth0", "fe80::/64"),
    ],
)
def test_addresses_of_this_machine_and_of_one_ipv6_network_count_as_one(
    address, origin
):
    assert origin_of(address) == origin
