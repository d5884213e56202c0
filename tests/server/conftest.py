"""Fixtures of the tests of the server."""

import warnings
from types import SimpleNamespace

import pytest
from page_loop import Loop

from equipment.server_fakes import (
    TOKEN,
    FakeGate,
    FakeModel,
    FakePage,
    FakeSite,
    key_in,
)

with warnings.catch_warnings():
    # Starlette wants another library for its test client; httpx works, too.
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient

from webmap.server.access import Settings
from webmap.server.app import WebApp

HOST = "127.0.0.1:8000"


@pytest.fixture
def rooms() -> SimpleNamespace:
    """The packages below the server, all of them fakes."""
    return SimpleNamespace(
        site=FakeSite(FakePage("/"), FakePage("/lab/", title="The <lab>")),
        model=FakeModel(),
        gate=FakeGate(),
    )


@pytest.fixture
def app(rooms):
    return WebApp(rooms.site, rooms.model, rooms.gate, Settings(token=TOKEN))


@pytest.fixture
def make_client():
    """Make a client of an ASGI application; the client follows no redirect."""

    def make(app, **options):
        return TestClient(
            app, base_url=f"http://{HOST}", follow_redirects=False, **options
        )

    return make


@pytest.fixture
def stranger(app, make_client):
    """A client that has not signed in."""
    return make_client(app)


@pytest.fixture
def client(app, make_client):
    """A client that has signed in."""
    client = make_client(app)
    page = client.get(f"/?token={TOKEN}", follow_redirects=True)
    client.headers["webmap-key"] = key_in(page.text)
    return client


@pytest.fixture
def loop():
    loop = Loop()
    yield loop
    loop.end()
