"""Each route with each method, asked by everybody: the matrix of the server."""

import itertools

import pytest
from starlette.routing import WebSocketRoute

from equipment.server_fakes import FakePage
from webmap.base.roles import ROLES, covers
from webmap.core.operators import Viewer
from webmap.core.pictures import videos
from webmap.server.access import Settings
from webmap.server.app import RouteFor, WebApp

METHODS = ("GET", "HEAD", "OPTIONS", "POST", "PUT", "PATCH", "DELETE")
ORIGIN = {"origin": "http://127.0.0.1:8000"}
TO_EVERYBODY = {"/healthz"}
"""Paths that are answered without a sign-in, to GET and HEAD."""


def made(rooms, role):
    """Return the real application, for a viewer of a role; None for nobody."""
    viewer = role and Viewer("v", "Vic", role)
    settings = Settings(authenticate=lambda scope: viewer)
    return WebApp(rooms.site, rooms.model, rooms.gate, settings)


def path_of(route):
    fillers = {"{name:path}": "web/page.js", "{tag}": "x", "{path:path}": "lab/"}
    path = route.path
    for name, filler in fillers.items():
        path = path.replace(name, filler)
    assert "{" not in path, "the test knows no value for a part of this path"
    return path


@pytest.mark.parametrize("role", [None, *ROLES])
def test_a_route_answers_those_of_its_least_role_and_no_others(
    rooms, make_client, role
):
    app = made(rooms, role)
    client = make_client(app)
    asked = 0
    for route, method in itertools.product(app.routes, METHODS):
        if isinstance(route, WebSocketRoute):
            continue
        asked += 1
        path = path_of(route)
        status = client.request(method, path, headers=ORIGIN).status_code
        if role is None:
            allowed = path in TO_EVERYBODY and method in {"GET", "HEAD"}
        else:
            allowed = covers(role, route.least)
        known = route.methods or {"GET", "HEAD"}
        if role is not None and method not in known:
            # The next route gets it, which is for pages and files.
            assert status in {404, 405}, (method, path, status)
        else:
            assert (status in {401, 403}) == (not allowed), (method, path, role, status)
            assert not allowed or status != 405, (method, path)
    assert asked == 7 * (len(app.routes) - 3)


def test_every_route_declares_the_least_role(rooms):
    for route in made(rooms, "admin").routes:
        assert isinstance(route, WebSocketRoute) or route.least in ROLES
    with pytest.raises(TypeError, match="missing"):
        RouteFor("/undeclared", made)
    rooms.site.pages["/healthz"] = FakePage("/healthz")  # a page replaces no report


@pytest.mark.parametrize("role", ROLES)
def test_a_socket_opens_for_every_role_and_gives_the_gate_the_role(
    rooms, make_client, role
):
    client = make_client(made(rooms, role))
    video = videos.open()
    for name in ("scene", "drive", video.url.removeprefix("/_webmap/")):
        url = f"ws://127.0.0.1:8000/_webmap/{name}?id=p"
        with client.websocket_connect(url, headers=ORIGIN) as socket:
            socket.close()
    assert [each.role for each in rooms.gate.connections] == [role]
    assert [each.viewer.role for each in rooms.model.scenes] == [role]
