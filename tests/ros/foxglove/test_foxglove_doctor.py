"""The diagnosis of a Foxglove bridge, and what the commands print about it."""

import asyncio
import socket

import foxglove
import pytest

from equipment.command_line import run_inside
from equipment.foxglove_server import live, old_server, sdk_server
from webmap.discovery.doctor import judge
from webmap.discovery.doctor.measure import observe, tried
from webmap.ros.foxglove import advice
from webmap.ros.rosbridge.advice import client_writes, type_not_certain
from webmap.ros.rosbridge.checks import LinkFacts

FEEDBACK = "int16 number_of_recoveries\nfloat32 distance_remaining\n"


def texts(seen):
    return {finding.text: finding for finding in judge(seen)}


@pytest.mark.parametrize("kind", ["sdk", "old"])
def test_a_robot_behind_a_foxglove_bridge_is_examined(kind):
    async def examine(server):
        living = asyncio.ensure_future(live(server))
        try:
            seen = await observe(server.url, seconds=2.0)
            return await tried(seen)
        finally:
            living.cancel()

    async def scenario():
        if kind == "sdk":
            with sdk_server() as server:
                return await examine(server)
        async with old_server() as server:
            return await examine(server)

    seen = asyncio.run(scenario())
    found = texts(seen)
    assert "The bridge lists its topics; robots found: robot." in found
    assert "Both clocks agree." in found
    assert any(text.startswith("A ping takes") for text in found)
    assert any("/odom" in text and "in the frame odom" in text for text in found)
    assert seen.measured["/map"].count
    assert seen.measured["/camera/image/compressed"].count
    assert any("can offer no service" in text for text in found)
    assert "The Foxglove bridge listens on this machine alone." in found
    options = [finding.advice for finding in found.values() if finding.advice]
    assert any("include_hidden:=true" in each for each in options) == (kind == "sdk")
    assert not any(finding.level == "wrong" for finding in found.values())
    assert not any("rosbridge" in text or "rosapi" in text for text in found)


def test_an_action_of_nav2_is_found_where_the_bridge_offers_it():
    async def scenario():
        with sdk_server() as server:
            feedback = foxglove.Channel(
                "/navigate_to_pose/_action/feedback",
                message_encoding="cdr",
                schema=foxglove.Schema(
                    name="nav2_msgs/action/NavigateToPose_FeedbackMessage",
                    encoding="ros2msg",
                    data=FEEDBACK.encode(),
                ),
                context=server.context,
            )
            seen = await observe(server.url, seconds=1.0)
            feedback.close()
            return seen

    seen = asyncio.run(asyncio.wait_for(scenario(), 60))
    (robot,) = seen.findings.robots
    assert robot.action == ("/navigate_to_pose", "nav2_msgs/action/NavigateToPose")
    assert not any("offers no action" in text for text in texts(seen))


def test_a_foxglove_bridge_that_is_not_there():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        url = f"foxglove://127.0.0.1:{free.getsockname()[1]}"
    (finding,) = judge(asyncio.run(observe(url)))
    assert finding.level == "wrong"
    assert finding.text.startswith("The Foxglove bridge cannot be reached: ")
    assert "foxglove_bridge" in finding.advice


@pytest.mark.parametrize(
    ("facts", "url", "level", "part"),
    [
        (LinkFacts("127.0.0.1"), "foxglove://127.0.0.1", "note", "cannot see whether"),
        (
            LinkFacts("127.0.0.1", ("0.0.0.0",)),
            "foxglove://127.0.0.1",
            "warning",
            "listens at 0.0.0.0",
        ),
        (LinkFacts("192.0.2.7"), "foxglove://robot", "warning", "read and change"),
        (LinkFacts("192.0.2.7"), "foxgloves://robot", "note", "is encrypted"),
    ],
)
def test_who_reaches_a_foxglove_bridge(facts, url, level, part):
    finding = next(advice.findings(facts, url))
    assert finding.level == level
    assert part in finding.text


def test_findings_about_velocity_name_no_rosbridge():
    writes = client_writes("Bob", "/cmd_vel", ["/foxglove_bridge"])
    assert "A client of a bridge (/foxglove_bridge) writes to /cmd_vel" in writes.text
    uncertain = type_not_certain("Bob", "/cmd_vel", "Twist")
    assert "The bridge names the type Twist for /cmd_vel" in uncertain.text
    assert "ros" not in uncertain.text


def test_webmap_discover_lists_the_robot():
    with sdk_server() as server:
        done = run_inside("discover", server.url)
    assert done.returncode == 0, done.stderr
    assert "ROS 2, 1 robot" in done.stdout
    assert "/battery_state" in done.stdout
