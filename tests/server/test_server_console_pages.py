"""Consoles open and close: nothing of a console is left after its page is closed."""

import asyncio

import pytest
from page_loop import make_model, objects_left, open_page

from equipment.waiting import wait_for
from webmap import Bridge, Robot, RobotConfig
from webmap.console import make_robot
from webmap.console.console import Console
from webmap.console.page import build as build_console
from webmap.core.map import Layer
from webmap.features.log.rosout import RosoutPanel, log_of
from webmap.server import open_pages as host_module


@pytest.fixture
def bridge():
    return Bridge("ws://localhost:9090")


@pytest.fixture
def robots(loop, bridge):
    def make():
        return [
            make_robot(
                RobotConfig.from_dict(
                    {
                        "name": name,
                        "bridge": bridge.url,
                        "odometry": f"/{name}/odom",
                        "twist": f"/{name}/cmd_vel",
                        "scan": f"/{name}/scan",
                        "battery": f"/{name}/battery",
                        "cameras": f"/{name}/camera/compressed",
                        "move": f"/{name}/goal",
                        "initial_pose": f"/{name}/initialpose",
                    }
                ),
                [bridge],
            )
            for name in ("Bob", "Ann", "Cid")
        ]

    robots = loop.call(make)
    yield robots
    loop.call(lambda: [robot.destroy() for robot in robots])


class Held:
    """Counts of everything that outlives pages."""

    def __init__(self, bridge: Bridge, robots: list[Robot]) -> None:
        # Tasks and the bridge are read in the model's thread, which owns them.
        self.tasks = len(asyncio.all_tasks())
        self.topics = {
            name: len(topic.listeners) for name, topic in bridge._topics.items()
        }
        self.callbacks = [
            len(callbacks)
            for callbacks in (bridge._on_open, bridge._on_close, bridge._on_error)
        ]
        self.modules = [len(robot.modules) for robot in robots]
        self.maps = [len(robot.maps) for robot in robots]
        self.elements = [len(robot.fragment) for robot in robots]
        self.watched = [m.watched for r in robots for m in r.modules if _camera(m)]
        self.listeners = sum(
            len(element._listeners) for robot in robots for element in _all(robot.svg)
        )
        self.layers = len(Layer._shared)
        self.log_watchers = log_of(bridge)._watchers


def _camera(module: object) -> bool:
    return hasattr(module, "watched")


def _all(element):
    yield element
    for child in getattr(element, "children", ()):
        if hasattr(child, "children"):
            yield from _all(child)


def test_a_hundred_consoles_opened_and_closed_leave_nothing_behind(
    loop, bridge, robots, monkeypatch
):
    monkeypatch.setattr(host_module, "KEPT_FOR", 0.0)
    opened, held, names = Console(robots), {}, []

    def build(page):
        build_console(page, [bridge], opened, None, "test", "test")
        opened.opened(page)
        (map,) = page.maps
        # Everything that subscribes: the card with its feed and camera, and the log.
        map.set_selected(robots[len(names) % 3])
        panel = next(m for m in map.modules if isinstance(m, RosoutPanel))
        panel.on_message({"open": True})
        held.update(vars(Held(bridge, robots)))
        names.append(page.viewer.name)

    opened.add_grid(bridge, "/map")
    model = make_model(loop, build)

    def round_of(count):
        for number in range(count):
            handle, _ = open_page(model, f"page{number:04}")
            handle.closed()
        loop.call(lambda: True)
        wait_for(lambda: not model._hosts)
        # Cancelled tasks end in the next turns of the loop.
        wait_for(lambda: loop.call(lambda: len(asyncio.all_tasks())) <= tasks)

    tasks = loop.call(lambda: len(asyncio.all_tasks()))
    round_of(10)
    before = loop.call(lambda: vars(Held(bridge, robots)))
    more = objects_left(round_of, 4, 25)
    after = loop.call(lambda: vars(Held(bridge, robots)))
    assert len(names) == 110
    assert after == before
    assert loop.runtime._watchers == {}
    assert min(more) < 2 * 25, "fewer than two objects for each page"
    # These are the counts that an open console increases.
    differs = {name for name in before if held[name] != before[name]}
    assert differs >= {"tasks", "topics", "modules", "maps", "watched", "layers"}
