import numpy as np
import pytest
from PIL import Image

from webmap.base.errors import ConfigError
from webmap.sim.maps import FLOOR, load_map

SETTINGS = {
    "image": "plan.pgm",
    "resolution": 0.5,
    "origin": "[-1.0, 2.0, 0.0]",
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
}


def write(folder, **changes):
    settings = {**SETTINGS, **changes}
    path = folder / "plan.yaml"
    path.write_text("".join(f"{k}: {v}\n" for k, v in settings.items()))
    return path


def write_pgm(folder, rows, name="plan.pgm"):
    pixels = np.array(rows, np.uint8)
    head = f"P5\n# a comment\n{pixels.shape[1]} {pixels.shape[0]}\n255\n"
    (folder / name).write_bytes(head.encode() + pixels.tobytes())


def test_the_bottom_row_of_the_image_is_the_first_row_of_the_grid(tmp_path):
    write_pgm(tmp_path, [[0, 254, 205], [254, 254, 254]])
    plan = load_map(write(tmp_path))
    assert plan.occupancy.tolist() == [[0, 0, 0], [100, 0, -1]]
    assert (plan.resolution, plan.x, plan.y) == (0.5, -1.0, 2.0)


def test_a_plain_text_pgm_image_is_read(tmp_path):
    (tmp_path / "plan.pgm").write_text("P2\n2 1\n255\n0 254\n")
    assert load_map(write(tmp_path)).occupancy.tolist() == [[100, 0]]


def test_the_mean_of_the_colour_channels_decides_the_cell_value(tmp_path):
    image = Image.new("RGB", (2, 1), (250, 252, 254))
    image.putpixel((0, 0), (70, 84, 104))
    image.save(tmp_path / "plan.png")
    plan = load_map(write(tmp_path, image="plan.png"))
    assert plan.occupancy.tolist() == [[100, 0]]


def test_negate_makes_white_cells_occupied(tmp_path):
    write_pgm(tmp_path, [[0, 254]])
    assert load_map(write(tmp_path, negate=1)).occupancy.tolist() == [[0, 100]]


def test_scale_mode_gives_intermediate_values_between_the_thresholds(tmp_path):
    write_pgm(tmp_path, [[0, 254, 150]])
    wall, free, between = load_map(write(tmp_path, mode="scale")).occupancy[0]
    assert (wall, free) == (100, 0)
    assert 1 <= between <= 99


def test_raw_mode_uses_pixel_values_as_cell_values(tmp_path):
    write_pgm(tmp_path, [[0, 100, 42, 255]])
    plan = load_map(write(tmp_path, mode="raw"))
    assert plan.occupancy.tolist() == [[0, 100, 42, -1]]


def test_an_image_outside_the_folder_of_the_yaml_is_refused(tmp_path):
    folder = tmp_path / "maps"
    folder.mkdir()
    write_pgm(tmp_path, [[0]])
    with pytest.raises(ConfigError, match="not in the folder of the YAML"):
        load_map(write(folder, image="../plan.pgm"))


def test_yaml_that_constructs_python_objects_is_refused(tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_text(
        "image: !!python/object/apply:os.system ['true']\nresolution: 1\n"
        "origin: [0, 0, 0]\n"
    )
    with pytest.raises(ConfigError, match="image must be the name of a file"):
        load_map(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"resolution": 0}, "resolution must be above 0"),
        ({"resolution": "fine"}, "resolution must be a finite number"),
        ({"origin": "[0, 0]"}, "origin must be"),
        ({"origin": "[0, 0, 1.5]"}, "yaw is not supported"),
        ({"mode": "quaternary"}, "mode must be"),
        ({"negate": "yes"}, "negate must be 0 or 1"),
        ({"negate": "maybe"}, "negate must be 0 or 1"),
        ({"free_thresh": 0.9}, "free_thresh < occupied_thresh"),
        ({"image": "absent.pgm"}, "no image file"),
        ({"image": ""}, "image must be"),
    ],
)
def test_an_invalid_map_setting_is_refused_with_its_name(tmp_path, change, message):
    write_pgm(tmp_path, [[0, 254]])
    with pytest.raises(ConfigError, match=message):
        load_map(write(tmp_path, **change))


def test_a_truncated_image_is_refused(tmp_path):
    (tmp_path / "plan.pgm").write_bytes(b"P5\n999 99\n255\nshort")
    with pytest.raises(ConfigError, match="the image cannot be read: image file"):
        load_map(write(tmp_path))


def test_a_too_large_image_is_refused(tmp_path):
    (tmp_path / "plan.pgm").write_bytes(b"P5\n99999 9999\n255\nshort")
    with pytest.raises(ConfigError, match="pixels"):
        load_map(write(tmp_path))


def test_a_missing_map_file_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="No such file"):
        load_map(tmp_path / "absent.yaml")


def test_the_shipped_floor_is_a_closed_building():
    plan = load_map(FLOOR)
    rows, columns = plan.occupancy.shape
    assert (columns * plan.resolution, rows * plan.resolution) == (42.0, 27.0)
    share = {v: (plan.occupancy == v).mean() for v in (-1, 0, 100)}
    assert share[-1] > 0.05
    assert share[0] > 0.6
    assert share[100] > 0.05
    # The walls are closed: no path leads from inside to the unknown area.
    free = plan.occupancy == 0
    assert not free[[0, -1]].any()
    assert not free[:, [0, -1]].any()
    beside = np.zeros_like(free)
    beside[1:] |= free[:-1]
    beside[:-1] |= free[1:]
    beside[:, 1:] |= free[:, :-1]
    beside[:, :-1] |= free[:, 1:]
    assert not (beside & (plan.occupancy == -1)).any()
