"""The fault proxy, with real sockets at both ends."""

import socket
import threading
import time

import pytest

from webmap.testing import FaultProxy, Shape


@pytest.fixture
def ends():
    """The proxy, a client's socket, and the server's socket behind the proxy."""
    listener = socket.create_server(("127.0.0.1", 0))
    with listener, FaultProxy(listener.getsockname()[1]) as proxy:
        client = socket.create_connection(("127.0.0.1", proxy.port), 5)
        server, _ = listener.accept()
        with client, server:
            client.settimeout(5)
            server.settimeout(5)
            client.sendall(b"!")
            assert server.recv(1) == b"!"
            yield proxy, client, server


def read(end, size):
    data = b""
    while len(data) < size and (more := end.recv(size - len(data))):
        data += more
    return data


def nothing_comes(end, seconds):
    end.settimeout(seconds)
    try:
        with pytest.raises(TimeoutError):
            end.recv(1)
    finally:
        end.settimeout(5)


def test_the_proxy_passes_bytes_in_both_directions(ends):
    _, client, server = ends
    client.sendall(b"hello")
    assert read(server, 5) == b"hello"
    server.sendall(b"there")
    assert read(client, 5) == b"there"


def test_the_proxy_passes_five_megabytes_unchanged(ends):
    _, client, server = ends
    data = bytes(range(256)) * 20_000
    sender = threading.Thread(target=client.sendall, args=(data,))
    sender.start()
    assert read(server, len(data)) == data
    sender.join(5)


def test_held_bytes_arrive_only_after_release(ends):
    proxy, client, server = ends
    proxy.hold("up")
    client.sendall(b"late")
    nothing_comes(server, 0.2)
    server.sendall(b"down")
    assert read(client, 4) == b"down"
    proxy.release("up")
    assert read(server, 4) == b"late"


def test_latency_applies_to_each_direction(ends):
    proxy, client, server = ends
    proxy.shape(Shape(latency=0.15))
    begin = time.monotonic()
    client.sendall(b"x")
    server.sendall(read(server, 1))
    assert read(client, 1) == b"x"
    assert time.monotonic() - begin >= 0.3


def test_slicing_splits_one_write_into_several_reads(ends):
    proxy, client, server = ends
    proxy.shape(Shape(slice_size=3, slice_gap=1.0), "up")
    client.sendall(b"abcdef")
    assert server.recv(100) == b"abc"
    assert read(server, 3) == b"def"


def test_a_reset_reaches_both_ends_and_the_proxy_accepts_new_links(ends):
    proxy, client, server = ends
    proxy.reset()
    for end in (client, server):
        with pytest.raises(ConnectionResetError):
            end.recv(1)
    assert proxy.port != proxy.target
    socket.create_connection(("127.0.0.1", proxy.port), 5).close()


def test_a_half_close_ends_one_direction_and_keeps_the_other(ends):
    proxy, client, server = ends
    proxy.half_close("up")
    assert server.recv(1) == b""
    client.sendall(b"lost")
    server.sendall(b"still here")
    assert read(client, 10) == b"still here"


def test_bytes_sent_before_a_shutdown_arrive(ends):
    _, client, server = ends
    client.sendall(b"bye")
    client.shutdown(socket.SHUT_WR)
    assert read(server, 4) == b"bye"


def test_a_refusing_proxy_resets_new_links(ends):
    proxy, _, _ = ends
    proxy.refuse()
    with (
        pytest.raises(ConnectionResetError),
        socket.create_connection(("127.0.0.1", proxy.port), 5) as link,
    ):
        link.recv(1)


def test_a_proxy_without_a_server_resets_new_links():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with (
        FaultProxy(port) as proxy,
        # The reset may arrive before connect() has returned.
        pytest.raises(ConnectionResetError),
        socket.create_connection(("127.0.0.1", proxy.port), 5) as link,
    ):
        link.recv(1)
