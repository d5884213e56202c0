"""Bombs and floods before and after the sign-in fill no memory of the display."""

import contextlib
import gzip
import socket
import time

import httpx
import psutil
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from equipment.processes import WEB, running
from equipment.server_fakes import sign_in

pytestmark = pytest.mark.slow

SCRIPT = """
import webmap

@webmap.page("/")
def main(page):
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("MetreGrid")

webmap.run()
"""

CEILING = 64 << 20
"""Bytes by which the memory of a process may grow in each test."""


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    file = tmp_path_factory.mktemp("page") / "page.py"
    file.write_text(SCRIPT)
    with running("run", file, "--port", 0, "--no-browser", pattern=WEB) as process:
        root = process.url.partition("/?")[0]
        yield root, process.url, psutil.Process(process.popen.pid)


@pytest.fixture
def memory(served):
    """Fail if the memory of the display or its gate grows by more than allowed."""
    _, url, process = served
    sign_in(url)
    processes = [process, *process.children()]
    before = [each.memory_info().rss for each in processes]
    highest = list(before)

    def look():
        for n, each in enumerate(processes):
            highest[n] = max(highest[n], each.memory_info().rss)

    yield look
    look()
    grown = [(a - b) >> 20 for a, b in zip(highest, before, strict=True)]
    print(f"grown by {grown} MiB")
    assert all(a - b < CEILING for a, b in zip(highest, before, strict=True)), grown
    assert process.children() == processes[1:], "a process ended"


def raw(root):
    host, _, port = root.removeprefix("http://").partition(":")
    link = socket.create_connection((host, int(port)), timeout=5)
    link.settimeout(1)
    return link


HEAD = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"
POST = "POST /_webmap/sign-in HTTP/1.1\r\nHost: 127.0.0.1\r\n"
BOMB = gzip.compress(b"name=" + b"a" * (64 << 20))

STRANGERS = {
    "headers without an end": (HEAD.encode(), b"X: " + b"a" * 60_000 + b"\r\n"),
    "one header without an end": (HEAD.encode() + b"X: ", b"a" * 64_000),
    "a body without an end": (
        f"{POST}Transfer-Encoding: chunked\r\n\r\n".encode(),
        b"fa00\r\n" + b"a" * 64_000 + b"\r\n",
    ),
    "a body of a gigabyte": (
        f"{POST}Content-Length: 1000000000\r\n\r\n".encode(),
        b"a" * 64_000,
    ),
    "a compressed body": (
        f"{POST}Content-Encoding: gzip\r\nContent-Length: {len(BOMB)}\r\n\r\n".encode(),
        BOMB,
    ),
}


@pytest.mark.parametrize("kind", STRANGERS)
def test_strangers_who_send_without_end_fill_no_memory(served, memory, kind):
    root, url, _ = served
    begin, rest = STRANGERS[kind]
    links = []
    try:
        for _ in range(60):
            with contextlib.suppress(OSError):
                link = raw(root)
                links.append(link)
                link.sendall(begin)
                for _ in range(16):
                    link.sendall(rest)
            memory()
        sign_in(url)  # people are served meanwhile
    finally:
        for link in links:
            link.close()


def opened(root, browser, name, **options):
    return connect(
        f"{root.replace('http', 'ws')}/_webmap/{name}",
        origin=root,
        subprotocols=browser.protocols,
        max_size=None,
        **options,
    )


def test_people_who_send_too_much_or_read_nothing_fill_no_memory(served, memory):
    root, url, _ = served
    browser = sign_in(url)
    with contextlib.ExitStack() as stack:
        for n in range(25):
            hello = '{"type":"hello","width":800,"height":600,"maps":[]}'
            link = stack.enter_context(
                opened(root, browser, f"scene?id=p{n}&page=/", max_queue=1)
            )
            link.send(hello)  # and reads nothing
            memory()
        for message in ("x" * (8 << 20), b"\0" * (8 << 20), "[" * 16_000):
            with contextlib.suppress(ConnectionClosed, OSError):
                link = stack.enter_context(opened(root, browser, "drive"))
                for _ in range(20):
                    link.send(message)
            memory()
        with contextlib.suppress(ConnectionClosed, OSError):
            link = stack.enter_context(opened(root, browser, "drive"))
            until = time.monotonic() + 1
            while time.monotonic() < until:
                link.send('{"op":"cancel","robot":"r1"}')
        memory()
        cookie = {"cookie": browser.cookie}
        assert httpx.get(f"{root}/healthz", headers=cookie).json()["status"] == "ok"


def test_sockets_of_pages_accept_no_compression(served):
    root, url, _ = served
    browser = sign_in(url)
    with opened(root, browser, "drive") as link:
        assert link.response.headers.get("sec-websocket-extensions") is None
