"""A layer of tiles on a map: what it loads, reports and releases."""

import asyncio
import threading
from pathlib import Path

import pytest
from scene_of_tiles import DATUM, EAST, made_tiles, number

from equipment.waiting import until
from webmap.base.errors import ConfigError
from webmap.core.pictures import PREFIX, pictures
from webmap.features.tiles import tile_layer


@pytest.fixture(scope="module")
def tiles(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("tiles")
    made_tiles(folder)
    return folder


def test_removing_the_tile_layer_releases_its_tiles(map, tiles, channel):
    async def scenario():
        before = len(pictures)
        map.fit(-200, -150, 400, 300)
        layer = map.add_module("TileLayer", tiles, DATUM, east=EAST, most=12)
        await asyncio.sleep(0)
        await until(lambda: layer._looking is None)
        assert 4 <= len(layer.shown) <= 12
        assert len(pictures) > before
        urls = [shown.url for shown in layer.shown.values() if shown]
        map.remove_module(layer)
        await asyncio.sleep(0)
        assert len(pictures) == before
        for url in urls:  # a page may still load them
            assert pictures.get(url.removeprefix(PREFIX)) is not None
        assert layer._fragment not in channel.mounted.values()

    asyncio.run(scenario())


def test_invalid_tiles_give_one_notice_and_the_others_are_drawn(map, channel, tmp_path):
    made_tiles(tmp_path)
    x, y = (int(n) for n in number(17, *DATUM))
    for row in (y, y + 1):
        (tmp_path / "17" / str(x) / f"{row}.png").write_text("<svg/>")

    async def scenario():
        map.fit(-200, -150, 400, 300)
        layer = map.add_module("TileLayer", tmp_path, DATUM)
        await asyncio.sleep(0)
        await until(lambda: layer._looking is None)
        drawn = [tile for tile, shown in layer.shown.items() if shown]
        map.remove_module(layer)
        return drawn

    drawn = asyncio.run(scenario())
    assert len(drawn) > 3
    (error,) = channel.errors
    assert "a tile is not shown" in error
    assert "is not a PNG, JPEG or WebP" in error


class Slow:
    """Tiles from a slow disk."""

    zooms = range(20)
    attribution = ""

    def __init__(self):
        self.reading = threading.Event()
        self.goes_on = threading.Event()
        self.closed_in: threading.Thread | None = None

    def read(self, tile):
        self.reading.set()
        assert self.goes_on.wait(10)
        raise ConfigError("the file is closed")

    def close(self):
        assert self.goes_on.wait(10)
        self.closed_in = threading.current_thread()


def test_closing_a_page_does_not_wait_for_the_reading_of_a_tile(
    map, page, channel, monkeypatch
):
    slow = Slow()
    monkeypatch.setattr(tile_layer, "open_tiles", lambda source: slow)

    async def scenario():
        map.fit(-200, -150, 400, 300)
        map.add_module("TileLayer", "a.mbtiles", DATUM)
        await asyncio.to_thread(slow.reading.wait, 10)
        page.close()
        assert slow.closed_in is None
        slow.goes_on.set()

    asyncio.run(scenario())
    assert slow.closed_in not in (None, threading.main_thread())
    assert not channel.errors


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"datum": (91, 0)}, "datum is a latitude and a longitude"),
        ({"datum": (50,)}, "datum: expected 2 in a list: a number, a number"),
        ({"tile_size": 300}, "tile_size: got the whole number 300, expected 256 or"),
        (
            {"most": 0},
            "most: got the whole number 0, expected a whole number from 1 to",
        ),
        ({"opacity": 2}, "opacity: got the whole number 2, expected a number of full"),
        ({"east": float("inf")}, "east must be finite"),
        ({"source": "https://tiles.example"}, "this machine's disk alone"),
    ],
)
def test_invalid_options_are_refused(map, tiles, change, words):
    options = {"source": tiles, "datum": DATUM, **change}
    with pytest.raises(ConfigError, match=words):
        map.add_module("TileLayer", **options)
    assert map.modules == []
