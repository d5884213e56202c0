"""The bad link of ``webmap demo``."""

import socket
import threading
import time
from contextlib import contextmanager
from urllib.parse import urlsplit

import pytest

from equipment.command_line import run_inside
from webmap.cli import demo

pytestmark = pytest.mark.slow


@contextmanager
def echo():
    """A server that echoes the data of one client; yield its address."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve():
            near, _ = listener.accept()
            with near:
                while data := near.recv(100):
                    near.sendall(data)

        thread = threading.Thread(target=serve)
        thread.start()
        yield f"ws://127.0.0.1:{listener.getsockname()[1]}"
        thread.join()


def seconds_for_an_answer(client):
    start = time.monotonic()
    client.sendall(b"x")
    assert client.recv(1) == b"x"
    return time.monotonic() - start


def connected(url):
    return socket.create_connection(("127.0.0.1", urlsplit(url).port), timeout=20)


def test_without_faults_the_address_is_the_one_of_the_server():
    with demo.bad_link("ws://127.0.0.1:9", 0, 0, 0) as url:
        assert url == "ws://127.0.0.1:9"


def test_a_delay_is_added_each_way():
    with (
        echo() as server,
        demo.bad_link(server, 50, 0, 0) as url,
        connected(url) as client,
    ):
        assert seconds_for_an_answer(client) >= 0.1


def test_jitter_is_added_at_random():
    with (
        echo() as server,
        demo.bad_link(server, 0, 40, 0) as url,
        connected(url) as client,
    ):
        took = [seconds_for_an_answer(client) for _ in range(10)]
    assert sum(took) / 10 > 0.02, (
        "the delay is 40 ms on average, for both ways together"
    )


def test_a_stall_holds_the_link_again_and_again(monkeypatch):
    monkeypatch.setattr(demo, "STALL_EVERY", 0.5)
    with (
        echo() as server,
        demo.bad_link(server, 0, 0, 0.3) as url,
        connected(url) as client,
    ):
        stalls, deadline = 0, time.monotonic() + 20
        while stalls < 3:
            assert time.monotonic() < deadline
            # A message that waits for the end of a stall was sent during the stall.
            stalls += seconds_for_an_answer(client) > 0.15


@pytest.mark.parametrize(
    ("option", "value", "expected"),
    [
        ("--delay", "-1", "0.0<=x<=5000.0"),
        ("--delay", "slow", "not a valid float"),
        ("--jitter", "6000", "0.0<=x<=5000.0"),
        ("--jitter", "nan", "not a finite number"),
        ("--stall", "15", "0.0<=x<=10.0"),
        ("--stall", "inf", "inf"),
    ],
)
def test_an_invalid_fault_is_refused_with_the_expected_range(option, value, expected):
    result = run_inside("demo", option, value)
    assert result.returncode == 2
    assert option in result.stderr
    assert value in result.stderr
    assert expected in result.stderr
