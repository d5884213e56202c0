"""The specified behaviour of a robot: chapter 5.3 of the seed."""

import asyncio
import contextlib
import math
import subprocess
import sys
import zlib

import pytest

from webmap import Robot, svg
from webmap.base.errors import ConfigError, MotionError
from webmap.base.scope import Removal, Scope
from webmap.core.runtime import goal_message, twist_message
from webmap.gate.protocol import SentGoal, SentTwist
from webmap.poses import odometry
from webmap.ros import messages


class Listening(Removal):
    """A subscription whose rate makes no difference."""

    def set_pace(self, throttle, unwatched):
        pass


class Link:
    """A bridge that is open at once and whose messages the test publishes."""

    url = "ws://test:9090"
    state = "open"
    lag = 0.0

    def __init__(self, **types: str) -> None:
        self.types = {f"/{topic}": type for topic, type in types.items()}
        self.subscribed: list[tuple] = []
        self.protected: dict[str, str] = {}

    def on_open(self, fn):
        with contextlib.suppress(RuntimeError):
            asyncio.get_running_loop().call_soon(fn)
        return Removal(lambda: None)

    async def topic_type(self, topic):
        return self.types.get(topic)

    def subscribe(self, topic, callback, type=None, *, throttle=0, decode=None, **kw):
        entry = (topic, callback, type, throttle, decode)
        self.subscribed.append(entry)
        return Listening(lambda: self.subscribed.remove(entry))

    def protect(self, topic, carries):
        self.protected[topic] = carries

    def publish(self, topic, message):
        for name, callback, _, _, decode in tuple(self.subscribed):
            if name == topic:
                if decode is not None:
                    import msgspec

                    callback(msgspec.convert(message, decode, strict=False))
                else:
                    callback(message)


async def settle():
    for _ in range(5):
        await asyncio.sleep(0)


def pose(x=1.0, y=2.0, yaw=math.pi / 2, **more):
    q = {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
    return {"position": {"x": x, "y": y, "z": 0.0}, "orientation": q, **more}


HEADER = {"seq": 1, "stamp": {"secs": 0, "nsecs": 0}, "frame_id": "map"}
ZERO = {"x": 0.0, "y": 0.0, "z": 0.0}
SHAPES = {
    "geometry_msgs/Pose": pose(),
    "geometry_msgs/PoseStamped": {"header": HEADER, "pose": pose()},
    "geometry_msgs/PoseWithCovarianceStamped": {
        "header": HEADER,
        "pose": {"pose": pose(), "covariance": [0.0] * 36},
    },
    "geometry_msgs/Pose2D": {"x": 1.0, "y": 2.0, "theta": math.pi / 2},
    "nav_msgs/Odometry": {
        "header": HEADER,
        "child_frame_id": "base_link",
        "pose": {"pose": pose(), "covariance": [0.0] * 36},
        "twist": {"twist": {"linear": {**ZERO, "x": 0.5}, "angular": ZERO}},
    },
}


@pytest.mark.parametrize("known", ["rosapi knows the type", "only the shape tells"])
@pytest.mark.parametrize("type_name", SHAPES)
def test_a_robot_takes_its_pose_from_each_pose_type(type_name, known):
    async def scenario():
        link = Link(odom=type_name) if known.startswith("rosapi") else Link()
        robot = Robot("Bob")
        robot.set_odometry_topic(link, "/odom", throttle=50)
        await settle()
        link.publish("/odom", SHAPES[type_name])
        assert robot.valid
        assert (robot.position.x, robot.position.y) == (1.0, 2.0)
        assert robot.angle == pytest.approx(90.0)
        pose = (robot.position.x, robot.position.y, robot.yaw)
        assert (robot.pose.x, robot.pose.y, robot.pose.yaw) == pose
        assert robot.yaw == pytest.approx(math.pi / 2)
        (topic, _, asked, throttle, _) = link.subscribed[0]
        assert (topic, asked, throttle) == ("/odom", type_name, 50)
        assert len(link.subscribed) == 1
        robot.destroy()
        assert link.subscribed == []

    asyncio.run(scenario())


def test_a_ros_2_type_name_is_decoded_as_the_same_type():
    async def scenario():
        link = Link(odom="nav_msgs/msg/Odometry")
        robot = Robot("Bob")
        robot.set_odometry_topic(link, "/odom")
        await settle()
        assert link.subscribed[0][4] is messages.OdometryMsg

    asyncio.run(scenario())


def odometry_in_spec(robot: Robot) -> tuple[str | None, str | None]:
    """Return topic and type of the odometry in the robot's declaration to the gate."""
    spec = robot.motion.spec()
    return spec.odometry_topic, spec.odometry_type


@pytest.mark.parametrize("type", [None, "nav_msgs/Odometry"])
def test_the_gate_gets_an_odometry_topic_before_its_first_message(type):
    async def scenario():
        link = Link()
        robot = Robot("Bob")
        robot.set_move_topic(link, "/goal")
        robot.set_odometry_topic(link, "/odom", type=type)
        await settle()
        assert odometry_in_spec(robot) == ("/odom", type)
        robot.unsubscribe_odometry_topic()
        assert odometry_in_spec(robot) == (None, None)
        robot.destroy()

    asyncio.run(scenario())


def test_a_pose_topic_without_velocity_is_not_given_to_the_gate_as_odometry():
    async def scenario():
        link = Link(pose="geometry_msgs/PoseStamped")
        robot = Robot("Bob")
        robot.set_move_topic(link, "/goal")
        robot.set_odometry_topic(link, "/pose")
        assert odometry_in_spec(robot) == ("/pose", None)
        await settle()
        assert odometry_in_spec(robot) == (None, None)
        robot.destroy()

    asyncio.run(scenario())


def test_a_topic_without_a_pose_is_not_given_to_the_gate_as_odometry():
    async def scenario():
        known, unknown = Link(odom="std_msgs/String"), Link()
        for link in (known, unknown):
            robot = Robot("Bob")
            robot.set_move_topic(link, "/goal")
            robot.set_odometry_topic(link, "/odom")
            await settle()
            link.publish("/odom", {"data": "hello"})
            assert odometry_in_spec(robot) == (None, None)
            robot.destroy()

    asyncio.run(scenario())


def test_a_refused_topic_is_not_given_to_the_gate_as_odometry():
    robot = Robot("Bob")
    robot.set_move_topic(Link(), "/goal")
    with pytest.raises(ConfigError):
        robot.set_odometry_topic(Link(), "/odom", type="std_msgs/String")
    assert odometry_in_spec(robot) == (None, None)
    robot.destroy()


def test_rosapi_gives_the_type_of_a_pose_topic_before_its_first_message(
    monkeypatch,
):
    monkeypatch.setattr(odometry, "SOON", 0.01)

    async def scenario():
        link = Link()
        robot = Robot("Bob")
        robot.set_move_topic(link, "/goal")
        robot.set_odometry_topic(link, "/pose")
        await settle()
        assert odometry_in_spec(robot) == ("/pose", None)
        link.types["/pose"] = "geometry_msgs/PoseStamped"
        while odometry_in_spec(robot) != (None, None):
            await asyncio.sleep(0.01)
        (topic, _, type, _, _) = link.subscribed[0]
        assert (len(link.subscribed), topic, type) == (1, "/pose", link.types["/pose"])
        robot.destroy()
        assert link.subscribed == []

    asyncio.run(scenario())


def test_odometry_with_invalid_poses_is_still_given_to_the_gate():
    async def scenario():
        link = Link(odom="nav_msgs/Odometry")
        robot = Robot("Bob")
        robot.set_move_topic(link, "/goal")
        robot.set_odometry_topic(link, "/odom")
        await settle()
        nowhere = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}
        bad = {**pose(), "orientation": nowhere}
        link.publish("/odom", {**SHAPES["nav_msgs/Odometry"], "pose": {"pose": bad}})
        assert not robot.valid
        assert odometry_in_spec(robot) == ("/odom", "nav_msgs/Odometry")
        robot.destroy()

    asyncio.run(scenario())


def test_an_odometry_topic_of_a_wrong_type_is_reported_as_a_problem():
    async def scenario():
        link = Link(odom="std_msgs/String")
        robot = Robot("Bob")
        robot.set_odometry_topic(link, "/odom")
        await settle()
        assert "std_msgs/String" in robot.problems["odometry"]
        assert "these types have one: nav_msgs/Odometry" in robot.problems["odometry"]
        assert link.subscribed == []

    asyncio.run(scenario())


def test_an_odometry_message_without_a_pose_is_reported_as_a_problem():
    async def scenario():
        link = Link()
        robot = Robot("Bob")
        robot.set_odometry_topic(link, "/odom")
        await settle()
        link.publish("/odom", {"data": "hello"})
        assert (
            "with the fields data has no pose of a robot" in robot.problems["odometry"]
        )
        assert not robot.valid

    asyncio.run(scenario())


def test_an_odometry_type_without_a_pose_is_refused_at_once():
    with pytest.raises(ConfigError, match="one of the types nav_msgs/Odometry"):
        Robot("Bob").set_odometry_topic(Link(), "/odom", type="std_msgs/String")


def test_a_robot_has_the_orientation_of_its_odometry():
    link = Link()
    robot = Robot("Bob")
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/Pose")
    q = {"x": 0.5, "y": -0.5, "z": 0.5, "w": 0.5}
    link.publish("/odom", {**pose(), "orientation": q})
    o = robot.orientation
    assert (o.x, o.y, o.z, o.w) == (0.5, -0.5, 0.5, 0.5)


def test_a_robot_keeps_its_last_position_after_unsubscribing_odometry():
    link = Link()
    robot = Robot("Bob")
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/Pose")
    link.publish("/odom", pose())
    robot.unsubscribe_odometry_topic()
    link.publish("/odom", pose(x=3.0))
    assert (robot.position.x, robot.position.y) == (1.0, 2.0)
    assert link.subscribed == []
    robot.unsubscribe_odometry_topic()


def test_on_odometry_update_fires_only_when_the_pose_changes():
    seen = []

    class Listener:
        def __init__(self, robot) -> None:
            pass

        def on_odometry_update(self):
            seen.append(1)

    link = Link()
    robot = Robot("Bob")
    robot.add_module(Listener)
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/Pose")
    link.publish("/odom", pose())
    link.publish("/odom", pose())
    link.publish("/odom", pose(x=3.0))
    assert len(seen) == 2


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e300])
def test_an_invalid_pose_is_ignored_and_reported_as_a_problem(bad):
    link = Link()
    robot = Robot("Bob")
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/Pose")
    link.publish("/odom", pose())
    link.publish("/odom", pose(x=bad))
    zeros = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}
    link.publish("/odom", {**pose(), "orientation": zeros})
    assert (robot.position.x, robot.position.y) == (1.0, 2.0)
    assert "ignored" in robot.problems["odometry"]
    link.publish("/odom", pose(x=3.0))
    assert not robot.problems


def test_a_robot_without_a_pose_has_the_class_unplaced():
    link = Link()
    robot = Robot("Bob")
    assert "unplaced" in robot.svg.classes
    assert robot.pose_age is None
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/Pose")
    link.publish("/odom", pose())
    assert "unplaced" not in robot.svg.classes
    assert robot.pose_age < 10


def test_the_svg_group_of_a_robot_contains_its_name_its_id_and_its_model():
    model = svg.circle(r=0.2)
    robot = Robot("<Bob>", model)
    assert robot.svg.get("data-name") == "<Bob>"
    assert robot.svg.get("data-robot") == robot.id
    assert "robot" in robot.svg.classes
    assert [child.tag for child in robot.svg.children] == ["title", "circle"]
    assert robot.svg.children[0].text == "<Bob>"


def test_a_velocity_before_the_start_of_webmap_is_refused():
    robot = Robot("Bob")
    robot.set_twist_topic(Link(), "/cmd_vel")
    with pytest.raises(MotionError, match="cannot be moved before"):
        robot.twist(1.0)


def test_velocity_and_goal_topics_are_protected_on_the_bridge():
    link = Link()
    robot = Robot("Bob")

    async def scenario():
        robot.set_twist_topic(link, "/cmd_vel")
        robot.set_move_topic(link, "/goal", cancel_topic="/cancel")

    asyncio.run(scenario())
    assert set(link.protected) == {"/cmd_vel", "/goal", "/cancel"}


def test_a_velocity_topic_of_a_wrong_type_is_refused():
    with pytest.raises(ConfigError, match="one of the types geometry_msgs/Twist"):
        Robot("Bob").set_twist_topic(Link(), "/cmd_vel", type="std_msgs/String")


def test_the_spec_for_the_gate_contains_the_topics_and_limits_of_a_robot():
    async def scenario():
        link = Link(cmd_vel="geometry_msgs/msg/TwistStamped")
        robot = Robot("Bob")
        robot.set_twist_topic(link, "/cmd_vel", stops_within=0.25, v_max=1.0)
        robot.set_move_topic(link, "/goal")
        await settle()
        spec = robot.motion.spec()
        assert spec.twist_type == "geometry_msgs/msg/TwistStamped"
        assert (spec.base.stops_within, spec.base.v_max, spec.base.w_max) == (
            0.25,
            1.0,
            None,
        )
        assert (spec.navigation.topic, spec.goal_frame) == ("/goal", "map")
        robot.unadvertise_twist_topic()
        assert robot.motion.spec().twist is None
        robot.unadvertise_move_topic()
        assert robot.motion.spec() is None

    asyncio.run(scenario())


def test_send_triggers_receive_the_messages_that_the_gate_published():
    seen = []

    class Listener:
        def __init__(self, robot) -> None:
            pass

        def on_send_twist(self, message):
            seen.append(message)

        def on_send_move(self, message):
            seen.append(message["position"]["y"])

    robot = Robot("Bob")
    robot.add_module(Listener)
    sent = SentTwist(robot.id, 1, 2, 6, "c1", vz=3, wx=4, wy=5)
    robot.on_written("twist", twist_message(sent))
    robot.on_written("move", goal_message(SentGoal(robot.id, 1, 2, 3, "c1")))
    linear, angular = {"x": 1, "y": 2, "z": 3}, {"x": 4, "y": 5, "z": 6}
    assert seen == [{"linear": linear, "angular": angular}, 2]


def test_a_robot_made_for_a_page_is_closed_with_the_page():
    link = Link()
    scope = Scope()
    with scope.active():
        robot = Robot("Bob")
        robot.set_odometry_topic(link, "/odom", type="geometry_msgs/Pose")
    assert len(link.subscribed) == 1
    scope.close()
    assert link.subscribed == []


def test_a_topic_set_for_a_shared_robot_is_kept_after_its_page_is_closed():
    link = Link()
    robot = Robot("Bob")
    with Scope().active() as scope:
        robot.set_odometry_topic(link, "/odom", type="geometry_msgs/Pose")
    scope.close()
    assert len(link.subscribed) == 1


def test_a_robot_is_restored_from_plain_data():
    link = Link()

    async def scenario():
        robot = Robot("Bob", svg.g(svg.circle(r=0.2, fill="red")))
        robot.svg.classes.add("big")
        robot.set_odometry_topic(link, "/odom", 50, type="nav_msgs/Odometry")
        robot.set_twist_topic(link, "/cmd_vel", stops_within=0.25)
        robot.set_move_topic(link, "/goal")
        data = robot.to_dict()
        again = Robot.from_dict(data, {link.url: link})
        assert again.to_dict() == data
        assert data["classes"] == ["big"]
        assert data["twist"]["stops_within"] == 0.25
        assert data["model"]["children"][0]["attributes"]["fill"] == "red"

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ({}, 'the key "name" is missing'),
        (
            {"name": "Bob", "odom": {}},
            'there is no key "odom" here; did you mean "odometry"',
        ),
        (
            {"name": "Bob", "odometry": {"bridge": "ws://x"}},
            'odometry: the key "topic" is missing',
        ),
        (
            {"name": "Bob", "modules": [{"name": 3}]},
            "name: got the whole number 3, expected a text",
        ),
        ({"name": "Bob", "model": {"r": 1}}, "with a tag"),
    ],
)
def test_invalid_plain_data_of_a_robot_are_refused_with_the_reason(data, expected):
    with pytest.raises(ConfigError, match=expected):
        Robot.from_dict(data)


def test_scan_assist_is_in_the_spec_for_the_gate_only_while_set():
    link = Link()
    robot = Robot("Bob")
    robot.set_twist_topic(link, "/cmd_vel", type="geometry_msgs/Twist")
    assert robot.motion.spec().scan_assist is None
    robot.set_scan_assist("scan", 0.3, x=0.1, angle=90)
    received = robot.motion.spec().scan_assist
    assert received.topic == "/scan"
    assert received.sensor == pytest.approx((0.1, 0.0, math.pi / 2))
    assert all(math.hypot(x, y) >= 0.3 for x, y in received.corners)
    with pytest.raises(ConfigError, match="3 corners of its outline or more"):
        robot.set_scan_assist("scan", [(0, 0), (1, 0)])
    robot.clear_scan_assist()
    assert robot.motion.spec().scan_assist is None


def test_the_id_of_a_robot_does_not_depend_on_other_robots():
    program = "import sys, webmap; print(*(webmap.Robot(n).id for n in sys.argv[1:]))"

    def ids(*names):
        command = [sys.executable, "-c", program, *names]
        process = subprocess.run(command, capture_output=True, text=True, check=True)
        return dict(zip(names, process.stdout.split(), strict=True))

    before, after = ids("Bob", "Ann"), ids("Cid", "Ann", "Bob")
    assert before == {name: after[name] for name in before}
    assert len(set(after.values())) == 3


def test_the_id_of_a_robot_does_not_depend_on_a_name_with_the_same_checksum():
    names = ("plumless", "buckeroo")
    assert zlib.crc32(names[0].encode()) == zlib.crc32(names[1].encode())
    first = [Robot(name) for name in names]
    assert not any("-" in robot.id for robot in first)
    assert first[0].id != first[1].id


def test_two_robots_of_the_same_name_have_different_ids():
    one, other = Robot("Twin"), Robot("Twin")
    assert one.id != other.id
