"""An operator who drives by a camera cannot drive with an old picture (S16)."""

import pytest

from equipment.gate_harness import Bench
from webmap.gate.commands import Refusal, parse
from webmap.gate.rules.health import Video


@pytest.fixture
def bench():
    """A bench where A drives a robot by a camera with new pictures."""
    bench = Bench().begin()
    bench.take("a")
    look(bench, 0.3, 100)
    look(bench, 0.5, 100, x=1.0)
    assert bench.state == "driving"
    return bench


def look(bench, seconds, video, **axes):
    """Hold inputs with a picture that always has the same age in ms."""
    bench.run(seconds, lambda: bench.drive(video=video, **axes))


def freeze(bench, seconds, **axes):
    """Hold inputs with a picture that gets older."""
    frozen = bench.now - 0.1
    bench.run(
        seconds,
        lambda: bench.drive(video=round(1000 * (bench.now - frozen)), **axes),
    )


def test_a_robot_stops_when_the_camera_picture_is_one_second_old(bench):
    before = bench.now
    freeze(bench, 3.0, x=1.0)
    last = max(w.at for w in bench.moving_since(before))
    assert 0.7 < last - before <= 0.95  # the picture was 100 ms old before
    assert bench.written[-1].twist.is_zero
    assert not bench.report().armed
    assert bench.report().reason == "no picture from the camera for 1 s"
    assert "no picture from the camera" in bench.refusals()[-1].why


def test_a_picture_continues_to_age_after_the_last_command(bench):
    look(bench, 0.1, 990, x=1.0)
    at = bench.now
    bench.run(0.15)
    assert not bench.moving_since(at + 0.05)
    assert bench.report().reason == "no picture from the camera for 1 s"


def test_new_pictures_move_nothing_until_inputs_are_released_and_pressed(bench):
    freeze(bench, 2.0, x=1.0)
    at = bench.now
    look(bench, 2.0, 50, x=1.0)
    assert not bench.moving_since(at)
    assert bench.report().reason is None
    look(bench, 0.3, 50)
    assert not bench.moving_since(at)
    look(bench, 0.3, 50, x=1.0)
    assert bench.moving_since(at)


def test_the_age_of_the_tick_is_added_to_the_age_of_the_picture(bench):
    at = bench.now

    def late():
        bench.drive(video=900, tick=bench.tick - 4, x=1.0)

    bench.run(0.5, late)
    assert not bench.moving_since(at + 0.06)


def test_commands_without_a_picture_age_can_drive_the_robot(bench):
    freeze(bench, 2.0, x=1.0)
    bench.hold(0.3)
    at = bench.now
    bench.hold(0.5, x=1.0)
    assert bench.moving_since(at)


def test_the_next_operator_does_not_inherit_an_old_picture(bench):
    freeze(bench, 2.0, x=0.0)
    bench.send("a", op="release", robot="r1")
    bench.run(1.0)
    bench.drive_off("b")
    assert bench.state == "driving"


def test_forgetting_an_old_picture_ends_the_video_fault(bench):
    video = Video()
    video.observe(5.0, 100.0)
    assert video.fault(100.0)
    video.forget()
    assert video.fault(100.0) is None


@pytest.mark.parametrize("video", [-1, 1.5, None, "100", True, [], 2**53])
def test_an_invalid_picture_age_is_refused(video):
    import json

    fields = {"op": "drive", "robot": "r1", "epoch": 1, "seq": 1, "tick": 1}
    fields |= {"x": 0, "y": 0, "turn": 0}
    assert parse(json.dumps(fields).encode()).video is None
    assert parse(json.dumps({**fields, "video": 250}).encode()).video == 0.25
    with pytest.raises(Refusal, match="'video' is"):
        parse(json.dumps({**fields, "video": video}).encode())
