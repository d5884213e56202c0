"""Labels and tiles in a fleet file are read strictly; mistakes have a line number."""

import io
import os

import pytest
from PIL import Image

from webmap.base.errors import ConfigError
from webmap.fleet.fleet_file import prepare

HEAD = """\
[bridges]
hall = "ws://hall:9090"

[[robots]]
name = "Bob"

"""
TILES = '[tiles]\nsource = "tiles"\nlatitude = 50\nlongitude = 14.5\neast = 90\n'


@pytest.fixture
def prepared(tmp_path):
    (tmp_path / "tiles" / "3" / "4").mkdir(parents=True)
    data = io.BytesIO()
    Image.new("RGB", (256, 256)).save(data, "PNG")
    (tmp_path / "tiles" / "3" / "4" / "2.png").write_bytes(data.getvalue())
    made = []

    def prepared_(text, head=HEAD):
        file = tmp_path / "fleet.toml"
        file.write_text(text if head is None else f"{text}{head}")
        made.append(prepare(file))
        return made[-1]

    yield prepared_
    for fleet in made:
        for robot in fleet.robots:
            robot.destroy()


def test_the_tile_layer_gets_its_source_and_position_from_the_fleet_file(
    prepared, tmp_path
):
    assert prepared(TILES).modules == {
        "TileLayer": {
            "source": str(tmp_path / "tiles"),
            "datum": (50.0, 14.5),
            "east": 90.0,
        }
    }


def test_labels_are_read_from_the_fleet_file_or_from_a_separate_file(
    prepared, tmp_path
):
    label = {"name": "Dock", "x": 1.5, "y": -2}
    table = '[[labels]]\nname = "Dock"\nx = 1.5\ny = -2\n'
    assert prepared(table).modules == {"Labels": {"labels": [label]}}
    (tmp_path / "places.yaml").write_text("- {name: Dock, x: 1, y: 2}")
    assert prepared('labels = "places.yaml"\n').modules == {
        "Labels": {"file": str(tmp_path / "places.yaml")}
    }


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "labels = 3\n",
            "fleet.toml:1: labels: got the whole number 3, expected a file",
        ),
        ('labels = "no.yaml"\n', "no.yaml: No such file or directory"),
        (
            '[[labels]]\nname = "A"\nx = 1\ny = "2"\n',
            'fleet.toml:4: labels[0].y: got the text "2", expected a number of metres',
        ),
        (
            '[[labels]]\nname = "A"\nx = 1\ny = 2\niocn = "pin"\n',
            'fleet.toml:5: labels[0].iocn: there is no key "iocn" here; did you',
        ),
        (
            '[[labels]]\nname = "A"\nx = 1\n',
            'fleet.toml:1: labels[0]: the key "y" is missing',
        ),
        (
            TILES.replace("50", "91"),
            "fleet.toml:3: tiles.latitude: got the whole number 91, expected a number "
            "of degrees from -89.999 to 89.999",
        ),
        (
            TILES.replace("latitude", "lattitude"),
            'there is no key "lattitude" here; did you mean "latitude"?',
        ),
        (
            TILES.replace('"tiles"', '"https://tiles.example/{z}/{x}/{y}.png"'),
            "fleet.toml:2: tiles.source: tiles 'https://tiles.example/{z}/{x}/{y}.png':"
            " tiles are read from this machine's disk alone",
        ),
        (
            TILES + "tile_size = 300\n",
            "tiles.tile_size: got the whole number 300, expected 256 or 512",
        ),
        (TILES.replace('"tiles"', '"no"'), "no such folder and no such file"),
    ],
)
def test_invalid_labels_and_tiles_are_reported_with_their_line(
    prepared, text, expected
):
    with pytest.raises(ConfigError) as error:
        prepared(text)
    assert expected in str(error.value)


@pytest.mark.parametrize("key", ["floor", "labels"])
def test_a_mistake_in_a_separate_file_is_reported_with_the_line_in_both_files(
    prepared, tmp_path, key
):
    (tmp_path / "own.yaml").write_text(
        "image: none.png\nresolution: 0.1\norigin: [0, 0, north]\n"
        if key == "floor"
        else "- {name: Dock, x: 1, y: 2}\n- name: Desk\n  x: far\n  y: 2\n"
    )
    with pytest.raises(ConfigError) as error:
        prepared(f'{key} = "own.yaml"\n')
    assert f"fleet.toml:1: {key}: {tmp_path / 'own.yaml'}:3: " in str(error.value)


@pytest.mark.parametrize("key", ["floor", "labels"])
def test_a_pipe_instead_of_a_file_is_refused_at_once(prepared, tmp_path, key):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(ConfigError, match="pipe: expected a file, got a pipe"):
        prepared(f'{key} = "pipe"\n')
