"""The line between an agent and a router, and the subscriptions of an agent."""

import json
import socket
import threading
from contextlib import closing

import pytest

from benchmarks.line import Line
from benchmarks.uplink import Scene

SENT = bytes(range(256)) * 100


@pytest.fixture
def echo():
    """Return the port of a server that sends back all bytes that it receives."""
    server = socket.create_server(("127.0.0.1", 0))

    def serve(link):
        with closing(link):
            while data := link.recv(1 << 16):
                link.sendall(data)

    def accept():
        while True:
            try:
                link, _ = server.accept()
            except OSError:
                return
            threading.Thread(target=serve, args=(link,), daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    with closing(server):
        yield server.getsockname()[1]


def there_and_back(port, sent=SENT):
    with socket.create_connection(("127.0.0.1", port)) as link:
        link.settimeout(20)
        threading.Thread(target=link.sendall, args=(sent,)).start()
        got = b""
        while len(got) < len(sent):
            got += link.recv(1 << 16)
    return got


@pytest.mark.parametrize(
    ("rate", "queue"), [(None, "fair"), (1e6, "fair"), (1e6, "one")]
)
def test_a_line_carries_and_counts_every_byte_in_order(echo, rate, queue):
    with Line(echo, rate, queue, depth=4000) as line:
        assert there_and_back(line.port) == SENT
        assert there_and_back(line.port, SENT[:5000]) == SENT[:5000]
        assert line.up.bytes == line.down.bytes == len(SENT) + 5000


def test_the_scene_is_what_the_agent_subscribed_to_last():
    scene = Scene()
    for id, throttle in (("agent-1", 1), ("agent-2", 100), ("other", 5)):
        op = {"op": "subscribe", "topic": "/scan", "type": "sensor_msgs/LaserScan"}
        scene.note(json.dumps({**op, "id": id, "throttle_rate": throttle}))
    scene.note('{"op":"call_service","service":"/rosapi/topics"}')
    assert [op["throttle_rate"] for op in scene.subscriptions] == [100]
    assert scene.scans == ["/scan"]
