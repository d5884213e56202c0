"""Routes on disk: valid routes, refused routes, and broken files."""

import math
import os

import pytest

from webmap.base.errors import ConfigError
from webmap.features.routes.route_tool import (
    MOST_POINTS,
    MOST_ROUTES,
    RouteStore,
    read_name,
    read_route,
)

POINT = {"x": 1.0, "y": 2.0, "yaw": 0.5}


@pytest.fixture
def store(tmp_path):
    return RouteStore(tmp_path / "routes", "Hall 1")


def route(*points, loop=False):
    return read_route({"points": list(points) or [POINT], "loop": loop})


def test_a_route_is_saved_loaded_replaced_and_deleted(store, tmp_path):
    assert store.names() == []
    store.save("Round", route(POINT, POINT, loop=True))
    store.save("a first", route())
    again = RouteStore(tmp_path / "routes", "Hall 1")
    assert again.names() == ["a first", "Round"]
    assert again.load("Round") == route(POINT, POINT, loop=True)
    store.save("Round", route())
    assert len(again.load("Round").points) == 1
    store.delete("Round")
    store.delete("Round")
    assert again.names() == ["a first"]
    with pytest.raises(ConfigError, match="no route 'Round'"):
        again.load("Round")


def test_maps_with_any_name_have_separate_routes(tmp_path):
    names = ["Hall 1", "hall-1", "../../etc", "Höhle", "", "x" * 300]
    stores = [RouteStore(tmp_path / "routes", name) for name in names]
    for number, store in enumerate(stores):
        store.save(f"route {number}", route())
    for number, store in enumerate(stores):
        assert store.names() == [f"route {number}"]
        assert store.file.parent == tmp_path / "routes"


def test_an_unreadable_route_file_is_refused_and_left_unchanged(store):
    store.save("Round", route())
    store.file.write_text("{ broken")
    for act in (store.names, lambda: store.save("New", route())):
        with pytest.raises(ConfigError, match="cannot be read"):
            act()
    assert store.file.read_text() == "{ broken"


def test_an_unwritable_route_folder_is_an_error(tmp_path):
    (tmp_path / "routes").write_text("in the way")
    with pytest.raises(ConfigError, match="cannot be"):
        RouteStore(tmp_path / "routes", "Hall").save("Round", route())


def test_the_number_of_saved_routes_is_limited(store, monkeypatch):
    monkeypatch.setattr("webmap.features.routes.route_tool.MOST_ROUTES", 2)
    store.save("1", route())
    store.save("2", route())
    with pytest.raises(ConfigError, match="delete one first"):
        store.save("3", route())
    store.save("2", route())
    assert MOST_ROUTES > 2


@pytest.mark.parametrize(
    "value",
    [
        None,
        {},
        {"points": []},
        {"points": [POINT] * (MOST_POINTS + 1)},
        {"points": [{"x": 1.0, "y": 2.0}]},
        {"points": [{**POINT, "x": "1"}]},
        {"points": [{**POINT, "x": math.nan}]},
        {"points": [{**POINT, "y": 1e9}]},
        {"points": [{**POINT, "z": 1.0}]},
        {"points": [POINT], "loop": 1},
    ],
)
def test_an_invalid_route_is_refused(value):
    with pytest.raises(ConfigError, match=r"not a route|a route has|expected x, y"):
        read_route(value)


@pytest.mark.parametrize("value", [None, "", "  ", "a\nb", "x" * 61, 7])
def test_an_invalid_route_name_is_refused(value):
    with pytest.raises(ConfigError, match="a route's name"):
        read_name(value)


def test_spaces_around_a_route_name_are_removed():
    assert read_name("  Round ") == "Round"


def test_a_deeply_nested_route_file_or_a_pipe_is_refused(store):
    store.file.parent.mkdir(parents=True)
    store.file.write_bytes(b'{"map":"Hall 1","routes":' + b"[" * 100_000)
    with pytest.raises(ConfigError, match="cannot be read"):
        store.names()
    store.file.unlink()
    os.mkfifo(store.file)
    with pytest.raises(ConfigError, match="got a pipe"):
        store.names()
