"""The cameras of a robot in a fleet file."""

import pytest

from webmap.base.errors import ConfigError
from webmap.discovery import discover
from webmap.discovery.fleet_toml import fleet_toml
from webmap.fleet.fleet_file import prepare

HEAD = '[bridges]\nhall = "ws://hall:9090"\n\n[[robots]]\nname = "Bob"\n'


@pytest.fixture
def read(tmp_path):
    """Read a file with these cameras in line 6; return the cameras of the robot."""
    robots = []

    def read_(cameras: str) -> list:
        file = tmp_path / "fleet.toml"
        file.write_text(f"{HEAD}cameras = {cameras}\n")
        robots.extend(prepare(file).robots)
        modules = robots[-1].modules
        return [module for module in modules if hasattr(module, "watch")]

    yield read_
    for robot in robots:
        robot.destroy()


def test_a_camera_needs_only_a_topic_or_a_url(read):
    (camera,) = read('"/front/image_raw/compressed"')
    assert (camera.name, camera.topic) == ("Camera", "/front/image_raw/compressed")
    (camera,) = read('"http://bob:8080/stream?topic=/front"')
    assert (camera.name, camera.address) == ("Camera", "http://bob:8080/stream")


def test_several_cameras_get_different_names(read):
    cameras = read(
        '["/front", {url = "https://bob/rear", name = "Rear", throttle = 500}, '
        '{topic = "/arm"}]'
    )
    kinds = [(type(camera).__name__, camera.name) for camera in cameras]
    assert kinds == [
        ("Camera", "Camera 1"),
        ("HttpCamera", "Rear"),
        ("Camera", "Camera 3"),
    ]


@pytest.mark.parametrize(
    ("cameras", "expected"),
    [
        ('"rtsp://bob/stream"', 'cameras: got the text "rtsp://bob/stream", expected'),
        ('"front camera"', 'cameras: got the text "front camera", expected a topic'),
        ("7", "cameras: got the whole number 7, expected a topic"),
        ("[7]", "cameras[0]: got the whole number 7"),
        ("{}", 'cameras: a camera has either a "topic" or a "url"'),
        (
            '{topic = "/a", url = "http://bob/"}',
            'cameras: a camera has either a "topic" or a "url"',
        ),
        ('{url = "bob"}', 'cameras.url: got the text "bob", expected the address'),
        (
            '{topic = "/a", throtle = 5}',
            'cameras.throtle: there is no key "throtle" here; did you mean "throttle"?',
        ),
        (
            '{topic = "/a/ffmpeg", throttle = 5}',
            "cameras.throttle: a video has no throttle",
        ),
        (
            '{url = "http://bob/", type = "sensor_msgs/Image"}',
            'cameras.type: only a camera with a "topic" has a type',
        ),
        ('{topic = "/a", type = "std_msgs/Bool"}', "expected one of the types"),
        ('{topic = "/a", throttle = -5}', "expected a whole number of milliseconds"),
        (
            '[{topic = "/a", name = "Arm"}, {topic = "/b", name = "arm"}]',
            'cameras[1]: a second camera is called "arm"',
        ),
    ],
)
def test_an_invalid_camera_is_reported_with_its_line(read, cameras, expected):
    with pytest.raises(ConfigError) as refused:
        read(cameras)
    (line,) = str(refused.value).splitlines()
    assert "fleet.toml:6: robots[0]." in line
    assert expected in line


def test_discovered_cameras_in_a_fleet_file_get_different_names(tmp_path):
    image = "sensor_msgs/msg/CompressedImage"
    topics = {f"/cam{n}/image_raw/compressed": image for n in (1, 2)}
    findings = discover({"/odom": "nav_msgs/msg/Odometry"} | topics, "bob")
    file = tmp_path / "fleet.toml"
    file.write_text(fleet_toml([("hall", "ws://hall:9090", findings)]))
    (robot,) = prepare(file).robots
    cameras = [module for module in robot.modules if hasattr(module, "watch")]
    assert {camera.name: camera.topic for camera in cameras} == {
        "Camera 1": "/cam1/image_raw/compressed",
        "Camera 2": "/cam2/image_raw/compressed",
    }
    robot.destroy()


def test_a_video_is_known_by_its_type_or_by_the_name_of_its_topic(read):
    cameras = read(
        '["/front/image_raw/ffmpeg", "/rear/image_raw/foxglove", '
        '{topic = "/arm", type = "foxglove_msgs/msg/CompressedVideo"}, '
        '{topic = "/x/ffmpeg", type = "sensor_msgs/Image"}]'
    )
    kinds = [(type(camera).__name__, camera.type) for camera in cameras]
    assert kinds == [
        ("VideoCamera", "ffmpeg_image_transport_msgs/FFMPEGPacket"),
        ("VideoCamera", "foxglove_msgs/CompressedVideo"),
        ("VideoCamera", "foxglove_msgs/CompressedVideo"),
        ("Camera", "sensor_msgs/Image"),
    ]


def test_discovered_videos_in_a_fleet_file_are_videos(tmp_path):
    topics = {
        "/odom": "nav_msgs/msg/Odometry",
        "/cam/image_raw/compressed": "sensor_msgs/msg/CompressedImage",
        "/cam/image_raw/ffmpeg": "ffmpeg_image_transport_msgs/msg/FFMPEGPacket",
        "/dash": "foxglove_msgs/msg/CompressedVideo",
    }
    file = tmp_path / "fleet.toml"
    file.write_text(fleet_toml([("hall", "ws://hall:9090", discover(topics, "bob"))]))
    (robot,) = prepare(file).robots
    cameras = [module for module in robot.modules if hasattr(module, "watch")]
    kinds = {camera.topic: type(camera).__name__ for camera in cameras}
    assert kinds == {
        "/cam/image_raw/compressed": "Camera",
        "/cam/image_raw/ffmpeg": "VideoCamera",
        "/dash": "VideoCamera",
    }
    robot.destroy()
