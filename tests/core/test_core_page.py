"""Events of a page: which handlers are called, and what a removed handler leaves."""

import asyncio

import pytest

from webmap import Map, Robot, html, svg
from webmap.base.lifecycle import lifecycle
from webmap.base.scope import Scope
from webmap.config.buttons import read_buttons
from webmap.features.buttons import robot_button
from webmap.features.buttons.buttons import ButtonView
from webmap.features.buttons.robot_button import RobotButton
from webmap.scene.element import Event


def click(page, mount, element):
    page.dispatch(mount, element, Event(kind="click", element=element))


async def settled():
    """Let every task run until it waits for something that does not happen."""
    for _ in range(20):
        await asyncio.sleep(0)


class Work:
    """An async handler that runs until it is cancelled."""

    def __init__(self):
        self.began = self.cancelled = 0

    async def __call__(self, event):
        self.began += 1
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            self.cancelled += 1
            raise


# Asynchronous handlers.


def test_async_handlers_are_cancelled_when_the_page_is_closed(page):
    async def scenario():
        owners, viewers = Work(), Work()
        button = html.button()
        page.element("bar").append(button)
        with page.scope.active():
            button.on("click", owners)
        page.listen(page.mount, button, "click", viewers)
        click(page, page.mount, button)
        await settled()
        assert (owners.began, viewers.began) == (1, 1)
        assert (owners.cancelled, viewers.cancelled) == (0, 0)
        page.close()
        await settled()
        assert (owners.cancelled, viewers.cancelled) == (1, 1)

    asyncio.run(scenario())


def test_an_async_handler_does_not_start_after_the_page_is_closed(page):
    async def scenario():
        work = Work()
        page.listen(page.mount, page.element("bar"), "click", work)
        click(page, page.mount, page.element("bar"))
        page.close()
        await settled()
        assert work.began == 0

    asyncio.run(scenario())


def test_an_async_handler_of_a_module_is_cancelled_with_the_module(page, container):
    async def scenario():
        work = Work()

        class Button:
            def __init__(self, map):
                map.on(map.root, "click", work)

        map = Map(container, 700, 500)
        button = map.add_module(Button)
        (mount,) = (n for n, f in page.channel.mounted.items() if f is map.fragment)
        click(page, mount, map.root)
        await settled()
        map.remove_module(button)
        await settled()
        assert (work.began, work.cancelled) == (1, 1)

    asyncio.run(scenario())


def test_an_async_handler_that_removes_itself_runs_to_its_end(page):
    async def scenario():
        done, own = [], Scope("own")

        async def once(event):
            own.close()
            await asyncio.sleep(0)
            done.append(event.kind)

        button = html.button()
        page.element("bar").append(button)
        with own.active():
            button.on("click", once)
        click(page, page.mount, button)
        await settled()
        assert done == ["click"]

    asyncio.run(scenario())


@pytest.mark.parametrize("own", [True, False])
def test_an_exception_in_an_async_handler_is_shown_on_the_page(page, channel, own):
    async def scenario():
        async def fail(event):
            await asyncio.sleep(0)
            raise RuntimeError("flat battery")

        bar = page.element("bar")
        if own:
            page.listen(page.mount, bar, "click", fail)
        else:
            bar.on("click", fail)
        click(page, page.mount, bar)
        await settled()
        assert channel.errors == ["A handler failed: RuntimeError: flat battery"]

    asyncio.run(scenario())


def test_a_running_button_call_continues_when_the_page_is_closed(page, monkeypatch):
    async def scenario():
        answer = asyncio.Event()

        async def run(bridge, spec, values):
            await answer.wait()
            return "docked"

        monkeypatch.setattr(robot_button, "run", run)
        bob = Robot("Bob")
        (spec,) = read_buttons([{"label": "D", "service": "/d"}])
        button = RobotButton(bob, None, spec)
        shown = Scope("shown")
        with shown.active():
            view = ButtonView(button, page.element("bar"))
        click(page, page.mount, view._press)
        await settled()
        assert button.state == "running"
        shown.close()
        page.close()
        answer.set()
        await settled()
        assert (button.state, button.result) == ("done", "docked")
        bob.destroy()

    asyncio.run(scenario())


# Requests to the browser.


def test_prevent_and_stop_of_any_handler_apply_to_the_event_in_the_browser(
    page, channel
):
    bar = page.element("bar")
    key = (page.mount, bar.id, "click")
    first = page.listen(page.mount, bar, "click", print)
    assert channel.flags[key] == (False, False)
    second = page.listen(page.mount, bar, "click", print, prevent=True)
    assert channel.flags[key] == (True, False)
    third = page.listen(page.mount, bar, "click", print, stop=True)
    assert channel.flags[key] == (True, True)
    second.remove()
    assert channel.flags[key] == (False, True)
    first.remove()
    assert channel.flags[key] == (False, True)
    third.remove()
    assert channel.flags == {}


def test_a_click_on_the_map_itself_can_be_prevented(page, container, channel):
    map = Map(container, 700, 500)
    map.on(map.root, "click", print, prevent=True)
    (flags,) = (f for (_, i, _), f in channel.flags.items() if i == map.root.id)
    assert flags == (True, False)


def test_a_refused_listener_is_not_kept(page, channel, monkeypatch):
    def refuse(*key, prevent, stop):
        raise ValueError("no such event")

    monkeypatch.setattr(channel, "listen", refuse)
    with pytest.raises(ValueError, match="no such event"):
        page.listen(page.mount, page.element("bar"), "clack", print)
    assert page._listening == {}


# What remains after removal.


def test_a_removed_handler_leaves_nothing_in_its_scope(page):
    scope = Scope("module")
    with scope.active():
        page.listen(page.mount, page.element("bar"), "click", print).remove()
    assert len(scope) == 0


def test_handlers_of_an_added_and_removed_robot_leave_nothing_behind(page, container):
    bob = Robot("Bob")
    with page.scope.active():
        map = Map(container, 700, 500)
        before = len(page.scope)
        for _ in range(3):
            map.add_robot(bob)
            map.on(bob.svg, "dblclick", print)
            map.remove_robot(bob)
    assert len(page.scope) == before
    bob.destroy()


def test_a_closed_page_leaves_no_handlers_in_the_scope_of_a_module(page, container):
    scope = Scope("a robot's module")
    bar = page.element("bar")
    with scope.active():
        page.listen(page.mount, bar, "click", print)
    page.close()
    assert len(scope) == 0


def test_bridges_made_by_a_robot_from_plain_data_end_with_its_page(page, caplog):
    url = "ws://a-robot-of-one-page:9090"
    data = {
        "name": "Bob",
        "odometry": {"bridge": url, "topic": "/odom", "type": "nav_msgs/Odometry"},
        "tf": {"bridge": url},
        "twist": {"bridge": url, "topic": "/cmd_vel"},
        "modules": [{"name": "LaserScanner", "args": [{"bridge": url}, "/scan"]}],
    }
    with page.scope.active():
        bridge = Robot.from_dict(data).feed.bridge
    assert bridge in lifecycle._services
    page.close()
    assert bridge not in lifecycle._services
    assert bridge._topics == {}
    assert caplog.text == ""
    assert len(page.scope) == 0


def test_a_removed_image_is_no_longer_published(container, publisher, page):
    page.entry.folder.joinpath("floor.png").write_bytes(b"png")
    map = Map(container, 700, 500)
    before = len(page.scope)
    for _ in range(3):
        image = map.add_image("floor.png", 0, 0, 1, 1)
        assert publisher.images == ["floor.png"]
        map.remove_image(image)
        assert publisher.images == []
    assert len(page.scope) == before
    map.remove_image(image)
    map.remove_image(svg.image())


def test_the_images_of_a_destroyed_map_are_no_longer_published(
    container, publisher, page
):
    page.entry.folder.joinpath("floor.png").write_bytes(b"png")
    map = Map(container, 700, 500)
    map.add_image("floor.png", 0, 0, 1, 1)
    map.destroy()
    assert publisher.images == []
    page.close()
