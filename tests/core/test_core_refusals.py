"""Refused messages are counted and shown to users."""

from datetime import UTC, datetime

from webmap.core.refusals import MOST, Refusals

AT = datetime(2026, 11, 21, 17, 0, tzinfo=UTC)


def test_each_sender_has_one_line_and_the_newest_is_first():
    refusals = Refusals()
    refusals.note("Ann", 3, "drive: too old", AT)
    refusals.note("Ben", 1, "command: no JSON", AT)
    refusals.note("Ann", 2, "take: Ben drives it", AT)
    assert [(row.by, row.count, row.last) for row in refusals.rows] == [
        ("Ann", 5, "take: Ben drives it"),
        ("Ben", 1, "command: no JSON"),
    ]
    assert refusals.total == 6


def test_all_refusals_are_counted_and_only_the_newest_senders_are_kept():
    refusals = Refusals()
    for number in range(MOST + 7):
        refusals.note(f"viewer {number}", 1, "command: no JSON", AT)
    assert refusals.total == MOST + 7
    assert len(refusals.rows) == MOST
    assert refusals.rows[0].by == f"viewer {MOST + 6}"
