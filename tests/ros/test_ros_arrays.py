"""Arrays of numbers arrive as lists, as bytes, or as views of memory."""

import tracemalloc
from array import array

import pytest

from webmap.ros.arrays import MOST_PACKED, NOT_COPIED, Floats, Int8s


@pytest.mark.parametrize("count", [0, 3, NOT_COPIED])
def test_a_view_of_the_same_width_has_the_same_numbers(count):
    cells = Int8s.from_wire(memoryview(array("b", [5] * count)))
    assert (len(cells), bytes(cells)) == (count, b"\5" * count)


def test_many_numbers_are_not_copied():
    memory = array("b", [5]) * (NOT_COPIED + 1)
    cells = Int8s.from_wire(memoryview(memory))
    memory[0] = 7
    assert bytes(cells)[0] == 7


def test_many_received_bytes_are_not_copied():
    cells = Int8s.from_wire(b"\5" * (NOT_COPIED + 1))
    assert isinstance(cells.values, memoryview)
    assert (len(cells), cells.values[-1]) == (NOT_COPIED + 1, 5)


def test_numbers_of_another_width_are_converted():
    distances = Floats.from_wire(memoryview(array("d", [0.5, 2.0])))
    assert distances == Floats(array("f", [0.5, 2.0]))


@pytest.mark.parametrize(
    ("received", "numbers"),
    [
        ([], []),
        ([0.25, 3, True], [0.25, 3.0, 1.0]),
        ([None, 0.25, None], [float("nan"), 0.25, float("nan")]),
        ([1e300, -1e300, 2**70], [float("inf"), float("-inf"), 2.0**70]),
    ],
)
def test_a_list_of_json_becomes_floats_of_four_bytes(received, numbers):
    assert Floats.from_wire(received) == Floats(array("f", numbers))


@pytest.mark.parametrize("null", [None, 1.5])
def test_a_long_list_of_json_becomes_floats_without_a_copy_of_its_references(null):
    received = [0.25] * (4 * MOST_PACKED) + [null]
    tracemalloc.start()
    floats = Floats.from_wire(received)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    numbers = [float("nan") if item is None else item for item in received]
    assert floats == Floats(array("f", numbers))
    replaced = 9 * len(received) if null is None else 0  # a list that grows
    assert most < 1.1 * len(bytes(floats)) + replaced


@pytest.mark.parametrize("received", [["1"], [None, "1"], [[1.0]], [10**400], "1", 1])
def test_what_is_no_array_of_numbers_is_an_error(received):
    with pytest.raises(ValueError, match="expected an array of numbers, got"):
        Floats.from_wire(received)


def test_a_number_that_does_not_fit_is_an_error():
    with pytest.raises(ValueError, match="expected an array of numbers"):
        Int8s.from_wire(memoryview(array("h", [300])))
