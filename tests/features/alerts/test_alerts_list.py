"""The list of alerts: begin, end, acknowledgement, flapping, and the limit."""

import pytest

from webmap.features.alerts.alerts import AGAIN, MOST, Alerts


@pytest.fixture
def alerts() -> Alerts:
    return Alerts()


def lost(alerts, active, now, robot="r1", text="No pose received"):
    if active:
        alerts.report(robot, f"Robot {robot}", "lost", text, now)
    else:
        alerts.end_others(set(alerts._newest) - {(robot, "lost")}, now)


def only(alerts):
    (alert,) = alerts.listed.values()
    return alert


def test_an_alert_begins_once_and_ends_by_itself(alerts):
    lost(alerts, False, 90)
    assert not alerts.listed
    for now in (100, 101, 102):
        lost(alerts, True, now)
    alert = only(alerts)
    assert (alert.name, alert.kind, alert.text) == (
        "Robot r1",
        "lost",
        "No pose received",
    )
    assert (alert.began, alert.ended, alert.count) == (100, None, 1)
    lost(alerts, False, 112)
    lost(alerts, False, 130)
    assert only(alerts).ended == 112


def test_a_condition_that_flaps_is_one_alert_with_a_count(alerts):
    for second in range(60):
        lost(alerts, second % 2 == 0, second)
    alert = only(alerts)
    assert (alert.began, alert.ended, alert.count) == (0, 59, 30)


def test_an_acknowledged_alert_has_the_first_viewer_and_the_time(alerts):
    lost(alerts, True, 100)
    id = only(alerts).id
    assert alerts.acknowledge(id, "Ann", 105)
    assert alerts.acknowledge(id, "Bob", 106)
    assert (only(alerts).by, only(alerts).acknowledged) == ("Ann", 105)


def test_an_unknown_alert_cannot_be_acknowledged(alerts):
    assert not alerts.acknowledge(7, "Ann", 1)


def test_an_acknowledged_condition_that_returns_soon_is_the_same_alert(alerts):
    lost(alerts, True, 100)
    alerts.acknowledge(only(alerts).id, "Ann", 101)
    lost(alerts, False, 102)
    lost(alerts, True, 103)
    assert (only(alerts).by, only(alerts).count) == ("Ann", 2)


def test_an_acknowledged_condition_that_returns_later_is_a_new_alert(alerts):
    lost(alerts, True, 100)
    alerts.acknowledge(only(alerts).id, "Ann", 101)
    lost(alerts, False, 102)
    lost(alerts, True, 102 + AGAIN)
    first, second = alerts.listed.values()
    assert (first.by, first.ended, second.by, second.count) == ("Ann", 102, None, 1)
    lost(alerts, False, 200)
    assert (first.ended, second.ended) == (102, 200)


def test_only_a_text_that_differs_in_more_than_numbers_is_a_change(alerts):
    lost(alerts, True, 100, text="moves at 0.30 m/s")
    version = alerts.version
    lost(alerts, True, 101, text="moves at 0.31 m/s")
    assert alerts.since(version) == []
    lost(alerts, True, 102, text="turns at 0.31 rad/s")
    assert [alert.text for alert in alerts.since(version)] == ["turns at 0.31 rad/s"]


def test_a_long_text_of_a_robot_is_shortened(alerts):
    lost(alerts, True, 100, text="x" * 1_000_000)
    assert len(only(alerts).text) < 2000


def test_the_alerts_of_a_robot_that_is_no_longer_shown_end(alerts):
    lost(alerts, True, 100, "r1")
    lost(alerts, True, 100, "r2")
    alerts.end_others({("r2", "lost")}, 110)
    assert [alert.ended for alert in alerts.listed.values()] == [110, None]


def test_a_full_list_drops_the_oldest_acknowledged_alert_first(alerts):
    for number in range(MOST):
        lost(alerts, True, number, f"r{number}")
    third = list(alerts.listed.values())[2]
    alerts.acknowledge(third.id, "Ann", 300)
    lost(alerts, True, 301, "new")
    assert len(alerts.listed) == MOST
    assert third.id not in alerts.listed
    assert alerts.dropped == 0


def test_a_full_list_of_new_alerts_drops_those_that_are_over_first(alerts):
    for number in range(MOST):
        lost(alerts, True, number, f"r{number}")
    lost(alerts, False, 300, "r5")
    lost(alerts, True, 301, "a")
    assert "r5" not in {alert.robot for alert in alerts.listed.values()}
    lost(alerts, True, 302, "b")
    assert "r0" not in {alert.robot for alert in alerts.listed.values()}
    assert alerts.dropped == 2


def test_an_active_alert_that_left_the_full_list_does_not_begin_again(alerts):
    robots = [f"r{number}" for number in range(3 * MOST)]
    for now in range(3):
        for robot in robots:
            lost(alerts, True, now, robot)
    assert alerts.dropped == 2 * MOST
    for robot in robots:
        lost(alerts, False, 4, robot)
    assert len(alerts._newest) == MOST, (
        "alerts that are neither listed nor active are removed"
    )


def test_only_changed_alerts_are_sent_again(alerts):
    lost(alerts, True, 1, "r1")
    lost(alerts, True, 1, "r2")
    version = alerts.version
    lost(alerts, False, 2, "r1")
    assert [alert.robot for alert in alerts.since(version)] == ["r1"]
