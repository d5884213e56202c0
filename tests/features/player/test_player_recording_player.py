"""The player of a recording: what a page receives, and which commands are valid."""

import json
import math

import pytest

from webmap.bags.playback import MARKS, STATUS, PlaybackCommand
from webmap.features.player.recording_player import RecordingPlayer, expect_jumps


def status(**changes):
    usual = {"name": "office", "at": 3.0, "seconds": 60.0, "rate": 1.0, "jumps": 1}
    return {**usual, "playing": True, "ended": False, "problem": "", **changes}


def publish(link, topic, content):
    link.publish(topic, {"data": json.dumps(content)})


@pytest.fixture
def given():
    return []


@pytest.fixture
def player(map, link, given, monkeypatch):
    player = map.add_module(RecordingPlayer, link, given.append)
    player.sent = []
    monkeypatch.setattr(player.browser_part, "send", player.sent.append)
    return player


def test_a_page_receives_the_status_and_the_marks(player, link):
    mark = {"at": 5.0, "kind": "stop", "text": "Stop on /e_stop"}
    publish(link, STATUS, status())
    publish(link, MARKS, {"marks": [mark], "left_out": 0, "read": 1.0})
    assert player.sent == [
        {"status": status()},
        {"marks": {"marks": [mark], "left_out": 0, "read": 1.0}},
    ]


def test_a_reloaded_page_receives_the_newest_status_again(player, link):
    player.on_ready()
    assert player.sent == []
    publish(link, STATUS, status())
    player.on_ready()
    assert player.sent == [{"status": status()}] * 2


def test_a_later_page_receives_marks_that_were_found_in_several_parts(
    player, map, link, monkeypatch
):
    marks = {"marks": [], "left_out": 0, "read": 0.5}
    publish(link, MARKS, marks)
    publish(link, MARKS, marks | {"read": 1.0})
    later = map.add_module(RecordingPlayer, link, print)
    sent = []
    monkeypatch.setattr(later.browser_part, "send", sent.append)
    later.on_ready()
    assert sent == [{"marks": marks | {"read": 1.0}}]


@pytest.mark.parametrize(
    "text", ["", "Recording office: 1.0 of 4.0 s", "[]", '{"at": "x"}', "null", "{"]
)
def test_another_text_on_the_topics_is_ignored(player, link, text):
    link.publish(STATUS, {"data": text})
    link.publish(MARKS, {"data": text})
    assert player.sent == []


@pytest.mark.parametrize(
    ("message", "command"),
    [
        ({"command": "play"}, PlaybackCommand("play")),
        ({"command": "pause"}, PlaybackCommand("pause")),
        ({"command": "seek", "value": 12}, PlaybackCommand("seek", 12.0)),
        ({"command": "rate", "value": 0.25}, PlaybackCommand("rate", 0.25)),
    ],
)
def test_a_command_of_the_page_is_given_to_the_replay(player, given, message, command):
    player.on_message(message)
    assert given == [command]


@pytest.mark.parametrize(
    "message",
    [
        {},
        {"command": "drive"},
        {"command": ["play"]},
        {"command": "play\nseek 3"},
        {"command": "seek", "value": "3\nrate 2"},
        {"command": "seek", "value": math.nan},
        {"command": "rate", "value": {"a": 1}},
        {"command": "rate", "value": 10**400},
    ],
)
def test_a_command_that_is_not_valid_is_reported_and_not_given(
    player, given, channel, message
):
    player.on_message(message)
    assert given == []
    assert "got" in channel.errors[0]


def test_the_first_page_begins_the_recording_anew_and_later_ones_do_not(
    player, link, given
):
    publish(link, STATUS, status(jumps=0))
    publish(link, STATUS, status(jumps=1))
    assert given == [PlaybackCommand("again")]


def test_a_later_page_does_not_begin_the_recording_anew(player, link, given):
    publish(link, STATUS, status(jumps=1))
    assert given == []


def test_a_jump_of_the_position_clears_the_trails(link, robot):
    trail = robot.add_module("Trail")
    expect_jumps(link, lambda: [robot])
    publish(link, STATUS, status(jumps=1))
    trail._begin((1.0, 0.0))
    publish(link, STATUS, status(jumps=1))
    assert trail.points
    publish(link, STATUS, status(jumps=2))
    assert trail.points == []


def test_a_jump_of_the_position_is_no_jump_of_the_robot(link, robot, monkeypatch):
    expected = []
    monkeypatch.setattr(type(robot), "expect_jump", lambda self: expected.append(self))
    expect_jumps(link, lambda: [robot])
    for jumps in (1, 1, 2):
        publish(link, STATUS, status(jumps=jumps))
    link.publish(STATUS, {"data": "no status"})
    assert expected == [robot, robot]
