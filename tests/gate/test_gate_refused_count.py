"""Refused messages are counted for the display, each message once."""

import pytest

from webmap.gate.actions import SendToDisplay
from webmap.gate.protocol import Connect, Disconnect, FromPage, RefusedCount
from webmap.gate.rules.gate import Gate


@pytest.fixture
def gate() -> Gate:
    gate = Gate()
    gate.handle(Connect("c1", "Ann", "operator"), 0.0)
    return gate


def counts(actions):
    messages = [
        action.message for action in actions if isinstance(action, SendToDisplay)
    ]
    return [message for message in messages if isinstance(message, RefusedCount)]


def garbage(gate, texts, at):
    return [
        count
        for text in texts
        for count in counts(gate.handle(FromPage("c1", text.encode()), at))
    ]


def test_nine_invalid_messages_at_once_are_counted_as_nine(gate):
    received = garbage(gate, ['{"op":"drive"}'] * 9, 1.0)
    received += (
        counts(gate.step(1.01)) + counts(gate.step(1.5)) + counts(gate.step(2.1))
    )
    assert sum(count.count for count in received) == 9
    assert {count.by for count in received} == {"Ann"}
    assert received[-1].last.startswith("command: ")


def test_the_refusals_of_one_page_are_reported_about_once_a_second(gate):
    received = []
    for tick in range(200):
        now = 1.0 + tick / 100
        received += garbage(gate, ["x"], now) if tick % 10 == 0 else []
        received += counts(gate.step(now))
    assert sum(count.count for count in received) >= 11
    assert len(received) <= 3


def test_remaining_refusals_are_reported_when_the_page_disconnects(gate):
    received = garbage(gate, ["x"], 1.0) + counts(gate.step(1.0))
    received += garbage(gate, ["y", "z"], 1.1)
    received += counts(gate.handle(Disconnect("c1"), 1.2))
    assert [count.count for count in received] == [1, 2]
    assert counts(gate.handle(Disconnect("c1"), 1.3)) == []


def test_a_refused_command_is_counted(gate):
    text = '{"op":"take","robot":"nobody"}'
    received = garbage(gate, [text], 1.0) + counts(gate.step(1.0))
    assert [count.last for count in received] == ["take: there is no robot 'nobody'"]
