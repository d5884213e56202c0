"""Sign-in with a real browser: URLs, cookies, and requests to another server."""

import http.server
import threading

import pytest
from playwright.sync_api import expect

from equipment.processes import WEB, running
from equipment.waiting import wait_for

pytestmark = pytest.mark.browser

SCRIPT = """
import webmap

@webmap.page("/")
@webmap.page("/lab")
def main(page):
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("StopButton")

webmap.run()
"""
SOCKETS = """async (protocols) => {
  const closed = [];
  for (const name of ["scene?id=x&page=/", "drive?id=x"]) {
    const url = new URL(`/_webmap/${name}`, location.href.replace(/^http/, "ws"));
    const socket = new WebSocket(url, protocols);
    closed.push(await new Promise((done) => {
      socket.onopen = () => done("open");
      socket.onerror = () => done("refused");
    }));
    socket.close();
  }
  return closed;
}"""


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "page.py"
    path.write_text(SCRIPT)
    return path


@pytest.fixture(autouse=True)
def ends_while_pages_are_open(tab, other):
    for page in (tab, other):
        page.allowed += ["WebSocket", "ERR_CONNECTION", "401"]


def shows_its_map(page):
    page.wait_for_selector("svg.webmap")
    expect(page.get_by_role("status")).to_be_hidden()


def test_the_file_opened_in_the_browser_signs_in_and_leaves_a_clean_url(
    tab, script, tmp_path, monkeypatch
):
    file = tmp_path / "command line"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\necho "$@" > "{file}.new"\nmv "{file}.new" "{file}"')
    browser.chmod(0o755)
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("BROWSER", f"{browser} %s")
    with running("run", script, "--port", 0, pattern=WEB) as process:
        wait_for(file.exists)
        line = file.read_text().strip()
        assert line.startswith(f"file://{home}/")
        root = process.url.partition("?")[0]
        tab.goto(line)
        tab.wait_for_url(root)
        shows_its_map(tab)
        tab.reload()
        shows_its_map(tab)
        second = tab.context.new_page()
        second.goto(root + "lab")
        shows_its_map(second)
        assert tab.evaluate("history.length") <= 3
    assert list(home.iterdir()) == []


def test_the_printed_url_works_several_times_and_its_token_disappears(
    tab, other, script
):
    with running("run", script, "--port", 0, "--no-browser", pattern=WEB) as process:
        root = process.url.partition("?")[0]
        for page in (tab, other):
            page.goto(process.url + "&a=b")
            shows_its_map(page)
            assert page.url == root + "?a=b"


class Neighbour(http.server.BaseHTTPRequestHandler):
    """A server on another port of the same host."""

    cookies: list[str]

    def do_GET(self):
        self.cookies.append(self.headers.get("cookie", ""))
        self.send_response(200)
        # The page also removes the cookie.
        for pair in self.headers.get("cookie", "").split("; "):
            name = pair.partition("=")[0]
            self.send_header("set-cookie", f"{name}=; Path=/; Max-Age=0")
        self.end_headers()
        self.wfile.write(b"hello")

    def log_message(self, *args):
        pass


def test_the_cookie_alone_gives_a_server_on_another_port_no_access(tab, script):
    Neighbour.cookies = []
    near = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Neighbour)
    threading.Thread(target=near.serve_forever).start()
    try:
        with running(
            "run", script, "--port", 0, "--no-browser", pattern=WEB
        ) as process:
            tab.goto(process.url)
            shows_its_map(tab)
            key = tab.evaluate("Object.values(localStorage)")
            near_page = tab.context.new_page()
            near_page.goto(f"http://127.0.0.1:{near.server_port}/")
            assert Neighbour.cookies[0].startswith("webmap_")
            assert near_page.evaluate("Object.values(localStorage)") == []
            near_page.close()
            # An open page needs no cookie; its key is enough.
            assert tab.context.cookies() == []
            assert tab.evaluate(SOCKETS, ["webmap", *key]) == ["open", "open"]
            # The cookie alone gives no access, from any page.
            name, _, value = Neighbour.cookies[0].partition("=")
            root = process.url.partition("?")[0]
            tab.context.add_cookies([{"name": name, "value": value, "url": root}])
            assert tab.evaluate(SOCKETS, ["webmap"]) == ["refused", "refused"]
    finally:
        near.shutdown()
        near.server_close()


def test_a_page_without_a_key_explains_the_sign_in_and_resumes_afterwards(
    tab, script, tmp_path
):
    with running("run", script, "--port", 0, "--no-browser", pattern=WEB) as process:
        root = process.url.partition("?")[0]
        tab.goto(process.url)
        shows_its_map(tab)
        tab.evaluate("localStorage.clear()")
        tab.goto(root + "lab")
        status = tab.locator(".webmap-notice.status")
        expect(status).to_contain_text("Open the address that WebMap printed")
        tab.screenshot(path=str(tmp_path / "signed-out.png"))
        second = tab.context.new_page()
        second.goto(process.url)
        shows_its_map(second)
        shows_its_map(tab)


def test_the_sign_in_page_has_its_style_and_a_focused_field(tab, script):
    with running("run", script, "--port", 0, "--no-browser", pattern=WEB) as process:
        tab.goto(process.url.partition("?")[0])
        expect(tab.get_by_label("Token")).to_be_focused()
        expect(tab.locator("main")).to_have_css("border-radius", "12px")
        expect(tab.get_by_text("Sign in first.")).to_be_visible()
