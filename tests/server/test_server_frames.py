"""WebMap in a frame of another page: only of a named one, and without driving."""

import pytest

from equipment.server_fakes import (
    TOKEN,
    FakeGate,
    FakeModel,
    FakePage,
    FakeSite,
    key_in,
)
from webmap.server.access import Settings
from webmap.server.app import WebApp

WORK = "https://work.example"
IN_FRAME = {"sec-fetch-dest": "iframe"}
HOST = "ws://127.0.0.1:8000/_webmap"


@pytest.fixture
def gate():
    return FakeGate()


@pytest.fixture
def model():
    return FakeModel()


@pytest.fixture
def make(make_client, gate, model):
    def make(**settings):
        site = FakeSite(FakePage("/"))
        app = WebApp(site, model, gate, Settings(token=TOKEN, **settings))
        return make_client(app)

    return make


def ancestors(answer):
    policy = answer.headers["content-security-policy"].split("; ")
    return [each for each in policy if each.startswith("frame-ancestors")]


def sign_in(client, **headers):
    page = client.get(f"/?token={TOKEN}", follow_redirects=True, headers=headers)
    assert page.status_code == 200
    return page


def roles(client, gate, model, key, query=""):
    """Return the roles with which the two sockets of a page are opened."""
    for kind in ("drive", "scene"):
        url = f"{HOST}/{kind}?id=p&page=/{query}"
        headers = {"origin": "http://127.0.0.1:8000"}
        with client.websocket_connect(url, ["webmap", key], headers=headers) as socket:
            socket.close()
    return gate.connections[-1].role, model.scenes[-1].viewer.role


@pytest.mark.parametrize("path", ["/", "/_webmap/icon.svg", "/nothing", "/?token=x"])
def test_each_answer_names_the_pages_that_may_show_it(make, path):
    assert ancestors(make().get(path)) == ["frame-ancestors 'none'"]
    named = make(embed_from=frozenset({WORK, "https://b.example"}))
    expected = f"frame-ancestors https://b.example {WORK}"
    assert ancestors(named.get(path)) == [expected]
    sign_in(named)
    assert ancestors(named.get(path)) == [expected]


@pytest.mark.parametrize("dest", ["iframe", "frame", "embed", "object"])
def test_the_cookie_of_a_frame_is_kept_apart_for_the_page_around_it(make, dest):
    cookie = sign_in(make(embed_from={WORK}), **{"sec-fetch-dest": dest}).headers
    assert cookie["set-cookie"].endswith("HttpOnly; SameSite=None; Secure; Partitioned")
    for headers, settings in (
        ({"sec-fetch-dest": dest}, {}),
        ({"sec-fetch-dest": "document"}, {"embed_from": {WORK}}),
        ({}, {"embed_from": {WORK}}),
    ):
        page = sign_in(make(**settings), **headers)
        assert page.headers["set-cookie"].endswith("HttpOnly; SameSite=Strict")


def test_the_key_of_a_frame_looks_and_stops_whatever_the_page_states(make, gate, model):
    client = make(embed_from={WORK})
    page = sign_in(client, **IN_FRAME)
    assert '<meta name="webmap-frame">' in page.text
    key = key_in(page.text)
    assert roles(client, gate, model, key) == ("viewer", "viewer")
    assert roles(client, gate, model, key, "&frame=") == ("viewer", "viewer")
    assert client.post("/_webmap/key", headers={"webmap-key": key, **ORIGIN}).is_success


ORIGIN = {"origin": "http://127.0.0.1:8000"}


def test_a_page_in_a_frame_does_not_continue_one_that_was_open_in_a_tab(
    make, gate, model
):
    client = make(embed_from={WORK})
    key = key_in(sign_in(client).text)
    assert roles(client, gate, model, key) == ("admin", "admin")
    assert roles(client, gate, model, key, "&frame=") == ("viewer", "viewer")
    assert [scene.page_id for scene in model.scenes] == ["p", "frame-p"]


def test_robots_are_driven_in_a_frame_only_if_that_was_asked_for(make, gate, model):
    client = make(embed_from={WORK}, embed_driving=True)
    key = key_in(sign_in(client, **IN_FRAME).text)
    assert roles(client, gate, model, key, "&frame=") == ("admin", "admin")
