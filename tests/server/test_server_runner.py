"""The server process: one line of output, clear refusals, a clean end."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import httpx
import pytest
from websockets.sync.client import connect

import webmap
from equipment.server_fakes import (
    TOKEN,
    FakeGate,
    FakeModel,
    FakePage,
    FakeSite,
    sign_in,
)
from webmap.base.errors import ConfigError, WebMapError
from webmap.server.access import Settings
from webmap.server.app import WebApp
from webmap.server.proxy import Grant, Proxies, ProxyUsers
from webmap.server.runner import announce, check_exposure, listen, serve, url_of

PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
from equipment.server_fakes import FakeGate, FakeModel, FakePage, FakeSite
from webmap.server.app import WebApp
from webmap.server.runner import serve
from webmap.server.access import Settings

app = WebApp(
    FakeSite(FakePage("/")), FakeModel(), FakeGate(), Settings(token=sys.argv[2])
)
serve(app, port=0)
print("ended", flush=True)
"""


@pytest.fixture
def process():
    """A process that serves; at its end, its output and log are shown."""
    child = subprocess.Popen(
        [sys.executable, "-c", PROGRAM, str(Path(__file__).parents[1]), TOKEN],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    yield child
    child.kill()
    child.communicate()


@pytest.mark.serial
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_server_within_two_seconds_even_with_open_sockets(
    process, number
):
    line = process.stdout.readline()
    assert line.startswith("WebMap is ready at http://127.0.0.1:")
    assert line.endswith(f"/?token={TOKEN}\n")
    url = line.split()[-1]
    origin = url.partition("/?")[0]
    browser = sign_in(url)
    with contextlib.ExitStack() as stack:
        for name in ("scene?id=p", "drive?id=p"):
            address = f"ws{origin[4:]}/_webmap/{name}"
            stack.enter_context(
                connect(address, origin=origin, subprotocols=browser.protocols)
            )
        idle = stack.enter_context(httpx.Client(headers={"cookie": browser.cookie}))
        assert idle.get(origin).status_code == 200
        half = socket.create_connection(("127.0.0.1", int(origin.rpartition(":")[2])))
        stack.enter_context(half)
        half.sendall(b"GET / HT")
        began = time.monotonic()
        os.kill(process.pid, number)
        out, log = process.communicate(timeout=10)
    assert time.monotonic() - began < 2.0
    assert process.returncode == 0
    assert out == "ended\n"
    assert "Traceback" not in log
    assert TOKEN not in log


def app(settings=None, lifespan=None):
    return WebApp(
        FakeSite(FakePage("/")),
        FakeModel(),
        FakeGate(),
        settings or Settings(token=TOKEN),
        lifespan=lifespan,
    )


def test_the_ready_line_is_printed_at_once(capsys):
    announce("http://127.0.0.1:1/")
    assert capsys.readouterr().out == "WebMap is ready at http://127.0.0.1:1/\n"


def test_a_port_in_use_is_refused_with_a_clear_message():
    with listen("127.0.0.1", 0) as occupied:
        port = occupied.getsockname()[1]
        with pytest.raises(ConfigError, match=f"port {port} on 127.0.0.1 is in use"):
            serve(app(), port=port)


@pytest.mark.parametrize("port", [-1, 65536])
def test_an_invalid_port_is_refused(port):
    with pytest.raises(ConfigError, match="from 0 to 65535"):
        listen("127.0.0.1", port)


@pytest.mark.parametrize("host", ["no such host", "a" * 300, "192.0.2.1"])
def test_a_host_that_is_not_an_address_of_this_machine_is_refused(host):
    with pytest.raises(ConfigError, match=r"host|address"):
        listen(host, 0)


@pytest.mark.parametrize(
    "host", ["", "0.0.0.0", "::", "192.168.1.5", "robots.example.com", "127.0.0.1.x"]
)
def test_serving_other_machines_needs_tls_or_the_insecure_lan_option(host):
    with pytest.raises(ConfigError, match="insecure"):
        serve(app(), host=host, port=0)
    check_exposure(host, insecure_lan=True)
    check_exposure(host, tls=True)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "127.9.9.9"])
def test_serving_only_this_machine_needs_no_option(host):
    check_exposure(host)


def test_the_url_can_be_opened_by_a_browser_on_this_machine():
    with listen("0.0.0.0", 0) as listener:
        port = listener.getsockname()[1]
        assert url_of(listener, "0.0.0.0") == f"http://127.0.0.1:{port}/"
        assert url_of(listener, "", tls=True) == f"https://127.0.0.1:{port}/"
        assert url_of(listener, "::1") == f"http://[::1]:{port}/"
        assert url_of(listener, "localhost") == f"http://localhost:{port}/"


def serve_in_thread(application, **options):
    """Run :func:`serve` until it fails; return the error."""
    errors = []

    def run():
        try:
            serve(application, port=0, **options)
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join(20)
    assert not thread.is_alive()
    return errors


def test_an_application_that_cannot_start_is_an_error_and_is_not_announced(caplog):
    @contextlib.asynccontextmanager
    async def life(_):
        raise RuntimeError("no gate")
        yield

    ready = []
    errors = serve_in_thread(app(lifespan=life), on_ready=ready.append)
    assert [type(error) for error in errors] == [WebMapError]
    assert ready == []
    assert "no gate" in caplog.text


def test_the_url_has_no_token_if_a_host_application_authenticates_viewers():
    def stop(url):
        urls.append(url)
        raise BrokenPipeError

    urls = []
    settings = Settings(token=TOKEN, authenticate=lambda scope: None)
    errors = serve_in_thread(app(settings), on_ready=stop)
    assert [type(error) for error in errors] == [BrokenPipeError]
    assert len(urls) == 1
    assert "token" not in urls[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"proxy_user_header": "X-User"}, "everybody could send X-User"),
        (
            {"proxy_user_header": "X-User", "trusted_proxies": ["127.0.0.1"]},
            "nobody could sign in",
        ),
        (
            {"embed_from": ["https://a"], "host": "0.0.0.0", "insecure_lan": True},
            "in a frame of another page with TLS",
        ),
        ({"embed_from": ["a.example"]}, "an origin is a scheme"),
        ({"public_url": "example.com"}, "the public URL"),
        ({"public_url": "http://example.com"}, "without TLS anyone"),
    ],
)
def test_options_of_a_proxy_or_a_frame_that_are_not_safe_are_refused(options, words):
    with pytest.raises(ConfigError, match=words):
        webmap.run(port=0, **options)


@pytest.mark.parametrize("signs_in", [False, True])
def test_the_printed_address_is_the_public_one(signs_in):
    users = ProxyUsers("X-User", (Grant("*", "viewer"),)) if signs_in else None
    proxies = Proxies.of("https://a.example/robots/")
    settings = Settings(token=TOKEN, proxies=proxies, proxy_users=users)
    urls = []

    def ready(url):
        urls.append(url)
        raise WebMapError("enough")

    with pytest.raises(WebMapError, match="enough"):
        serve(app(settings), port=0, on_ready=ready)
    token = "" if signs_in else f"?token={TOKEN}"
    assert urls == [f"https://a.example/robots/{token}"]
