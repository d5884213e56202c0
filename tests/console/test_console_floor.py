"""Floor plans in map_server's form."""

import math
import re
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from webmap import console
from webmap.base.errors import ConfigError
from webmap.base.map_file import MAX_YAML, read_map
from webmap.console.floor import COLOURS, load_floor

WALL, UNKNOWN, FREE = 0, 205, 254


def write(folder: Path, image: str = "floor.png", **changes: object) -> Path:
    keys = {"resolution": 0.5, "origin": [-2.0, -1.0, 0.0], "negate": 0, **changes}
    lines = [f"image: {image}", *(f"{key}: {value}" for key, value in keys.items())]
    file = folder / "floor.yaml"
    file.write_text("\n".join(lines))
    return file


def draw(folder: Path, name: str = "floor.png", mode: str = "L") -> None:
    image = Image.new("L", (8, 4), UNKNOWN)
    image.paste(FREE, (2, 1, 6, 3))
    image.putpixel((2, 1), WALL)
    image.convert(mode).save(folder / name)


def test_a_floor_has_its_position_its_size_and_the_bounds_of_its_known_area(tmp_path):
    draw(tmp_path)
    floor = load_floor(write(tmp_path), tmp_path)
    assert (floor.x, floor.y, floor.width, floor.height) == (-2.0, -1.0, 4.0, 2.0)
    assert floor.bounds == (-1.0, -0.5, 2.0, 1.0)


def test_the_upper_left_pixel_of_the_image_is_at_the_upper_left_in_the_world(tmp_path):
    draw(tmp_path)
    floor = load_floor(write(tmp_path), tmp_path)
    # add_image places the image's box at x, y; the matrix turns it upright there.
    assert floor.matrix.apply(floor.x, floor.y) == pytest.approx((-2.0, 1.0))


def test_a_map_with_a_yaw_is_rotated_about_its_origin(tmp_path):
    draw(tmp_path)
    yaw = math.pi / 2
    floor = load_floor(write(tmp_path, origin=[-2.0, -1.0, yaw]), tmp_path)
    lower_left = floor.matrix.apply(floor.x, floor.y + floor.height)
    lower_right = floor.matrix.apply(floor.x + floor.width, floor.y + floor.height)
    assert lower_left == pytest.approx((-2.0, -1.0))
    assert lower_right == pytest.approx((-2.0, 3.0))
    assert floor.bounds == pytest.approx((-4.0, -1.0, 2.0, 4.0))


GIVEN = """\
image: FOLDER/g.pgm
resolution: 0.05
origin: [-1.0, -2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


@pytest.mark.parametrize("negate", ["0", "0.0"])
@pytest.mark.parametrize("mode", ["", "mode: Trinary", "mode: TRINARY"])
def test_an_absolute_path_and_the_spellings_of_other_map_servers_are_accepted(
    tmp_path, negate, mode
):
    rows = bytes(6) + bytes([UNKNOWN]) * 6 + bytes([FREE]) * 12
    (tmp_path / "g.pgm").write_bytes(b"P5\n6 4\n255\n" + rows)
    (tmp_path / "link").symlink_to(tmp_path, target_is_directory=True)
    for folder in (tmp_path, tmp_path / "link", tmp_path / "link" / "link"):
        text = GIVEN.replace("FOLDER", str(folder))
        text = text.replace("negate: 0", f"negate: {negate}")
        file = tmp_path / "map.yaml"
        file.write_text(text + mode)
        floor = load_floor(file, tmp_path)
        assert (floor.x, floor.y) == (-1.0, -2.0)
        assert (floor.width, floor.height) == pytest.approx((0.3, 0.2))
        wanted = [[0] * 6, [0] * 6, [-1] * 6, [100] * 6]
        assert read_map(file).cells.tolist() == wanted


def test_an_absolute_path_that_leads_out_of_the_folder_is_refused(tmp_path):
    folder = tmp_path / "maps"
    folder.mkdir()
    draw(tmp_path)
    (folder / "out.png").symlink_to(tmp_path / "floor.png")
    for image in (
        tmp_path / "floor.png",
        folder / ".." / "floor.png",
        folder / "out.png",
    ):
        with pytest.raises(ConfigError, match="is not in the folder of the YAML"):
            load_floor(write(folder, str(image)), tmp_path)


def colour(image: Image.Image, at: tuple[int, int]) -> str:
    return "#" + bytes(image.getpixel(at)).hex()


@pytest.mark.parametrize("name", ["day", "night"])
def test_wall_unknown_and_free_pixels_have_exactly_their_colours(tmp_path, name):
    draw(tmp_path)
    floor = load_floor(write(tmp_path), tmp_path)
    painted = Image.open(getattr(floor, name)).convert("RGB")
    seen = [colour(painted, at) for at in ((2, 1), (0, 0), (4, 2))]
    assert seen == list(COLOURS[name])


def test_the_colours_of_the_floor_are_equal_to_those_of_the_style_sheet():
    package = Path(console.__file__).parents[1]
    text = (package / "web/style/tokens.css").read_text("utf-8")
    for token, index in (("--map-void", 1), ("--map-floor", 2)):
        values = re.findall(rf"{token}: light-dark\((#\w+), (#\w+)\);", text)
        assert values == [(COLOURS["day"][index], COLOURS["night"][index])]


@pytest.mark.parametrize(
    ("form", "high"), [("png", 65535), ("pgm", 65535), ("pgm", 255)]
)
def test_an_image_with_16_bits_per_pixel_gives_the_same_picture(tmp_path, form, high):
    levels = np.array([[0, 205, 254]]) * high // 255
    name = f"floor.{form}"
    if form == "png":
        Image.fromarray(levels.astype(np.uint16)).save(tmp_path / name)
    else:
        kind = ">u2" if high > 255 else "u1"
        head = f"P5 3 1 {high}\n".encode()
        (tmp_path / name).write_bytes(head + levels.astype(kind).tobytes())
    floor = load_floor(write(tmp_path, name), tmp_path)
    painted = Image.open(floor.day).convert("RGB")
    assert [colour(painted, (x, 0)) for x in range(3)] == list(COLOURS["day"])


def test_the_thresholds_and_the_mode_of_the_yaml_file_are_applied(tmp_path):
    image = Image.new("L", (3, 1))
    image.putdata([0, 128, 254])
    image.save(tmp_path / "floor.png")

    def drawn(**changes):
        floor = load_floor(write(tmp_path, **changes), tmp_path)
        painted = Image.open(floor.day).convert("RGB")
        return [colour(painted, (x, 0)) for x in range(3)]

    wall, unknown, free = COLOURS["day"]
    assert drawn() == [wall, unknown, free]
    assert drawn(occupied_thresh=0.4) == [wall, wall, free]
    assert drawn(free_thresh=0.6) == [wall, free, free]
    graded = drawn(mode="scale")
    assert graded[0] == wall
    assert graded[2] == free
    assert graded[1] not in COLOURS["day"]
    assert drawn(mode="raw") == [free, unknown, unknown], (
        "in raw mode 0 is free and 128 is unknown"
    )


def test_a_negated_image_is_drawn_inverted(tmp_path):
    Image.new("L", (4, 4), 255).save(tmp_path / "floor.png")
    floor = load_floor(write(tmp_path, negate=1), tmp_path)
    painted = Image.open(floor.day).convert("RGB")
    assert colour(painted, (0, 0)) == COLOURS["day"][0]


@pytest.mark.parametrize(("name", "mode"), [("a.pgm", "L"), ("a.png", "RGBA")])
def test_the_formats_of_map_saver_are_read(tmp_path, name, mode):
    draw(tmp_path, name, mode)
    assert load_floor(write(tmp_path, name), tmp_path).width == 4.0


@pytest.mark.parametrize(
    ("mode", "light", "place"),
    [("scale", 0, 1), ("scale", 255, 1), ("trinary", 0, 0), ("trinary", 255, 1)],
)
def test_transparent_pixels_are_read_as_map_server_reads_them(
    tmp_path, mode, light, place
):
    Image.new("RGBA", (4, 4), (*[light] * 3, 0)).save(tmp_path / "floor.png")
    floor = load_floor(write(tmp_path, mode=mode), tmp_path)
    painted = Image.open(floor.day).convert("RGB")
    wall_or_unknown = COLOURS["day"][place]
    assert colour(painted, (0, 0)) == wall_or_unknown


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"resolution": 0}, "resolution"),
        ({"resolution": ".nan"}, "resolution"),
        ({"resolution": "wide"}, "resolution"),
        ({"origin": [0.0, 0.0]}, "origin"),
        ({"origin": [0.0, 0.0, ".inf"]}, "origin"),
        ({"image": "../floor.png"}, "folder of the YAML"),
        ({"image": "/etc/passwd"}, "folder of the YAML"),
        ({"image": "."}, "no image"),
        ({"image": "gone.png"}, "no image"),
        ({"negate": "maybe"}, "negate"),
        ({"negate": "yes"}, "negate must be 0 or 1"),
        ({"occupied_thresh": 0.1}, "free_thresh < occupied_thresh"),
    ],
)
def test_a_map_with_an_invalid_value_is_refused_with_the_reason(
    tmp_path, changes, reason
):
    draw(tmp_path)
    with pytest.raises(ConfigError, match=reason):
        load_floor(write(tmp_path, **changes), tmp_path)


@pytest.mark.parametrize(
    ("line", "wrong"),
    [
        (2, "resolution: -1"),
        (3, "origin: [0, x, 0]"),
        (1, "image: gone.png"),
        (4, "negate: maybe"),
        (4, "resolution: 2"),
    ],
)
def test_an_error_in_the_yaml_file_is_reported_with_its_line(tmp_path, line, wrong):
    draw(tmp_path)
    lines = ["image: floor.png", "resolution: 0.5", "origin: [0, 0, 0]", "negate: 0"]
    lines[line - 1] = wrong
    file = tmp_path / "floor.yaml"
    file.write_text("\n".join(lines))
    with pytest.raises(ConfigError) as error:
        load_floor(file, tmp_path)
    assert str(error.value).startswith(f"{file}:{line}: ")


@pytest.mark.parametrize("text", ["", "- a\n- b", "{", "\x00", "a: &a [*a]"])
def test_an_invalid_yaml_file_is_refused(tmp_path, text):
    file = tmp_path / "floor.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=r"floor\.yaml"):
        load_floor(file, tmp_path)


def test_an_invalid_image_is_refused(tmp_path):
    (tmp_path / "floor.png").write_bytes(b"\x89PNG\r\n\x1a\n nothing")
    with pytest.raises(ConfigError, match=r"floor\.yaml: the image cannot be read"):
        load_floor(write(tmp_path), tmp_path)


def test_a_missing_yaml_file_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.yaml"):
        load_floor(tmp_path / "none.yaml", tmp_path)


def test_a_yaml_file_above_the_size_limit_is_refused(tmp_path):
    draw(tmp_path)
    file = write(tmp_path)
    file.write_text(file.read_text() + "\n# " + "x" * MAX_YAML)
    with pytest.raises(ConfigError, match="expected at most 16384 for a map's YAML"):
        load_floor(file, tmp_path)


def test_nested_merge_keys_of_a_yaml_file_are_read_within_three_seconds(tmp_path):
    draw(tmp_path)
    file = write(tmp_path)
    depth, many = 45, ", ".join(f"k{number}: 0" for number in range(1200))
    nested = "<<: {" * depth + many + "}" * depth
    file.write_text(f"{file.read_text()}\n{nested}\n")
    assert file.stat().st_size < MAX_YAML
    before = time.process_time()
    assert load_floor(file, tmp_path).width == 4.0
    assert time.process_time() - before < 3.0
