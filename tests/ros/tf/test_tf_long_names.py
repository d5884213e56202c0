"""Frames with names that are far too long; messages may contain any text."""

import time

import pytest

from webmap.ros.tf import Buffer, FrameMissing, Transform, TransformError

LONG = "f" * 1_000_000


@pytest.mark.parametrize("names", [(LONG, "a"), ("a", LONG)])
def test_a_frame_with_a_too_long_name_is_refused(names):
    buffer = Buffer()
    with pytest.raises(TransformError, match="characters; the limit is 256") as refused:
        buffer.add(*names, Transform(), 1.0)
    assert len(str(refused.value)) < 200
    assert buffer.frames == []


def test_looking_up_a_too_long_name_is_fast_and_raises_a_short_error():
    buffer = Buffer()
    for number in range(100):
        buffer.add("map", f"f{number}", Transform(), 1.0)
    before = time.process_time()
    for number in range(20):
        with pytest.raises(FrameMissing, match="name of") as refused:
            buffer.lookup("map", f"{LONG}{number}")
        assert len(str(refused.value)) < 200
    assert time.process_time() - before < 1.0
