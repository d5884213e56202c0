"""Paths that should lead out of a folder, on every route that serves files."""

import asyncio
import itertools
import os

import pytest
from starlette.routing import WebSocketRoute

from equipment.server_fakes import FakePage
from webmap.core.operators import Viewer
from webmap.server.access import Settings
from webmap.server.app import WebApp

SECRET = "the secret outside"

TRICKS = [
    *("..", "../secret.css", "../../secret.css", "..//secret.css", "./../secret.css"),
    *("....//secret.css", "..;/secret.css", "images/../../secret.css", "/secret.css"),
    *("/etc/passwd", "//etc/passwd", "///etc/passwd", "file:///etc/passwd"),
    *("..\\secret.css", "..\\..\\secret.css", "images\\..\\..\\secret.css"),
    *("C:\\secret.css", "c:secret.css", "\\\\host\\share\\secret.css", "//host/x.css"),
    *("%2e%2e/secret.css", "%2e%2e%2fsecret.css", "..%2fsecret.css", "..%5csecret.css"),
    *("%252e%252e%252fsecret.css", "..%c0%afsecret.css", "..%ef%bc%8fsecret.css"),
    *("..\u2215secret.css", "\uff0e\uff0e/secret.css", "\udc2e\udc2e/secret.css"),
    *("style.css\0", "../secret.css\0.css", "style.css:stream", "style.css::$DATA"),
    *("out.css", "up/secret.css", "pipe.css", "device.png", "folder.css", "gone.css"),
    *(".hidden.css", ".git/config.css", "main.py", "con.css", "nul", "style.css/"),
    *("style.css ", "style.css.", "STYLE.CSS", "a" * 5000, "a/" * 2000, "~/x.css"),
    *("http://example.com/x.css", "v-0/../../secret.css", "\r\nset-cookie: a=b"),
]


@pytest.fixture
def served(rooms, tmp_path):
    """The real application, with a page whose folder has every kind of entry."""
    inside = tmp_path / "own"
    (inside / "images").mkdir(parents=True)
    (inside / "index.html").write_text("<head></head>")
    (inside / "style.css").write_text("a{}")
    for hidden in (inside / ".hidden.css", inside / "main.py", tmp_path / "secret.css"):
        hidden.write_text(SECRET)
    (inside / "out.css").symlink_to(tmp_path / "secret.css")
    (inside / "up").symlink_to(tmp_path)
    (inside / "folder.css").mkdir()
    os.mkfifo(inside / "pipe.css")
    (inside / "device.png").symlink_to("/dev/zero")
    rooms.site.pages["/own/"] = FakePage("/own/", inside / "index.html", inside)
    settings = Settings(authenticate=lambda scope: Viewer("v", "Vic", "admin"))
    app = WebApp(rooms.site, rooms.model, rooms.gate, settings)
    return app, app.published.publish_file(inside / "style.css")


async def asked(app, path):
    """Return the status, headers and body for a path, however it is spelled."""
    sent = []

    async def receive():
        return {"type": "http.request", "body": b"", "more_body": False}

    async def send(message):
        sent.append(message)

    scope = {
        **{"type": "http", "method": "GET", "path": path, "root_path": ""},
        **{"raw_path": path.encode(errors="replace"), "query_string": b""},
        **{"headers": [(b"host", b"127.0.0.1")], "client": ("127.0.0.1", 5)},
        **{"scheme": "http", "server": ("127.0.0.1", 80), "http_version": "1.1"},
    }
    await app(scope, receive, send)
    body = b"".join(each.get("body", b"") for each in sent)
    return sent[0]["status"], sent[0]["headers"], body


def test_no_path_of_any_route_leads_out_of_its_folder(served):
    app, published = served
    begins = {
        route.path.partition("{")[0]
        for route in app.routes
        if not isinstance(route, WebSocketRoute) and "{" in route.path
    }
    assert len(begins) >= 4
    begins |= {"/own/", published.rpartition("/")[0] + "/", "/_webmap/web/"}
    found = {"/own/style.css", published}

    async def all_of_them():
        for begin, trick in itertools.product(sorted(begins), TRICKS):
            status, headers, body = await asked(app, begin + trick)
            assert status in {404, 308} or begin + trick in found, (begin, trick)
            assert SECRET.encode() not in body, (begin, trick)
            assert b"root:" not in body, (begin, trick)
            for name, value in headers:
                assert b"\n" not in name + value, (begin, trick)
                # A redirect stays here: two slashes would name another host.
                if name == b"location":
                    assert value.startswith(b"/"), (begin, trick)
                    assert not value.startswith((b"//", b"/\\")), (begin, trick)
        for path in found:
            assert (await asked(app, path))[0] == 200

    asyncio.run(all_of_them())
