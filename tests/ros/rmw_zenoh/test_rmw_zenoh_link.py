"""A bridge to robots with rmw_zenoh, over a real router."""

import asyncio
import contextlib
import logging

import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores

pytest.importorskip("zenoh")

from equipment.command_line import run_inside
from equipment.rmw_zenoh_robot import TOPICS, VELOCITY, Robot, rmw_zenoh_robot, router
from equipment.waiting import until
from webmap import Bridge
from webmap import Robot as ShownRobot
from webmap.bags.record import record_to
from webmap.base.errors import BridgeClosed, BridgeError, ConfigError, ServiceError
from webmap.console import make_robot
from webmap.discovery import discover
from webmap.discovery.doctor import judge
from webmap.discovery.doctor.measure import observe
from webmap.fleet.overrides import Overrides
from webmap.ros.limits import MAX_FRAME
from webmap.ros.messages import LaserScanMsg, OccupancyGridMsg, OdometryMsg
from webmap.ros.rmw_zenoh import link as links
from webmap.ros.temporary_bridge import TemporaryBridge, ask_topics

pytestmark = pytest.mark.slow

LOGGER = "webmap.ros"


def run(scenario):
    asyncio.run(asyncio.wait_for(scenario(), 90))


@contextlib.asynccontextmanager
async def watched(port, path=""):
    """Open a bridge to a router on this computer; it keeps its errors."""
    errors = []
    bridge = TemporaryBridge(f"zenoh-ros2://127.0.0.1:{port}{path}")
    bridge.on_error(lambda error: errors.append(str(error)))
    bridge.errors = errors
    async with bridge:
        await bridge.open()
        yield bridge


def send_odometry(robot, attachment=None):
    """Publish one message; return None."""
    robot.publish("/odom", robot.robot.odometry(), attachment)


async def until_listed(robot):
    """Wait until the router knows the tokens of a robot."""
    async with TemporaryBridge(f"{robot.url}/{robot.domain}") as bridge:
        topics = {}
        for _ in range(100):
            topics = await bridge.topics()
            if VELOCITY[0] in topics:
                return topics
    raise AssertionError(f"only {topics} are listed")


@pytest.mark.parametrize("path", ["/x", "/1/2", "/233", "/-1"])
def test_an_address_with_another_domain_is_refused(path):
    with pytest.raises(ConfigError, match="a number from 0 to 232"):
        Bridge(f"zenoh-ros2://robot:7447{path}")


def test_the_default_port_is_that_of_a_router():
    assert Bridge("Zenoh-ROS2://Robot:7447/").url == "zenoh-ros2://robot"


def test_pose_scan_map_and_frames_of_a_robot():
    async def scenario():
        with router() as port, rmw_zenoh_robot(port) as robot:
            async with watched(port) as bridge:
                shown, scans, grids, frames = ShownRobot("Bob"), [], [], []
                shown.set_odometry_topic(bridge, "/odom")
                bridge.subscribe("/scan", scans.append, decode=LaserScanMsg)
                bridge.subscribe("/map", grids.append, decode=OccupancyGridMsg)
                bridge.subscribe("/tf", frames.append, "tf2_msgs/TFMessage")
                robot.robot.speed = 0.5
                for _ in range(500):
                    robot.live()
                    await asyncio.sleep(0.02)
                    if scans and grids and frames and shown.pose.x > 0:
                        break
                assert shown.pose.x > 0
                assert scans[0].ranges[0] == 2.0
                assert grids[0].info.width == 200
                assert frames[0]["transforms"][0]["child_frame_id"] == "base_link"
                assert (
                    abs(await bridge.time() - robot.robot.header("")["stamp"].sec) < 5
                )
                assert await bridge.publishers("/odom") == ["/robot"]
                assert await bridge.subscribers("/cmd_vel") == ["/robot"]
                assert bridge.last_heard is not None
                assert not bridge.errors
                shown.destroy()

    run(scenario)


def test_topics_without_an_open_connection():
    async def scenario():
        with router() as port, rmw_zenoh_robot(port) as robot:
            expected = {topic: type for topic, (type, *_) in TOPICS.items()}
            expected |= dict([VELOCITY])
            topics = await until_listed(robot)
            assert {n: t.replace("/msg", "") for n, t in topics.items()} == expected
            assert await ask_topics(robot.url, wait=5.0) == topics

    run(scenario)


def test_every_message_that_a_latched_topic_has_kept_arrives():
    async def scenario():
        frames = {"/tf_static": ("tf2_msgs/TFMessage", Robot.frames, True)}
        with (
            router() as port,
            rmw_zenoh_robot(port, topics=frames),
            rmw_zenoh_robot(port, topics=frames),
        ):
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/tf_static", got.append, "tf2_msgs/TFMessage")
                await until(lambda: len(got) == 2)
                with rmw_zenoh_robot(port, topics=frames):  # a late one
                    await until(lambda: len(got) == 3)

    run(scenario)


def test_kept_messages_of_a_publisher_that_is_announced_late_arrive():
    """Subscribers come first, as after a restart of the router."""

    async def scenario():
        with router() as port, rmw_zenoh_robot(port, topics={}) as robot:
            topic, type = "/tf_static", "tf2_msgs/TFMessage"
            robot.undeclare(robot.add(topic, type, latched=True))
            robot.publish(topic, robot.robot.frames())
            robot.announce("MS", topic, type)
            async with watched(port) as bridge:
                got = []
                bridge.subscribe(topic, got.append, type)
                await until(lambda: bridge._graph.known(topic))
                await asyncio.sleep(0.5)
                assert not got
                robot.announce("MP", topic, type, latched=True)
                await until(lambda: got)

    run(scenario)


def test_nothing_is_published_or_called_and_the_robot_cannot_be_driven(caplog):
    async def scenario():
        with router() as port, rmw_zenoh_robot(port) as robot:
            tokens = []
            robot.session.liveliness().declare_subscriber("**", tokens.append)
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/odom", got.append)
                await until(lambda: robot.live() or got)
                with pytest.raises(BridgeError, match="WebMap only reads zenoh-ros2"):
                    bridge.publish("/hello", {"data": "hi"}, "std_msgs/String")
                bridge.unadvertise("/hello")
                with pytest.raises(ServiceError, match="WebMap only reads zenoh-ros2"):
                    await bridge.call_service("/dock", type="std_srvs/Trigger")
                with pytest.raises(ServiceError, match="cannot be set"):
                    await bridge.set_parameter("gain", 1)
                (found,) = discover(await bridge.topics(), "loft").robots
                config = Overrides().config(bridge.url, found)
                assert "no gate can move robots behind" in caplog.text
                one = make_robot(config, [bridge])
                assert one.motion.spec() is None
                with pytest.raises(ConfigError, match="can only be watched"):
                    one.set_twist_topic(bridge, "/cmd_vel")
                one.destroy()
            assert not tokens  # WebMap announces no node and no subscription

    run(scenario)


def test_another_domain_is_named_where_there_is_no_node():
    async def scenario():
        with router() as port, rmw_zenoh_robot(port, domain=42) as robot:
            await until_listed(robot)
            async with TemporaryBridge(robot.url) as bridge:
                with pytest.raises(BridgeClosed, match="in the domain 0, but in 42"):
                    await bridge.topics()
                with pytest.raises(
                    BridgeClosed, match="add the robot's domain at the end"
                ):
                    await bridge.open()
                assert "in the domain 0, but in 42" in bridge.trouble
            async with watched(port, "/42") as bridge:
                await until(lambda: bridge._graph.known("/odom"))

    run(scenario)


def test_robots_in_two_domains_of_one_router_are_read():
    async def scenario():
        with (
            router() as port,
            rmw_zenoh_robot(port) as robot,
            rmw_zenoh_robot(port, domain=42) as other,
        ):
            expected = await until_listed(robot)
            assert await until_listed(other) == expected
            for path in ("", "/42") * 5:
                url = f"zenoh-ros2://127.0.0.1:{port}{path}"
                assert await ask_topics(url, wait=5.0) == expected

    run(scenario)


def test_types_that_cannot_be_read_are_refused_once_in_words(caplog):
    async def scenario():
        strange = "RIHS01_" + "ab" * 32
        with router() as port, rmw_zenoh_robot(port) as robot:
            robot.add("/imu", "sensor_msgs/Imu")
            robot.add("/mine", "my_msgs/Dock", hash=strange)
            robot.add("/other", "nav_msgs/Odometry", hash=strange)
            robot.add("/humble", "nav_msgs/Odometry", hash="TypeHashNotSupported")
            async with watched(port) as bridge:
                refused, got, odometry = ["/imu", "/mine", "/other", "/humble"], [], []
                for topic in refused:
                    bridge.subscribe(topic, got.append)
                    bridge.subscribe(topic, got.append)
                bridge.subscribe("/odom", odometry.append)

                def send():
                    robot.live()
                    for topic in refused:
                        robot.publish(topic, robot.robot.odometry())

                await until(lambda: send() or (odometry and len(bridge.errors) >= 4))
                before = len(odometry)
                await until(lambda: send() or len(odometry) > before + 3)
                assert not got
                text = "\n".join(bridge.errors)
                assert "/imu: expected" in text
                assert "the definition of sensor_msgs/Imu is not included" in text
                assert "my_msgs/Dock is not included" in text
                assert f"the hash is {strange}, expected RIHS01_3cc97dc7" in text
                assert "like rmw_zenoh of ROS 2 Humble" in text
                assert len(bridge.errors) == 4
                lines = [
                    r for r in caplog.records if "cannot be used" in r.getMessage()
                ]
                assert len(lines) == 4

    run(scenario)


def test_a_readable_publisher_is_read_beside_one_that_is_refused():
    async def scenario():
        with router() as port, rmw_zenoh_robot(port, topics={}) as robot:
            robot.announce("MP", "/odom", "nav_msgs/Odometry", hash="x", node="old")
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/odom", got.append, decode=OdometryMsg)
                await until(lambda: bridge._graph.known("/odom"))
                robot.add("/odom", "nav_msgs/Odometry")
                await until(lambda: send_odometry(robot) or got)
                assert await bridge.publishers("/odom") == ["/old", "/robot"]

    run(scenario)


@pytest.mark.parametrize(
    ("store", "why"), [(Stores.ROS2_JAZZY, ""), (Stores.ROS2_KILTED, "older rmw_zenoh")]
)
def test_a_robot_of_an_earlier_release(store, why):
    """Equal definitions are read; the attachment of an old rmw_zenoh is refused."""

    async def scenario():
        with router() as port, rmw_zenoh_robot(port, store=store) as robot:
            old = b"sequence_number" + bytes(8) + b"source_timestamp" + bytes(24)
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/odom", got.append, decode=OdometryMsg)
                form = old if why else None
                await until(lambda: send_odometry(robot, form) or got or bridge.errors)
                assert bool(got) == (not why)
                assert why in "".join(bridge.errors)
                if why:
                    frames = bridge.stats.frames
                    await until(
                        lambda: (
                            send_odometry(robot, form)
                            or bridge.stats.frames > frames + 2
                        )
                    )
                    assert len(bridge.errors) == 1
                    await until(lambda: robot.live() or got)  # others are read

    run(scenario)


def test_short_long_and_odd_messages_are_reported_and_the_next_ones_are_read():
    async def scenario():
        with router() as port, rmw_zenoh_robot(port) as robot:
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/odom", got.append, "nav_msgs/Odometry")
                await until(lambda: robot.live() or got)
                good = robot.robot.odometry()
                for data in (b"", good[:50], b"\0\7" + good[2:], good + good):
                    robot.publish("/odom", data)
                await until(lambda: bridge.errors)
                # rmw_zenoh drops messages while a connection is busy.
                large = bytes(5 << 20)
                await until(
                    lambda: robot.publish("/odom", large) or len(bridge.errors) >= 2
                )
                before = len(got)
                await until(lambda: robot.live() or len(got) > before)
                assert all("/odom" in each for each in bridge.errors)
                assert any("5.0 MiB" in each for each in bridge.errors)

    run(scenario)


def test_a_message_that_is_too_long_is_refused_by_its_size():
    async def scenario():
        with router() as port, rmw_zenoh_robot(port) as robot:
            robot.add("/huge", "nav_msgs/OccupancyGrid", all=True)
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/huge", got.append, "nav_msgs/OccupancyGrid")
                grid = robot.robot.map()
                await until(lambda: robot.publish("/huge", grid) or got)
                await asyncio.to_thread(robot.publish, "/huge", bytes(MAX_FRAME + 1))
                await until(lambda: bridge.errors)
                assert "coarser map" in bridge.errors[0]

    run(scenario)


def test_lying_tokens_disturb_nobody():
    async def scenario():
        with router() as port, rmw_zenoh_robot(port) as robot:
            for key in ("@ros2_lv/0/nonsense", "@ros2_lv/0/a/0/1/MP/%/%/n/%o/t/h/q"):
                robot.declare(key)
            twice = robot.announce("MP", "/odom", "sensor_msgs/LaserScan", node="liar")
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/odom", got.append, "nav_msgs/Odometry")
                await until(lambda: robot.live() or (got and len(bridge.errors) == 2))
                assert all("which no rmw_zenoh makes" in e for e in bridge.errors)
                robot.undeclare(twice)

    run(scenario)


def test_a_thousand_tokens_are_listed_while_others_are_read():
    async def scenario():
        with router() as port, rmw_zenoh_robot(port) as robot:
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/odom", got.append, "nav_msgs/Odometry")
                for i in range(1000):
                    robot.announce("MP", f"/x{i}", "my_msgs/T", hash="h")
                await until(
                    lambda: robot.live() or (got and bridge._graph.known("/x999"))
                )
                assert len(await bridge.topics()) == 1000 + len(TOPICS) + 1

    run(scenario)


def test_a_flood_of_one_topic_delays_no_other(monkeypatch):
    monkeypatch.setattr(links, "MOST_WAITING", 50)

    async def scenario():
        with router() as port, rmw_zenoh_robot(port) as robot:
            robot.add("/flood", "std_msgs/String")
            async with watched(port) as bridge:
                flood, got = [], []
                bridge.subscribe("/flood", flood.append, "std_msgs/String")
                bridge.subscribe("/odom", got.append, "nav_msgs/Odometry")
                await until(lambda: robot.live() or got)
                text = robot.robot.data("std_msgs/String", data="x" * 100)

                def pour():
                    for _ in range(3000):
                        robot.publish("/flood", text)

                pouring = asyncio.create_task(asyncio.to_thread(pour))
                before = len(got)
                await until(lambda: robot.live() or len(got) > before + 3)
                await pouring
                pour_here = 0
                while not any("faster than they are read" in e for e in bridge.errors):
                    pour()  # in the model's thread: nothing is read meanwhile
                    await asyncio.sleep(0.1)
                    pour_here += 1
                    assert pour_here < 20
                last = robot.robot.data("std_msgs/String", data="last")
                robot.publish("/flood", last)
                await until(lambda: flood[-1]["data"] == "last")

    run(scenario)


def test_the_router_vanishes_and_returns(caplog):
    async def scenario():
        got, closed = [], []
        with router() as port, rmw_zenoh_robot(port) as robot:
            bridge = TemporaryBridge(f"zenoh-ros2://127.0.0.1:{port}")
            await bridge.open()
            bridge.on_close(closed.append)
            bridge.subscribe("/odom", got.append, "nav_msgs/Odometry")
            await until(lambda: robot.live() or got)
        await until(lambda: closed)
        assert bridge.lost
        assert "the Zenoh router closed it" in bridge.trouble
        await until(lambda: "refused" in (bridge.trouble or ""))
        with router(port), rmw_zenoh_robot(port) as robot:
            await until(lambda: bridge.state == "open")
            got.clear()
            await until(lambda: robot.live() or got)
            assert bridge.stats.links == 2
            await bridge.stop()
            assert bridge.state == "closed"

    with caplog.at_level(logging.INFO, LOGGER):
        run(scenario)
    warned = [r for r in caplog.records if "cannot reach" in r.getMessage()]
    assert sum(record.levelno == logging.WARNING for record in warned) == 1


def test_a_robot_that_restarts_is_read_again():
    async def scenario():
        with router() as port:
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/odom", got.append, "nav_msgs/Odometry")
                for _ in range(2):
                    got.clear()
                    with rmw_zenoh_robot(port) as robot:
                        await until(lambda: robot.live() or got)
                    await until(lambda: bridge._graph.known("/odom") is None)

    run(scenario)


def test_a_publisher_that_returns_with_another_definition_is_read():
    async def scenario():
        with router() as port:
            async with watched(port) as bridge:
                got = []
                bridge.subscribe("/odom", got.append, decode=OdometryMsg)
                with rmw_zenoh_robot(port, topics={}) as robot:
                    robot.add("/odom", "nav_msgs/Odometry", hash="RIHS01_old")
                    await until(lambda: send_odometry(robot) or bridge.errors)
                    assert "the hash is RIHS01_old" in bridge.errors[0]
                assert not got
                with rmw_zenoh_robot(port) as robot:
                    await until(lambda: robot.live() or got)

    run(scenario)


def test_what_is_no_router_is_named():
    async def scenario():
        server = await asyncio.start_server(lambda _, w: w.close(), "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        async with server, TemporaryBridge(f"zenoh-ros2://127.0.0.1:{port}") as bridge:
            with pytest.raises(BridgeClosed, match="not a Zenoh router"):
                await bridge.topics()
        async with TemporaryBridge(f"zenoh-ros2://127.0.0.1:{port}") as bridge:
            with pytest.raises(BridgeClosed, match="refused") as refused:
                await bridge.open()
            assert "zenoh-ros2://127.0.0.1" in str(refused.value)

    run(scenario)


def test_the_bag_has_the_bytes_that_the_robot_sent(tmp_path):
    async def scenario():
        sent = {}
        with router() as port, rmw_zenoh_robot(port) as robot:
            url = f"zenoh-ros2://127.0.0.1:{port}"
            recording = asyncio.ensure_future(
                record_to(
                    url, tmp_path / "bag", only=[], stated=None, wait=9, duration=8.0
                )
            )
            await asyncio.sleep(3)
            for topic, (_, make, latched) in TOPICS.items():
                if not latched:
                    sent[topic] = make(robot.robot)
                    robot.publish(topic, sent[topic])
            assert not await recording
        return sent

    sent = asyncio.run(scenario())
    with AnyReader([tmp_path / "bag"]) as bag:
        found = {link.topic: bytes(data) for link, _, data in bag.messages()}
    assert "/map" in found
    assert {topic: found[topic] for topic in sent} == sent


def test_an_agent_for_a_robot_that_is_only_read_is_refused():
    url = "zenoh-ros2://127.0.0.1:1"
    router = ("--router", "tcp/127.0.0.1:2", "--name", "bay3", "--wait", "0")
    done = run_inside("agent", url, *router)
    assert done.returncode != 0
    assert f"got {url}, expected the address of a rosbridge" in done.stderr


def test_the_doctor_examines_the_topics_and_states_that_nothing_is_driven():
    async def scenario():
        with router() as port, rmw_zenoh_robot(port) as robot:

            async def live():
                while True:
                    robot.live()
                    await asyncio.sleep(0.05)

            living = asyncio.ensure_future(live())
            await asyncio.sleep(0.5)
            try:
                return await observe(f"zenoh-ros2://127.0.0.1:{port}", seconds=2.0)
            finally:
                living.cancel()

    found = {finding.text: finding for finding in judge(asyncio.run(scenario()))}
    text = "\n".join(found)
    assert "/odom" in text
    watched = "The robots behind this kind of bridge can be watched and not driven."
    assert watched in found
    assert not any("No node publishes" in each for each in found)
    assert "takes" not in text
    wrong = [each for each, finding in found.items() if finding.level == "wrong"]
    assert wrong == [watched]
