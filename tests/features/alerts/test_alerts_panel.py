"""The panel of each page: what it sends, and what it accepts."""

from pathlib import Path

import pytest
from module_fakes import Channel

import webmap
from webmap import Map
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page
from webmap.features.alerts.alerts import MOST, AlertPanel, Alerts

PACKAGE = Path(webmap.__file__).parent


@pytest.fixture
def alerts():
    alerts = Alerts()
    alerts.report("r1", "Bob", "lost", "No pose received", 100)
    return alerts


class Browser:
    """A page of a viewer with the panel, and the messages that the page received."""

    def __init__(self, alerts, folder, name="Ann", role="operator"):
        entry = PageEntry("/", lambda page: None, None, folder, "test")
        self.attached = []
        channel = Channel()
        channel.attach = lambda *args: self.attached.append(args)
        self.page = Page(entry, channel, Viewer(name, name, role), None, {})
        self.map = Map(self.page.element("map"), 700, 500)
        self.panel = self.map.add_module(AlertPanel, alerts)
        self.got = []
        self.panel.browser_part.send = self.got.append

    def problem(self):
        return [message["problem"] for message in self.got if "problem" in message][-1]


@pytest.fixture
def open_page(alerts, tmp_path):
    pages = []

    def open_(**who):
        pages.append(Browser(alerts, tmp_path, **who))
        return pages[-1]

    yield open_
    for each in pages:
        each.page.close()


def test_the_script_and_the_style_of_the_panel_exist(open_page):
    ((_, _, script, options, style),) = open_page().attached
    assert (PACKAGE / script).is_file()
    assert (PACKAGE / style).is_file()
    assert options["may"] is True


def test_a_page_gets_all_alerts_when_it_is_ready_and_then_the_changes(
    open_page, alerts
):
    ann = open_page()
    ann.panel.on_ready()
    (first,) = ann.got
    assert [alert["name"] for alert in first["alerts"]] == ["Bob"]
    assert first["ids"] == list(alerts.listed)
    ann.panel.poll()
    assert len(ann.got) == 1
    alerts.report("r2", "Eve", "lost", "No pose received", 101)
    ann.panel.poll()
    assert [alert["name"] for alert in ann.got[-1]["alerts"]] == ["Eve"]
    ann.panel.on_ready()
    assert len(ann.got[-1]["alerts"]) == 2


def test_all_viewers_see_who_acknowledged_an_alert(open_page, alerts):
    ann, bob = open_page(), open_page(name="Bob")
    ann.panel.on_message({"acknowledge": list(alerts.listed)})
    assert ann.problem() == ""
    bob.panel.poll()
    (alert,) = bob.got[-1]["alerts"]
    assert alert["by"] == "Ann"
    assert alert["acknowledged"] > 0


def test_a_viewer_may_not_acknowledge(open_page, alerts):
    eve = open_page(name="Eve", role="viewer")
    assert eve.attached[0][3]["may"] is False
    eve.panel.on_message({"acknowledge": list(alerts.listed)})
    assert "sign in as an operator" in eve.problem()
    assert [alert.by for alert in alerts.listed.values()] == [None]


@pytest.mark.parametrize(
    "ids",
    [None, 7, "all", {"id": 1}, [True], ["1"], [1.0], [None], [[1]], [1] * (MOST + 1)],
)
def test_a_wrong_list_of_alerts_is_refused_with_the_reason(open_page, alerts, ids):
    ann = open_page()
    ann.panel.on_message({"acknowledge": ids})
    assert ann.problem().startswith(f"Not acknowledged: a list of at most {MOST}")
    assert len(ann.problem()) < 250
    assert [alert.by for alert in alerts.listed.values()] == [None]


def test_an_unknown_alert_is_reported_and_the_others_are_acknowledged(
    open_page, alerts
):
    ann = open_page()
    ann.panel.on_message({"acknowledge": [*alerts.listed, -1, 10**30]})
    assert ann.problem() == "No longer in the list: 2 of the acknowledged alerts."
    assert [str(alert.by) for alert in alerts.listed.values()] == ["Ann"]


def test_a_press_on_the_robot_selects_it_and_moves_it_into_view(open_page, robot):
    ann = open_page()
    ann.map.add_robot(robot)
    robot.valid, robot.position = True, robot.position.__class__(5000, 0, 0)
    ann.panel.on_message({"select": robot.id})
    assert ann.map.selected is robot
    assert ann.problem() == ""
    x, y = ann.map.world.tf.apply(5000, 0)
    assert (x, y) == (350, 250)


@pytest.mark.parametrize("id", ["r999", None, 5, ["r1"]])
def test_an_unknown_robot_is_not_selected(open_page, id):
    ann = open_page()
    ann.panel.on_message({"select": id})
    assert ann.problem() == "This robot is no longer on the page."


def test_an_unknown_message_is_ignored(open_page, caplog):
    ann = open_page()
    ann.panel.on_message({"sound": True})
    assert ann.got == []
    assert "unknown message" in caplog.text
