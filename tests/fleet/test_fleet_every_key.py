"""Every key of a robot has the same effect directly and through an agent."""

import asyncio
from pathlib import Path

import msgspec
import pytest
from PIL import Image

from webmap import Bridge, Robot
from webmap.agents import address
from webmap.base.lifecycle import Lifecycle
from webmap.config.checks import Mistakes
from webmap.config.fleet import read_fleet
from webmap.config.robot import RobotConfig, TfConfig
from webmap.config.toml_text import read_text
from webmap.console import Console
from webmap.core.motion import RobotMotion
from webmap.core.robot import apply_config
from webmap.core.robot_model import element_to_dict
from webmap.core.visible_robot import robots
from webmap.fleet import agent, remote_robots
from webmap.fleet.agent_robots import moving_parts, robots_in_file
from webmap.fleet.fleet_file import make_bridges, make_robots
from webmap.scene.element import Element

TEXT = (Path(__file__).parents[1] / "wires/fleets/every_key.toml").read_text()
MORE = """
[[robots]]
name = "Mo"
bridge = "hall"
base_link = "mo_base"
battery_low = 0.3
tags = ["yard", "big"]
classes = ["loud"]
odometry = { topic = "/mo/odom", bridge = "hall" }
tf = { namespace = "/mo", bridge = "hall" }
initial_pose = { topic = "/mo/here", bridge = "hall" }

[robots.twist]
topic = "/mo/cmd_vel"
type = "geometry_msgs/TwistStamped"
bridge = "hall"
check_every = "12h"
drive_without_proof = true

[[robots.cameras]]
topic = "/mo/video"
type = "foxglove_msgs/CompressedVideo"

[[robots.buttons]]
label = "Horn"
topic = "/mo/horn"
type = "std_msgs/Bool"
message = { data = true }
form = true
during_stop = true

[[robots.buttons]]
label = "Mode"
service = "/mo/mode"
type = "std_srvs/SetBool"
args = { data = true }
confirm = "Change the mode?"
timeout = 3.0

[[robots.buttons]]
label = "Speed"
parameter = "speed"
node = "/mo/base"
value = 0.5

[robots.move]
action = "/mo/m"
action_type = "move_base_msgs/MoveBaseAction"
bridge = "hall"

[robots.model]
tag = "g"
children = [{ tag = "circle", attributes = { r = "0.5" } }]
"""


class FakePeer:
    """The sessions with a router whose agents send these answers."""

    locator, trouble = "tcp/hall:7447", None

    def listen(self, key, fn, *, gate=False):
        return 0

    def ask(self, key, patience=0.0, most=0):
        return self.answers[key]


@pytest.fixture
def fleet(tmp_path):
    """Return a file with every key of a robot, all behind one bridge."""
    Image.new("RGB", (20, 10)).save(tmp_path / "ann.png")
    file = tmp_path / "fleet.toml"
    lines = [line for line in TEXT.splitlines() if not line.startswith("yard = ")]
    file.write_text("\n".join(lines).replace('"yard"', '"hall"') + MORE)
    return file


def keys(config, path=()):
    """Yield the path of every key, and whether it has a value of its own."""
    for field in msgspec.structs.fields(config):
        value, key = getattr(config, field.name), (*path, field.name)
        if isinstance(value, msgspec.Struct):
            yield from keys(value, key)
        elif isinstance(value, list) and value and isinstance(value[0], msgspec.Struct):
            for each in value:
                yield from keys(each, key)
        else:
            default = field.default
            if field.default_factory is not msgspec.NODEFAULT:
                default = field.default_factory()
            yield key, value != default


def plain(value):
    """Return a value without the address of the bridge, which is another one."""
    if isinstance(value, Bridge):
        return "the bridge"
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    http = ("http://eve:8080", "zenoh://hall/bay3?")
    return "a camera" if isinstance(value, str) and value.startswith(http) else value


def drawn(element):
    data = element_to_dict(element)
    for name in ("data-name", "data-robot", "data-layer-of"):
        data.get("attributes", {}).pop(name, None)
    if data["tag"] in ("title", "text"):  # the agent's name follows that of the robot
        data.pop("children", None)
    inside = [each for each in element.children if isinstance(each, Element)]
    return {**data, "children": [drawn(each) for each in inside]}


def shown(robot):
    """Return what a display makes of a robot."""
    feed = robot.feed
    return {
        "modules": plain(robot.module_arguments()),
        "tf": plain(robot.tf),
        "poses": feed and (feed.topic, feed.type, feed.throttle),
        "alignment": robot.pose_source.own_alignment,
        "base_link": robot.base_link,
        "battery_low": robot.battery_low,
        "tags": robot.tags,
        "drawn": drawn(robot.svg),
    }


def told(robot):
    """Return what the gate is told of a robot."""
    spec = msgspec.to_builtins(robot.motion.spec())
    parts = [part for part in spec.values() if isinstance(part, dict)]
    bridges = {part.pop("bridge", None) for part in parts}
    assert len({spec.pop("odometry_url"), *bridges} - {None}) == 1
    return {key: value for key, value in spec.items() if key not in ("id", "name")}


def test_every_key_has_the_same_effect_directly_and_through_an_agent(
    fleet, monkeypatch
):
    mistakes = Mistakes()
    config = read_fleet(read_text(fleet).data, mistakes)
    given = dict.fromkeys(key for each in config.robots for key, _ in keys(each))
    own = {key for each in config.robots for key, is_own in keys(each) if is_own}
    own |= {key[:-1] for key in given}  # its keys have values
    assert given.keys() - own == set()
    assert {key[0] for key in given} == set(RobotConfig.__struct_fields__)
    direct = make_robots(config, make_bridges(config), fleet.parent, mistakes)
    assert mistakes.found == []

    peer = FakePeer()
    for module in (agent, remote_robots):
        monkeypatch.setattr(module, "peer_of", lambda _, **_limits: peer)
        monkeypatch.setattr(module, "lifecycle", Lifecycle())
    monkeypatch.setattr(RobotMotion, "agent", "bay3")
    held = robots_in_file(fleet)
    beside = [robots[each.id] for each in held.robots()]
    assert list(map(told, beside)) == list(map(told, direct))
    for each in beside:
        each.destroy()

    monkeypatch.setattr(RobotMotion, "agent", "")
    there = agent.Agent("bay3", "zenoh://hall", held)
    there._describe()
    peer.answers = {
        address.about_picture("bay3", n): d for n, d in held.pictures.items()
    }
    here, console = remote_robots.RemoteAgents("zenoh://hall/bay3"), Console()
    known = here._known["bay3"]
    asyncio.run(here._apply(known, there._about, console))
    asyncio.run(here._draw(known))
    for far, near in zip(map(shown, console.robots), map(shown, direct), strict=True):
        for key in near:
            assert (key, far[key]) == (key, near[key])
    for each in (*console.robots, *direct):
        each.destroy()


def test_an_agent_takes_over_a_frame_of_a_robot_that_it_learns_later():
    before = RobotConfig(name="Bob")
    robot = Robot("Bob")
    later = before.with_part("tf", TfConfig(base_frame="chassis", namespace="/bob"))
    mistakes = apply_config(robot, moving_parts(before), moving_parts(later))
    assert (mistakes.found, robot.motion.base_frame) == ([], "bob/chassis")
    robot.destroy()
