"""The least role for each message of a page, and for each event of an element."""

import importlib
import inspect
import pkgutil
from types import SimpleNamespace

import pytest

import webmap
from webmap import Map
from webmap.base.errors import ConfigError
from webmap.base.roles import NOT_YOURS, ROLES, covers
from webmap.core.operators import Viewer
from webmap.core.world_view import least_role
from webmap.scene import html
from webmap.scene.element import Event


def of_pages():
    """Yield the classes of WebMap that get messages of pages."""
    for found in pkgutil.walk_packages(webmap.__path__, "webmap."):
        if not found.name.endswith("__main__"):
            module = importlib.import_module(found.name)
            for each in vars(module).values():
                taken = inspect.isclass(each) and getattr(each, "on_message", None)
                if taken and each.__module__ == found.name:
                    (_, message) = inspect.signature(taken).parameters.values()
                    if message.annotation == dict[str, object] or "dict" in str(
                        message.annotation
                    ):
                        yield each


CLASSES = list(of_pages())


def test_every_module_of_webmap_states_who_may_send_each_message():
    assert len(CLASSES) >= 15
    assert [each.__name__ for each in CLASSES if not vars(each).get("MAY_SEND")] == []
    for each in CLASSES:
        assert set(each.MAY_SEND.values()) <= set(ROLES), each


class Part:
    MAY_SEND = {"look": "viewer", "send": "operator", "align": "admin"}

    def __init__(self, map):
        self.map = map
        self.browser_part = map.add_browser_part(self, "features/view/follow.js", {})
        self.messages = []

    def on_message(self, message):
        self.messages.append(message)


@pytest.mark.parametrize(
    ("message", "least"),
    [
        ({"look": 1}, "viewer"),
        ({"op": "look", "send": 1}, "viewer"),
        ({"look": 1, "send": 1}, "operator"),
        ({"look": 1, "unknown": 1}, "operator"),
        ({"look": 1, "align": 1}, "admin"),
        ({"op": "unknown"}, None),
        ({"op": "unknown", "look": 1}, None),
        ({"op": ["look"]}, None),
        ({"unknown": 1}, None),
        ({}, None),
    ],
)
@pytest.mark.parametrize("role", ROLES)
def test_a_message_reaches_a_module_only_from_those_who_may_send_it(
    make_page, role, message, least
):
    page = make_page(Viewer("v1", "Vic", role))
    map = Map(page.element("webmap_container"))
    part = Part(map)
    assert least_role(part, message) == least
    map.on_module_message(part.browser_part.instance, message)
    may = least is not None and covers(role, least)
    assert part.messages == ([message] if may else [])
    assert len(page.channel.errors) == (not may)


def test_a_module_that_states_nothing_gets_messages_of_operators():
    assert least_role(SimpleNamespace(), {"anything": 1}) == "operator"


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("least", [None, *ROLES])
def test_a_handler_gets_the_events_of_those_who_may(make_page, role, least):
    page = make_page(Viewer("v1", "Vic", role))
    button, calls = html.button(), []
    button.on("click", calls.append, **({} if least is None else {"role": least}))
    page.dispatch(1, button, Event(kind="click", viewer=page.viewer, page=page))
    assert len(calls) == covers(role, least or "operator")
    assert len(page.channel.errors) == 1 - len(calls)


@pytest.fixture
def robots():
    """Two robots, of which the person below may drive the first."""
    mine, other = webmap.Robot("bay2/bob"), webmap.Robot("bay1/eve")
    yield mine, other
    mine.destroy()
    other.destroy()


def person(role="admin", patterns=("bay2/*",)):
    return Viewer("v1", "Vic", role, robots=patterns)


@pytest.mark.parametrize("role", ROLES)
def test_a_viewer_may_drive_robots_by_their_names_and_tags(robots, role):
    mine, other = robots
    drives = role != "viewer"
    assert person(role).may_drive(mine.id) is drives
    assert not person(role).may_drive(other.id)
    tagged = person(role, ("tag:bay 2",))
    assert not tagged.may_drive(other.id)
    other.set_tags(["lift", "bay 2"])
    assert tagged.may_drive(other.id) is drives
    other.set_tags([])
    assert not tagged.may_drive(other.id)
    assert Viewer("v2", "Eve", role).may_drive(other.id) is drives


def test_a_robot_that_has_ended_belongs_to_those_who_may_drive_all(robots):
    mine, _ = robots
    mine.destroy()
    assert not person().may_drive(mine.id)
    assert Viewer("v2", "Eve").may_drive(mine.id)


def test_a_pattern_of_a_program_is_checked():
    with pytest.raises(ConfigError, match="a pattern of robots"):
        person(patterns=("tag:",))


OPS = [
    (each, op, least)
    for each in CLASSES
    for op, least in each.MAY_SEND.items()
    if least != "viewer"
]


@pytest.mark.parametrize(
    ("cls", "op", "least"), OPS, ids=[f"{cls.__name__}-{op}" for cls, op, _ in OPS]
)
def test_no_message_about_the_robot_of_another_person_reaches_a_module(
    make_page, robots, cls, op, least
):
    class Stated(Part):
        MAY_SEND = cls.MAY_SEND

    mine, _ = robots
    page = make_page(person())
    map = Map(page.element("webmap_container"))
    part = Stated(map)
    for robot in robots:
        for message in (
            {op: robot.id},
            {"op": op, "robot": robot.id},
            {op: {"robot": robot.id, "x": 1.0}},
            {op: [robot.id]},
            {op: [{"to": {robot.id: 1, "robot": robot.id}}, None]},
        ):
            part.messages.clear()
            page.channel.calls.clear()
            map.on_module_message(part.browser_part.instance, message)
            assert bool(part.messages) is (robot is mine)
            assert page.channel.errors == ([] if robot is mine else [NOT_YOURS])


def test_looking_at_the_robot_of_another_person_is_allowed(make_page, robots):
    _, other = robots
    page = make_page(person())
    part = Part(Map(page.element("webmap_container")))
    part.map.on_module_message(part.browser_part.instance, {"look": other.id})
    assert part.messages == [{"look": other.id}]


@pytest.mark.parametrize("each", CLASSES, ids=lambda each: each.__name__)
def test_each_message_of_each_module_reaches_it_only_from_its_least_role(
    make_page, each
):
    class Declared(Part):
        MAY_SEND = each.MAY_SEND

    for role in ROLES:
        map = Map(make_page(Viewer("v1", "Vic", role)).element("webmap_container"))
        part = Declared(map)
        for op, least in [*each.MAY_SEND.items(), ("undeclared", None)]:
            for message in ({"op": op}, {op: 1}):
                part.messages.clear()
                map.on_module_message(part.browser_part.instance, message)
                may = least is not None and covers(role, least)
                assert part.messages == [message] * may, (role, op)
