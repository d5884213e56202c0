"""A page that stops reading is closed in seconds, with a reason and without a leak."""

import asyncio
import contextlib
import logging
import time

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from equipment.server_fakes import (
    TOKEN,
    FakeGate,
    FakeModel,
    FakePage,
    FakeSite,
    running,
)
from equipment.waiting import wait_for
from webmap.server import page_socket, runner
from webmap.server.access import Settings
from webmap.server.app import WebApp
from webmap.server.connections import WebSocketProtocol

pytestmark = pytest.mark.slow


@pytest.fixture
def model():
    return FakeModel()


@pytest.fixture
def gate():
    return FakeGate()


@pytest.fixture
def server(model, gate, monkeypatch, request):
    """A server with a tenth of the timeout, or with another timeout for pongs."""
    patience = getattr(request, "param", None) or runner.PONG_WITHIN_S / 10
    monkeypatch.setattr(runner, "PING_EVERY_S", runner.PING_EVERY_S / 10)
    monkeypatch.setattr(runner, "PONG_WITHIN_S", patience)
    monkeypatch.setattr(page_socket, "STALLED_S", page_socket.STALLED_S / 10)
    app = WebApp(FakeSite(FakePage("/")), model, gate, Settings(token=TOKEN))
    with running(app) as server:
        yield server


def web_sockets(server):
    return [c for c in tuple(server.connections) if isinstance(c, WebSocketProtocol)]


def stall(server, name, meanwhile=lambda: None):
    """Let a page stop reading until the server has no connection of it.

    Returns:
        The time until then, in seconds, and the code and reason of the closed socket
        that the page gets when it reads again.

    """
    browser = server.sign_in()

    async def scenario():
        async with connect(
            server.socket_url(name),
            origin=server.origin,
            additional_headers={"cookie": browser.cookie},
            subprotocols=browser.protocols,
            max_size=None,
            max_queue=1,
        ) as socket:
            socket.transport.pause_reading()
            began = time.monotonic()
            while web_sockets(server):
                meanwhile()
                await asyncio.sleep(0.01)
                assert time.monotonic() < began + 8
            took = time.monotonic() - began
            socket.transport.resume_reading()
            with contextlib.suppress(ConnectionClosed):
                async with asyncio.timeout(5):
                    while True:
                        await socket.recv()
            return took, socket.close_code, socket.close_reason

    return asyncio.run(scenario())


def test_a_page_is_given_up_within_ten_seconds():
    assert runner.PING_EVERY_S + runner.PONG_WITHIN_S <= 10
    assert page_socket.STALLED_S <= 10


@pytest.mark.parametrize("name", ["scene", "drive"])
def test_a_page_that_answers_nothing_is_closed_with_a_sentence(
    server, model, gate, caplog, name
):
    caplog.set_level(logging.INFO)
    why = "this page answered nothing for 0.4 s"
    took, code, reason = stall(server, f"{name}?id=p")
    assert took < 3
    assert (code, reason) == (1011, why)
    sides = [*model.scenes, *gate.connections]
    wait_for(lambda: [side.times_closed for side in sides] == [1])
    (line,) = [r.message for r in caplog.records if why in r.message]
    assert line.startswith(name)


@pytest.mark.parametrize("server", [None, 60.0], indirect=True, ids=["pings", "none"])
def test_a_page_that_reads_nothing_leaves_nothing_behind(server, model, caplog):
    """The connection is cut, although the system would keep the unread bytes."""
    caplog.set_level(logging.INFO)

    def flood():
        for one in web_sockets(server):
            one.close_timeout = 0.1
        for scene in model.scenes:
            if not scene.times_closed:
                scene.socket.offer(bytes(500_000))

    took, _, _ = stall(server, "scene?id=p", flood)
    assert took < 5
    assert model.scenes[0].times_closed == 1
    (line,) = [r.message for r in caplog.records if "scene of / for" in r.message]
    assert "this page" in line
