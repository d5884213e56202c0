"""Pages of other origins, and names that lead to this machine, in a real Chromium."""

import http.server
import threading
from contextlib import contextmanager

import pytest

from equipment.chromium import CHROMIUM_ARGS, chromium_path
from equipment.webmap_process import page_of

pytestmark = pytest.mark.browser

SCRIPT = """
import webmap

@webmap.page("/")
def main(page):
    webmap.Map(page.element("webmap_container"))

webmap.run()
"""

REBOUND = ("evil.example", "localhost.evil.example", "127.0.0.1.evil.example")
"""Names of others that lead to this machine."""

TRY = """async ([root, key]) => {
  const settled = {};
  for (const name of ["scene?id=x&page=/", "drive?id=x"]) {
    const socket = new WebSocket(
      `${root.replace("http", "ws")}/_webmap/${name}`, ["webmap", key]);
    settled[name.slice(0, 5)] = await new Promise((done) => {
      socket.onopen = () => done("open");
      socket.onerror = () => done("refused");
    });
    socket.close();
  }
  for (const [name, path, options] of [
    ["read", "/", {}],
    ["health", "/healthz", {}],
    ["figures", "/metrics", {}],
    ["sign out", "/_webmap/sign-out", { method: "POST", mode: "no-cors" }],
    ["key", "/_webmap/key", { method: "POST", headers: { "webmap-key": key } }],
  ])
    settled[name] = await fetch(root + path, { credentials: "include", ...options })
      .then((answer) => answer.type === "opaque" ? "unknown" : `${answer.status}`)
      .catch(() => "refused");
  for (const [name, tag, at] of [
    ["script", "script", "/_webmap/web/page.js"],
    ["picture", "img", "/_webmap/icon.svg"],
  ])
    settled[name] = await new Promise((done) => {
      const element = document.createElement(tag);
      element.onload = () => done("loaded");
      element.onerror = () => done("refused");
      try {
        element.src = root + at;
        document.documentElement.append(element);
      } catch {
        done("refused");  // by trusted types
      }
    });
  return settled;
}"""

OWN = {
    **{"scene": "open", "drive": "open", "read": "200", "health": "200"},
    **{"figures": "200", "sign out": "401", "key": "204"},
}
"""What a page of WebMap gets."""

NOTHING = {
    **{"scene": "refused", "drive": "refused", "read": "refused", "health": "refused"},
    **{"figures": "refused", "key": "refused", "script": "refused"},
    "picture": "refused",
}
"""What pages of other origins get, also with the key of a page."""

FRAME = """async (root) => {
  const frame = document.createElement("iframe");
  frame.src = root;
  const loaded = new Promise((done) => { frame.onload = done; });
  document.documentElement.append(frame);
  await loaded;
}"""


class Neighbour(http.server.BaseHTTPRequestHandler):
    """A server of somebody else on another port; its page has no policy."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("content-type", "text/html")
        if self.path == "/sandbox":
            self.send_header("content-security-policy", "sandbox allow-scripts")
        self.end_headers()
        self.wfile.write(b"<!doctype html><title>other</title>")

    def log_message(self, *args):
        pass


@contextmanager
def neighbour():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Neighbour)
    threading.Thread(target=server.serve_forever).start()
    try:
        yield server.server_port
    finally:
        server.shutdown()
        server.server_close()


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "page.py"
    file.write_text(SCRIPT)
    with page_of(file) as url:
        yield url


@pytest.fixture
def context(chromium):
    """A browser for which names of others lead to this machine."""
    rules = ", ".join(f"MAP {name} 127.0.0.1" for name in REBOUND)
    browser = chromium.browser_type.launch(
        executable_path=chromium_path(),
        args=[*CHROMIUM_ARGS, f"--host-resolver-rules={rules}"],
    )
    yield browser.new_context()
    browser.close()


def test_no_page_of_another_origin_or_of_a_rebound_name_reaches_webmap(context, page):
    root, _, token = page.partition("/?token=")
    port = root.rpartition(":")[2]
    own = context.new_page()
    own.goto(page)
    own.wait_for_selector("svg.webmap")
    key = own.evaluate("Object.values(localStorage)[0]")
    assert own.evaluate(TRY, [root, key]).items() >= OWN.items()

    with neighbour() as other:
        origins = [
            f"http://127.0.0.1:{other}/",  # another port, with the same cookies
            f"http://localhost:{other}/",
            f"http://127.0.0.1:{other}/sandbox",  # its origin is "null"
            *(f"http://{name}:{other}/" for name in REBOUND),
        ]
        for origin in origins:
            foreign = context.new_page()
            foreign.goto(origin)
            got = foreign.evaluate(TRY, [root, key])
            assert got.items() >= NOTHING.items(), (origin, got)
            foreign.evaluate(FRAME, root)
            (frame,) = [f for f in foreign.frames if f != foreign.main_frame]
            assert frame.url.startswith("chrome-error:"), (origin, frame.url)
            foreign.close()

    # The address that the token was printed for works under no other name.
    for name in REBOUND:
        rebound = context.new_page()
        answer = rebound.goto(f"http://{name}:{port}/?token={token}")
        assert answer.status == 421
        assert "does not accept this host name" in rebound.content()
        assert context.cookies(f"http://{name}:{port}/") == []
        got = rebound.evaluate(TRY, [f"http://{name}:{port}", key])
        assert (got["scene"], got["drive"], got["key"]) == ("refused", "refused", "421")
        assert (got["read"], got["health"], got["figures"]) == ("421", "421", "421")
        assert got["script"] == "refused"
        rebound.close()
    assert own.evaluate(TRY, [root, key])["drive"] == "open"
