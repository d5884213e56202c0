"""Alerts survive a restart, and the shift log has what becomes of them."""

import asyncio
import json
from types import SimpleNamespace

import pytest

from webmap.core.operators import Operator
from webmap.core.shift_log import shift_log
from webmap.features.alerts.alert_store import AlertKeeper
from webmap.features.alerts.alerts import MOST, Alerts

ANA = Operator("Ana", "desk 4", "91c2", verified=True)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))
    return tmp_path


def keeper(alerts):
    bridge = SimpleNamespace(name="hall", url="ws://hall:9090")
    bob = SimpleNamespace(id="r1", pose_source=SimpleNamespace(bridge=bridge))
    return AlertKeeper(alerts, lambda: [bob], "console")


def test_alerts_and_who_acknowledged_them_survive_a_restart():
    first = Alerts()
    kept = keeper(first)
    first.report("r1", "Bob", "battery", "Battery at 9 %", 100.0)
    first.report("r1", "Bob", "lost", "No pose received", 101.0)
    first.acknowledge(next(iter(first.listed)), ANA, 102.0)
    asyncio.run(kept.look())
    second = Alerts()
    keeper(second)
    battery, lost = second.listed.values()
    assert (battery.text, battery.by, battery.acknowledged) == (
        "Battery at 9 %",
        ANA,
        102.0,
    )
    assert (lost.began, lost.ended, lost.by) == (101.0, None, None)
    assert set(second.listed) != set(first.listed)  # an old page has other ids
    # It is the same alert if its condition is still true, and ends if it is not.
    second.report("r1", "Bob", "lost", "No pose received", 200.0)
    assert (len(second.listed), lost.count) == (2, 1)
    second.end_others((), 201.0)
    assert (battery.ended, lost.ended) == (201.0, 201.0)


def test_a_damaged_file_is_a_sentence_and_an_empty_list(folder):
    file = folder / "alerts" / "console.json"
    file.parent.mkdir()
    for damaged in (b"", b"[{", b'[{"id": 1}]', b"\xff\xfe", b"[" * 100_000):
        file.write_bytes(damaged)
        before = shift_log.total
        alerts = Alerts()
        keeper(alerts)
        assert alerts.listed == {}
        (entry,) = shift_log.since(before)
        assert entry.text.startswith("The earlier alerts cannot be read")


def test_a_long_file_keeps_the_newest_alerts(folder):
    many = Alerts()
    kept = keeper(many)
    for number in range(MOST):
        many.report(f"r{number}", "Bob", "lost", "No pose received", float(number))
    asyncio.run(kept.look())
    file = folder / "alerts" / "console.json"
    file.write_text(json.dumps(2 * json.loads(file.read_text())))
    again = Alerts()
    keeper(again)
    assert len(again.listed) == MOST


def test_a_disk_that_refuses_loses_no_alert_of_the_list(monkeypatch, caplog):
    def full(file, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("webmap.features.alerts.alert_store.write_file", full)
    alerts = Alerts()
    kept = keeper(alerts)
    alerts.report("r1", "Bob", "lost", "No pose received", 1.0)
    asyncio.run(kept.look())
    assert len(alerts.listed) == 1
    assert "the alerts are lost at a restart" in caplog.text


def test_the_shift_log_has_begin_acknowledgement_and_end():
    alerts = Alerts()
    kept = keeper(alerts)
    before = shift_log.total
    alerts.report("r1", "Bob", "lost", "No pose received", 1.0)
    asyncio.run(kept.look())
    alerts.acknowledge(next(iter(alerts.listed)), ANA, 2.0)
    asyncio.run(kept.look())
    alerts.end_others((), 3.0)
    asyncio.run(kept.look())
    asyncio.run(kept.look())
    entries = shift_log.since(before)
    assert [(e.person, e.text, e.facts["event"]) for e in entries] == [
        ("", "No pose received", "began"),
        ("Ana", "acknowledged: No pose received", "acknowledged"),
        ("", "over: No pose received", "over"),
    ]
    assert {(e.robot, e.facts["bridge"]) for e in entries} == {("r1", "hall")}
