"""The two sockets, with a real server and the client of websockets."""

import asyncio
import contextlib
import json
import logging
import socket as sockets
import time
from urllib.parse import urlencode

import pytest
from starlette.websockets import WebSocket
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.frames import Frame, Opcode

from equipment.server_fakes import TOKEN, running
from equipment.waiting import wait_for
from webmap.server.access import Settings
from webmap.server.app import WebApp
from webmap.server.page_socket import OPENS_AT_ONCE, REPLACED, TOO_SOON
from webmap.server.sockets import MOST_STOP_ONLY, place_of

TICK = '{"op":"tick","tick":%d,"ack":-1}'


@pytest.fixture(scope="module")
def module_rooms():
    from types import SimpleNamespace

    from equipment.server_fakes import FakeGate, FakeModel, FakePage, FakeSite

    return SimpleNamespace(
        site=FakeSite(FakePage("/"), FakePage("/lab")),
        model=FakeModel(),
        gate=FakeGate(),
    )


@pytest.fixture(scope="module")
def server(module_rooms):
    rooms = module_rooms
    app = WebApp(
        rooms.site, rooms.model, rooms.gate, Settings(token=TOKEN, max_pages=4)
    )
    with running(app) as server:
        yield server


@pytest.fixture
def rooms(module_rooms):
    """The packages below the server, without earlier connections."""
    wait_for(lambda: all(s.times_closed for s in module_rooms.model.scenes))
    wait_for(lambda: all(c.times_closed for c in module_rooms.gate.connections))
    module_rooms.model.scenes.clear()
    module_rooms.model.drives.clear()
    module_rooms.gate.connections.clear()
    return module_rooms


@pytest.fixture
def open_socket(server):
    """Open sockets as one viewer's browser does."""
    own = server.sign_in()

    def opened(name, browser=own, **options):
        return connect(
            server.socket_url(name),
            origin=server.origin,
            additional_headers={"cookie": browser.cookie},
            subprotocols=browser.protocols,
            max_size=None,
            **options,
        )

    return opened


async def reason_of(socket):
    """Read until the socket ends; return its close code and reason."""
    with contextlib.suppress(ConnectionClosed):
        async with asyncio.timeout(20):
            while True:
                await socket.recv()
    return socket.close_code, socket.close_reason


def test_a_scene_socket_carries_messages_both_ways_and_reports_its_close_once(
    rooms, open_socket
):
    async def scenario():
        async with open_socket("scene?page=lab&id=p1") as socket:
            await socket.send("hello")
            # The server opens the scene after it has accepted the socket.
            await asyncio.to_thread(wait_for, lambda: rooms.model.scenes)
            scene = rooms.model.scenes[0]
            await asyncio.to_thread(wait_for, lambda: scene.received)
            await asyncio.to_thread(scene.socket.offer, b"frame 1")
            await asyncio.to_thread(scene.socket.offer, b"frame 2")
            assert [await socket.recv(), await socket.recv()] == [
                b"frame 1",
                b"frame 2",
            ]
            assert socket.response.headers.get("sec-websocket-extensions") is None

    asyncio.run(scenario())
    scene = rooms.model.scenes[0]
    assert (scene.path, scene.page_id, scene.received) == ("/lab", "p1", ["hello"])
    wait_for(lambda: scene.times_closed)
    scene.socket.offer(b"too late")
    scene.socket.end(1011, "too late")
    assert scene.times_closed == 1


def test_the_hello_of_a_page_is_part_of_the_address_of_its_scene_socket(
    rooms, open_socket
):
    async def scenario():
        query = urlencode({"page": "lab", "id": "p1", "hello": '{"op":"hello"}'})
        async with open_socket(f"scene?{query}") as socket:
            await asyncio.to_thread(wait_for, lambda: rooms.model.scenes)
            scene = rooms.model.scenes[0]
            await asyncio.to_thread(wait_for, lambda: scene.received)
            await socket.send("later")
            await asyncio.to_thread(wait_for, lambda: len(scene.received) == 2)

    asyncio.run(scenario())
    assert rooms.model.scenes[0].received == ['{"op":"hello"}', "later"]


def test_a_drive_socket_carries_messages_both_ways_and_reports_its_close(
    rooms, open_socket
):
    async def scenario():
        async with open_socket("drive?id=p1") as socket:
            await socket.send('{"op":"take","robot":"r1"}')
            await asyncio.to_thread(wait_for, lambda: rooms.gate.connections)
            connection = rooms.gate.connections[0]
            await asyncio.to_thread(wait_for, lambda: connection.received)
            connection.send(TICK % 7)
            assert await socket.recv() == TICK % 7

    asyncio.run(scenario())
    connection = rooms.gate.connections[0]
    assert connection.role == "admin"
    assert connection.received == ['{"op":"take","robot":"r1"}']
    wait_for(lambda: len(rooms.model.drives) == 2)
    assert connection.times_closed == 1
    assert rooms.model.drives == [
        ("opened", "p1", connection),
        ("closed", "p1", connection),
    ]


def test_a_page_has_a_speed_limit_of_zero_before_its_own_limit_is_known(
    rooms, open_socket
):
    async def scenario():
        async with open_socket("drive?id=p1"), open_socket("drive"):
            await asyncio.to_thread(wait_for, lambda: len(rooms.gate.connections) == 2)

    asyncio.run(scenario())
    # Without a page there is no speed limit; the model sends the limit of a page.
    speeds = [connection.speeds for connection in rooms.gate.connections]
    assert sorted(speeds, key=str) == [(0.0, 0.0), None]
    wait_for(lambda: len(rooms.model.drives) == 4)


def test_a_drive_socket_without_an_id_counts_as_its_own_page(rooms, open_socket):
    expected = [["x"], ["x"]]

    async def scenario():
        async with open_socket("drive") as first, open_socket("drive") as second:
            await first.send("x")
            await second.send("x")
            await asyncio.to_thread(
                wait_for,
                lambda: [c.received for c in rooms.gate.connections] == expected,
            )

    asyncio.run(scenario())
    assert len({page_id for _, page_id, _ in rooms.model.drives}) == 2


def test_the_gate_can_close_a_drive_socket_with_a_reason(rooms, open_socket):
    async def scenario():
        async with open_socket("drive?id=p") as socket:
            await socket.send("rubbish")
            await asyncio.to_thread(wait_for, lambda: rooms.gate.connections)
            rooms.gate.connections[0].end("20 bad messages in a second")
            return await reason_of(socket)

    assert asyncio.run(scenario()) == (1008, "20 bad messages in a second")


def test_the_model_can_close_a_scene_socket_with_a_reason(rooms, open_socket):
    async def scenario():
        async with open_socket("scene?id=p") as socket:
            await asyncio.to_thread(wait_for, lambda: rooms.model.scenes)
            rooms.model.scenes[0].socket.end(1011, "the page was closed " + "€" * 99)
            return await reason_of(socket)

    code, reason = asyncio.run(scenario())
    assert code == 1011
    assert reason.startswith("the page was closed €")


@pytest.mark.parametrize(
    ("name", "message", "reason"),
    [
        (
            "scene?id=p",
            "x" * (16 * 1024 + 1),
            "got a message of 16385 bytes, expected at most 16384",
        ),
        (
            "drive?id=p",
            "x" * 1025,
            "got a message of 1025 bytes, expected at most 1024",
        ),
        ("scene?id=p", b"binary", "got a binary message, expected text"),
        ("drive?id=p", b"binary", "got a binary message, expected text"),
    ],
)
def test_a_too_large_or_binary_message_closes_the_socket(
    rooms, open_socket, name, message, reason
):
    async def scenario():
        async with open_socket(name) as socket:
            await socket.send(message)
            return await reason_of(socket)

    code, close_reason = asyncio.run(scenario())
    assert code == 1008
    assert close_reason.startswith(reason)
    assert not any(s.received for s in (*rooms.model.scenes, *rooms.gate.connections))


def test_a_message_far_above_the_size_limit_closes_the_socket_with_code_1009(
    rooms, open_socket
):
    async def scenario():
        async with open_socket("scene?id=p") as socket:
            await socket.send("x" * 1_000_000)
            return (await reason_of(socket))[0]

    assert asyncio.run(scenario()) == 1009


STOPS = {
    "oversized": '{"op":"stop","robot":"r1","x":"' + "x" * 20_000 + '"}',
    "binary": b'{"op":"stop","robot":"r1"}',
    "binary nonsense": b' { "op" : "stop" \xff',
}


@pytest.mark.parametrize("message", STOPS.values(), ids=STOPS)
def test_an_invalid_stop_reaches_the_gate_before_the_socket_is_closed(
    rooms, open_socket, message
):
    async def scenario():
        async with open_socket("drive?id=p") as socket:
            await socket.send(message)
            return await reason_of(socket)

    assert asyncio.run(scenario())[0] == 1008
    (connection,) = rooms.gate.connections
    assert connection.received == [message]
    assert rooms.model.refusals


def test_a_stop_in_invalid_utf_8_reaches_the_gate_before_the_socket_is_closed(
    rooms, open_socket, caplog
):
    async def scenario(*frames):
        async with open_socket("drive?id=p") as socket:
            for n, (fin, data) in enumerate(frames):
                opcode = Opcode.CONT if n else Opcode.TEXT
                socket.protocol.send_frame(Frame(opcode, data, fin))
            socket.send_data()
            return await reason_of(socket)

    whole = b'{"op":"stop","robot":"\xff"}'
    assert asyncio.run(scenario((True, whole)))[0] == 1008
    assert asyncio.run(scenario((False, whole[:8]), (True, whole[8:])))[0] == 1008
    texts = [each for one in rooms.gate.connections for each in one.received]
    assert texts == [whole, whole]
    assert "Traceback" not in caplog.text


def test_a_stop_after_a_message_that_closes_the_socket_reaches_the_gate(
    rooms, open_socket
):
    stop, drive = '{"op":"stop","robot":"r1"}', '{"op":"drive"}'

    async def scenario():
        async with open_socket("drive?id=p") as socket:
            for text in ("x" * 1025, drive, stop, drive):
                socket.protocol.send_text(text.encode())
            socket.send_data()
            return await reason_of(socket)

    assert asyncio.run(scenario())[0] == 1008
    (connection,) = rooms.gate.connections
    assert connection.received == [stop]


def test_a_stop_in_a_flood_of_messages_reaches_the_gate(rooms, open_socket):
    stop = '{"op":"stop","robot":"*"}'

    async def scenario():
        async with open_socket("drive?id=p") as socket:
            for text in (*["x"] * 200, stop, *[stop] * 500):
                socket.protocol.send_text(text.encode())
            socket.send_data()
            return await reason_of(socket)

    assert asyncio.run(scenario())[0] == 1008
    (connection,) = rooms.gate.connections
    assert connection.received.count(stop) in range(1, 62)


@pytest.mark.parametrize(("name", "rate"), [("scene?id=p", 240), ("drive?id=p", 60)])
def test_a_socket_with_too_many_messages_per_second_is_closed(
    rooms, open_socket, name, rate
):
    async def scenario():
        async with open_socket(name) as socket:
            with contextlib.suppress(ConnectionClosed):
                for _ in range(1000):
                    await socket.send("x")
            return await reason_of(socket)

    assert asyncio.run(scenario()) == (1008, f"more than {rate} messages a second")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("scene?page=nothing&id=p", "there is no page at this address"),
        ("scene?page=/", "id must be"),
        ("scene?page=/&id=a/b", "id must be"),
        ("drive?id=", "id must be"),
        (f"drive?id={'x' * 65}", "id must be"),
    ],
)
def test_a_socket_with_an_unknown_page_or_an_invalid_id_is_closed_with_a_reason(
    rooms, open_socket, name, reason
):
    async def scenario():
        async with open_socket(name) as socket:
            return await reason_of(socket)

    code, close_reason = asyncio.run(scenario())
    assert code == 1008
    assert close_reason.startswith(reason)
    assert rooms.model.scenes == []


@pytest.mark.parametrize("name", ["scene?id=p", "drive?id=p"])
def test_a_page_that_reconnects_replaces_its_lost_socket(rooms, open_socket, name):
    async def scenario():
        async with open_socket(name) as old:
            await old.send("old")
            async with open_socket(name) as new:
                assert (await reason_of(old))[0] == REPLACED
                await new.send("new")
                sides = rooms.model.scenes or rooms.gate.connections
                await asyncio.to_thread(wait_for, lambda: len(sides) == 2)
                await asyncio.to_thread(wait_for, lambda: sides[1].received)
                assert sides[1].times_closed == 0
                await asyncio.to_thread(wait_for, lambda: sides[0].times_closed)

    asyncio.run(scenario())


def test_two_viewers_can_use_the_same_page_id(rooms, server, open_socket):
    other = server.sign_in()

    async def scenario():
        async with (
            open_socket("scene?id=p") as first,
            open_socket("scene?id=p", browser=other) as second,
        ):
            await second.send("second")
            await asyncio.to_thread(wait_for, lambda: len(rooms.model.scenes) == 2)
            await asyncio.to_thread(wait_for, lambda: rooms.model.scenes[1].received)
            await first.send("first")
            await asyncio.to_thread(wait_for, lambda: rooms.model.scenes[0].received)

    asyncio.run(scenario())
    assert len({scene.viewer.id for scene in rooms.model.scenes}) == 2


def test_a_page_above_the_limit_is_refused(rooms, open_socket):
    async def scenario():
        async with contextlib.AsyncExitStack() as stack:
            for number in range(4):
                await stack.enter_async_context(open_socket(f"scene?id={number}"))
            async with open_socket("scene?id=last") as socket:
                return await reason_of(socket)

    code, reason = asyncio.run(scenario())
    assert code == 1013
    assert "too many open pages" in reason


@pytest.mark.parametrize("name", ["scene", "drive"])
def test_a_viewer_with_all_places_yields_one_to_another_viewer(
    rooms, server, open_socket, name
):
    async def scenario():
        async with contextlib.AsyncExitStack() as stack:
            enter = stack.enter_async_context
            sockets = [await enter(open_socket(f"{name}?id={n}")) for n in range(4)]
            other = await enter(open_socket(f"{name}?id=0", server.sign_in()))
            reason = await reason_of(sockets[-1])
            for socket in (*sockets[:-1], other):
                await (await socket.ping())
            return reason

    code, reason = asyncio.run(scenario())
    assert code == 1013
    assert "too many open pages" in reason


def test_a_stop_is_served_at_every_limit_of_places_and_rates(
    rooms, server, open_socket
):
    stop, take = '{"op":"stop","robot":"*"}', '{"op":"take","robot":"r1"}'

    async def scenario():
        async with contextlib.AsyncExitStack() as stack:
            enter = stack.enter_async_context
            for number in range(4 + MOST_STOP_ONLY):
                await enter(open_socket(f"drive?id=more{number}"))
            for number in range(40):
                async with open_socket(f"scene?id={number}"):
                    pass
            # Of five viewers with one page each, the last has no place to drive.
            for number in range(1, 4):
                await enter(open_socket(f"drive?id={number}", server.sign_in()))
            late = await enter(open_socket("drive?id=late", server.sign_in()))
            await late.send(take)
            refused = json.loads(await late.recv())
            await late.send(stop)
            await asyncio.to_thread(
                wait_for,
                lambda: any(c.received == [stop] for c in rooms.gate.connections),
            )
            await late.send("x" * 1025)  # ends the socket
            await late.send(stop)
            assert (await reason_of(late))[0] == 1008
            return refused

    refused = asyncio.run(scenario())
    assert refused == {
        "op": "refused",
        "robot": "r1",
        "what": "take",
        "why": "too many open pages: this page can only stop robots",
    }
    (connection,) = [c for c in rooms.gate.connections if c.received]
    assert (connection.role, connection.received) == ("viewer", [stop, stop])


def test_a_page_that_can_only_stop_connects_again_when_there_is_a_place(
    rooms, server, open_socket
):
    async def scenario():
        async with contextlib.AsyncExitStack() as stack:
            enter = stack.enter_async_context
            own = [await enter(open_socket(f"drive?id={n}")) for n in range(4)]
            more = await enter(open_socket("drive?id=more"))
            await own[0].close()
            return await reason_of(more)

    code, reason = asyncio.run(scenario())
    assert (code, reason) == (1013, "there is a place now: connect again")


@pytest.mark.serial
def test_a_viewer_who_opens_pages_too_fast_must_wait_and_others_need_not(
    rooms, server, open_socket
):
    async def scenario():
        for _ in range(OPENS_AT_ONCE):
            async with open_socket("scene?id=p"):
                pass
        begun = time.monotonic()
        async with open_socket("scene?id=p") as socket:
            reason = await reason_of(socket)
        assert time.monotonic() - begun > 0.9  # the next attempt comes late
        async with open_socket("scene?id=p", server.sign_in()) as socket:
            await (await socket.ping())
        return reason

    code, reason = asyncio.run(scenario())
    assert (code, reason) == (1013, TOO_SOON)


def test_a_page_that_stops_reading_is_closed(rooms, open_socket):
    async def scenario():
        async with open_socket("scene?id=p", max_queue=1) as socket:
            await asyncio.to_thread(wait_for, lambda: rooms.model.scenes)
            scene = rooms.model.scenes[0]

            def flood():
                scene.socket.offer(bytes(900_000))
                return scene.times_closed

            await asyncio.to_thread(wait_for, flood, seconds=10)
            socket.transport.abort()

    asyncio.run(scenario())
    assert rooms.model.scenes[0].times_closed == 1


def test_a_slow_scene_socket_does_not_delay_ticks(rooms, open_socket):
    async def scenario():
        async with (
            open_socket("scene?id=p", max_queue=1) as slow,
            open_socket("drive?id=p") as quick,
        ):
            await asyncio.to_thread(
                wait_for, lambda: rooms.model.scenes and rooms.gate.connections
            )
            for number in range(20):
                rooms.model.scenes[0].socket.offer(bytes(700_000))
                rooms.gate.connections[0].send(TICK % number)
                async with asyncio.timeout(4):  # less than STALLED_S
                    assert await quick.recv() == TICK % number
            slow.transport.abort()

    asyncio.run(scenario())


def test_an_aborted_connection_of_a_browser_is_closed_at_the_gate(rooms, open_socket):
    async def scenario():
        async with open_socket("drive?id=p") as socket:
            await asyncio.to_thread(wait_for, lambda: rooms.gate.connections)
            socket.transport.abort()
            await asyncio.to_thread(
                wait_for, lambda: rooms.gate.connections[0].times_closed
            )

    asyncio.run(scenario())


def test_an_exception_in_the_model_or_the_gate_closes_only_its_socket(
    rooms, open_socket, caplog, monkeypatch
):
    def fail(*args):
        raise RuntimeError("the model is not there")

    async def scenario():
        with monkeypatch.context() as patch:
            patch.setattr(rooms.model, "open_scene", fail)
            patch.setattr(rooms.gate, "connect", fail)
            async with open_socket("scene?id=p") as socket:
                scene = await reason_of(socket)
            async with open_socket("drive?id=p") as socket:
                drive = await reason_of(socket)
        async with open_socket("scene?id=p") as socket:
            await asyncio.to_thread(wait_for, lambda: rooms.model.scenes)
            rooms.model.scenes[0].received = None
            await socket.send("x")
            message = await reason_of(socket)
        return scene, drive, message

    scene, drive, message = asyncio.run(scenario())
    assert scene == (1011, "the page could not be opened; see the log of WebMap")
    assert drive == (1011, "no connection to the gate; see the log of WebMap")
    assert message == (1011, "WebMap failed on this page; see the log of WebMap")
    assert "the model is not there" in caplog.text
    assert "has no attribute 'append'" in caplog.text


@pytest.mark.parametrize("name", ["scene?id=p", "drive?id=p"])
@pytest.mark.parametrize(
    ("origin", "key", "status"),
    [
        (None, True, 403),
        ("null", True, 403),
        ("http://localhost:{port}", True, 403),
        ("http://127.0.0.1:1", True, 403),
        ("http://127.0.0.1:{port}.evil.com", True, 403),
        ("http://127.0.0.1:{port}", False, 401),
    ],
)
def test_a_refused_socket_is_never_upgraded(rooms, server, name, origin, key, status):
    async def scenario():
        browser = server.sign_in()
        with pytest.raises(InvalidStatus) as caught:
            async with connect(
                server.socket_url(name),
                origin=origin.format(port=server.port) if origin else None,
                additional_headers={"cookie": browser.cookie},
                subprotocols=browser.protocols if key else None,
            ):
                pass
        return caught.value.response

    response = asyncio.run(scenario())
    assert response.status_code == status
    assert "default-src 'none'" in response.headers["content-security-policy"]
    assert rooms.model.scenes == []
    assert rooms.gate.connections == []


def test_the_token_is_in_no_log_and_no_answer_of_the_server(rooms, server, caplog):
    with (
        caplog.at_level(logging.DEBUG),
        sockets.create_connection(("127.0.0.1", server.port)) as raw,
    ):
        raw.sendall(
            f"GET /?token={TOKEN} HTTP/1.1\r\nHost: 127.0.0.1\r\n"
            "Connection: close\r\n\r\n".encode()
        )
        answer = b""
        while data := raw.recv(4096):
            answer += data
    assert answer.startswith(b"HTTP/1.1 303")
    assert b"server:" not in answer.lower()
    assert TOKEN.encode() not in answer
    assert TOKEN not in caplog.text


def test_the_gate_gets_the_name_and_the_identity_of_a_page(rooms, open_socket):
    async def scenario():
        async with open_socket("drive?id=p1"), open_socket("drive?id=p2"):
            await asyncio.to_thread(wait_for, lambda: len(rooms.gate.connections) == 2)
            return list(rooms.gate.connections)

    one, other = asyncio.run(scenario())
    assert one.name == other.name == "an operator at WebMap's computer (no name)"
    assert one.identity.person == other.identity.person
    assert one.identity.page != other.identity.page
    assert not one.identity.verified


@pytest.mark.parametrize(
    ("client", "headers", "place"),
    [
        ("127.0.0.1", {}, "WebMap's computer"),
        ("::1", {}, "WebMap's computer"),
        ("127.0.0.1", {"x-forwarded-for": "10.0.0.5"}, ""),
        ("127.0.0.1", {"forwarded": "for=10.0.0.5"}, ""),
        ("::ffff:10.0.0.5", {}, "10.0.0.5"),
        ("fe80::1%eth0", {}, "fe80::1"),
        ("testclient", {}, ""),
        (None, {}, ""),
    ],
)
def test_a_browser_is_where_its_address_is_unless_a_proxy_hides_it(
    client, headers, place
):
    pairs = [(name.encode(), value.encode()) for name, value in headers.items()]
    scope = {"type": "websocket", "headers": pairs, "path": "/", "query_string": b""}
    scope["client"] = client and (client, 1)
    assert place_of(WebSocket(scope, None, None)) == place
