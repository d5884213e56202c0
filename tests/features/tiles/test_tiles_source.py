"""Tiles: their places on the map, which are wanted, and which are refused."""

import errno
import io
import math
import os
import sqlite3
from pathlib import Path

import pytest
from PIL import Image

from webmap.base.errors import ConfigError
from webmap.base.geometry import Affine
from webmap.base.local_plane import LocalPlane
from webmap.features.tiles.tile_layer import TileGrid
from webmap.features.tiles.tile_source import (
    FolderTiles,
    MBTiles,
    Tile,
    open_tiles,
    plain,
)

PLACES = [(50.0, 14.0), (0.0, 179.9999), (-33.9, 18.4), (67.0, -150.0)]


def png(colour=(1, 2, 3), size=(256, 256), form="PNG") -> bytes:
    data = io.BytesIO()
    Image.new("RGB", size, colour).save(data, form)
    return data.getvalue()


TILE = png()


# The plane.


def ground(latitude: float, metres: float, steps: int = 2000) -> float:
    """Return the latitude at a distance north on the ellipsoid, along the meridian."""
    lat, step = math.radians(latitude), metres / steps
    for _ in range(steps):
        flat = 1 - 6.69437999014e-3 * math.sin(lat) ** 2
        lat += step / (6378137.0 * (1 - 6.69437999014e-3) / flat**1.5)
    return math.degrees(lat)


@pytest.mark.parametrize(("metres", "error"), [(10_000, 0.005), (50_000, 0.6)])
def test_the_length_error_of_the_local_plane_is_within_its_limit(metres, error):
    x, y = LocalPlane(50, 14).from_globe(ground(50, metres), 14)
    assert x == pytest.approx(0, abs=1e-6)
    assert metres - error < y < metres


@pytest.mark.parametrize("east", [0.0, 30.0, -135.0])
@pytest.mark.parametrize("datum", PLACES)
def test_a_conversion_to_the_globe_and_back_returns_the_same_position(datum, east):
    plane = LocalPlane(*datum, east)
    assert plane.from_globe(*datum) == pytest.approx((0, 0), abs=1e-6)
    for x, y in [(3, 4), (-5e3, 2e3), (4e4, -6e4)]:
        back = plane.from_globe(*plane.to_globe(x, y))
        assert back == pytest.approx((x, y), abs=1e-5)


def test_north_is_along_x_with_east_at_90_degrees():
    x, y = LocalPlane(50, 14, 90).from_globe(50.001, 14)
    assert (x, y) == pytest.approx((111.23, 0), abs=0.01)


# The grid.


def globe_of(z: int, x: float, y: float) -> tuple[float, float]:
    lat = math.degrees(math.atan(math.sinh(math.pi * (1 - 2 * y / 2**z))))
    return lat, x / 2**z * 360 - 180


@pytest.mark.parametrize(
    ("z", "away", "within"), [(19, 0, 0.002), (16, 3, 0.02), (13, 2, 0.1), (10, 0, 1)]
)
def test_a_point_of_a_tile_is_within_a_pixel_of_its_true_position(z, away, within):
    """`within` is in pixels of the tile, for tiles at some distance from the datum."""
    plane = LocalPlane(50, 14, 25)
    grid = TileGrid(plane, [z], size=256, most=64)
    n = 2**z
    x = int((14 + 180) / 360 * n) + away
    y = int((1 - math.asinh(math.tan(math.radians(50))) / math.pi) / 2 * n) + away
    place = grid.place(Tile(z, x, y))
    pixel = math.hypot(place.a, place.b) / 256
    for u in (0, 0.3, 1):
        for v in (0, 0.6, 1):
            drawn = place.apply(u, v)
            true = plane.from_globe(*globe_of(z, x + u, y + v))
            assert math.dist(drawn, true) < within * pixel


def view(scale: float, x: float = 0, y: float = 0, turn: float = 0) -> Affine:
    """Return the view of 800 x 600 pixels with a place of the map in the centre."""
    middle = Affine.translation(400, 300) @ Affine.rotation(turn)
    return middle @ Affine(scale, 0, 0, -scale, 0, 0) @ Affine.translation(-x, -y)


def test_the_zoom_level_has_pixels_of_the_screen_pixel_size():
    grid = TileGrid(LocalPlane(50, 14), range(5, 20), size=256, most=64)
    for z in (14, 17, 19):
        scale = 256 * 2**z / (40_075_016.686 * math.cos(math.radians(50)))
        assert {tile.z for tile in grid.tiles_in_view(view(scale), 800, 600)} == {z}
        nearer = grid.tiles_in_view(view(1.3 * scale), 800, 600)
        assert {tile.z for tile in nearer} == {z}
    assert {tile.z for tile in grid.tiles_in_view(view(1000), 800, 600)} == {19}


@pytest.mark.parametrize("turn", [0, 0.7])
def test_the_wanted_tiles_cover_the_view(turn):
    grid = TileGrid(LocalPlane(50, 14, 40), [17], size=256, most=64)
    seen = view(1.2, 500, -200, turn)
    tiles = grid.tiles_in_view(seen, 800, 600)
    for u in range(0, 801, 50):
        for v in range(0, 601, 50):
            x, y = seen.inverse.apply(u, v)
            assert any(
                -1e-3 <= a <= 1 + 1e-3 and -1e-3 <= b <= 1 + 1e-3
                for a, b in (grid.place(tile).inverse.apply(x, y) for tile in tiles)
            )
    assert len(tiles) < 30


@pytest.mark.parametrize("scale", [1e-4, 1e-2, 1, 100, 1e5])
@pytest.mark.parametrize("datum", PLACES)
def test_the_number_of_wanted_tiles_is_limited(datum, scale):
    for zooms in ([18], range(10, 19), [0, 1]):
        grid = TileGrid(LocalPlane(*datum), zooms, size=256, most=20)
        tiles = grid.tiles_in_view(view(scale), 800, 600)
        assert 1 <= len(tiles) <= 20
        assert len(set(tiles)) == len(tiles)
        for tile in tiles:
            assert 0 <= tile.x < 2**tile.z
            assert 0 <= tile.y < 2**tile.z


def test_a_small_tile_limit_selects_a_coarser_zoom_level():
    fine = TileGrid(LocalPlane(50, 14), range(10, 19), size=256, most=64)
    few = TileGrid(LocalPlane(50, 14), range(10, 19), size=256, most=6)
    (z,) = {tile.z for tile in fine.tiles_in_view(view(0.5), 800, 600)}
    assert {tile.z for tile in few.tiles_in_view(view(0.5), 800, 600)} <= {z - 1, z - 2}


# Sources of tiles.


@pytest.fixture
def folder(tmp_path):
    tiles = tmp_path / "tiles"
    (tiles / "3" / "4").mkdir(parents=True)
    (tiles / "3" / "4" / "5.png").write_bytes(png())
    (tiles / "3" / "4" / "6.jpg").write_bytes(png(form="JPEG"))
    return tiles


def test_a_folder_returns_tiles_with_their_detected_media_type(folder):
    (folder / "notes").mkdir()
    source = open_tiles(str(folder))
    assert list(source.zooms) == [3]
    assert source.read(Tile(3, 4, 5)) == (png(), "image/png")
    assert source.read(Tile(3, 4, 6))[1] == "image/jpeg"
    assert source.read(Tile(3, 4, 7)) is None


def test_a_symbolic_link_out_of_the_folder_is_refused(folder, tmp_path):
    (tmp_path / "secret.png").write_bytes(png())
    (folder / "3" / "4" / "7.png").symlink_to(tmp_path / "secret.png")
    (folder / "3" / "9").symlink_to(tmp_path)
    (tmp_path / "1.png").write_bytes(png())
    source = FolderTiles(folder)
    for tile in (Tile(3, 4, 7), Tile(3, 9, 1)):
        with pytest.raises(ConfigError, match="leads out of"):
            source.read(tile)


def test_a_symbolic_link_loop_a_folder_or_a_pipe_is_not_a_tile(folder):
    column = folder / "3" / "4"
    (column / "7.png").symlink_to("7.png")
    (column / "8.png").mkdir()
    os.mkfifo(column / "9.png")
    source = FolderTiles(folder)
    assert source.read(Tile(3, 4, 7)) is None
    for row in (8, 9):
        with pytest.raises(ConfigError, match="is not a file"):
            source.read(Tile(3, 4, row))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"<svg xmlns='http://www.w3.org/2000/svg'/>", "is not a PNG, JPEG or WebP"),
        (b"", "is not a PNG"),
        (png()[:20], "is not a PNG"),
        (png(size=(2000, 10)), "has 2000 x 10 pixels, expected 1024"),
        (b"\x89PNG" + bytes(5 << 20), "more than 4 MiB"),
        (png(form="GIF"), "is not a PNG, JPEG or WebP"),
    ],
)
def test_an_invalid_tile_picture_in_a_folder_is_refused(folder, data, words):
    (folder / "3" / "4" / "5.png").write_bytes(data)
    with pytest.raises(ConfigError, match=words):
        FolderTiles(folder).read(Tile(3, 4, 5))


@pytest.mark.parametrize(
    "source", ["https://tiles.example/{z}/{x}/{y}.png", "file:///etc", "ftp://x"]
)
def test_urls_as_tile_sources_are_refused(source):
    with pytest.raises(ConfigError, match="this machine's disk alone"):
        open_tiles(source)


def test_a_missing_empty_or_invalid_tile_source_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="no such folder and no such file"):
        open_tiles(tmp_path / "none")
    with pytest.raises(ConfigError, match="no folder of a level"):
        open_tiles(tmp_path)
    (tmp_path / "x.mbtiles").write_bytes(b"GIF89a")
    with pytest.raises(ConfigError, match="this is not an MBTiles file"):
        open_tiles(tmp_path / "x.mbtiles")


@pytest.fixture
def mbtiles(tmp_path):
    def make(*statements, metadata=(), tiles=((3, 4, 2, TILE),)):
        file = tmp_path / "m ü?#.mbtiles"
        with sqlite3.connect(file) as database:
            database.execute("CREATE TABLE metadata (name text, value text)")
            database.executemany("INSERT INTO metadata VALUES (?, ?)", metadata)
            if tiles is not None:
                database.execute(
                    "CREATE TABLE tiles (zoom_level integer, tile_column integer, "
                    "tile_row integer, tile_data blob)"
                )
                database.executemany("INSERT INTO tiles VALUES (?, ?, ?, ?)", tiles)
            for statement in statements:
                database.execute(statement)
        database.close()
        return file

    made = []

    def open_(*statements, **options):
        made.append(MBTiles(make(*statements, **options)))
        return made[-1]

    yield open_
    for source in made:
        source.close()


def test_mbtiles_rows_are_counted_from_the_south(mbtiles):
    attribution = "<a href='https://x' onclick='y'>&copy; Somebody</a>\n and more"
    source = mbtiles(metadata=[("attribution", attribution), ("format", "png")])
    assert list(source.zooms) == [3]
    assert source.read(Tile(3, 4, 5)) == (png(), "image/png")
    assert source.read(Tile(3, 4, 2)) is None
    assert source.attribution == "© Somebody and more"


@pytest.mark.parametrize("made", ["table", "view"])
def test_zoom_levels_of_a_large_mbtiles_file_are_found_without_a_full_scan(
    mbtiles, monkeypatch, made
):
    rows = (
        "WITH RECURSIVE n(i) AS (SELECT 0 UNION ALL SELECT i + 1 FROM n WHERE i < 1e5)"
    )
    index = "(zoom_level, tile_column, tile_row)"
    if made == "table":
        statements = [
            f"INSERT INTO tiles {rows} SELECT 4 + i % 9, i, i, NULL FROM n",
            f"CREATE UNIQUE INDEX tile_index ON tiles {index}",
        ]
    else:
        statements = [
            "CREATE TABLE images (tile_data blob, tile_id integer PRIMARY KEY)",
            f"INSERT INTO images {rows} SELECT NULL, i FROM n",
            "CREATE TABLE map (zoom_level integer, tile_column integer, "
            "tile_row integer, tile_id integer)",
            f"INSERT INTO map {rows} SELECT 4 + i % 9, i, i, i FROM n",
            f"CREATE UNIQUE INDEX map_index ON map {index}",
            "DROP TABLE tiles",
            "CREATE VIEW tiles AS SELECT map.zoom_level, map.tile_column, "
            "map.tile_row, images.tile_data FROM map "
            "JOIN images ON images.tile_id = map.tile_id",
        ]
    # The first check of the clock, after some database steps, is already too late.
    monkeypatch.setattr("webmap.features.tiles.tile_source.PATIENCE", -1.0)
    source = mbtiles(*statements, tiles=())
    assert list(source.zooms) == list(range(4, 13))


def test_zoom_levels_are_taken_from_the_metadata_if_present(mbtiles):
    source = mbtiles(metadata=[("minzoom", "2"), ("maxzoom", "99")])
    assert list(source.zooms) == list(range(2, 25))


@pytest.mark.parametrize(
    ("metadata", "words"),
    [
        ([("format", "pbf")], "vector tiles cannot be drawn"),
        ([("minzoom", "5"), ("maxzoom", "3")], "there are no tiles"),
    ],
)
def test_an_mbtiles_file_with_vector_tiles_or_no_levels_is_refused(
    mbtiles, metadata, words
):
    with pytest.raises(ConfigError, match=words):
        mbtiles(metadata=metadata)


def test_an_empty_or_missing_tiles_table_is_refused(mbtiles, tmp_path):
    with pytest.raises(ConfigError, match="there are no tiles"):
        mbtiles(tiles=())
    (tmp_path / "m ü?#.mbtiles").unlink()
    with pytest.raises(ConfigError, match="no such table: tiles"):
        mbtiles(tiles=None)


@pytest.mark.parametrize(
    ("data", "words"),
    [("text", "got str, expected a picture"), (7, "got int"), (b"MZ", "is not a PNG")],
)
def test_an_invalid_tile_picture_in_an_mbtiles_file_is_refused(mbtiles, data, words):
    with pytest.raises(ConfigError, match=words):
        mbtiles(tiles=[(3, 4, 2, data)]).read(Tile(3, 4, 5))


def test_an_endless_tile_query_is_interrupted(mbtiles, monkeypatch):
    monkeypatch.setattr("webmap.features.tiles.tile_source.PATIENCE", 0.2)
    endless = (
        "CREATE VIEW tiles AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 "
        "FROM n) SELECT 3 AS zoom_level, 4 AS tile_column, i + 9 AS tile_row, "
        "x'00' AS tile_data FROM n"
    )
    levels = [("minzoom", "3"), ("maxzoom", "3")]
    source = mbtiles(endless, tiles=None, metadata=levels)
    with pytest.raises(ConfigError, match="interrupted"):
        source.read(Tile(3, 4, 5))


def test_a_tile_of_gigabytes_is_refused(mbtiles):
    bomb = (
        "CREATE VIEW tiles AS SELECT 3 AS zoom_level, 4 AS tile_column, 2 AS tile_row,"
        " zeroblob(2000000000) AS tile_data"
    )
    levels = [("minzoom", "3"), ("maxzoom", "3")]
    source = mbtiles(bomb, tiles=None, metadata=levels)
    with pytest.raises(ConfigError, match="too big"):
        source.read(Tile(3, 4, 5))


def test_an_mbtiles_file_is_opened_read_only_without_files_beside_it(mbtiles, tmp_path):
    before = sorted(tmp_path.iterdir())
    source = mbtiles()
    source.read(Tile(3, 4, 5))
    with pytest.raises(sqlite3.OperationalError, match="readonly"):
        source._database.execute("DELETE FROM tiles")
    assert len(sorted(tmp_path.iterdir())) == len(before) + 1


def test_an_attribution_is_one_short_line_of_plain_text():
    assert plain("a\x00<script>b</script>\n c &lt;d") == "a b c <d"
    assert len(plain("x" * 5000)) == 300


def test_an_unreadable_tile_folder_is_refused_with_its_name(tmp_path, monkeypatch):
    def unreadable(self):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", unreadable)
    with pytest.raises(ConfigError, match=r"tiles '.*' cannot be read: Permission"):
        open_tiles(tmp_path)
