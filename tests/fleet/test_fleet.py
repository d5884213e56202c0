"""Fleet files are read strictly; each mistake is reported with its line."""

import pytest

from webmap.base.errors import ConfigError
from webmap.fleet.fleet_file import prepare

GOOD = """\
title = "Two halls"

[bridges]
north = "ws://north:9090"
south = "wss://south/ros"

[map]
bridge = "north"
topic = "/map"

[[robots]]
name = "Bob"
bridge = "north"
odometry = "/bob/odom"
scan = ["/bob/front/scan", "/bob/rear/scan"]
battery = "/bob/battery_state"

[robots.twist]
topic = "/bob/cmd_vel"
type = "geometry_msgs/Twist"
stops_within = 0.25
v_max = 0.5
w_max = 1

[robots.move]
topic = "/bob/move_base_simple/goal"
cancel_topic = "/bob/move_base/cancel"
on_operator_loss = "cancel"

[[robots]]
name = "Ann"
bridge = "south"
base_link = "base_footprint"
tf = { namespace = "/ann", map_frame = "world" }
odometry = { topic = "/odom", type = "nav_msgs/msg/Odometry", throttle = 50 }
twist = { topic = "/cmd_vel", type = "geometry_msgs/msg/TwistStamped" }
modules = [
  { name = "LaserScanner", args = [{ bridge = "north" }, "/s"], options = { x = 1 } },
]
"""


@pytest.fixture
def write(tmp_path):
    def write_(text):
        file = tmp_path / "fleet.toml"
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return file

    return write_


@pytest.fixture
def ready(write):
    made = []

    def ready_(text):
        made.append(prepare(write(text)))
        return made[-1]

    yield ready_
    for fleet in made:
        for robot in fleet.robots:
            robot.destroy()


def refused(write, text):
    file = write(text)
    with pytest.raises(ConfigError) as error:
        prepare(file)
    return str(error.value).replace(str(file), "FILE")


def test_one_fleet_file_describes_robots_of_ros_1_and_ros_2(ready):
    fleet = ready(GOOD)
    assert [bridge.url for bridge in fleet.bridges.values()] == [
        "ws://north:9090",
        "wss://south/ros",
    ]
    assert fleet.fleet.to_dict()["map"] == [{"bridge": "north", "topic": "/map"}]
    bob, ann = fleet.robots
    spec = bob.motion.spec()
    assert (bob.name, spec.base.topic, spec.base.stops_within) == (
        "Bob",
        "/bob/cmd_vel",
        0.25,
    )
    assert (spec.base.v_max, spec.base.w_max) == (0.5, 1.0)
    assert spec.navigation.cancel_topic == "/bob/move_base/cancel"
    names = [type(module).__name__ for module in bob.modules]
    assert names.count("LaserScanner") == 2
    assert "Battery" in names
    assert ann.base_link == "base_footprint"
    assert ann.feed.throttle == 50
    assert (ann.tf["namespace"], ann.tf["map_frame"]) == ("/ann", "world")
    assert bob.tf is None
    assert "TwistStamped" in ann.motion.spec().twist_type
    scanner = next(m for m in ann.modules if type(m).__name__ == "LaserScanner")
    assert scanner is not None


def test_the_fleet_file_sets_limits_for_the_other_axes_of_a_flying_robot(ready):
    limits = "z_max = 0.5\nrx_max = 0.2\nry_max = 1"
    spec = ready(changed("w_max = 1", f"w_max = 1\n{limits}")).robots[0].motion.spec()
    assert (spec.base.z_max, spec.base.rx_max, spec.base.ry_max) == (0.5, 0.2, 1.0)


def test_robots_use_the_only_bridge_by_default_and_a_topic_may_be_plain_text(ready):
    fleet = ready(
        '[bridges]\nhall = "ws://hall:9090"\n'
        '[[robots]]\nname = "Bob"\ntwist = "/cmd_vel"\nscan = "/scan"\n'
    )
    assert fleet.robots[0].motion.bridge("twist").url == "ws://hall:9090"


def changed(old, new):
    assert old in GOOD
    return GOOD.replace(old, new, 1)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            changed("stops_within", "stops_witin"),
            'FILE:21: robots[0].twist.stops_witin: there is no key "stops_witin" here; '
            'did you mean "stops_within"?; there are topic, type,',
        ),
        (
            changed("v_max = 0.5", 'v_max = "0.5"'),
            'FILE:22: robots[0].twist.v_max: got the text "0.5", expected a number of '
            "metres per second from 0 on",
        ),
        (changed("0.25", "0"), "FILE:21: robots[0].twist.stops_within: got the whole"),
        (changed("0.25", "-1.5"), "got the number -1.5, expected a number of seconds"),
        (changed("0.25", "inf"), "got the number inf, expected a number of seconds"),
        (changed("0.25", "nan"), "got the number nan, expected a number of seconds"),
        (changed("0.25", "true"), "got the boolean true, expected a number of seconds"),
        (changed("0.25", "9" * 400), "got the whole number of very many digits"),
        (changed("title", "tilte"), 'FILE:1: tilte: there is no key "tilte" here; did'),
        (
            changed('"ws://north:9090"', '"http://north"'),
            'FILE:4: bridges.north: got the text "http://north", expected the address',
        ),
        (
            changed('"Bob"\nbridge = "north"', '"Bob"\nbridge = "nroth"'),
            'FILE:13: robots[0].bridge: got the text "nroth", expected the name of a '
            'bridge (north, south); did you mean "north"?',
        ),
        (
            changed('"Bob"\nbridge = "north"\n', '"Bob"\n'),
            'FILE:11: robots[0]: the key "bridge" is',
        ),
        (
            changed('name = "Bob"\n', ""),
            'FILE:11: robots[0]: the key "name" is missing',
        ),
        (
            changed('"Ann"', '"BOB"'),
            'FILE:31: robots[1].name: got the text "BOB", expected a name that differs',
        ),
        (
            changed('"Ann"', '"\uff22ob"'),
            "expected a name that differs from",
        ),
        (
            changed('"/bob/odom"', '"/bob odom"'),
            'FILE:14: robots[0].odometry: got the text "/bob odom", expected the name',
        ),
        (
            changed('"/bob/rear/scan"', "7"),
            "FILE:15: robots[0].scan[1]: got the whole number 7, expected the name of",
        ),
        (
            changed('"geometry_msgs/Twist"', '"nav_msgs/Odometry"'),
            "FILE:20: robots[0].twist.type: got",
        ),
        (changed('"cancel"', '"cancle"'), 'did you mean "cancel"?'),
        (
            changed("throttle = 50", "throttle = 1.5"),
            "FILE:35: robots[1].odometry.thro",
        ),
        (
            changed('"LaserScanner"', '"LaserScaner"'),
            "FILE:38: robots[1].modules[0].name: there is no robot module "
            "'LaserScaner'. Did you mean 'LaserScanner'?",
        ),
        (
            changed("{ x = 1 }", "{ colour = 1 }"),
            "FILE:38: robots[1].modules[0].options.colour: LaserScanner: there is no",
        ),
        (
            changed('{ bridge = "north" }', '{ bridge = "east" }'),
            "FILE:38: robots[1].modules[0].args[0].bridge: got the text",
        ),
        (changed("[[robots]]", "[robots]"), "this is not TOML"),
        (changed('topic = "/map"\n', ""), 'FILE:7: map: the key "topic" is missing'),
        (
            changed('[map]\nbridge = "north"', '[map]\nbridge = "nort"'),
            'FILE:8: map.bridge: got the text "nort", expected the name of a bridge',
        ),
        (changed("map_frame", "mapframe"), "FILE:34: robots[1].tf.mapframe: there is"),
        (
            changed('battery = "/bob/battery_state"', "tf = 1"),
            "FILE:16: robots[0].tf: got the whole number 1, expected true, false or a",
        ),
        (
            "title = 1\n[[robots]]\n",
            "FILE:1: title: got the whole number 1, expected a",
        ),
        ('[bridges]\na = "ws://a"\n', "FILE:1: robots: got nothing, expected a table"),
        (changed('title = "Two halls"', 'floor = "none.yaml"'), "FILE:1: floor: "),
        ("", "FILE: the file is empty; expected TOML with a table [bridges]"),
        ("# nothing\n", "FILE:1: bridges: got nothing"),
        ("title = \n", "FILE:1: this is not TOML: got title =, expected a value: a"),
        (changed("w_max = 1", "w_max = .inf"), "FILE:23: this is not TOML: got w_max"),
        (changed('"Ann"', '"Ann'), "expected the quote that ends a text on the same l"),
        (
            changed("w_max = 1", "v_max = 1"),
            "FILE:23: this is not TOML: got v_max = 1, this key is already defined",
        ),
        (
            changed("[robots.move]", "[robots.twist]"),
            "FILE:25: this is not TOML: got [robots.twist], the table [robots.",
        ),
        ("bridges:\n", "FILE:1: this is not TOML: got bridges:, expected a key, an eq"),
        ("x = [1,\n\n", "FILE:2: this is not TOML: expected a value"),
        (changed("v_max = 0.5", 'v_max = "0.5"'), "; write 0.5 without quotes"),
        (changed('"Bob"', "7"), '; write it in quotes: "7"'),
        (changed('"Bob"', r'"B\nob"'), "expected a text of one line with at most 10"),
        (
            changed("w_max = 1", 'holonomic = "yes"'),
            "expected true or false; write true without quotes",
        ),
        (
            changed("w_max = 1", 'floor = "hall.yaml"'),
            'there is no key "floor" here; it belongs to the file: write it above',
        ),
        (
            changed('title = "Two halls"', "").replace(
                "[bridges]", '[bridges]\ntitle = "Two halls"'
            ),
            'FILE:4: bridges.title: got the text "Two halls" for a bridge; write',
        ),
        (
            changed('"/cmd_vel"', '"bob/cmd_vel"').replace('"south"\nb', '"north"\nb'),
            'FILE:36: robots[1].twist.topic: got the text "/bob/cmd_vel", which drives '
            '"Bob" (robots[0]) already',
        ),
        (changed('"Ann"', '"Bob"'), 'differs from "Bob" (robots[0]) by more than case'),
        (
            changed('title = "Two halls"', 'floor = "a.png"'),
            "expected the YAML file that",
        ),
        (
            '[bridges]\na = "ws://a"\n[robots]\nname = "Bob"\n',
            "expected a table [[robots]] in double brackets for each",
        ),
        (
            '[bridges]\na = "ws://a"\n[[robots]]\nname = "B"\n[robots.modules]\n',
            "expected a table [[robots.modules]] in double brackets for each",
        ),
        (
            b"\xef\xbb\xbf" + GOOD.encode(),
            "FILE: the file begins with a byte order mark",
        ),
        (GOOD.encode("utf-16"), "byte order mark"),
        (b'title = "ok"\nfloor = "\xff"\n', "FILE:2: this is not UTF-8"),
        ("x = " + "[" * 5000, "FILE:1: keys and values are nested at most 20 deep"),
        (
            "x = " + "9" * 5000,
            "FILE:1: this is not TOML: a whole number of far too many digits",
        ),
        ("#" * (2 << 20), "FILE: the file is larger than 512 KiB"),
    ],
)
def test_a_mistake_is_reported_with_its_line_and_the_expected_value(
    write, text, expected
):
    assert expected in refused(write, text)


def test_all_mistakes_are_reported_at_once(write):
    text = changed("v_max", "vmax").replace("w_max = 1", "w_max = false")
    errors = refused(write, text).splitlines()
    assert len(errors) == 2
    assert errors[0].startswith("FILE:22: ")
    assert errors[1].startswith("FILE:23: ")


def test_error_messages_escape_control_characters_of_the_fleet_file(write):
    for odd in (changed('"north"', r'"\u001b[2J"'), changed("title", r'"\u001b[2J"')):
        assert "\x1b" not in refused(write, odd)


def test_a_missing_bridges_table_is_the_only_mistake_reported(write):
    errors = refused(write, '[[robots]]\nname = "Bob"\n').splitlines()
    assert len(errors) == 1
    assert errors[0].startswith(
        "FILE:1: bridges: got nothing, expected a table [bridges]"
    )


ONE = '[bridges]\nhall = "ws://hall:9090"\n\n[[robots]]\nname = "Bob"\n'


def test_a_robot_must_name_its_bridge_among_several_even_if_its_goal_names_one(
    tmp_path,
):
    file = tmp_path / "fleet.toml"
    move = (
        'move = { topic = "/goal", bridge = "hall" }\ninitial_pose = "/initialpose"\n'
    )
    file.write_text(f"{ONE}{move}")
    (robot,) = prepare(file).robots
    assert robot.motion.config.initial_pose.bridge == "ws://hall:9090"
    robot.destroy()
    file.write_text(f"{ONE}{move}".replace("[[rob", 'yard = "ws://yard:9090"\n[[rob'))
    with pytest.raises(ConfigError, match="several bridges"):
        prepare(file)


@pytest.mark.parametrize(
    "last",
    [
        "[[image]]\nwidth = 4.0\nheight = 2.0\n",
        '[tiles]\nsource = "tiles"\nlatitude = "north"\nlongitude = 8.0\n',
        "[[robots]]\nname = 'Ann'\nscan_assist = { topic = '/scan' }\n",
    ],
)
def test_at_most_a_hundred_mistakes_are_listed_and_the_rest_are_counted(tmp_path, last):
    file = tmp_path / "fleet.toml"
    wrong = "".join(f"k{number} = 1\n" for number in range(120))
    file.write_text(f"{ONE}{wrong}{last}")
    with pytest.raises(ConfigError) as error:
        prepare(file)
    lines = str(error.value).splitlines()
    assert len(lines) == 101
    assert "more mistakes" in lines[-1]


def test_all_mistakes_of_one_robot_are_reported(tmp_path):
    file = tmp_path / "fleet.toml"
    parts = (
        'twist = { topic = "/cmd_vel", v_max = "fast" }\n'
        "nonsense = 1\n"
        'model = { tag = "script" }\n'
        'modules = [{ name = "Trial" }]\n'
    )
    file.write_text(f"{ONE}{parts}")
    with pytest.raises(ConfigError) as error:
        prepare(file)
    lines = str(error.value).splitlines()
    assert len(lines) == 4
    for number, key in ((6, "twist.v_max"), (7, "nonsense"), (8, "model"), (9, "mod")):
        assert any(f".toml:{number}: robots[0].{key}" in line for line in lines), key
