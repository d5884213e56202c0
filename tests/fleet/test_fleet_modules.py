"""Arguments of modules in a fleet file: the line of each that is wrong."""

import pytest

from webmap.base.errors import ConfigError
from webmap.fleet.fleet_file import prepare

HEAD = """\
[bridges]
hall = "ws://hall:9090"

[[robots]]
name = "Bob"

"""
SCAN = """\
[[robots.modules]]
name = "LaserScanner"
args = [{ bridge = "hall" }, "/scan"]

[robots.modules.options]
x = 0.1
"""


def module(name, *options, args='{ bridge = "hall" }, "/topic"'):
    lines = [f'name = "{name}"', f"args = [{args}]", "[robots.modules.options]"]
    return "\n".join(["[[robots.modules]]", *lines, *options, ""])


@pytest.fixture
def refused(tmp_path):
    def refused_(text):
        file = tmp_path / "fleet.toml"
        file.write_text(HEAD + text)
        with pytest.raises(ConfigError) as error:
            prepare(file)
        return str(error.value).replace(str(file), "FILE")

    return refused_


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            f'{SCAN}max_dots = "50"\n',
            'FILE:13: robots[0].modules[0].options.max_dots: got the text "50", '
            "expected a whole number, for max_dots of LaserScanner",
        ),
        (
            module("PointCloud", "cell = 0.1", 'z_min = "0"'),
            'FILE:12: robots[0].modules[0].options.z_min: got the text "0", expected a '
            "number, for z_min of PointCloud",
        ),
        (module("Path", 'max_points = "9"'), "FILE:11: robots[0].modules[0].options.m"),
        (module("Diagnostics", "hold = true"), "got the boolean true, expected a num"),
        (module("Trail", "step = nan", args=""), "options.step: Trail: step must be m"),
        (module("Range", "x = [1]"), "got the array [1], expected a number, for x of"),
        (module("Camera", 'throttle = "x"'), 'got the text "x", expected a whole num'),
        (module("Camera", "throttle = -1"), "of milliseconds, 0 or more, for"),
        (
            module("Path", args='"/plan"'),
            'FILE:9: robots[0].modules[0].args[0]: got the text "/plan", expected a '
            'bridge, such as { bridge = "hall" }, for bridge of Path',
        ),
        (
            module("Path", args=""),
            "FILE:7: robots[0].modules[0]: Path: missing a required argument: 'bridge'",
        ),
        (
            module("Path", args='{ bridge = "hall" }, "/no good"'),
            'args[1]: got the text "/no good", expected the name of a topic',
        ),
        (
            module("NavSatFix", 'datum = [50, "14"]'),
            'FILE:11: robots[0].modules[0].options.datum[1]: got the text "14", expec',
        ),
        (
            module("LaserScanner", "max_dot = 7"),
            "FILE:11: robots[0].modules[0].options.max_dot: LaserScanner: there is no "
            'argument "max_dot"; did you mean "max_dots"?; it takes (bridge, topic,',
        ),
        (
            module("Path", "throttle = 0", "max_points = 1"),
            "FILE:12: robots[0].modules[0].options.max_points: Path: max_points must "
            "be at least 2, got 1",
        ),
        (module("Range", "x = inf"), "FILE:7: robots[0].modules[0]: Range: "),
    ],
)
def test_an_invalid_module_argument_is_reported_with_the_line_of_its_key(
    refused, text, expected
):
    assert expected in refused(text)


def test_all_invalid_module_arguments_are_reported_at_once(refused):
    text = module("LaserScanner", 'x = "1"', 'y = "2"', 'max_dots = "3"')
    assert [line.split(":")[1] for line in refused(text).splitlines()] == [
        "11",
        "12",
        "13",
    ]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ('palette = "foo"', 'options.palette: got the text "foo", expected "map" or "'),
        ("pallet = 1", 'there is no argument "pallet"; did you mean "palette"?'),
        ('throttle = "1"', 'options.throttle: got the text "1", expected a whole'),
    ],
)
def test_arguments_of_an_on_maps_module_are_checked_before_a_map_exists(
    refused, options, expected
):
    args = '"OccupancyGrid", { bridge = "hall" }, "/c"'
    assert f"FILE:11: robots[0].modules[0].options.{options.split(' ')[0]}: " in (
        received := refused(module("OnMaps", options, args=args))
    )
    assert expected in received


def test_an_argument_index_in_an_error_counts_as_in_the_fleet_file(refused):
    args = '"OccupancyGrid", "/c"'
    assert "modules[0].args[1]: got the text" in refused(module("OnMaps", args=args))
