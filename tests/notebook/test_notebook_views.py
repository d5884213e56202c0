"""What a widget accepts from a notebook, and when its pages end."""

import gc
import json
import subprocess
import sys
import time

import pytest
from fake_comm import FakeComm, request

import webmap
from equipment.waiting import wait_for
from webmap.base.errors import ConfigError
from webmap.core.runtime import runtime
from webmap.notebook import widget as widget_module
from webmap.notebook.widget import esm
from webmap.server.outbox import FRAMES

HELLO = {"op": "hello", "page": "a-view-1", "url": "/", "width": 600, "height": 400}


class Shown:
    """A widget, and a notebook that a test speaks for."""

    def __init__(self) -> None:
        self.pages: list[webmap.Page] = []
        self.clicks: list[object] = []
        self.widget = webmap.widget(self.build)
        self.comm: FakeComm = self.widget.comm

    def build(self, page: webmap.Page) -> None:
        self.pages.append(page)
        map = webmap.Map(page.element("webmap_container"))
        page.map = map
        map.on(map.root, "click", self.clicks.append, role="viewer")

    def send(self, message: object, view: str = "a-view-1") -> None:
        self.comm.deliver({"view": view, "text": json.dumps(message)})
        self.settle()

    def open(self, view: str = "a-view-1") -> webmap.Page:
        number = len(self.pages)
        self.send(HELLO, view)
        wait_for(lambda: len(self.pages) > number)
        return self.pages[-1]

    def settle(self) -> None:
        """Wait until the model's thread has received what was sent."""
        webmap.call(lambda: None)

    def received(self) -> list:
        messages = []
        while not self.comm.sent.empty():
            messages.append(self.comm.sent.get())
        return messages


@pytest.fixture
def shown() -> Shown:
    return Shown()


def test_a_hello_opens_a_page_of_a_viewer_and_its_first_message_is_a_frame(shown):
    page = shown.open()
    assert page.viewer.role == "viewer"
    wait_for(lambda: not shown.comm.sent.empty())
    content, buffers, _ = shown.received()[0]
    assert content["view"] == "a-view-1"
    assert len(buffers) == 1


def test_no_page_of_a_notebook_can_send_a_goal(shown):
    page = shown.open()
    with pytest.raises(webmap.errors.MotionError):
        webmap.call(page.move, "bob", 1.0, 1.0, 0.0)


@pytest.mark.parametrize(
    "message",
    [
        {"op": "event", "mount": 1, "element": 1, "event": "click"},
        {"op": "module", "instance": 1, "data": {"active": True}},
        {"op": "ready", "instance": 1},
        {"op": "stop", "robot": "*"},
        {"op": "twist"},
        "text",
    ],
)
def test_what_a_looking_page_need_not_send_is_refused(shown, message, caplog):
    page = shown.open()
    if isinstance(message, dict) and message["op"] == "event":
        message |= {"mount": page.map._mount, "element": page.map.root.id}
    shown.send(message)
    assert shown.clicks == []
    refused = [text for text in caplog.messages if "notebook" in text]
    assert len(refused) == 1, caplog.text


@pytest.mark.parametrize(
    "content", [None, 1, [], {}, {"view": 1}, {"view": "x" * 65, "text": "{}"}]
)
def test_a_message_of_another_form_does_nothing(shown, content):
    shown.comm.deliver(content)
    shown.settle()
    assert shown.received() == []
    shown.open()


def test_a_view_that_is_not_known_is_asked_for_its_hello(shown):
    shown.send({"op": "seen", "frame": 3})
    ((content, buffers, _),) = shown.received()
    assert content == {"view": "a-view-1", "unknown": True}
    assert buffers == []


def test_a_page_that_answers_nothing_gets_no_third_frame(shown):
    page = shown.open()
    for step in range(40):
        webmap.call(page.map.root.set, "data-step", str(step))
        time.sleep(0.02)
    assert 1 <= len(shown.received()) <= 2 < FRAMES


def test_a_frame_is_sent_for_the_last_message_of_the_notebook(shown):
    page = shown.open()
    reset = request.set("an answer")
    shown.send({"op": "seen", "frame": 1})
    request.reset(reset)
    shown.received()
    webmap.call(page.map.root.set, "data-step", "1")
    wait_for(lambda: not shown.comm.sent.empty())
    assert shown.received()[0].sent_for == "an answer"


def test_a_cleared_cell_closes_its_page_and_no_other(shown):
    first, second = shown.open("a-view-1"), shown.open("a-view-2")
    shown.comm.deliver({"view": "a-view-1"})
    wait_for(lambda: first.closed)
    assert not second.closed


def test_a_closed_widget_closes_all_its_pages(shown):
    pages = [shown.open("a-view-1"), shown.open("a-view-2")]
    shown.widget.close()
    wait_for(lambda: all(page.closed for page in pages))


def test_the_view_that_was_silent_longest_yields_to_a_new_one(shown, monkeypatch):
    monkeypatch.setattr(widget_module, "MOST_VIEWS", 2)
    first, second = shown.open("a-view-1"), shown.open("a-view-2")
    shown.send({"op": "seen", "frame": 0}, "a-view-1")
    shown.open("a-view-3")
    wait_for(lambda: second.closed)
    assert not first.closed


def test_a_view_that_stays_silent_is_closed(shown, monkeypatch):
    monkeypatch.setattr(widget_module, "SILENT_S", 0.2)
    page = shown.open()
    wait_for(lambda: page.closed)


def test_a_map_that_webmap_has_ended_opens_again_after_its_start(shown):
    page = shown.open()
    wait_for(lambda: not shown.comm.sent.empty())
    webmap.stop()
    assert page.closed
    assert "ended" in shown.received()[-1].content
    shown.comm.deliver({"view": "a-view-1", "text": "{}"})  # WebMap does not run
    webmap.start()
    shown.send({"op": "seen", "frame": 1})
    assert shown.received()[-1].content == {"view": "a-view-1", "unknown": True}
    assert not shown.open().closed


def test_nobody_looks_when_the_last_view_has_gone(shown):
    shown.open()
    assert runtime._watchers
    shown.comm.deliver({"view": "a-view-1"})
    wait_for(lambda: not runtime._watchers)


@pytest.mark.parametrize(
    ("page", "options"),
    [
        (webmap.svg.g(), {}),
        (print, {"height": 5}),
        (print, {"theme": "blue"}),
    ],
)
def test_an_argument_that_is_not_valid_is_refused(page, options):
    with pytest.raises(ConfigError, match="widget"):
        webmap.widget(page, **options)


def test_the_module_has_no_part_that_commands():
    for name in ("web/drive.js", "web/link.js", "web/motion/", "features/stop/"):
        assert f'$modules["{name}' not in esm()


WITHOUT = """
import sys
sys.modules["anywidget"] = None
import webmap
try:
    webmap.widget
except webmap.WebMapError as error:
    print(error)
"""


def test_without_the_extra_the_error_names_it():
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT], capture_output=True, text=True, check=True
    )
    assert "pip install 'webmap[notebook]'" in done.stdout


def test_the_objects_of_a_kernel_are_left_to_the_collector(monkeypatch):
    calls = []
    monkeypatch.setattr(gc, "freeze", lambda: calls.append("freeze"))
    widget_module.NotebookPages().built()
    assert calls == []
