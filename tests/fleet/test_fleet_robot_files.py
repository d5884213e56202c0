"""Which files and addresses of an agent's robots a display receives and opens."""

import inspect

import msgspec
import pytest
from PIL import Image

from webmap.agents.remote_camera import RemoteCamera
from webmap.base.errors import ConfigError, WireError
from webmap.config.robot import PictureConfig, RobotConfig
from webmap.core.registry import map_modules, robot_modules
from webmap.fleet import robot_files as passed
from webmap.fleet.agent_robots import robots_in_file
from webmap.fleet.robot_files import (
    LARGEST,
    OPENING,
    button_actions,
    check_parameters,
    config_for_displays,
    config_from_agent,
    is_picture_name,
)

AGENT = "zenoh://hall/bay3"
URL = "http://me:secret@cam:8080/stream?token=x"

HEAD = """
[bridges]
forklift = "ws://forklift:9090"

"""
ROBOT = """
[[robots]]
name = "Forklift"
odometry = "/odom"
"""
PICTURE = """
[robots.picture]
file = "FILE"
width = 1.0
height = 0.5
"""
SVG = b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 2 1"/>'


@pytest.fixture
def read(tmp_path):
    Image.new("RGB", (20, 10)).save(tmp_path / "bob.PNG")
    Image.new("1", (5000, 4000)).save(tmp_path / "wide.png")
    Image.new("RGB", (20, 10)).save(tmp_path / "bob.tiff")
    (tmp_path / "bob.tiff").rename(tmp_path / "tiff.png")
    (tmp_path / "bob.svg").write_bytes(SVG)
    (tmp_path / "long.svg").write_bytes(SVG + bytes(LARGEST))
    (tmp_path / "entity.svg").write_bytes(b'<!DOCTYPE a [<!ENTITY b "c">]>' + SVG)
    (tmp_path / "text.png").write_text("not a picture")

    def read_(text):
        file = tmp_path / "bay3.toml"
        file.write_text(text)
        return robots_in_file(file)

    return read_


@pytest.mark.parametrize("name", ["bob.PNG", "bob.svg"])
def test_an_agent_has_the_pictures_of_its_robots_by_names_without_paths(read, name):
    held = read(HEAD + ROBOT + PICTURE.replace("FILE", name))
    (robot,) = held.robots()
    served = robot.config.picture.file
    assert is_picture_name(served)
    assert served.endswith(name[-4:].lower())
    assert config_for_displays(robot.config).picture == robot.config.picture
    shown, picture = config_from_agent(robot.config, AGENT, robot.id, {"forklift"})
    assert (shown.picture, picture) == (None, robot.config.picture)
    data, media_type = passed.picture_from_agent(served, held.pictures[served])
    assert data == held.pictures[served]
    assert media_type.startswith("image/")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("none.png", "there is no file"),
        ("text.png", "got another format"),
        ("tiff.png", "got another format"),
        ("wide.png", "5000 x 4000 pixels; expected 16000000 at"),
        ("long.svg", f"passes on pictures of {LARGEST} at the most"),
        ("entity.svg", "has entities"),
    ],
)
def test_a_picture_that_a_display_would_not_show_is_refused_by_the_agent(
    read, name, words
):
    with pytest.raises(
        ConfigError, match=r"bay3.toml:11: robots\[0\].picture.file"
    ) as e:
        read(HEAD + ROBOT + PICTURE.replace("FILE", name))
    assert words in str(e.value)


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("0" * 32 + ".png", b"<svg onload='x'/>"),
        ("0" * 32 + ".svg", b"<html></html>"),
        ("0" * 32 + ".svg", b'<!DOCTYPE a [<!ENTITY b "c">]>' + SVG),
        ("0" * 32 + ".svg", SVG + bytes(LARGEST)),
        ("0" * 32 + ".jpeg", b""),
    ],
)
def test_a_display_checks_the_picture_that_an_agent_gives(name, data):
    assert is_picture_name(name)
    with pytest.raises(ConfigError):
        passed.picture_from_agent(name, data)


@pytest.mark.parametrize(
    ("head", "robot", "words"),
    [
        ('floor = "floor.yaml"\n', "", "floor: an agent does not pass it on"),
        ('labels = "labels.yaml"\n', "", "labels: an agent does not pass it on"),
        (
            "",
            "\n[[image]]\nfile = 'a.png'\nx = 0\ny = 0\nwidth = 1\nheight = 1\n",
            "image: an agent does not pass it on",
        ),
        (
            "",
            "\n[[modules]]\nname = 'MapFile'\nargs = ['floor.yaml']\n",
            "modules: an agent does not pass it on: a display's own fleet file has it",
        ),
        (
            "",
            f"\n[[robots.modules]]\nname = 'HttpCamera'\nargs = ['{URL}']\n",
            'modules[0]: an agent passes on the cameras of "cameras"',
        ),
        (
            "",
            "\n[[robots.modules]]\nname = 'OnMaps'\nargs = ['MapFile', 'floor.yaml']\n",
            "modules[0]: displays open no file and no address of an agent",
        ),
        (
            "",
            "\n[robots.model]\ntag = 'g'\n"
            "children = [{tag = 'image', attributes = {href = 'a.png'}}]\n",
            'model: an agent passes on no images of a model; use "picture"',
        ),
    ],
)
def test_what_an_agent_does_not_pass_on_is_a_mistake_in_its_file(
    read, head, robot, words
):
    with pytest.raises(ConfigError) as error:
        read(head + HEAD + ROBOT + robot)
    assert words in str(error.value)


def test_displays_get_the_address_of_a_camera_without_secrets():
    given = {"name": "Bob", "cameras": [URL, {"topic": "/cam"}]}
    config = config_for_displays(RobotConfig.from_dict(given))
    assert [(each.url, each.topic, each.name) for each in config.cameras] == [
        ("http://cam:8080/stream", "", "Camera 1"),
        ("", "/cam", "Camera 2"),
    ]
    assert "secret" not in str(config.to_dict())
    assert "token" not in str(config.to_dict())


def test_a_display_takes_the_cameras_of_an_agent_through_the_agent():
    given = {"name": "Bob", "bridge": "b", "cameras": [URL, "/cam"]}
    config, _ = config_from_agent(RobotConfig.from_dict(given), AGENT, "r1", {"b"})
    http, topic = config.cameras
    assert RemoteCamera.parse(http.url)[:3] == (AGENT, "r1", "Camera 1")
    assert topic.topic == "/cam"


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"bridge": "ws://elsewhere"}, "is not the rosbridge of the agent"),
        (
            {"odometry": {"topic": "/odom", "bridge": "ws://elsewhere"}},
            "is not the rosbridge of the agent",
        ),
        ({"modules": [{"name": "HttpCamera", "args": [URL]}]}, "does not open"),
        ({"modules": [{"name": "OnMaps", "args": ["MapFile", "/a"]}]}, "does not open"),
        (
            {"modules": [{"name": "OnMaps", "options": {"module": "Labels"}}]},
            "does not open",
        ),
        (
            {"picture": {"file": "/etc/a.png", "width": 1, "height": 1}},
            "is not a picture of the agent",
        ),
        (
            {"picture": {"file": "0" * 32 + ".css", "width": 1, "height": 1}},
            "is not a picture of the agent",
        ),
    ],
)
def test_a_display_opens_nothing_that_an_agent_names(more, words):
    config = RobotConfig.from_dict({"name": "Bob", "bridge": "b", **more})
    with pytest.raises(ConfigError, match=words):
        config_from_agent(config, AGENT, "r1", {"b"})


def test_every_module_that_is_given_a_file_or_an_address_is_known():
    names = ("file", "path", "folder", "source", "address", "url", "iri")
    found = {
        module.__name__
        for module in (*robot_modules, *map_modules)
        if not inspect.signature(module).parameters.keys().isdisjoint(names)
    }
    assert found == set(OPENING)


def test_a_picture_and_its_place_on_the_robot_are_kept():
    picture = PictureConfig(file="0" * 32 + ".svg", width=1, height=2, x=0.5, angle=90)
    config = RobotConfig(name="Bob", bridge="b", picture=picture)
    given = RobotConfig.from_dict(
        msgspec.json.decode(msgspec.json.encode(config.to_dict()))
    )
    assert (
        config_from_agent(config_for_displays(given), AGENT, "r1", {"b"})[1] == picture
    )


BUTTONS = [
    {"label": "Dock", "service": "eve/dock"},
    {"label": "Lamp", "topic": "eve/lamp", "message": {}, "type": "std_msgs/Empty"},
    {"label": "Slow", "node": "eve/base", "parameter": "v_max", "value": 0.2},
    {"label": "Old", "parameter": "/eve/v_max", "value": 0.2},
]
ROS2 = "/eve/base/set_parameters"


@pytest.mark.parametrize(
    "config",
    [
        {"buttons": BUTTONS},
        {"modules": [{"name": "Buttons", "args": [{"bridge": "b"}, BUTTONS]}]},
        {
            "modules": [
                {
                    "name": "Buttons",
                    "args": [{"bridge": "b"}],
                    "options": {"buttons": BUTTONS},
                }
            ]
        },
    ],
)
def test_displays_may_write_what_any_button_of_the_agent_writes(config):
    found = button_actions(
        RobotConfig.from_dict({"name": "Eve", "bridge": "b", **config})
    )
    assert [each.get("topic") or each["service"] for each in found] == [
        "/eve/dock",
        "/eve/lamp",
        ROS2,
        "/rosapi/set_param",
    ]
    v_max, other = {"name": "v_max", "value": {}}, {"name": "other", "value": {}}
    check_parameters("/eve/dock", {"any": 1}, found)
    check_parameters(ROS2, {"parameters": [v_max]}, found)
    check_parameters("/rosapi/set_param", {"name": "/eve/v_max", "value": "0"}, found)
    for service, args in (
        (ROS2, {"parameters": [v_max, other]}),
        (ROS2, [[v_max]]),
        (ROS2, None),
        ("/rosapi/set_param", {"name": "/eve/other", "value": "0"}),
        ("/rosapi/set_param", {"name": "/eve/other", "parameters": [v_max]}),
    ):
        with pytest.raises(WireError, match="has no button for this parameter"):
            check_parameters(service, args, found)
