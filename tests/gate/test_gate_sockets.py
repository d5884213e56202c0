"""One WebSocket to a bridge: how it is opened, refused, cut and closed."""

import asyncio
import socket
import ssl
import subprocess
import threading

import pytest
from link_bench import (
    CLOSE,
    MORE,
    PING,
    PONG,
    TEXT,
    Received,
    frame,
    in_loop,
    noting_bridge,
    raw_bridge,
)
from websockets.asyncio.server import serve
from websockets.client import ClientProtocol

from equipment.waiting import until
from webmap.base.errors import BridgeClosed
from webmap.gate.lanes import sockets
from webmap.gate.lanes.budget import Budget
from webmap.gate.lanes.sockets import Socket, open_socket
from webmap.ros.rosbridge.pieces import Pieces

pytestmark = pytest.mark.slow


async def opened(url, seen):
    return await open_socket(url, seen.handlers, Budget())


async def forever(link):
    """Read to the end."""
    while await link.reader.read(1 << 16):
        pass


class TestOpen:
    @in_loop
    async def test_a_message_arrives_and_its_answer_is_received(self):
        seen = Received()
        async with noting_bridge() as bridge:
            link = await opened(bridge.url, seen)
            assert link.is_open
            link.send(b'{"op": "call_service", "id": "7", "service": "/s"}')
            await until(lambda: seen.texts, "the answer")
            assert b'"id": "7"' in seen.texts[0]
            link.ping(b"12345678")
            await until(lambda: seen.pongs == [b"12345678"], "the pong")
            link.close()
            await until(lambda: not bridge.links, "its end")
        assert not link.is_open
        assert seen.lost == [], "closing a link is no loss"

    @in_loop
    async def test_a_fragmented_message_is_received_once_and_complete(self):
        seen = Received()

        async def talk(link):
            await link.accept()
            link.send(frame(TEXT, b"on", final=False))
            link.send(frame(PONG, b"between"))
            link.send(frame(MORE, b"e") + frame(TEXT, b"two"))
            await forever(link)

        async with raw_bridge(talk) as url:
            link = await opened(url, seen)
            await until(lambda: len(seen.texts) == 2, "both messages")
            assert seen.texts == [b"one", b"two"]
            assert seen.pongs == [b"between"]
            link.close()

    @in_loop
    async def test_a_ping_of_the_bridge_is_answered_without_calling_a_handler(self):
        seen, answers = Received(), []

        async def talk(link):
            await link.accept(frame(PING, b"there?"))
            answers.append(await link.reader.readexactly(2 + 4 + 6))
            await forever(link)

        async with raw_bridge(talk) as url:
            link = await opened(url, seen)
            await until(lambda: answers, "the pong")
            assert answers[0][0] == 0x80 | PONG
            assert (seen.texts, seen.pongs) == ([], [])
            link.close()

    @in_loop
    async def test_loading_the_certificate_authorities_does_not_block_the_event_loop(
        self, monkeypatch
    ):
        reading, may_end, ended = threading.Event(), threading.Event(), []

        def slow_disk():
            reading.set()
            ended.append(may_end.wait(2))
            return ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)

        monkeypatch.setattr(ssl, "create_default_context", slow_disk)
        asking = asyncio.create_task(opened("wss://127.0.0.1:1", Received()))
        await until(reading.is_set, "the reading")  # the loop is not blocked
        may_end.set()
        with pytest.raises(BridgeClosed):
            await asking
        assert ended == [True], "the loop was blocked by the reading"

    def test_a_tls_bridge_is_accepted_only_with_a_trusted_certificate(
        self, tmp_path, monkeypatch
    ):
        key, cert = str(tmp_path / "key.pem"), str(tmp_path / "cert.pem")
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "ec", "-nodes", "-keyout", key,
             "-pkeyopt", "ec_paramgen_curve:prime256v1", "-out", cert, "-days", "2",
             "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"],
            check=True,
            capture_output=True,
        )  # fmt: skip

        async def hang_up(connection):
            await connection.recv()
            connection.transport.close()

        async def story():
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(cert, key)
            async with serve(hang_up, "localhost", 0, ssl=context) as server:
                port = server.sockets[0].getsockname()[1]
                url = f"wss://localhost:{port}"
                with pytest.raises(BridgeClosed, match="certificate"):
                    await opened(url, Received())
                monkeypatch.setenv("SSL_CERT_FILE", cert)
                seen = Received()
                link = await opened(url, seen)
                link.send(b"hello")
                await until(lambda: seen.lost, "the end of the link")
                assert not link.is_open

        in_loop(story)()


class TestRefused:
    @in_loop
    async def test_a_refused_connection_raises_bridge_closed_with_the_reason(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            url = f"ws://127.0.0.1:{taken.getsockname()[1]}"
            with pytest.raises(BridgeClosed, match=f"{url}: .*Connect call failed"):
                await opened(url, Received())

    @pytest.mark.parametrize(
        "answer",
        [
            b"HTTP/1.1 403 Forbidden\r\nContent-Length: 0\r\n\r\n",
            b"SSH-2.0-OpenSSH_9.6\r\n",
            b"HTTP/1.1 101 Switching Protocols\r\n\r\n",
        ],
    )
    @in_loop
    async def test_a_server_without_websocket_is_refused_with_the_reason(self, answer):
        seen = Received()

        async def talk(link):
            await link.request()
            link.send(answer)
            await forever(link)

        async with raw_bridge(talk) as url:
            with pytest.raises(BridgeClosed, match="no WebSocket at this address"):
                await opened(url, seen)
        assert seen.lost == [], "a link that was never open is not lost"

    @in_loop
    async def test_a_bridge_that_closes_before_the_handshake_is_refused(self):
        seen = Received()

        async def talk(link):
            await link.request()
            link.writer.close()

        async with raw_bridge(talk) as url:
            with pytest.raises(BridgeClosed):
                await opened(url, seen)
        assert seen.lost == []

    @in_loop
    async def test_a_handshake_without_an_answer_times_out_and_reports_no_loss(
        self, monkeypatch
    ):
        monkeypatch.setattr(sockets, "CONNECT_TIMEOUT", 0.1)
        seen, ended = Received(), []

        async def talk(link):
            await link.request()
            try:
                await link.reader.read()
            except ConnectionResetError:
                ended.append("reset")

        async with raw_bridge(talk) as url:
            with pytest.raises(BridgeClosed, match=r"no answer within 0\.1 s"):
                await opened(url, seen)
            await until(lambda: ended == ["reset"], "the end of the attempt")
        assert seen.lost == []

    @in_loop
    async def test_a_cancelled_connection_attempt_closes_its_socket(self):
        seen, asked, ended = Received(), asyncio.Event(), []

        async def talk(link):
            await link.request()
            asked.set()
            try:
                await link.reader.read()
            except ConnectionResetError:
                ended.append("reset")

        async with raw_bridge(talk) as url:
            attempt = asyncio.create_task(opened(url, seen))
            await asked.wait()
            attempt.cancel()
            with pytest.raises(asyncio.CancelledError):
                await attempt
            await until(lambda: ended == ["reset"], "the end of the attempt")
        assert seen.lost == []

    @in_loop
    async def test_closing_a_socket_that_never_connected_reports_no_loss(self):
        seen = Received()
        link = Socket("ws://127.0.0.1:1", seen.handlers, Budget())
        assert link.unsent == 0
        link.close()
        assert not link.is_open
        link.connection_lost(None)
        assert seen.lost == []


class TestEnd:
    @in_loop
    async def test_aborting_a_socket_discards_its_unsent_data(self):
        seen, arrived, go_on = Received(), [], asyncio.Event()

        async def talk(link):
            await link.accept()
            link.writer.transport.pause_reading()
            await go_on.wait()
            link.writer.transport.resume_reading()
            try:
                while data := await link.reader.read(1 << 20):
                    arrived.append(len(data))
            except ConnectionResetError:
                arrived.append("reset")

        async with raw_bridge(talk) as url:
            link = await opened(url, seen)
            sent = 0
            while not link.unsent:
                link.send(b"x" * (1 << 20))
                sent += 1 << 20
            link.abort("no longer used")
            assert seen.lost == ["no longer used"]
            go_on.set()
            await until(lambda: "reset" in arrived, "the reset")
            assert sum(arrived[:-1]) < sent
            link.abort("again")
        assert seen.lost == ["no longer used"], "the loss is reported once"

    @in_loop
    async def test_closing_sends_a_close_frame_and_ignores_later_messages(self):
        seen, goodbyes, go_on = Received(), [], asyncio.Event()

        async def talk(link):
            await link.accept()
            goodbyes.append(await link.reader.readexactly(2 + 4 + 2))
            await go_on.wait()

        async with raw_bridge(talk) as url:
            link = await opened(url, seen)
            link.close()
            link.data_received(frame(TEXT, b"late"))
            await until(lambda: goodbyes, "the close frame")
            assert goodbyes[0][0] == 0x80 | CLOSE
            go_on.set()
            link.close()  # a second close does nothing
        assert (seen.texts, seen.lost) == ([], [])

    @in_loop
    async def test_a_close_frame_from_the_bridge_reports_a_loss(self):
        seen = Received()

        async def talk(link):
            await link.accept()
            link.send(frame(CLOSE, b"\x03\xe9"))
            await forever(link)

        async with raw_bridge(talk) as url:
            await opened(url, seen)
            await until(lambda: seen.lost, "the loss")
            assert seen.lost == ["the bridge closed the connection"]

    @in_loop
    async def test_an_end_of_stream_from_the_bridge_reports_a_loss(self):
        seen = Received()

        async def talk(link):
            await link.accept()
            link.writer.write_eof()
            await forever(link)

        async with raw_bridge(talk) as url:
            await opened(url, seen)
            await until(
                lambda: seen.lost == ["the bridge closed the connection"], "loss"
            )

    @in_loop
    async def test_a_connection_reset_reports_a_loss_with_the_system_error(self):
        seen = Received()
        async with noting_bridge() as bridge:
            link = await opened(bridge.url, seen)
            link.send(b'{"op": "x"}')
            await until(lambda: bridge.received, "the first message")
            raw = bridge.transport_of(1).get_extra_info("socket")
            raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, sockets._LINGER)
            bridge.transport_of(1).abort()
            await until(lambda: seen.lost, "the loss")
            assert "reset" in seen.lost[0]

    @in_loop
    async def test_a_message_that_is_too_long_closes_the_socket(self):
        seen = Received()
        size = sockets.MAX_FRAME + 1

        async def talk(link):
            await link.accept()
            link.send(b"\x81\x7f" + size.to_bytes(8, "big") + bytes(size))
            await forever(link)

        async with raw_bridge(talk) as url:
            link = await opened(url, seen)
            await until(lambda: seen.lost, "the loss")
            assert (seen.texts, link.is_open) == ([], False)


def test_a_whole_message_is_recognized_by_its_head():
    def heads(data):
        pieces, waiting, found = Pieces(), bytearray(data), []
        while size := pieces.next(waiting, handshake_done=True):
            found.append(pieces.head)
            del waiting[:size]
        return found

    text = frame(TEXT, b"{}")
    assert heads(text + b"\x82\x7e\x00\x80" + bytes(128)) == [2, 4]
    part, end, ping = frame(TEXT, b"{", final=False), frame(0, b"}"), frame(PING)
    masked = b"\x81\x80abcd"
    assert heads(part + end + ping + masked) == [0, 0, 0, 0, 0]
    assert heads(text[:1]) == []


@in_loop
async def test_websockets_reads_only_what_is_no_whole_message(monkeypatch):
    pieces, read = [], ClientProtocol.receive_data

    def noted(protocol, data=b""):
        pieces.append(data)
        read(protocol, data)

    parts = [frame(TEXT, b"2", final=False), frame(MORE, b"3")]
    after = frame(CLOSE) + frame(TEXT, b"after the close frame")

    async def talk(link):
        await link.accept(frame(TEXT, b"1") + b"".join(parts) + frame(TEXT, b"4"))
        await until(lambda: len(seen.texts) == 3, "the messages")
        link.send(after)
        await link.reader.read()

    seen = Received()
    monkeypatch.setattr(ClientProtocol, "receive_data", noted)
    async with raw_bridge(talk) as url:
        link = await opened(url, seen)
        assert link._transport.max_size == sockets.MAX_WAITING
        await until(lambda: seen.lost, "the end")
    assert seen.texts == [b"1", b"23", b"4"]
    assert [piece for piece in pieces if piece[:1] in b"\x00\x01\x80\x81"] == parts
