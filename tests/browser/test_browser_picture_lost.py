"""The scene connection of a driving page is lost while its drive connection holds."""

import json
import threading

import pytest
from playwright.sync_api import expect

from equipment.chromium import hold
from equipment.processes import WEB, running
from equipment.waiting import wait_for

pytestmark = pytest.mark.browser


def test_the_page_releases_its_inputs_when_the_scene_connection_is_lost(tab):
    pictures, sent = [], []
    cut = threading.Event()

    def through(route):
        pictures.append(route)
        if not cut.is_set():
            route.connect_to_server()

    def listen(link):
        if "/drive" in link.url:
            link.on("framesent", lambda frame: sent.append(json.loads(frame)))

    tab.route_web_socket("**/scene*", through)
    tab.on("websocket", listen)
    demo = ("demo", "--robots", 1, "--quiet", "--port", 0, "--no-browser")
    with running(*demo, pattern=WEB) as process:
        tab.goto(process.url)
        tab.locator("#robots .row button").first.click()
        expect(tab.locator(".robot.selected")).to_be_attached()

        def asked():
            tab.wait_for_timeout(20)
            last = [command["x"] for command in sent if command["op"] == "drive"][-1:]
            return last[0] if last else None

        hold(tab.keyboard, "w", lambda: asked() == 1)
        cut.set()
        pictures[-1].close()
        wait_for(lambda: asked() == 0, what="a neutral command")
        cut.clear()
        pictures[-1].close()
        expect(tab.locator("html.disconnected")).not_to_be_attached()
        assert asked() == 0, "a key that is still held moves nothing"
        tab.keyboard.up("w")
        hold(tab.keyboard, "w", lambda: asked() == 1)
        tab.close()
