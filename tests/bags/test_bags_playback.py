"""The position in a recording: what commands do, and which commands are valid."""

import contextlib
import math

import pytest
from hypothesis import given
from hypothesis import strategies as some

from webmap.bags.playback import Playback, PlaybackCommand, command_of, read_command
from webmap.bags.times import SECOND
from webmap.base.errors import ConfigError

BEGIN, NOW = 1_500_000_000 * SECOND, 1_700_000_000 * SECOND


def playback(**options):
    """A playback of sixty seconds that has begun."""
    options = {"start": 0.0, "rate": 1.0, "loop": False, "now": NOW, **options}
    made = Playback(BEGIN, BEGIN + 60 * SECOND, **options)
    made.begin(NOW)
    return made


def after(seconds):
    return NOW + round(seconds * SECOND)


def obey(made, line, now):
    made.obey(read_command(line), after(now))


def test_the_position_moves_with_the_rate():
    made = playback(start=10.0, rate=2.0)
    assert made.seconds_at(after(5)) == 20.0


def test_a_pause_holds_the_position_and_play_continues_there():
    made = playback()
    obey(made, "pause", 5)
    made.begin(after(5))
    assert made.seconds_at(after(50)) == 5.0
    obey(made, "play", 50)
    made.begin(after(50))
    assert made.seconds_at(after(52)) == 7.0
    assert made.jumps == 0


def test_a_seek_waits_at_its_position_until_the_turn_begins():
    made = playback()
    obey(made, "seek 30", 5)
    assert made.seconds_at(after(9)) == 30.0
    made.begin(after(9))
    assert made.seconds_at(after(10)) == 31.0
    assert (made.jumps, made.turn) == (1, 1)


def test_a_seek_beyond_the_end_leads_to_the_end():
    made = playback()
    obey(made, "seek 1e9", 5)
    assert made.seconds_at(after(5)) == 60.0


def test_a_seek_does_not_end_a_pause():
    made = playback()
    obey(made, "pause", 5)
    obey(made, "seek 30", 6)
    made.begin(after(6))
    assert not made.playing
    assert made.seconds_at(after(20)) == 30.0


def test_a_new_rate_keeps_the_position_and_the_turn():
    made = playback()
    obey(made, "rate 4", 10)
    assert made.seconds_at(after(10)) == 10.0
    assert made.seconds_at(after(11)) == 14.0
    assert made.turn == 0


def test_stamps_never_go_back_after_a_jump():
    made = playback()
    before = made.pace(after(20)).moved(BEGIN + 20 * SECOND)
    obey(made, "seek 5", 20)
    made.begin(after(20))
    assert made.pace(after(20)).moved(BEGIN + 4 * SECOND) >= before


def test_at_first_the_age_of_a_message_from_before_the_recording_is_kept():
    assert playback().pace(NOW).moved(BEGIN - SECOND) == NOW - SECOND


def test_after_the_end_play_begins_where_the_playing_began():
    made = playback(start=10.0)
    made.finish(BEGIN + 60 * SECOND)
    assert (made.ended, made.playing) == (True, False)
    assert made.seconds_at(after(99)) == 60.0
    obey(made, "play", 99)
    assert (made.ended, made.playing) == (False, True)
    assert made.seconds_at(after(99)) == 10.0


def test_with_loop_the_end_is_the_begin_of_the_next_round():
    made = playback(loop=True)
    made.finish(BEGIN + 60 * SECOND)
    assert (made.ended, made.playing, made.jumps) == (False, True, 1)
    assert made.seconds_at(after(60)) == 0.0


def test_a_second_pause_changes_nothing():
    made = playback()
    obey(made, "pause", 5)
    obey(made, "pause", 6)
    assert made.turn == 1


@pytest.mark.parametrize("line", ["again", "play", "pause", "seek 12.5", "rate 2.0"])
def test_a_command_is_read_back_from_its_line(line):
    assert read_command(line).line == line


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("rate", 0),
        ("rate", 1e9),
        ("rate", True),
        ("rate", "2"),
        ("rate", math.nan),
        ("seek", -1),
        ("seek", math.inf),
        ("seek", 10**400),
        ("seek", None),
        ("seek", [1]),
        ("play", 1),
        ("stop", None),
        (None, None),
        ({}, []),
    ],
)
def test_an_invalid_command_is_refused_with_what_was_expected(name, value):
    with pytest.raises(ConfigError, match=r"from|is again, play, pause"):
        command_of(name, value)


@given(some.text())
def test_any_line_is_a_command_or_refused(line):
    with contextlib.suppress(ConfigError):
        assert isinstance(read_command(line), PlaybackCommand)
