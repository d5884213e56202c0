"""The console's page, without a browser."""

import asyncio
from pathlib import Path

import pytest

from webmap import Bridge, Robot, RobotConfig
from webmap.base.errors import ConfigError
from webmap.console import Console, make_robot, open_console
from webmap.console.page import build
from webmap.console.robot_card import RobotCard
from webmap.console.robot_list import RobotList, StateWords
from webmap.core.base_page import PageEntry
from webmap.core.operators import Viewer
from webmap.core.page import Page, site
from webmap.scene.element import Element
from webmap.scene.wire.session import SceneSession


class Publisher:
    def publish_file(self, path: Path) -> str:
        assert path.is_file()
        return f"/_webmap/files/{path.name}"

    def publish_image(self, image: Path) -> str:
        return f"/_webmap/images/{image.name}"

    def withdraw_image(self, url: str) -> None:
        pass


@pytest.fixture
def bridge() -> Bridge:
    return Bridge("ws://localhost:9090")


@pytest.fixture
def robots(bridge):
    names = ("Bob", "Ann")
    made = [
        make_robot(
            RobotConfig.from_dict(
                {
                    "name": name,
                    "bridge": bridge.url,
                    "odometry": "/odom",
                    "scan": "/scan",
                    "battery": "/b",
                }
            ),
            [bridge],
        )
        for name in names
    ]
    yield made
    for robot in made:
        robot.destroy()


def open_page() -> Page:
    entry = PageEntry("/", lambda page: None, None, Path(), "test")
    viewer = Viewer("v1", "Ann")
    return Page(entry, SceneSession(), viewer, Publisher(), {"map": (800.0, 600.0)})


def on_a_page(scenario, bridge, robots):
    """Build the console on a page, run a scenario with it, and close it."""

    async def run() -> None:
        page = open_page()
        with page.scope.active():
            opened = Console(robots)
            build(page, [bridge], opened, None, "test", "test")
            opened.opened(page)
        await asyncio.sleep(0)
        try:
            scenario(page)
        finally:
            page.close()

    asyncio.run(run())


def lines(page: Page) -> list[str]:
    return [
        button.children[2].text
        for item in page.element("robots").children
        for button in item.children[:1]
    ]


def test_every_robot_is_in_the_list_and_on_the_map(bridge, robots):
    def scenario(page: Page) -> None:
        assert lines(page) == ["Bob", "Ann"]
        assert page.maps[0].robots == robots

    on_a_page(scenario, bridge, robots)


def test_a_closed_page_leaves_nothing_on_the_robots(bridge, robots):
    before = [list(robot.modules) for robot in robots]

    def scenario(page: Page) -> None:
        page.maps[0].set_selected(robots[0])
        assert len(robots[0].modules) > len(before[0])

    on_a_page(scenario, bridge, robots)
    assert [list(robot.modules) for robot in robots] == before
    assert all(robot.maps == [] for robot in robots)


def test_the_card_shows_the_selected_robot_and_releases_the_previous_one(
    bridge, robots
):
    def scenario(page: Page) -> None:
        card, map = page.element("card"), page.maps[0]
        assert card.get("hidden") is not None
        for robot in robots:
            map.set_selected(robot)
            assert card.get("data-robot") == robot.id
        assert len(robots[0].modules) < len(robots[1].modules)
        map.set_selected(None)
        assert card.get("hidden") is not None

    on_a_page(scenario, bridge, robots)


def test_the_battery_of_a_robot_is_shown_in_the_list_and_on_the_card(bridge, robots):
    def scenario(page: Page) -> None:
        page.maps[0].set_selected(robots[0])
        battery = next(m for m in robots[0].modules if hasattr(m, "charge"))
        battery.charge, battery.voltage = 0.5, 24.0
        robots[0].notify_modules("on_battery_update", battery)
        assert "50 %" in page.element("robots").text
        assert "50 %, 24.0 V" in page.element("card").text

    on_a_page(scenario, bridge, robots)


def test_without_a_floor_the_view_is_set_when_the_robots_have_poses(bridge, robots):
    def scenario(page: Page) -> None:
        map = page.maps[0]
        frame = next(m for m in map.modules if type(m).__name__ == "Frame")
        before = map.world.tf
        frame.place()
        assert map.world.tf == before
        for robot in robots:
            robot.valid = True
        frame.place()
        assert map.world.tf != before

    on_a_page(scenario, bridge, robots)


def test_the_console_becomes_the_page_at_the_root(bridge, monkeypatch):
    monkeypatch.setattr(site, "pages", {})
    open_console([bridge], [], title="Hall 3")
    entry = site.pages["/"]
    assert entry.html is not None
    assert entry.html.name == "console.html"


def test_a_missing_floor_file_is_refused_when_the_console_is_opened(bridge, tmp_path):
    with pytest.raises(ConfigError, match=r"none\.yaml"):
        open_console([bridge], [], floor=tmp_path / "none.yaml")


def test_a_camera_is_watched_only_while_its_robot_is_selected(bridge, robots):
    camera = robots[0].add_module("Camera", bridge, "/camera/compressed")

    def scenario(page: Page) -> None:
        map = page.maps[0]
        assert not camera.watched
        map.set_selected(robots[0])
        assert camera.watched
        map.set_selected(robots[1])
        assert not camera.watched
        map.set_selected(robots[0])

    on_a_page(scenario, bridge, robots)
    assert not camera.watched


def test_a_gone_robot_can_be_removed_until_its_poses_return(
    bridge, robots, monkeypatch
):
    silent = {"Bob": 31.0, "Ann": 0.1}
    monkeypatch.setattr(
        Robot, "silent_for", property(lambda robot: silent.get(robot.name))
    )
    monkeypatch.setattr(
        Robot, "hears_poses", lambda robot, within: silent[robot.name] < within
    )
    monkeypatch.setattr(Bridge, "state", "open")

    async def run() -> None:
        opened, pages = Console(robots), []

        def another() -> Page:
            page = open_page()
            with page.scope.active():
                build(page, [bridge], opened, None, "test", "test")
                opened.opened(page)
            pages.append(page)
            return page

        page = another()
        map = page.maps[0]
        map.set_selected(robots[0])
        card = page.element("card")
        assert card.get("data-state") == "gone"
        assert "No pose since " in card.text
        elements = (e for e in card.walk() if isinstance(e, Element))
        button = next(e for e in elements if e.get("data-act") == "remove")
        (press,) = button.handlers("click")
        press(None)
        assert map.robots == [robots[1]]
        assert another().maps[0].robots == [robots[1]]
        opened.bring_back()
        assert map.robots == [robots[1]]
        silent["Bob"] = 0.0
        opened.bring_back()
        assert [set(each.maps[0].robots) for each in pages] == [set(robots)] * 2
        for each in pages:
            each.close()

    asyncio.run(run())


def test_maps_are_named_by_their_bridge_too_once_there_are_several_bridges(
    bridge, robots
):
    hall, opened = Bridge("ws://hall:9090", name="hall"), Console(robots)

    def names(page):
        (map,) = page.maps
        grids = [getattr(each, "layer", None) for each in map.modules]
        return [grid.svg.get("data-layer") for grid in grids if grid is not None]

    def scenario(page):
        opened.opened(page)
        opened.add_grid(bridge, "/map")
        assert names(page) == ["/map"]
        opened.add_grid(hall, "/map")
        assert names(page) == ["/map (ws://localhost:9090)", "/map (hall)"]

    on_a_page(scenario, bridge, robots)


def test_a_page_shows_routers_and_why_no_robot_of_their_agents_is_there(bridge):
    state = ["lost", "cannot reach the router: nothing listens there; reconnecting"]

    async def scenario():
        page = open_page()
        with page.scope.active():
            opened = Console()
            opened.routers["zenoh://hall:7447"] = lambda: tuple(state)
            build(page, [bridge], opened, None, "test", "test")
        (details,) = [e for e in page.element("bridges").children if e.tag == "details"]
        listed = details.children[1]
        try:
            yard, own = listed.children
            assert (yard.get("data-link"), yard.get("title")) == (
                "lost",
                "zenoh://hall:7447",
            )
            assert own.get("data-link") == "connecting"
            assert details.children[0].get("data-link") == "lost"
            assert page.element("routers").text == (
                "Cannot reach the router: nothing listens there; reconnecting."
            )
            state[:] = "open", "1 agent connected"
            while page.element("routers").text:
                await asyncio.sleep(0.01)
            assert "1 agent connected" in yard.text
            assert details.children[0].get("data-link") == "connecting"
        finally:
            page.close()

    asyncio.run(scenario())


def test_robots_whose_state_is_the_same_set_no_attribute_of_their_lines(
    bridge, robots, monkeypatch
):
    def scenario(page):
        (listed,) = [m for m in page.maps[0].modules if isinstance(m, RobotList)]
        listed.poll()
        with monkeypatch.context() as patch:
            patch.setattr(Element, "set", lambda *args, **given: pytest.fail("set"))
            listed.poll()
            for robot in robots:
                robot.notify_modules("on_report", None)

    on_a_page(scenario, bridge, robots)


def words_of(words: StateWords) -> str:
    _old, activity, _own, *conditions = words.element.children
    return "".join(each.text for each in (activity, *conditions))


def test_the_list_the_card_and_the_map_show_the_same_state_of_a_robot(bridge, robots):
    def scenario(page):
        bob, (map,) = robots[0], page.maps
        parts = {type(module): module for module in map.modules}
        listed, card = parts[RobotList], parts[RobotCard]
        map.set_selected(bob)

        def shown():
            listed.poll()
            card.poll()
            row = listed._rows[id(bob)]
            on_map = bob.svg.children[0].text.removeprefix("Bob: ")
            assert words_of(row._words) == words_of(card._words) == on_map
            assert row.element.get("data-state") == bob.svg.get("data-state")
            return on_map

        before = shown()
        bob.goal_failed = True  # changes the state without a report
        assert shown() == before
        bob._show_state()
        assert shown() == f"{before} · goal failed"

    on_a_page(scenario, bridge, robots)
