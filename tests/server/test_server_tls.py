"""The server with TLS: signing in, sockets, clients that begin nothing."""

import contextlib
import socket
import ssl
import time

import httpx
import pytest
from websockets.sync.client import connect

from equipment.server_fakes import (
    TOKEN,
    FakeGate,
    FakeModel,
    FakePage,
    FakeSite,
    running,
)
from equipment.waiting import wait_for
from webmap.base.tls import Renewal, tls_files
from webmap.server import runner
from webmap.server.access import PROTOCOL, Settings
from webmap.server.app import WebApp


@pytest.fixture
def tls(tmp_path):
    return Renewal(tls_files("0.0.0.0", tmp_path, True, "", ""))


@pytest.fixture
def served(tls):
    app = WebApp(
        FakeSite(FakePage("/")), FakeModel(), FakeGate(), Settings(token=TOKEN)
    )
    with running(app, tls) as server:
        yield server


@pytest.fixture
def trusting(tls):
    return ssl.create_default_context(cafile=tls.files.authority)


def test_a_browser_signs_in_over_tls_and_its_cookie_is_secure(served, trusting):
    with httpx.Client(verify=trusting, follow_redirects=True) as browser:
        answer = browser.get(f"{served.origin}/?token={TOKEN}")
        assert answer.status_code == 200
        assert answer.url.scheme == "https"
        assert "; Secure" in answer.headers["set-cookie"]


def test_a_browser_that_does_not_know_the_authority_refuses_the_server(served):
    with pytest.raises(httpx.ConnectError, match="CERTIFICATE_VERIFY_FAILED"):
        httpx.get(served.origin)


@pytest.mark.parametrize(
    ("scheme", "status"), [("https", 401), ("http", 403)], ids=["own", "plain"]
)
def test_sockets_come_from_the_origin_with_tls_alone(served, trusting, scheme, status):
    with (
        pytest.raises(Exception, match=str(status)),
        connect(
            f"wss://127.0.0.1:{served.port}/_webmap/scene",
            ssl=trusting,
            origin=f"{scheme}://127.0.0.1:{served.port}",
            subprotocols=[PROTOCOL],
        ),
    ):
        pass


def test_a_client_that_does_not_begin_tls_is_disconnected(served, monkeypatch):
    begin = time.monotonic()
    with contextlib.ExitStack() as stack:
        silent = [
            stack.enter_context(socket.create_connection(("127.0.0.1", served.port)))
            for _ in range(20)
        ]
        for one in silent:
            one.settimeout(30)
            assert one.recv(1) == b""
    assert time.monotonic() - begin < 30  # asyncio alone would wait for a minute


def test_a_renewed_certificate_is_served_without_a_restart(
    tls, served, trusting, tmp_path
):
    def number():
        with (
            socket.create_connection(("127.0.0.1", served.port)) as link,
            trusting.wrap_socket(link, server_hostname="127.0.0.1") as secured,
        ):
            return secured.getpeercert()["serialNumber"]

    before = number()
    tls.files.certificate.unlink()
    assert tls.look()
    assert number() != before


def test_the_renewal_is_looked_for_while_the_server_runs(tls, tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "_RENEWAL_S", 0.01)
    app = WebApp(
        FakeSite(FakePage("/")), FakeModel(), FakeGate(), Settings(token=TOKEN)
    )
    with running(app, tls):
        before = tls.files.certificate.read_bytes()
        tls.files.certificate.unlink()

        def is_new():
            with contextlib.suppress(OSError):
                return tls.files.certificate.read_bytes() != before

        wait_for(is_new, "a new certificate")
