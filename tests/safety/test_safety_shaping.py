"""The times at which the bytes of a degraded link arrive."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.testing.fault_proxy import Shape, Shaper

shapes = st.builds(
    Shape,
    latency=st.floats(0, 2),
    jitter=st.floats(0, 1),
    bandwidth=st.none() | st.floats(10, 1e6),
    slice_size=st.none() | st.integers(1, 50),
    slice_gap=st.floats(0, 0.1),
)
writes = st.lists(st.tuples(st.floats(0, 1), st.binary(max_size=200)), max_size=20)


@given(st.lists(shapes, min_size=1, max_size=3), writes)
def test_the_shaper_delivers_all_bytes_once_in_order_and_never_early(shapes, writes):
    shaper, now, sent, came = Shaper(), 0.0, b"", []
    for number, (gap, data) in enumerate(writes):
        now += gap
        sent += data
        shaper.shape = shapes[number % len(shapes)]
        pieces = shaper.take(data, now)
        assert all(due >= now + shaper.shape.latency for due, _ in pieces)
        came += pieces
    assert b"".join(piece for _, piece in came) == sent
    assert [due for due, _ in came] == sorted(due for due, _ in came)


def test_limited_bandwidth_delays_bytes_by_their_number():
    shaper = Shaper(Shape(bandwidth=1000))
    (first,), (second,) = shaper.take(b"x" * 500, 10.0), shaper.take(b"y" * 500, 10.0)
    assert (first[0], second[0]) == (10.5, 11.0)


def test_jitter_stays_within_its_limit():
    shaper = Shaper(Shape(latency=0.1, jitter=0.05))
    dues = [shaper.take(b"x", float(n))[0][0] - n for n in range(100)]
    assert min(dues) >= 0.1
    assert max(dues) <= 0.15 + 1e-9
    assert max(dues) - min(dues) > 0.02


def test_slicing_splits_one_write_into_slices_with_gaps():
    pieces = Shaper(Shape(slice_size=2, slice_gap=0.1)).take(b"abcde", 0.0)
    assert [piece for _, piece in pieces] == [b"ab", b"cd", b"e"]
    assert [due for due, _ in pieces] == pytest.approx([0.0, 0.1, 0.2])


@pytest.mark.parametrize(
    "bad", [{"latency": -1}, {"jitter": -1}, {"bandwidth": 0}, {"slice_size": 0}]
)
def test_a_shape_with_an_invalid_value_is_refused(bad):
    with pytest.raises(ValueError, match=next(iter(bad))):
        Shape(**bad)
