"""A script in a text, wherever the text comes from, stays a text."""

import itertools
import json
import re
from typing import Literal, get_args, get_origin, get_type_hints

import msgspec
import pytest
from scripted_bridge import scripted_bridge

from equipment.chromium import watched_tab
from equipment.script_strings import FOUND, NOTHING, SCRIPTS, WATCH
from equipment.waiting import polls
from equipment.webmap_process import webmap
from webmap.gate import protocol
from webmap.modules.declaration import declarations

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def texts_of(type, path=()):
    """Yield the path of each text of a message, by its type; no words of a list."""
    if isinstance(type, msgspec.structs.StructMeta):
        for name, hint in get_type_hints(type).items():
            yield from texts_of(hint, (*path, name))
    elif type is str:
        yield path
    elif get_origin(type) is not Literal:
        for each in get_args(type):
            yield from texts_of(each, path)


IDS = {
    *("robot", "id", "connection", "person", "page", "by.identity", "stop_date"),
    *("holder.connection", "asker.connection", "stop.id", "goal.id", "goal.by"),
}
"""Texts by which a page finds something."""

SHOWN = [path for path in texts_of(protocol.RobotReport) if path[-1] not in IDS]
MADE = {
    "stop": {"confirmed": False, "id": "s", "by": "", "why": ""},
    "asker": {"connection": "c", "left": 5.0, "name": ""},
    "holder": {"connection": "c", "name": ""},
    "test": {"state": "failed", "text": ""},
    "check": {"every": None, "by": "", "at": 0.0},
    "goal": {
        **{"id": "g", "x": 1.0, "y": 1.0, "yaw": 0.0, "by": "c", "why": ""},
        **{"method": "navigate_to_pose", "state": "failed", "left": None},
        **{"time": None, "eta": None, "recoveries": None},
    },
}
"""The parts of a report that are not always there."""


def scripted(text, scripts):
    """Return a message of the gate with a script in each text that a page shows."""
    message = json.loads(text)
    if message.get("op") == "robot":
        for path in SHOWN:
            inner = message
            for name in path[:-1]:
                inner[name] = inner = inner.get(name) or dict(MADE[name])
            value = f"{'.'.join(path)} {next(scripts)}"
            inner[path[-1]] = [value] if path[-1] in {"why", "hooks"} else value
        if isinstance(message["stop"]["why"], list):
            message["stop"]["why"] = f"stop.why {next(scripts)}"
            message["goal"]["why"] = f"goal.why {next(scripts)}"
        message["latched"], message["state"] = True, "stopped"
    elif message.get("op") == "you":
        message["name"] = next(scripts)
    return json.dumps(message)


@pytest.fixture
def tab(chromium):
    with watched_tab(chromium, 1400, 900) as page:
        # A picture that is none is not drawn, and an id may be unknown.
        page.allowed += ["picture", "Failed to load resource", "WebSocket"]
        page.add_init_script(WATCH)
        yield page


IN_LISTS = ("markers.text", "status.name", "msg", "header.frame_id", "fields.name")
"""Fields of messages that are shown in different ways."""


def missing(seen):
    """Return the scripts and the fields that were not seen."""
    scripts = [one for one in SCRIPTS if not any(one in text for text in seen)]
    return scripts + [
        one
        for one in IN_LISTS
        if not any(re.search(rf"(^|\W){one} ", text) for text in seen)
    ]


def look(tab, missing):
    """Look until no text with a script is missing; return what was seen."""
    for _ in polls(lambda: f"the texts {lacking}", 40.0, 0.25):
        if not (lacking := missing(seen := tab.evaluate("() => [...__seen]"))):
            break
        tab.wait_for_timeout(250)
    assert tab.evaluate(FOUND) == NOTHING
    return seen


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_script_in_any_text_of_any_message_of_a_robot_does_not_run(tab, dialect):
    with scripted_bridge(dialect) as bridge:
        types = {type for type, _ in bridge._sites[0].values()}
        drawn = [layer for layer in declarations() if layer.built_in and layer.types]
        assert [one.name for one in drawn if types.isdisjoint(one.types)] == []
        with webmap("view", bridge.url, "--port", "0", "--no-browser") as url:
            tab.goto(url)
            tab.locator("#robots .row button", has_text="anna").first.dispatch_event(
                "click"
            )
            tab.locator("summary[title=Log]").dispatch_event("click")
            look(tab, missing)
        assert {name for _, name in bridge.texts} >= {*IN_LISTS}


def test_a_script_in_any_text_of_the_gates_reports_does_not_run(tab):
    scripts, newest = itertools.cycle(SCRIPTS), {}

    def relay(page_side):
        server_side = page_side.connect_to_server()

        def pass_on(text):
            op = json.loads(text).get("op")
            if op == "robot":
                newest[op] = text
            for each in (text, *(newest.values() if op == "tick" else ())):
                page_side.send(scripted(each, scripts))

        server_side.on_message(pass_on)

    tab.route_web_socket(re.compile("_webmap/drive"), relay)
    quiet = ("--robots", "1", "--port", "0", "--no-browser")
    with webmap("demo", "--quiet", *quiet) as url:
        tab.goto(url)
        tab.locator("#robots .row button").first.dispatch_event("click")
        seen = look(
            tab, lambda seen: [s for s in SCRIPTS if not any(s in t for t in seen)]
        )
        for path in ("name", "alarm", "stop.by"):
            assert any(f"{path} " in text for text in seen), path
