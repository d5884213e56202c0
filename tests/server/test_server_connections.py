"""Connections without a sign-in are limited and do not block other viewers."""

import asyncio
import contextlib
import socket
import time
from pathlib import Path

import httpx
import pytest
from websockets.asyncio.client import connect

from equipment.server_fakes import (
    TOKEN,
    FakeGate,
    FakeModel,
    FakePage,
    FakeSite,
    running,
)
from equipment.waiting import wait_for
from webmap.server import connections
from webmap.server.access import Settings
from webmap.server.app import WebApp
from webmap.server.connections import STRANGERS
from webmap.server.outbox import BatchedCallsByLoop, DriveQueue
from webmap.server.page_socket import DRIVE, PageSocket

pytestmark = pytest.mark.slow

SHORT_S = 0.5
HEAD = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"


@pytest.fixture
def gate():
    return FakeGate()


@pytest.fixture
def large(tmp_path):
    path = tmp_path / "large.html"
    path.write_text("<head></head>" + "x" * 20_000_000)
    return path


@pytest.fixture
def server(gate, large):
    site = FakeSite(FakePage("/"), FakePage("/large", large, Path(large.parent)))
    app = WebApp(site, FakeModel(), gate, Settings(token=TOKEN))
    with running(app) as server:
        yield server


@pytest.fixture
def short(monkeypatch):
    """Shorten the time that a connection may wait."""
    monkeypatch.setattr(connections, "WAITING_S", SHORT_S)


@pytest.fixture
def open_raw(server):
    """Open connections that send the bytes of the test."""
    with contextlib.ExitStack() as stack:

        def opened(sent="", receive_buffer=None):
            link = socket.socket()
            stack.enter_context(link)
            if receive_buffer is not None:
                link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
            link.settimeout(20)
            link.connect(("127.0.0.1", server.port))
            link.sendall(sent.encode())
            return link

        yield opened


def is_open(link):
    """Return whether a connection on which the server sends nothing is still open."""
    link.setblocking(False)
    try:
        return link.recv(1) != b""
    except BlockingIOError:
        return True
    except ConnectionError:
        return False


def ends_though_bytes_come(link, sent):
    """Return whether the server ends a connection that sends a byte now and then."""
    deadline = time.monotonic() + 20 * SHORT_S
    link.settimeout(SHORT_S / 4)
    try:
        while time.monotonic() < deadline:
            link.sendall(sent)
            sent = sent and b"x"
            with contextlib.suppress(TimeoutError):
                if not link.recv(1 << 16):
                    return True
    except ConnectionError:
        return True
    return False


def rest_of(link):
    """Return the bytes that arrive until the server ends a connection."""
    got = bytearray()
    with contextlib.suppress(ConnectionError):
        while data := link.recv(1 << 20):
            got += data
    return bytes(got)


def test_600_idle_connections_without_sign_in_do_not_block_a_signed_in_viewer(
    server, gate, open_raw
):
    browser = server.sign_in()
    sent = ["", HEAD, HEAD + "Cookie: webmap_1=x\r\n"]
    links = [open_raw(sent[n % 3]) for n in range(600)]
    page = httpx.get(server.origin, headers={"cookie": browser.cookie})
    assert page.status_code == 200

    async def drive():
        async with connect(
            server.socket_url("drive"),
            origin=server.origin,
            subprotocols=browser.protocols,
        ) as link:
            await link.send('{"op":"stop","robot":"*"}')
            await asyncio.to_thread(wait_for, lambda: gate.connections[0].received)

    asyncio.run(drive())
    assert gate.connections[0].received == ['{"op":"stop","robot":"*"}']
    wait_for(lambda: sum(map(is_open, links)) <= STRANGERS)
    # The newest connections stay: one of them may be about to sign in.
    assert is_open(links[-1])


def test_connections_of_a_signed_in_viewer_are_not_closed_at_the_limit(
    server, gate, open_raw
):
    browser = server.sign_in()

    async def scenario():
        async with connect(
            server.socket_url("drive"),
            origin=server.origin,
            subprotocols=browser.protocols,
        ) as link:
            with httpx.Client(headers={"cookie": browser.cookie}) as kept:
                assert kept.get(server.origin).status_code == 200
                links = [open_raw() for _ in range(STRANGERS + 50)]
                await asyncio.to_thread(
                    wait_for, lambda: sum(map(is_open, links)) == STRANGERS
                )
                assert kept.get(server.origin).status_code == 200
            await link.send("still here")
            await asyncio.to_thread(wait_for, lambda: gate.connections[0].received)

    asyncio.run(scenario())


def test_too_many_connections_without_sign_in_are_logged_once(server, open_raw, caplog):
    links = [open_raw() for _ in range(STRANGERS + 50)]
    wait_for(lambda: sum(map(is_open, links)) == STRANGERS)
    assert caplog.text.count("too many connections wait") == 1


@pytest.mark.parametrize(
    "sent",
    [
        "",
        "GET / HT",
        HEAD,
        "POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 9\r\n\r\n",
        "GET /_webmap/drive HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: upgrade\r\n"
        "Upgrade: websocket\r\n",
    ],
)
def test_a_connection_that_sends_no_complete_request_is_closed(short, open_raw, sent):
    link = open_raw(sent)
    assert ends_though_bytes_come(link, b"x" if sent else b"")


def test_an_endless_request_after_a_valid_one_closes_the_connection(
    short, server, open_raw
):
    cookie = server.sign_in().cookie
    host = f"Host: 127.0.0.1:{server.port}\r\n"
    link = open_raw(f"HEAD / HTTP/1.1\r\n{host}Cookie: {cookie}\r\n\r\n")
    assert link.recv(1 << 16).startswith(b"HTTP/1.1 200")
    assert ends_though_bytes_come(link, b"GET / HTTP/1.1\r\nX: ")


def test_a_large_answer_over_a_slow_link_is_sent_completely(short, server, open_raw):
    cookie = server.sign_in().cookie
    host = f"Host: 127.0.0.1:{server.port}\r\n"
    link = open_raw(
        f"GET /large HTTP/1.1\r\n{host}Cookie: {cookie}\r\n\r\n", receive_buffer=4096
    )
    time.sleep(4 * SHORT_S)  # the test is slow on purpose
    assert len(rest_of(link)) > 20_000_000


def test_a_connection_without_sign_in_gets_only_one_answer(open_raw):
    link = open_raw("GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 3)
    answer = rest_of(link)
    assert answer.count(b"HTTP/1.1 401") == 1
    assert b"connection: close" in answer.lower()


UPGRADE = (
    "GET /_webmap/drive HTTP/1.1\r\nHost: 127.0.0.1\r\nOrigin: http://127.0.0.1\r\n"
    "Connection: upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)


@pytest.mark.parametrize(("host", "status"), [("127.0.0.1", 401), ("evil.com", 421)])
def test_a_refused_socket_is_not_logged_as_an_error(
    server, open_raw, caplog, host, status
):
    link = open_raw(UPGRADE.replace("Host: 127.0.0.1", f"Host: {host}"))
    assert rest_of(link).startswith(f"HTTP/1.1 {status}".encode())
    open_raw("").close()
    assert httpx.get(server.origin).status_code == 401  # it would be logged by now
    assert "handshake" not in caplog.text
    assert not [one for one in caplog.records if one.levelname == "ERROR"]


class GivenUp:
    """A socket that the server has closed, as its pings were not answered."""

    async def receive(self):
        await asyncio.Event().wait()

    async def send_text(self, text):
        raise RuntimeError("Unexpected ASGI message 'websocket.send', after sending")

    async def close(self, code, reason):
        raise RuntimeError("Unexpected ASGI message 'websocket.close', after sending")


def test_sending_to_a_closed_page_logs_no_traceback(caplog):
    async def scenario():
        line = PageSocket(
            GivenUp(), "drive", BatchedCallsByLoop().of_this_loop(), DRIVE, DriveQueue()
        )
        line.offer("tick")
        async with asyncio.timeout(10):
            await line.run(print, print)
        line.end(1011, "too late")
        await line.refuse(1011, "too late")

    asyncio.run(scenario())
    assert caplog.records == []


class Stalled:
    """A socket of a page that breaks a rule and sends STOP, while no thread runs."""

    def __init__(self):
        self._messages = asyncio.Queue()
        self._mine, self._pages = socket.socketpair()
        self.closed = None
        self._came(b"x" * 2000)

    def _came(self, data):
        message = {"type": "websocket.receive", "text": data.decode()}
        self._messages.put_nowait(message)

    async def receive(self):
        if self._messages.empty():
            loop = asyncio.get_running_loop()
            loop.add_reader(self._mine, lambda: self._came(self._mine.recv(100)))
            loop.call_soon(self._stall)
        return await self._messages.get()

    def _stall(self):
        # The timer of whoever waits and the message are due in the same turn.
        self._pages.send(b"stop")
        time.sleep(0.1)
        self._stall = lambda: None

    async def close(self, code, reason):
        asyncio.get_running_loop().remove_reader(self._mine)
        self._mine.close()
        self._pages.close()
        self.closed = code


def test_a_stop_after_a_broken_rule_is_read_although_the_thread_did_not_run():
    async def scenario():
        page = Stalled()
        calls = BatchedCallsByLoop().of_this_loop()
        line = PageSocket(page, "drive", calls, DRIVE, DriveQueue())
        rest = []
        async with asyncio.timeout(10):
            await line.run(print, lambda why: None, rest.append)
        assert page.closed == 1008
        return rest[1:]

    assert asyncio.run(scenario()) == ["stop"]
