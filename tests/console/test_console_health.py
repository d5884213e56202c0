"""The health of the selected robot, on its card."""

from types import SimpleNamespace

import pytest

from webmap import html
from webmap.console.card_parts import MOST, RobotHealth


class Diagnosing:
    hold = 10.0

    def __init__(self, *parts):
        self.parts = [
            SimpleNamespace(name=name, level=level, message=message, shared=shared)
            for name, level, message, *rest in parts
            for shared in [bool(rest)]
        ]


@pytest.fixture
def map():
    return SimpleNamespace(selected=None)


def chosen(map, *modules):
    map.selected = SimpleNamespace(modules=[*modules, object()])


def shown_parts(health):
    items = health.element.children[1].children
    return [(item.get("data-level"), item.text) for item in items]


def test_parts_that_are_not_ok_are_listed_with_their_level_and_message(map):
    card = html.section()
    health = RobotHealth(map, card)
    assert health.element.get("hidden") is not None
    diagnosing = Diagnosing(
        ("motors", "error", "<b>hot</b>"),
        ("laser", "stale", "no data for 12 s"),
        ("battery", "warn", "low"),
        ("wheels", "ok", "fine"),
    )
    chosen(map, diagnosing)
    health.on_select()
    assert health.element.get("hidden") is None
    assert shown_parts(health) == [
        ("wrong", "Error: motors: <b>hot</b>"),
        ("note", "Stale: laser"),
        ("warning", "Warning: battery: low"),
    ]
    first = health.element.children[1].children[0]
    health.poll()
    assert health.element.children[1].children[0] is first, (
        "the list is not replaced without a change"
    )
    diagnosing.parts = diagnosing.parts[3:]
    health.poll()
    assert shown_parts(health) == [("good", "All OK: 1 part")]
    map.selected = None
    health.on_select()
    assert health.element.get("hidden") is not None
    health.destroy()
    assert not card.children


def test_a_robot_without_diagnostics_shows_no_health(map):
    chosen(map, SimpleNamespace(parts=["of something else"]))
    health = RobotHealth(map, html.section())
    assert health.element.get("hidden") is not None


NO_DATA = ("note", "No data: no diagnostics of this robot received yet")


@pytest.mark.parametrize("parts", [[], [("base: Motors", "ok", "fine", "nobody's")]])
def test_a_robot_without_received_diagnostics_is_shown_as_no_data(map, parts):
    chosen(map, Diagnosing(*parts))
    health = RobotHealth(map, html.section())
    assert health.element.get("hidden") is None
    assert shown_parts(health) == [NO_DATA]


def test_a_bad_part_of_an_unknown_robot_is_listed_with_robot_unknown(map):
    nobodys = [
        ("base: Motors", "error", "hot", "nobody's"),
        ("base: Laser", "stale", "no data for 12 s", "nobody's"),
    ]
    chosen(map, Diagnosing(*nobodys, ("robot_0/base: Battery", "ok", "full")))
    health = RobotHealth(map, html.section())
    assert shown_parts(health) == [
        ("wrong", "Error: base: Motors (robot unknown): hot"),
        ("note", "Stale: base: Laser (robot unknown)"),
    ]


def test_parts_above_the_limit_are_only_counted(map):
    parts = [(f"part {number}", "error", "bad") for number in range(MOST + 3)]
    chosen(map, Diagnosing(*parts))
    health = RobotHealth(map, html.section())
    assert len(shown_parts(health)) == MOST + 1
    assert shown_parts(health)[-1] == ("note", "and 3 more parts")
