"""Maps from disk, in the format of map_server."""

import asyncio
import math
import os
import re
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from module_fakes import image_of, images, pixel
from PIL import Image

from equipment.waiting import until
from webmap.base.errors import ConfigError
from webmap.base.geometry import Affine
from webmap.base.map_file import read_map
from webmap.core.map import Layer
from webmap.sim.maps import load_map

pytestmark = pytest.mark.slow

YAML = "image: {image}\nresolution: 0.05\norigin: [-1.25, 2.5, 0]\nnegate: 0\n"
ENDS = "occupied_thresh: 0.65\nfree_thresh: 0.196\n"


def pgm(folder, rows, *, name="map.pgm", most=255, kind="P5", comment=True):
    """Write a PGM, its upper row first."""
    rows = np.asarray(rows)
    note = "# CREATOR: map_saver 0.050 m/pix\n" if comment else ""
    head = f"{kind}\n{note}{rows.shape[1]} {rows.shape[0]}\n{most}\n".encode()
    if kind == "P2":
        body = " ".join(map(str, rows.ravel())).encode()
    else:
        body = rows.astype(">u2" if most > 255 else "u1").tobytes()
    (folder / name).write_bytes(head + body)


def described(folder, text="", *, image="map.pgm", **changed):
    """Write the YAML, with keys changed, and return its path."""
    lines = (YAML.format(image=image) + ENDS + text).splitlines()
    known = dict(line.split(": ", 1) for line in lines)
    known.update(changed, image=image)
    file = folder / "map.yaml"
    yaml_lines = [
        f"{key}: {value}" for key, value in known.items() if value is not None
    ]
    file.write_text("\n".join(yaml_lines) + "\n")
    return file


ROWS = [[0, 254, 254], [254, 205, 100]]
"""A wall at the upper left, an unknown cell below, and a value in between."""


@pytest.mark.parametrize(
    "form", [{}, {"kind": "P2"}, {"comment": False}, {"most": 65535}]
)
def test_the_bottom_row_of_the_image_is_the_first_row_of_the_grid(tmp_path, form):
    rows = np.array(ROWS) * (257 if form.get("most") else 1)
    pgm(tmp_path, rows, **form)
    read = read_map(described(tmp_path))
    assert read.cells.tolist() == [[0, -1, -1], [100, 0, 0]]
    assert (read.origin.x, read.origin.y, read.resolution) == (-1.25, 2.5, 0.05)


@pytest.mark.parametrize("suffix", ["png", "bmp"])
def test_png_and_bmp_images_give_the_same_map(tmp_path, suffix):
    Image.fromarray(np.array(ROWS, np.uint8)).save(tmp_path / f"map.{suffix}")
    read = read_map(described(tmp_path, image=f"map.{suffix}"))
    assert read.cells.tolist() == [[0, -1, -1], [100, 0, 0]]


SEE_THROUGH = [
    # Red, green, blue, alpha, and the result of map_server in each mode.
    ((0, 0, 0, 255), {"trinary": 100, "scale": 100, "raw": 0}),
    ((254, 254, 254, 255), {"trinary": 0, "scale": 0, "raw": -1}),
    # 205 alone is unknown; the mean with an alpha of 255 is 217, which is free.
    ((205, 205, 205, 255), {"trinary": 0, "raw": -1}),
    ((150, 150, 150, 255), {"trinary": -1, "raw": -1}),
    ((0, 0, 0, 0), {"trinary": 100, "scale": -1, "raw": 0}),
    ((254, 254, 254, 0), {"trinary": -1, "scale": -1, "raw": -1}),
    ((254, 254, 254, 254), {"trinary": 0, "scale": -1, "raw": -1}),
    ((60, 60, 60, 128), {"trinary": 100, "scale": -1, "raw": 60}),
]


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
def test_an_alpha_channel_is_read_as_by_map_server(tmp_path, mode):
    pixels = np.array([[colour for colour, _ in SEE_THROUGH]], np.uint8)
    Image.fromarray(pixels).save(tmp_path / "map.png")
    read = read_map(described(tmp_path, image="map.png", mode=mode)).cells[0]
    wanted = [cells.get(mode) for _, cells in SEE_THROUGH]
    for value, want in zip(read.tolist(), wanted, strict=True):
        assert 0 <= value < 100 if want is None else value == want


def test_rgba_grey_alpha_and_palette_images_give_the_same_map(tmp_path):
    colours = Image.fromarray(np.array([[[0] * 4, [150] * 3 + [255]]], np.uint8))
    palette = Image.new("P", (2, 1), 0)
    palette.putpalette([0, 0, 0, 150, 150, 150])
    palette.putpixel((1, 0), 1)
    palette.info["transparency"] = b"\x00\xff"
    for image in (colours, colours.convert("LA"), palette):
        image.save(tmp_path / "map.png")
        with Image.open(tmp_path / "map.png") as written:
            assert written.mode == image.mode
        read = read_map(described(tmp_path, image="map.png")).cells
        assert read.tolist() == [[100, -1]], image.mode


@pytest.mark.parametrize(
    ("grey", "value"), [(0, 100), (89, 100), (90, -1), (204, -1), (206, 0), (255, 0)]
)
def test_greys_between_the_thresholds_are_unknown_in_trinary_mode(
    tmp_path, grey, value
):
    # (255 - 89) / 255 is above 0.65, and (255 - 205) / 255 above 0.196.
    pgm(tmp_path, [[grey, 205]])
    file = described(tmp_path)
    assert read_map(file).cells.tolist() == [[value, -1]]
    assert load_map(file).occupancy.tolist() == [[value, -1]]


@pytest.mark.parametrize("word", ["1", "true"])
def test_negate_makes_white_pixels_walls(tmp_path, word):
    pgm(tmp_path, [[255, 0]])
    assert read_map(described(tmp_path, negate=word)).cells.tolist() == [[100, 0]]


def test_scale_and_raw_modes_give_the_values_of_map_server(tmp_path):
    pgm(tmp_path, [[0, 60, 150, 254]])
    shades = read_map(described(tmp_path, mode="scale")).cells[0]
    assert (shades[0], shades[3]) == (100, 0)
    assert 0 < shades[2] < 99
    raw = read_map(described(tmp_path, mode="raw")).cells[0]
    assert raw.tolist() == [0, 60, -1, -1]


def in_a_page(scenario):
    async def run():
        module = scenario()
        layer = module.layer
        await until(lambda: layer.image is not None or layer.problems)
        return module

    return asyncio.run(run())


@pytest.mark.parametrize(
    ("x", "y", "yaw"), [(0, 0, 0), (-12.34, 7.89, 0), (3, -4, 1.1), (-1, -2, -math.pi)]
)
def test_every_pixel_is_placed_by_the_origin_of_the_map(map, tmp_path, x, y, yaw):
    pgm(tmp_path, ROWS)
    file = described(tmp_path, origin=f"[{x}, {y}, {yaw}]", resolution="0.2")
    module = in_a_page(lambda: map.add_module("MapFile", file))
    placed = Affine.translation(x, y) @ Affine.rotation(yaw)
    (only,) = images(module.layer)
    wanted = [[(255,) * 4, (0,) * 4, (0,) * 4], [(0, 0, 0, 255), *[(255,) * 4] * 2]]
    for row, colours in enumerate(wanted):
        for column, colour in enumerate(colours):
            at = placed.apply(0.2 * (column + 0.5), 0.2 * (row + 0.5))
            got = pixel(only, *at)
            assert got == colour, (row, column)


def test_maps_share_a_map_file_layer_and_a_missing_file_gives_one_notice(
    map, tmp_path, channel
):
    pgm(tmp_path, ROWS)
    file = described(tmp_path)
    module = in_a_page(lambda: map.add_module("MapFile", str(file)))
    other = map.__class__(map.page.element("other"), 10, 10)
    assert other.add_module("MapFile", file).layer is module.layer
    (only,) = images(module.layer)
    assert image_of(only).size == (3, 2)
    broken = in_a_page(lambda: map.add_module("MapFile", tmp_path / "none.yaml"))
    assert images(broken.layer) == []
    (error,) = channel.errors
    assert "none.yaml: No such file" in error
    map.page.close()
    assert Layer._shared == {}


WRONG = {
    "resolution must be above 0, got 0.0": {"resolution": "0"},
    "resolution must be above 0, got -0.05": {"resolution": "-0.05"},
    "resolution must be 0.0001 m a cell at the least, got 1e-05": {
        "resolution": "1e-5"
    },
    "of 1e+300 m), expected at most 1e+07 m": {"resolution": "1e300"},
    "origin must be within 1e+07 m, got (1e+300, 2)": {"origin": "[1e300, 2, 0]"},
    "resolution must be a finite number, got 'nan'": {"resolution": "nan"},
    "resolution must be a finite number, got '.inf'": {"resolution": ".inf"},
    "resolution must be a finite number, got None": {"resolution": None},
    "origin must be [x, y, yaw], got ['1', '2']": {"origin": "[1, 2]"},
    "origin must be a finite number, got 'east'": {"origin": "[1, 2, east]"},
    "negate must be 0 or 1, got 'yes'": {"negate": "yes"},
    "needs 0 <= free_thresh < occupied_thresh <= 1": {"free_thresh": "0.9"},
    "mode must be trinary, scale, raw, got 'odd'": {"mode": "odd"},
    "image must be the name of a file, got None": {"image": None},
    "image must be the name of a file, got ['a']": {"image": "[a]"},
    "'/etc/passwd' is not in the folder": {"image": "/etc/passwd"},
    "'../map.pgm' is not in the folder": {"image": "../map.pgm"},
    "'out.pgm' is not in the folder": {"image": "out.pgm"},
    "no image file 'http://x/map.pgm'": {"image": "http://x/map.pgm"},
    "no image file 'folder'": {"image": "folder"},
    "no image file 'pipe.pgm'": {"image": "pipe.pgm"},
    "the symbolic links lead in a circle": {"image": "circle.pgm"},
    "the image must be PGM, PNG, BMP or JPEG": {"image": "map.yaml"},
}


@pytest.mark.parametrize(
    "key", ["image", "resolution", "origin", "negate", "mode", "free_thresh", "none"]
)
def test_yaml_aliases_with_exponential_growth_are_refused_quickly(tmp_path, key):
    pgm(tmp_path, ROWS)
    layers = ["a0: &a0 [" + "x, " * 10 + "]"]
    for i in range(1, 9):
        layers.append(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]")
    file = described(tmp_path, **{key: "*a8"})
    file.write_text("\n".join([*layers, file.read_text()]))
    began = time.process_time()
    for read in (read_map, load_map):
        with pytest.raises(ConfigError, match="aliases") as refused:
            read(file)
        assert len(str(refused.value)) < 300
    assert time.process_time() - began < 2


@pytest.mark.parametrize("why", WRONG)
def test_an_invalid_map_description_is_refused(tmp_path, why):
    folder = tmp_path / "maps"
    (folder / "folder").mkdir(parents=True)
    pgm(tmp_path, ROWS)
    pgm(folder, ROWS)
    (folder / "out.pgm").symlink_to(tmp_path / "map.pgm")
    os.mkfifo(folder / "pipe.pgm")
    (folder / "circle.pgm").symlink_to("circle.pgm")
    file = described(folder, **WRONG[why])
    with pytest.raises(ConfigError) as refused:
        read_map(file)
    assert why in str(refused.value)
    assert str(file) in str(refused.value)


NO_IMAGE = {
    "is too large: ": b"P5\n2147483648 2147483648\n255\n",
    "has 8193 x 8193 pixels, expected at most 6710": b"P5\n8193 8193\n255\n",
    "is too large: Image size (144000000": b"P5\n12000 12000\n255\n",
    "cannot be read: maxval must be greater than 0": b"P5\n3 2\n0\n" + bytes(6),
    "cannot be read: image file is truncated": b"P5\n3 2\n255\n" + bytes(3),
    "must be PGM, PNG, BMP or JPEG, got an empty file": b"",
    "must be PGM, PNG, BMP or JPEG, got a file that begins with b'GIF89a": (
        b"GIF89a" + bytes(20)
    ),
    "must be PGM, PNG, BMP or JPEG, got a file that begins with b'<svg/>'": b"<svg/>",
    "begins with b'P5\\n0 0\\n2' but cannot be decoded": b"P5\n0 0\n255\n",
}


@pytest.mark.parametrize("why", NO_IMAGE)
def test_an_invalid_map_image_is_refused_with_a_reason(tmp_path, why):
    (tmp_path / "map.pgm").write_bytes(NO_IMAGE[why])
    with pytest.raises(ConfigError, match=re.escape(why)) as refused:
        read_map(described(tmp_path))
    assert str(refused.value).startswith(f"{tmp_path / 'map.yaml'}: the image ")


def test_a_device_is_refused_as_map_description_and_as_image(tmp_path):
    endless = Path("/dev/zero")
    (tmp_path / "map.pgm").symlink_to(endless)
    with pytest.raises(ConfigError, match=r"'map\.pgm' is not in the folder"):
        read_map(described(tmp_path))
    (tmp_path / "link.yaml").symlink_to(endless)
    for file in (endless, tmp_path / "link.yaml"):
        with pytest.raises(ConfigError, match="expected a file, got a device"):
            read_map(file)


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "needs image, resolution and origin, .*, got nothing"),
        (b"- 1", "needs image, resolution and origin, .*, got a list"),
        (b"map.pgm", "needs image, resolution and origin, .*, got 'map.pgm'"),
        (b"a: [", "map.yaml"),
        (b"image: !!python/object/apply:os.system [ls]", "map.yaml:1: resolution"),
        (b" " * ((1 << 14) + 1), "for a map's YAML"),
        (b"\xff\xfe\xfa", "map.yaml"),
        (b"[" * 10_000, "nested more than 50 deep"),
    ],
)
def test_a_file_that_is_not_a_map_description_is_refused(tmp_path, data, why):
    file = tmp_path / "map.yaml"
    file.write_bytes(data)
    with pytest.raises(ConfigError, match=why):
        read_map(file)


def write_map(folder, image, **options):
    image.save(folder / "map.png", **options)
    yaml = "image: map.png\nresolution: 0.05\norigin: [0, 0, 0]\n"
    (folder / "map.yaml").write_text(yaml)
    return folder / "map.yaml"


@pytest.mark.parametrize("mode", ["L", "RGB", "RGBA", "P", "1", "I;16", "LA"])
def test_reading_a_map_in_pieces_gives_the_same_cells(tmp_path, monkeypatch, mode):
    grey = Image.fromarray(np.arange(64 * 50, dtype=np.uint32).astype(np.uint8))
    grey = grey.resize((40, 31))
    image = (
        grey if mode != "I;16" else Image.fromarray(np.asarray(grey) * np.uint16(257))
    )
    file = write_map(tmp_path, image if mode == "I;16" else grey.convert(mode))
    whole = read_map(file).cells
    monkeypatch.setattr("webmap.base.map_file.PIECE", 7)
    assert np.array_equal(read_map(file).cells, whole)
    assert whole.shape == (31, 40)


def test_reading_a_large_map_needs_little_more_memory_than_its_cells(tmp_path):
    file = write_map(tmp_path, Image.new("L", (3000, 3000), 254))
    tracemalloc.start()
    try:
        cells = read_map(file).cells
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert cells.shape == (3000, 3000)
    assert most < cells.nbytes + 40_000_000


def test_an_image_that_is_too_large_when_decoded_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("webmap.base.map_file.MAX_DECODED", 100 << 10)
    assert read_map(write_map(tmp_path, Image.new("L", (300, 300)))).cells.size == 90000
    file = write_map(tmp_path, Image.new("RGB", (300, 300)))
    with pytest.raises(ConfigError, match=r"300 x 300 pixels, which take .* in grey"):
        read_map(file)
