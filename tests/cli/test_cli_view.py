"""``webmap view``: robots that are found, given, or appear later."""

import asyncio
import re
import signal
import subprocess
import sys
import threading
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from equipment.waiting import wait_for
from equipment.webmap_process import simulator
from webmap import Bridge
from webmap.console import Console, make_robot
from webmap.core.map import Layer
from webmap.discovery import FoundRobot, Guess, discover
from webmap.discovery.findings import ROLES
from webmap.discovery.newcomers import Newcomers, News
from webmap.fleet.overrides import Overrides, parse_setting
from webmap.fleet.periodic_search import LayerSearch
from webmap.fleet.robot_options import Candidate
from webmap.fleet.search import find_fleet
from webmap.fleet.view_robots import ViewRobots

pytestmark = pytest.mark.slow

COMMAND = [sys.executable, "-m", "webmap", "view"]
READY = r"WebMap is ready at http://127\.0\.0\.1:\d+/\?token=[\w-]{43,}\n"
IMAGE = "sensor_msgs/CompressedImage"
TOPICS = {"/odom": "nav_msgs/Odometry", "/cmd_vel": "geometry_msgs/Twist"}


class View:
    """A running view, and all that it printed on standard error."""

    def __init__(self, process):
        self.process, self.printed = process, ""
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stderr:
            self.printed += line

    def read_all(self):
        """Wait until all output is read, before the pipe is closed."""
        self._reader.join(10)

    def wait_for(self, pattern, seconds=20.0):
        wait_for(
            lambda: re.search(pattern, self.printed),
            lambda: f"{pattern!r} in:\n{self.printed}",
            seconds,
        )


@contextmanager
def viewing(*arguments):
    with subprocess.Popen(
        [*COMMAND, "--port", "0", "--no-browser", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            view = View(process)
            yield view
            process.send_signal(signal.SIGINT)
            assert process.wait(15) == 0
            view.read_all()
            assert process.stdout.read() == "", "only the one line is printed"
        finally:
            process.kill()


def test_view_finds_robots_of_ros_1_and_ros_2(ros1, ros2):
    with viewing(ros1, ros2) as view:
        assert re.fullmatch(READY, view.process.stdout.readline())
        view.wait_for(r"Found robot_0: odometry /robot_0/odom, velocity /robot_0/")
        view.wait_for(r"Found robot_1: ")
        view.wait_for(r"Found robot: odometry /odom, velocity /cmd_vel")


def test_view_with_a_robot_option_discovers_no_other_robots(ros1):
    with viewing(ros1, "--robot", "Bob:/odom:/cmd_vel:/scan") as view:
        assert re.fullmatch(READY, view.process.stdout.readline())
    assert "Found" not in view.printed


def test_a_robot_option_replaces_the_discovered_robot_with_the_same_topics(ros1):
    given = "Bob:/robot_0/odom:/robot_0/cmd_vel:"
    with viewing(ros1, "--discover", "--robot", given) as view:
        assert re.fullmatch(READY, view.process.stdout.readline())
        view.wait_for("Found robot_1")
    assert "Found robot_0" not in view.printed


def test_view_opens_the_page_without_a_bridge_and_robots_appear_later(later_port):
    with viewing(f"ws://127.0.0.1:{later_port}", "--wait", "3") as view:
        assert re.fullmatch(READY, view.process.stdout.readline())
        view.wait_for(r"Waiting for the bridge at ws://127\.0\.0\.1")
        view.wait_for("cannot reach the rosbridge")
        with simulator("--port", str(later_port), "--robots", "1"):
            view.wait_for(r"A robot appeared behind ws://.*: robot_0: odometry", 40)


def test_a_robot_option_replaces_a_robot_of_a_bridge_that_starts_later(
    later_port,
):
    given = ("--discover", "--robot", "Bob:/robot_0/odom:/robot_0/cmd_vel:")
    with viewing(f"ws://127.0.0.1:{later_port}", "--wait", "0.5", *given) as view:
        assert re.fullmatch(READY, view.process.stdout.readline())
        with simulator("--port", str(later_port), "--robots", "2"):
            # Both robots are found at the same look, and reported in order of name.
            view.wait_for(r"A robot appeared behind ws://.*: robot_1: odometry", 40)
    assert "robot_0: odometry" not in view.printed


def test_view_without_rosapi_opens_the_page_and_advises_robot_options():
    from websockets.sync.client import connect

    with simulator("--port", "0", "--dialect", "ros2") as url:
        with connect(url, proxy=None) as other:  # in ROS 2, this call ends rosapi
            other.send('{"op":"call_service","service":"/rosapi/message_details",'
                       '"args":{"type":"nav_msgs/Odometry"}}')  # fmt: skip
        with viewing(url) as view:
            assert re.fullmatch(READY, view.process.stdout.readline())
            view.wait_for(r"the bridge has no rosapi that lists its topics: .*")
            view.wait_for(r"List each robot with --robot NAME:ODOM:CMD_VEL:SCAN")


@pytest.mark.parametrize("sig", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_wait_for_a_bridge_with_exit_code_0(sig):
    with subprocess.Popen(
        [*COMMAND, "ws://127.0.0.1:1", "--no-browser", "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        view = View(process)
        view.wait_for("Waiting for the bridge")
        process.send_signal(sig)
        assert process.wait(15) == 0
        view.read_all()
        assert process.stdout.read() == ""
    assert "Traceback" not in view.printed


@pytest.fixture
def bridge():
    return Bridge("ws://bob:9090")


class FakeMap:
    def __init__(self):
        self.robots, self.modules = [], []

    def add_module(self, *arguments, **options):
        self.modules.append(arguments)
        return SimpleNamespace(layer=Layer())

    def add_robot(self, robot):
        self.robots.append(robot.name)


class FakePage:
    def __init__(self):
        self.maps = [FakeMap()]


def candidate(bridge, name, **topics):
    guesses = {role: (Guess(topic, "", ""),) for role, topic in topics.items()}
    return Candidate(bridge, FoundRobot(name, "", guesses))


def found(name="bob", **more):
    (robot,) = discover(TOPICS | more, name).robots
    return robot


def test_a_new_robot_appears_on_open_pages_and_on_later_pages(bridge):
    console = Console()
    late = ViewRobots(console)
    early = FakePage()
    console.opened(early)
    late.add(Candidate(bridge, found()))
    for topic in ("/map", "/other/map", "/map"):  # the first map appears again
        late.show_news(News(found(**{topic: GRID}), ("map",)), bridge)
    after = FakePage()
    console.opened(after)
    for page in (early, after):
        assert page.maps[0].robots == ["bob"]
        assert page.maps[0].modules == [
            ("OccupancyGrid", bridge, "/map"),
            ("OccupancyGrid", bridge, "/other/map"),
        ]
    late.robots[0].destroy()


def test_a_new_robot_gets_a_unique_name(bridge, capsys):
    given = [candidate(Bridge("ws://al:9090"), "BOB")]
    late = ViewRobots(Console(), Overrides(stops_within=0.25), given=given)
    came = late.show_news
    (robot,) = discover(TOPICS, "bob").robots
    came(News(robot), bridge)
    assert late.robots[0].name == "bob (bob:9090)"
    assert late.robots[0].motion.spec().base.stops_within == 0.25
    printed = capsys.readouterr()
    assert printed.out == ""
    message = "A robot appeared behind ws://bob:9090: bob (bob:9090): odometry /odom"
    assert message in printed.err
    late.robots[0].destroy()


@pytest.mark.parametrize("accepted", [False, True])
def test_driving_without_proof_is_declared_to_the_gate_only_if_asked_for(
    bridge, accepted
):
    late = ViewRobots(Console(), Overrides(drive_without_proof=accepted))
    late.add(Candidate(bridge, found()))
    (made,) = late.robots
    assert made.motion.spec().base.drive_without_proof is accepted
    made.destroy()


def test_a_discovered_robot_gets_its_frames_plan_and_four_cameras(bridge):
    late = ViewRobots(Console())
    more = {"/tf": "tf2_msgs/TFMessage", "/plan": "nav_msgs/Path"}
    more |= {f"/cam{n}/image_raw/compressed": IMAGE for n in range(6)}
    robot = found(**more)
    late.add(Candidate(bridge, robot))
    (made,) = late.robots
    assert made.tf["namespace"] == ""
    assert made.tf["quiet"]
    names = [type(module).__name__ for module in made.modules]
    assert names.count("Path") == 1
    assert names.count("Camera") == 4
    made.destroy()


def test_a_robot_without_odometry_uses_the_amcl_pose(bridge):
    topics = {"/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped"}
    (robot,) = discover(topics, "bob").robots
    assert robot.config(bridge.url).odometry.topic == "/amcl_pose"


def test_a_robot_uses_topics_that_appear_later(bridge, capsys):
    console = Console()
    late = ViewRobots(console, Overrides(stops_within=0.25))
    came = late.show_news
    (bare,) = discover({"/odom": TOPICS["/odom"]}, "bob").robots
    came(News(bare), bridge)
    more = {"/scan": "sensor_msgs/LaserScan", "/tf": "tf2_msgs/TFMessage"}
    more |= {"/battery": "sensor_msgs/BatteryState", "/plan": "nav_msgs/Path"}
    more |= {"/goal_pose": "geometry_msgs/PoseStamped"}
    more |= {"/map": "nav_msgs/OccupancyGrid"}
    whole = found(**more)
    roles = tuple(
        role for role in ROLES if role in whole.guesses and role != "odometry"
    )
    came(News(whole, roles), bridge)
    (robot,) = late.robots
    spec = robot.motion.spec()
    assert (spec.base.topic, spec.navigation.topic) == ("/cmd_vel", "/goal_pose")
    assert spec.base.stops_within == 0.25
    assert robot.tf is not None
    names = {type(module).__name__ for module in robot.modules}
    assert {"LaserScanner", "Battery", "Path"} <= names
    assert list(console.grids) == [(bridge, "/map")]
    assert (
        "bob has new topics: velocity /cmd_vel, scan /scan" in capsys.readouterr().err
    )
    robot.destroy()


def test_cameras_that_appear_later_are_used_up_to_four(bridge, capsys):
    late = ViewRobots(Console(), Overrides(stops_within=0.25))
    came = late.show_news
    newcomers = Newcomers()

    def look(cameras):
        topics = {f"/cam{n}/image_raw/compressed": IMAGE for n in range(cameras)}
        for _ in range(2):
            for news in newcomers.look(discover(TOPICS | topics, "bob")):
                came(news, bridge)

    def names():
        (robot,) = late.robots
        return [m.name for m in robot.modules if type(m).__name__ == "Camera"]

    look(0)
    assert names() == []
    look(1)
    assert names() == ["Camera"]
    look(3)
    assert names() == ["Camera", "Camera 2", "Camera 3"]
    look(3)
    look(6)
    assert names() == ["Camera", "Camera 2", "Camera 3", "Camera 4"]
    lines = capsys.readouterr().err.splitlines()[1:]
    assert lines == [
        "bob has new topics: camera /cam0/image_raw/compressed",
        "bob has new topics: camera /cam1/image_raw/compressed, "
        "camera /cam2/image_raw/compressed",
        "bob has new topics: camera /cam3/image_raw/compressed",
    ]
    late.robots[0].destroy()


def test_new_topics_of_a_robot_that_is_not_shown_are_ignored(bridge, capsys):
    late = ViewRobots(Console())
    late.show_news(News(found(), ("velocity",)), bridge)
    assert late.robots == []
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("given", "is_it"),
    [
        ({"name": "bob"}, True),
        ({"name": "Al", "odometry": "/odom"}, True),
        ({"name": "Al", "velocity": "/cmd_vel"}, True),
        ({"name": "Al", "scan": "/scan"}, False),
    ],
)
def test_a_robot_option_matches_a_found_robot_by_name_odometry_or_velocity(
    bridge, given, is_it
):
    (robot,) = discover(TOPICS, "bob").robots
    found = Candidate(bridge, robot)
    assert candidate(bridge, **given).is_also(found) is is_it
    assert not candidate(Bridge("ws://al:9090"), **given).is_also(found)


STAMPED = "geometry_msgs/msg/TwistStamped"


def fleet_of(bridge, *given, topics, settings=()):
    """Return the fleet of a list of topics, without rosapi."""
    overrides = Overrides([parse_setting(text) for text in settings])
    return find_fleet([bridge], given, wait=0.0, topics=topics, overrides=overrides)


def test_a_robot_from_a_topic_list_is_driven_with_the_listed_velocity_type(bridge):
    fleet = fleet_of(bridge, topics=TOPICS | {"/cmd_vel": STAMPED})
    ((_, found),) = fleet.robots
    robot = make_robot(found.config(bridge.url), [bridge])
    assert robot.motion.spec().twist_type == STAMPED
    robot.destroy()


@pytest.mark.parametrize(
    ("listed", "type"), [(STAMPED, STAMPED), ("std_msgs/String", "")]
)
def test_a_robot_option_gets_the_listed_velocity_type_only_for_twist_types(
    bridge, listed, type
):
    given = candidate(bridge, "Al", velocity="al/go")
    fleet = fleet_of(bridge, given, topics=TOPICS | {"/al/go": listed})
    assert fleet.given[0].found.type_of("velocity") == type
    assert ("/go  " + type in fleet.table(grid=True, only_given=True)) == bool(type)


@pytest.mark.parametrize(
    ("urls", "shown"),
    [
        (("ws://bob:9090", "foxglove://bob:8765"), ["bob"]),
        (("foxglove://bob", "ws://bob:9090"), ["bob"]),
        (("ws://bob:9090", "foxglove://al"), ["bob", "al"]),
        (("ws://bob:9090", "ws://bob:9091"), ["bob (bob:9090)", "bob (bob:9091)"]),
    ],
)
def test_a_robot_with_a_rosbridge_and_a_foxglove_bridge_is_shown_once(
    capsys, urls, shown
):
    bridges = [Bridge(url) for url in urls]
    fleet = find_fleet(bridges, [], wait=0.0, topics=TOPICS)
    assert [robot.found.name for robot in fleet.robots] == shown
    said = f"{bridges[1].url} leads to the same robots as {bridges[0].url}: they are"
    assert (said in capsys.readouterr().err) == (len(shown) == 1)
    assert list(fleet.behind) == bridges[: len(shown)]


def test_a_velocity_topic_from_a_setting_gets_its_type_from_the_topic_list(bridge):
    topics = TOPICS | {"/cmd_vel_nav": STAMPED}
    settings = ["bob.velocity=/cmd_vel_nav"]
    fleet = fleet_of(bridge, topics=topics, settings=settings)
    ((_, found),) = fleet.robots
    velocity = found.first("velocity")
    assert (velocity.topic, velocity.type) == ("/cmd_vel_nav", STAMPED)


def test_a_velocity_topic_that_appears_later_is_used_with_its_type(bridge):
    late = ViewRobots(Console(), Overrides(stops_within=0.25))
    came = late.show_news
    (bare,) = discover({"/odom": TOPICS["/odom"]}, "bob").robots
    came(News(bare), bridge)
    came(News(found(**{"/cmd_vel": STAMPED}), ("velocity",)), bridge)
    assert late.robots[0].motion.spec().twist_type == STAMPED
    late.robots[0].destroy()


def test_topics_that_appear_later_do_not_change_the_velocity_topic(bridge):
    settings = [parse_setting("bob.velocity=/cmd_vel_nav")]
    topics = TOPICS | {"/cmd_vel_nav": STAMPED}
    fleet = fleet_of(bridge, topics=topics, settings=["bob.velocity=/cmd_vel_nav"])
    late = ViewRobots(Console(), Overrides(settings))
    late.add(fleet.robots[0])
    (robot,) = late.robots
    twist = robot.motion.config.twist
    assert twist.type == STAMPED
    whole = found(**{"/battery": "sensor_msgs/BatteryState"})
    late.show_news(News(whole, ("battery",)), bridge)
    assert robot.motion.config.twist is twist
    assert "Battery" in [type(module).__name__ for module in robot.modules]
    robot.destroy()


SCAN, GRID, PATH = "sensor_msgs/LaserScan", "nav_msgs/OccupancyGrid", "nav_msgs/Path"
RICH = {
    "/a/odom": "nav_msgs/Odometry",
    "/a/front/scan": SCAN,
    "/a/rear/scan": SCAN,
    "/map": GRID,
    "/a/map": GRID,
    "/a/plan": PATH,
    "/a/trajectory": PATH,
    "/a/move_base/current_goal": "geometry_msgs/PoseStamped",
}


def drawing_of(bridge, topics, *settings):
    """Draw the layers found for one robot; return the robot, the console and layers."""
    console = Console()
    overrides = Overrides([parse_setting(text) for text in settings])
    late = ViewRobots(console, overrides)
    (found_,) = overrides.findings(bridge.url, discover(topics, "bob")).robots
    late.add(Candidate(bridge, found_))
    layers = LayerSearch(bridge, late)
    asyncio.run(layers.take(topics))
    return late.robots[0], console, layers


def topics_of(robot, name):
    return [m.topic for m in robot.modules if type(m).__name__ == name]


def test_all_scans_maps_and_paths_are_drawn_once(bridge):
    robot, console, layers = drawing_of(bridge, RICH)
    assert topics_of(robot, "LaserScanner") == ["/a/front/scan", "/a/rear/scan"]
    scans = [m for m in robot.modules if type(m).__name__ == "LaserScanner"]
    classes = [list(scan.svg.classes) for scan in scans]
    assert classes == [["laserscan"], ["laserscan", "scan-2"]]
    assert sorted(topics_of(robot, "Path")) == ["/a/plan", "/a/trajectory"]
    assert topics_of(robot, "PoseStamped") == ["/a/move_base/current_goal"]
    own = [m for m in robot.modules if type(m).__name__ == "OnMaps"]
    assert [(m.module, m._arguments[0][1]) for m in own] == [
        ("OccupancyGrid", "/a/map")
    ]
    assert list(console.grids) == [(bridge, "/map")]
    asyncio.run(layers.take(RICH | {"/a/third": SCAN}))
    assert topics_of(robot, "LaserScanner")[2:] == ["/a/third"], (
        "the topic appeared later"
    )
    robot.destroy()


def test_settings_replace_scan_and_map_and_keep_the_paths(bridge):
    robot, console, _ = drawing_of(bridge, RICH, "a.scan=/a/other", "a.map=")
    assert topics_of(robot, "LaserScanner") == ["/a/other"]
    assert sorted(topics_of(robot, "Path")) == ["/a/plan", "/a/trajectory"]
    assert console.grids == {}
    robot.destroy()


def test_each_camera_above_the_limit_is_reported_once(bridge, capsys):
    def cameras(count):
        return {f"/a/cam{n}/image_raw/compressed": IMAGE for n in range(count)}

    def reports():
        return [line for line in capsys.readouterr().err.splitlines() if "cam" in line]

    robot, _, layers = drawing_of(bridge, RICH | cameras(6))
    (line,) = reports()
    assert line == (
        "a: not drawn, beyond the limit for their kind: "
        "/a/cam4/image_raw/compressed, /a/cam5/image_raw/compressed"
    )
    asyncio.run(layers.take(RICH | cameras(6)))
    assert reports() == []
    asyncio.run(layers.take(RICH | cameras(7)))
    assert reports() == [
        "a: not drawn, beyond the limit for their kind: /a/cam6/image_raw/compressed"
    ], "the topic appeared later"
    robot.destroy()


def test_cameras_within_the_limit_are_not_reported_as_left_out(bridge, capsys):
    cameras = {f"/a/cam{n}/image_raw/compressed": IMAGE for n in range(4)}
    robot, _, _ = drawing_of(bridge, RICH | cameras)
    assert "cam" not in capsys.readouterr().err
    robot.destroy()


def test_paths_above_the_limit_are_reported_once(bridge, capsys):
    many = RICH | {f"/a/path_{number}": PATH for number in range(9)}
    robot, _, layers = drawing_of(bridge, many)
    asyncio.run(layers.take(many))
    assert len(topics_of(robot, "Path")) == 6
    lines = [line for line in capsys.readouterr().err.splitlines() if "limit" in line]
    assert len(lines) == 1
    assert "a: not drawn, beyond the limit for their kind: /a/path_5" in lines[0]
    robot.destroy()
