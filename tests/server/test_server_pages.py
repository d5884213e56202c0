"""Pages open and close: objects of a page function live as long as their page."""

import asyncio
import gc
import json
import math
import time
from dataclasses import replace

import pytest
from page_loop import ANN, HELLO, make_model, objects_left, open_page

import webmap
from equipment.waiting import wait_for
from webmap.base.errors import MotionError
from webmap.base.scope import Removal, keep
from webmap.core.frame_pace import FramePace
from webmap.core.map import Layer
from webmap.core.operators import Viewer
from webmap.features.layers.laser_scanner import LaserScanner, SweepMsg
from webmap.ros.rosbridge.events import Publish
from webmap.server import open_pages as host_module
from webmap.testing.witness import WitnessRobot


def test_the_page_function_gets_the_container_size_and_a_frame_is_sent(loop):
    seen = []

    def build(page):
        map = webmap.Map(page.element("webmap_container"))
        seen.append((map.canvas_width, map.canvas_height, page.viewer.name))

    model = make_model(loop, build)
    _, socket = open_page(model)
    wait_for(lambda: socket.frames)
    assert seen == [(700, 500, "Ann")]
    loop.call(lambda: model.close() or True)


def test_the_first_picture_of_a_page_waits_for_no_tick(loop, monkeypatch):
    monkeypatch.setattr(loop.runtime, "frame_rate", 1 / 60)
    model = make_model(loop, lambda page: webmap.Map(page.element("map")))
    _, first = open_page(model)
    wait_for(lambda: first.frames)
    _, second = open_page(model, "page0002")
    loop.call(lambda: True)
    assert len(second.frames) == 1
    loop.call(lambda: model.close() or True)


def test_a_change_is_sent_at_once_and_the_next_one_when_the_rate_allows(
    loop, monkeypatch
):
    monkeypatch.setattr(loop.runtime, "frame_rate", 1 / 60)
    robot = webmap.Robot("r")

    def build(page):
        webmap.Map(page.element("map")).add_robot(robot)

    model = make_model(loop, build)
    _, socket = open_page(model)
    assert len(socket.frames) == 1
    for sent in (2, 2):
        loop.call(lambda: robot.svg.set("data-x", str(time.monotonic())) or True)
        loop.call(lambda: True)  # after the turn in which it changed
        assert len(socket.frames) == sent
    loop.call(lambda: model.close() or robot.destroy() or True)


def test_many_changes_of_one_turn_are_one_frame(loop):
    robots = [webmap.Robot(str(number)) for number in range(20)]

    def build(page):
        map = webmap.Map(page.element("map"))
        for robot in robots:
            map.add_robot(robot)

    model = make_model(loop, build)
    _, socket = open_page(model)

    def move():
        for robot in robots:
            robot.svg.set_pose(1.0, 2.0, 3.0)
        return True

    loop.call(move)
    wait_for(lambda: len(socket.frames) > 1)
    time.sleep(0.05)
    assert len(socket.frames) == 2
    loop.call(lambda: model.close() or True)


def test_frames_come_less_often_when_they_cost_more():
    pace = FramePace()
    assert pace.due(60.0) == -math.inf  # at once
    pace.made(100.0, took=0.001, number=1)
    assert pace.due(60.0) == pytest.approx(100.0 + 1 / 60)
    assert pace.due(5.0) == pytest.approx(100.2)
    pace.made(150.0, took=0.020, number=0)
    assert pace.due(5.0) == pytest.approx(100.2)
    pace.made(200.0, took=0.020, number=1)
    assert pace.due(60.0) == pytest.approx(200.05)
    for number, period in (
        (6, 1 / 60),
        (16, 0.04),
        (20, 0.05),
        (200, 0.05),
    ):
        pace.made(300.0, took=0.0, number=number)
        assert pace.due(60.0) == pytest.approx(300.0 + period)


def test_poses_while_nobody_looks_do_not_delay_the_frames_of_the_next_page():
    pace = FramePace()
    now = time.monotonic()
    for _ in range(3):
        pace.process(-math.inf, now - 10.0, lambda: None)
    pace.made(now, took=0.0, number=1)
    assert pace.due(60.0) == pytest.approx(now + 1 / 60)
    pace.process(-math.inf, now - 10.0, lambda: None)  # it took ten seconds
    assert pace.due(60.0) == pytest.approx(now + 1.0)
    pace.end()
    assert pace.due(60.0) == -math.inf


def test_a_full_collection_does_not_look_at_the_objects_of_robots_and_pages(loop):
    counts = []

    def build(page):
        counts.append(gc.get_freeze_count())
        webmap.Map(page.element("map"))

    gc.unfreeze()
    model = make_model(loop, build)
    _, socket = open_page(model)
    wait_for(lambda: socket.frames)
    assert 0 < counts[0] < loop.call(gc.get_freeze_count)
    loop.call(lambda: model.close() or True)
    gc.unfreeze()


def test_a_page_function_can_be_async(loop):

    done = []

    async def build(page):
        await asyncio.sleep(0)
        webmap.Map(page.element("webmap_container"))
        done.append(True)

    model = make_model(loop, build)
    open_page(model)
    wait_for(lambda: done)
    loop.call(lambda: model.close() or True)


def test_an_exception_in_a_page_function_is_shown_only_on_its_page(loop):
    def build(page):
        if page.viewer.name == "Bob":
            raise RuntimeError("no robot today")
        webmap.Map(page.element("webmap_container"))

    model = make_model(loop, build)
    _, bad = open_page(model, "page0002", Viewer("v2", "Bob"))
    _, good = open_page(model)
    wait_for(lambda: good.frames and bad.frames)
    assert b"no robot today" in b"".join(bad.frames)
    assert b"no robot today" not in b"".join(good.frames)
    loop.call(lambda: model.close() or True)


@pytest.mark.parametrize(
    "garbage", ["", "{", "[]", '{"op": "hello"}', '{"op": "fly"}', "x" * 20_000]
)
def test_an_invalid_message_of_a_page_does_not_close_the_page(loop, garbage):
    model = make_model(loop, lambda page: None)
    handle, socket = open_page(model)
    handle.receive(garbage)
    handle.receive(json.dumps(HELLO))
    loop.call(lambda: True)
    assert socket.reason is None
    loop.call(lambda: model.close() or True)


def test_the_map_is_kept_for_a_viewer_who_reconnects(loop):
    made = []

    def build(page):
        made.append(webmap.Map(page.element("webmap_container")))

    model = make_model(loop, build)
    handle, _ = open_page(model)
    wait_for(lambda: made)
    handle.closed()
    _, socket = open_page(model)
    wait_for(lambda: socket.frames)
    assert len(made) == 1
    loop.call(lambda: model.close() or True)


def test_another_viewer_does_not_get_the_page_of_the_first(loop):
    made = []
    model = make_model(loop, made.append)
    handle, _ = open_page(model)
    wait_for(lambda: made)
    handle.closed()
    open_page(model, viewer=Viewer("v2", "Eve"))
    wait_for(lambda: len(made) == 2)
    loop.call(lambda: model.close() or True)


@pytest.mark.parametrize("change", [{"role": "viewer"}, {"robots": ("bay2/*",)}])
def test_a_viewer_with_other_rights_gets_a_new_page(loop, change):
    pages = []
    model = make_model(loop, pages.append)
    before = Viewer("v1", "Ann")
    handle, _ = open_page(model, viewer=before)
    wait_for(lambda: pages)
    handle.closed()
    open_page(model, viewer=replace(before, **change))
    wait_for(lambda: len(pages) == 2)
    assert [page.viewer for page in pages] == [before, replace(before, **change)]
    assert pages[0].closed
    loop.call(lambda: model.close() or True)


def test_the_page_of_a_viewer_who_does_not_reconnect_is_closed(loop, monkeypatch):
    monkeypatch.setattr(host_module, "KEPT_FOR", 0.01)
    ended = []

    def build(page):
        page.on_close(lambda: ended.append(True))

    model = make_model(loop, build)
    handle, _ = open_page(model)
    handle.closed()
    wait_for(lambda: ended)


class Link:
    """A bridge that counts its subscribers."""

    url = "ws://test:9090"
    lag = 0.0

    def __init__(self) -> None:
        self.listeners: list = []

    def subscribe(self, topic, callback, type=None, **options):
        self.listeners.append(callback)
        return keep(Removal(lambda: self.listeners.remove(callback)))

    def on_open(self, fn):
        self.listeners.append(fn)
        return keep(Removal(lambda: self.listeners.remove(fn)))


class Grid(Layer):
    def __init__(self, link) -> None:
        super().__init__()
        self.link = link
        self.decoded = 0

    def start(self) -> None:
        self.link.subscribe("/map", self.take)

    def take(self, message) -> None:
        self.decoded += 1
        self.svg.clear()
        self.svg.append(webmap.svg.rect(width=message, height=1))


@pytest.mark.timeout(600)  # it runs with the time that tests of browsers leave
def test_a_thousand_pages_opened_and_closed_leave_nothing_behind(loop, monkeypatch):
    monkeypatch.setattr(host_module, "KEPT_FOR", 0.0)
    link = Link()
    bob = webmap.Robot("Bob")
    built = []

    def build(page):
        built.append(page.viewer.name)
        map = webmap.Map(page.element("webmap_container"), 700, 500)
        map.add_module("MouseViewControl")
        map.add_module("ShowSelected", page.element("selected"))
        map.add_module("Teleop", 1.0, 1.5)
        map.add_layer(Grid.shared(link))
        map.add_robot(bob)
        map.set_selected(bob)
        map.on(bob.svg, "click", print)
        bob.svg.on("dblclick", print)
        link.on_open(print)
        link.subscribe("/own", print)

    model = make_model(loop, build)
    nodes = len(bob.fragment)

    def round_of(count):
        for number in range(count):
            handle, socket = open_page(model, f"page{number:04}")
            handle.closed()
            del socket
        loop.call(lambda: True)
        wait_for(lambda: not model._hosts)

    round_of(50)
    more = objects_left(round_of, 4, 250)
    assert len(built) == 1050
    assert link.listeners == []
    assert Layer._shared == {}
    assert bob.maps == []
    assert not bob.selected
    assert bob.svg.handlers("dblclick") == ()
    assert len(bob.fragment) == nodes
    assert loop.runtime._watchers == {}
    assert min(more) < 2 * 250, "fewer than two objects for each page"
    loop.call(lambda: bob.destroy() or True)


def test_fifty_viewers_of_one_grid_share_one_decoding_and_one_encoding(loop):
    link = Link()
    layers = []

    def build(page):
        map = webmap.Map(page.element("webmap_container"), 700, 500)
        layers.append(Grid.shared(link))
        map.add_layer(layers[-1])

    model = make_model(loop, build)
    pages = [open_page(model, f"page{number:04}") for number in range(50)]
    wait_for(lambda: all(socket.frames for _, socket in pages))
    for handle, socket in pages:
        count = len(socket.frames)
        for frame in range(1, count + 1):
            handle.receive(json.dumps({"op": "seen", "frame": frame}))
    loop.call(lambda: True)
    assert len(link.listeners) == 1
    counts = [len(socket.frames) for _, socket in pages]
    loop.call(lambda: link.listeners[0](7) or True)

    def news():
        # A frame that only sends the time, once a second, is only a head.
        new = (o.frames[count:] for (_, o), count in zip(pages, counts, strict=True))
        return [[frame[15:] for frame in frames if frame[15:]] for frames in new]

    wait_for(lambda: all(news()))
    assert layers[0].decoded == 1
    assert all(layer is layers[0] for layer in layers)
    assert len({bodies[0] for bodies in news()}) == 1
    loop.call(lambda: model.close() or True)


SCAN = {
    "header": {"stamp": {"secs": 0, "nsecs": 0}, "frame_id": "laser"},
    "angle_min": 0.0,
    "angle_increment": 0.1,
    "range_min": 0.1,
    "range_max": 9.0,
    "ranges": [1.0] * 20,
}


def counted(monkeypatch, owner, name):
    """Record the arguments of each call of a method, and call the method."""
    calls, method = [], getattr(owner, name)

    def noting(self, *args):
        calls.append(args)
        return method(self, *args)

    monkeypatch.setattr(owner, name, noting)
    return calls


def test_fifty_viewers_of_one_scan_share_one_decoding_and_one_drawing(
    loop, monkeypatch
):
    decoded = counted(monkeypatch, Publish, "_decode")
    drawn = counted(monkeypatch, LaserScanner, "draw")
    with WitnessRobot() as there:
        bridge, bob = webmap.Bridge(there.url), webmap.Robot("Bob")
        bob.add_module("LaserScanner", bridge, "/scan")

        def build(page):
            webmap.Map(page.element("webmap_container")).add_robot(bob)

        def subscribed():
            messages = [received.message for received in there.log.messages]
            return [
                m for m in messages if (m["op"], m["topic"]) == ("subscribe", "/scan")
            ]

        model = make_model(loop, build)
        pages = [open_page(model, f"page{number:04}") for number in range(50)]
        wait_for(lambda: all(socket.frames for _, socket in pages))
        for handle, socket in pages:
            for frame in range(1, len(socket.frames) + 1):
                handle.receive(json.dumps({"op": "seen", "frame": frame}))
        loop.call(lambda: bridge.start(loop.runtime._loop) or True)
        wait_for(subscribed)
        counts = [len(socket.frames) for _, socket in pages]
        there.publish("/scan", SCAN)
        wait_for(lambda: drawn)
        wait_for(
            lambda: all(
                len(socket.frames) > count
                for (_, socket), count in zip(pages, counts, strict=True)
            )
        )
        assert len(drawn) == 1
        assert decoded == [(SweepMsg,)]
        assert len(subscribed()) == 1
        loop.call(lambda: model.close() or True)
        loop.call(lambda: bob.destroy() or True)
        loop.wait(bridge.stop())


def test_a_handler_sends_a_goal_in_the_name_of_the_page_that_was_clicked(loop):
    pages, events, sent = [], [], []
    bob = webmap.Robot("Bob")
    bob.set_move_topic(webmap.Bridge("ws://robot:9090"), "/goal")
    bob.motion.commands = lambda: None
    place, turn = webmap.geometry.Vector3(1.0, 2.0), webmap.geometry.Quaternion()

    def clicked(event):
        events.append(event)
        bob.move(place, turn, by=event.page)

    def build(page):
        pages.append(page)
        page.element("send").on("click", clicked)

    class Drive:
        def set_speeds(self, v, w):
            pass

        def move(self, *command):
            sent.append(command)

    model = make_model(loop, build)
    handle, _ = open_page(model)
    with pytest.raises(MotionError, match="the page is not connected"):
        bob.move(place, turn, by=pages[0])
    model.drive_opened("page0001", ANN, Drive())
    (page,) = pages
    press = {"op": "event", "mount": page.mount, "event": "click"}
    handle.receive(json.dumps({**press, "element": page.element("send").id}))
    loop.call(lambda: True)
    assert [event.page for event in events] == [page]
    assert sent == [(bob.id, 1.0, 2.0, 0.0)]
    loop.call(lambda: [model.close(), bob.destroy()])
