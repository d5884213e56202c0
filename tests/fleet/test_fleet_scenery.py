"""Maps, pictures and modules of the map in a fleet file."""

import pytest
from PIL import Image

from webmap.base.errors import ConfigError
from webmap.console import Console
from webmap.fleet.fleet_file import prepare, show_scenery

BASE = """\
[bridges]
north = "ws://north:9090"
south = "ws://south:9090"

[[robots]]
name = "Bob"
bridge = "north"

"""
GOOD = """\
[[map]]
bridge = "north"
topic = "/map"

[[map]]
bridge = "south"
topic = "/map"
palette = "costmap"
order = 12

[[image]]
file = "hall.png"
x = -2
y = 1.5
width = 40
height = 20

[[modules]]
name = "Markers"
args = [{ bridge = "south" }, "/zones"]

[[modules]]
name = "MapFile"
args = ["second.yaml"]
options = { order = 4.0 }
"""


@pytest.fixture
def write(tmp_path):
    Image.new("RGB", (4, 2)).save(tmp_path / "hall.png")
    plan = "image: hall.png\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"
    thresholds = "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (tmp_path / "second.yaml").write_text(plan + thresholds)
    (tmp_path / "none.yaml").write_text("image: hall.png\n")

    def write_(text):
        file = tmp_path / "fleet.toml"
        file.write_text(BASE + text)
        return file

    return write_


@pytest.fixture
def ready(write):
    made = prepare(write(GOOD))
    yield made
    for robot in made.robots:
        robot.destroy()


def test_maps_images_and_map_modules_of_the_fleet_file_are_shown(ready, tmp_path):
    console = Console()
    show_scenery(console, ready)
    north, south = ready.bridges.values()
    (first, second), options = console.grids, list(console.grids.values())
    assert (first, second) == ((north, "/map"), (south, "/map"))
    assert options[1] == {"palette": "costmap", "order": 12.0}
    assert console.images == [(str(tmp_path / "hall.png"), -2.0, 1.5, 40.0, 20.0)]
    assert [name for name, _, _ in ready.others] == ["Markers", "MapFile"]
    assert ready.others[0][1] == (south, "/zones")
    assert ready.others[1][1] == (str(tmp_path / "second.yaml"),)


def test_open_pages_and_later_pages_get_all_maps_images_and_map_modules(ready):
    console, page = Console(), FakePage()
    console.opened(page)  # before this map, and another map after it
    show_scenery(console, ready)
    after = FakePage()
    console.opened(after)
    for (map,) in (page.maps, after.maps):
        assert sorted(map.modules) == ["MapFile", "Markers", *2 * ["OccupancyGrid"]]
        assert len(map.images) == 1


class FakePage:
    def __init__(self):
        self.maps = [FakeMap()]


class FakeMap:
    def __init__(self):
        self.modules, self.images = [], []

    def add_module(self, name, *args, **options):
        self.modules.append(name)
        self.layer = self.svg = self
        return self

    def set(self, name, value):
        assert name == "data-layer"
        assert value in ("/map (north)", "/map (south)"), (
            "the layer has the name of its map"
        )

    def add_image(self, *image):
        self.images.append(image)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            'palette = "costmap"',
            'palette = "cost"',
            'FILE:16: map[1].palette: got the text "cost", expected "map" or "costmap"',
        ),
        (
            'bridge = "south"\ntopic',
            'bridge = "nort"\ntopic',
            'FILE:14: map[1].bridge: got the text "nort", expected the name of a b',
        ),
        (
            'bridge = "south"\ntopic',
            'bridge = "north"\ntopic',
            "is in the file already",
        ),
        ("order = 12", 'order = "12"', "FILE:17: map[1].order: got the text"),
        ("width = 40\n", "", 'image[0]: the key "width" is missing'),
        (
            "width = 40",
            "width = -1",
            "FILE:23: image[0].width: got the whole number -1",
        ),
        ("x = -2", "x = nan", "FILE:21: image[0].x: got the number nan"),
        ("x = -2", "z = 1\nx = -2", 'image[0].z: there is no key "z" here'),
        ('"hall.png"', '"no.png"', "FILE:20: image[0].file: there is no file"),
        ('"hall.png"', '"fleet.toml"', "is not a picture: its name must end in"),
        (
            'name = "Markers"',
            'name = "Marker"',
            "modules[0].name: there is no map modu",
        ),
        ("second.yaml", "no.yaml", "modules[1].args[0]: "),
        ("second.yaml", "none.yaml", "none.yaml:1: "),
        ('"/zones"]', "7]", "modules[0].args[1]: got the whole number 7, expected"),
        (
            "order = 4.0",
            "ordr = 4.0",
            'there is no argument "ordr"; did you mean "order',
        ),
        (
            '{ bridge = "south" }, "/z',
            '{ bridge = "x" }, "/z',
            "expected the name of a b",
        ),
    ],
)
def test_an_invalid_map_image_or_module_is_reported_with_its_line_and_key(
    write, old, new, expected
):
    assert old in GOOD
    file = write(GOOD.replace(old, new, 1))
    with pytest.raises(ConfigError) as error:
        prepare(file)
    assert expected in str(error.value).replace(str(file), "FILE")
