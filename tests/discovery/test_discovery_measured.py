"""Each finding of the readiness check is measured, on a system with that fault."""

import asyncio
import re
from pathlib import Path

import pytest
from faulty_site import site
from websockets.asyncio.server import serve

from equipment.waiting import until
from webmap.discovery.doctor import BridgeFacts, judge, measure
from webmap.discovery.doctor.measure import observe, tried
from webmap.discovery.doctor.samples import ENOUGH
from webmap.ros.rosbridge.checks import LinkFacts, look

# Rates and ages are measured.
pytestmark = [pytest.mark.slow, pytest.mark.serial]

SECONDS = 0.4
LONG = 2.0
"""A time in which a short stop of the machine changes a rate only a little."""

DIALECTS = pytest.mark.parametrize("dialect", ["ros1", "ros2"])


def looked_at(system, look=None, *, seconds=SECONDS, **options):
    """Observe a system; return the system, the findings and the observations."""

    async def run():
        async with system as there:
            if look is not None:
                look(there)
            seen = await observe(there.url, seconds=seconds, **options)
            await until(lambda: not there.server.sessions)
            return there, judge(seen), seen

    return asyncio.run(run())


def level_of(findings, words):
    """The level of the only finding with this text."""
    (found,) = [each for each in findings if words in each.text]
    if found.level in ("wrong", "warning"):
        assert found.advice, "the finding has no advice"
    return found.level


@DIALECTS
def test_a_good_robot_has_no_warnings_and_the_check_publishes_nothing(dialect):
    progress = []
    there, findings, _ = looked_at(
        site(dialect), seconds=LONG, progress=progress.append
    )
    assert {each.level for each in findings} == {"good", "note"}, findings
    assert there.graph.advertised == [], "the check advertised a topic"
    assert not {"/rosapi/get_param_names", "/rosapi/message_details"} & {
        *there.called
    }, "these calls end rosapi or make it hang"
    assert all(name.startswith("/rosapi/") for name in there.called)
    assert progress[0].startswith("Requesting")
    assert progress[-2] == f"Listening for {LONG:g} s."
    assert progress[-1] == "Listening for a few pictures, maps and plans."


@DIALECTS
def test_every_displayed_topic_is_measured_with_only_a_few_messages(dialect):
    _, findings, seen = looked_at(site(dialect))
    camera = "/robot_0/camera/image_raw/compressed"
    assert level_of(findings, f"{camera}: ") == "good"
    assert level_of(findings, "/map: 1 message, ") == "good"
    words = r"No message was received on /robot_0/plan in \d+ s; messages may"
    (plan,) = [each for each in findings if re.match(words, each.text)]
    assert plan.level == "note"
    assert seen.measured[camera].count <= ENOUGH
    assert seen.measured[camera].every > 0


def test_a_map_above_the_message_limit_is_a_warning_that_names_the_parameter():
    _, findings, seen = looked_at(site("ros2", limit=8000))
    assert seen.link.too_large["/map"] > 8000
    (found,) = [each for each in findings if each.text.startswith("/map comes")]
    assert found.level == "warning"
    assert "larger than max_message_size of the bridge" in found.text
    assert "parameter max_message_size of rosbridge_websocket to" in found.advice


def test_a_map_received_neither_in_cbor_nor_in_json_is_silent_and_names_the_limit(
    monkeypatch,
):
    monkeypatch.setattr(measure, "AS_TEXT", 0.3)

    def mute(name, message):
        return None if name == "/map" else message

    _, findings, seen = looked_at(site("ros2", change=mute))
    assert not seen.link.too_large
    (found,) = [
        each for each in findings if "No message was received on /map" in each.text
    ]
    assert "max_message_size" in found.advice


def test_a_silent_camera_is_a_warning_about_driving_with_the_camera():
    def change(name, message):
        return None if name.endswith("/compressed") else message

    _, findings, _ = looked_at(site("ros1", change=change))
    words = "can publish it, so driving with this camera stops"
    assert level_of(findings, words) == "warning"


@pytest.mark.parametrize(
    ("dialect", "twist"), [("ros1", "Twist"), ("ros2", "TwistStamped")]
)
def test_the_check_reports_the_velocity_type_that_the_base_subscribes_to(
    dialect, twist
):
    _, findings, _ = looked_at(site(dialect, twist=twist))
    assert level_of(findings, f"/robot_0/cmd_vel has the type {twist}, and") == "good"


@pytest.mark.skipif(
    not Path("/proc/net/tcp").exists(), reason="only Linux has this file"
)
def test_the_check_finds_the_listening_address_of_a_local_bridge():
    _, findings, seen = looked_at(site())
    assert seen.link.listens == ("127.0.0.1",)
    assert level_of(findings, "listens on this machine alone") == "good"


@DIALECTS
def test_another_node_that_publishes_velocities_is_named(dialect):
    def joystick(there):
        there.graph.advertise(
            object(), "/robot_0/cmd_vel", "geometry_msgs/Twist", node="/joy_teleop"
        )

    _, findings, _ = looked_at(site(dialect), joystick)
    assert (
        level_of(findings, "Other nodes publish to /robot_0/cmd_vel too: /joy_teleop")
        == "warning"
    )


@DIALECTS
@pytest.mark.parametrize(
    ("ahead", "words"),
    [(4.0, "4.0 s ahead of this"), (-7.0, "7.0 s behind this")],
)
def test_a_clock_difference_is_reported_and_does_not_change_ages(dialect, ahead, words):
    _, findings, seen = looked_at(site(dialect, ahead=ahead), seconds=LONG)
    assert level_of(findings, words) == "warning"
    assert level_of(findings, "/robot_0/odom:") == "good"
    assert seen.clock.ahead == pytest.approx(ahead, abs=0.2)


@DIALECTS
def test_old_stamps_are_reported_as_old_messages(dialect):
    first = []

    def stuck(name, message):
        if name == "/robot_0/odom":
            first.append(message["header"]["stamp"])
            old = dict(first[0])
            key = "sec" if "sec" in old else "secs"
            old[key] -= 5
            message = {**message, "header": {**message["header"], "stamp": old}}
        return message

    _, findings, _ = looked_at(site(dialect, change=stuck))
    assert level_of(findings, "s old when they arrive") == "warning"


@DIALECTS
def test_a_silent_topic_is_reported_with_its_publisher_node(dialect):
    def mute(name, message):
        return None if name in ("/robot_0/odom", "/robot_0/base_scan") else message

    _, findings, _ = looked_at(site(dialect, change=mute))
    assert level_of(findings, "No message was received on /robot_0/odom") == "wrong"
    assert (
        level_of(findings, "No message was received on /robot_0/base_scan") == "warning"
    )
    for topic in ("odom", "base_scan"):
        words = rf"No message was received on /robot_0/{topic} in \d+ s, "
        words += "although /robots can publish"
        assert any(re.match(words, each.text) for each in findings)


def without(*children):
    """Drop the transforms of some frames."""

    def change(name, message):
        if name not in ("/tf", "/tf_static"):
            return message
        kept = [
            each
            for each in message["transforms"]
            if each["child_frame_id"].rpartition("/")[2] not in children
        ]
        return {"transforms": kept}

    return change


@DIALECTS
@pytest.mark.parametrize(
    ("lost", "level", "words"),
    [
        ("odom", "note", "drawn in the frame robot_0/odom, at the pose from odometry"),
        ("base_link", "note", "no transform from robot_0/odom to robot_0/base_link"),
        ("base_laser", "warning", "The pose of the scanner on the robot is unknown"),
    ],
)
def test_each_missing_frame_is_reported(dialect, lost, level, words):
    _, findings, _ = looked_at(site(dialect, change=without(lost)))
    assert level_of(findings, words) == level


@DIALECTS
def test_complete_frames_are_good(dialect):
    _, findings, _ = looked_at(site(dialect))
    assert level_of(findings, "Frames lead from map to robot_0/odom (/tf:") == "good"
    assert level_of(
        findings, "Frames lead further from robot_0/odom to robot_0/base_link"
    ) == ("good")


def apart(name, message):
    """Put the robot's own map into a world frame, as several ROS 1 robots have it."""
    if name != "/tf":
        return message
    own = [
        {**each, "header": {**each["header"], "frame_id": "robot_0/map"}}
        if each["header"]["frame_id"] == "map"
        else each
        for each in message["transforms"]
    ]
    where = {
        **message["transforms"][0],
        "header": {**message["transforms"][0]["header"], "frame_id": "world"},
        "child_frame_id": "robot_0/map",
    }
    return {"transforms": [*own, where]}


@DIALECTS
def test_the_frames_of_a_robot_with_its_own_map_frame_are_good(dialect):
    _, findings, _ = looked_at(site(dialect, change=apart))
    assert level_of(findings, "Frames lead from world to robot_0/odom (/tf:") == "good"
    assert not any("at the pose from odometry" in each.text for each in findings)


@pytest.mark.parametrize(
    ("quirks", "level", "words"),
    [
        ("polite", "good", "blocks no other call (tried)"),
        ("polite,blocking_services", "warning", "blocks its whole connection (tried)"),
    ],
)
@DIALECTS
def test_a_trial_call_shows_whether_a_hanging_call_blocks_its_socket(
    dialect, quirks, level, words
):
    there, findings, _ = looked_at(site(dialect, quirks=quirks), try_call=True)
    assert level_of(findings, words) == level
    assert not any("webmap_doctor" in name for name in there.graph.services)


def test_a_bridge_without_client_services_leaves_the_blocking_unknown():
    def deaf(there):
        there.graph.serve = lambda *arguments, **named: None

    _, findings, seen = looked_at(site("ros2"), deaf, try_call=True)
    assert seen.link.calls_in_threads is None
    words = "call gave no result: the bridge offers no services of its clients"
    assert level_of(findings, words) == "note"


def test_without_rosapi_no_trial_call_is_made_and_the_reason_is_reported():
    there, findings, _ = looked_at(site("ros2", rosapi=False), try_call=True)
    assert level_of(findings, "gave no result: rosapi does not answer") == "note"
    assert not any("webmap_doctor" in name for name in there.called)


def test_repeating_the_trial_call_keeps_the_other_measurements():
    async def run():
        async with site("ros2", quirks="polite") as there:
            seen = await observe(there.url, seconds=SECONDS)
            asked = len(there.called)
            again = await tried(seen)
            return there.called[asked:], seen, again

    called, seen, again = asyncio.run(run())
    assert not seen.link.tried
    assert (again.link.tried, again.link.calls_in_threads) == (True, True)
    assert again.measured == seen.measured
    ours = [name for name in called if name.startswith("/webmap_doctor_")]
    assert len(ours) == len(called) - 1, called
    assert "/rosapi/get_time" in called, "the check calls no other service"


def test_an_unreachable_bridge_resets_the_result_of_an_earlier_trial_call():
    facts = LinkFacts(calls_in_threads=False, tried=True)
    blocking = BridgeFacts("ws://127.0.0.1:1", link=facts)
    seen = asyncio.run(tried(blocking))
    assert (seen.link.calls_in_threads, seen.link.tried) == (None, False)
    assert level_of(judge(seen), "slow service call gave no result") == "note"


TOPICS = {
    "/robot_0/odom": "nav_msgs/Odometry",
    "/robot_0/cmd_vel": "geometry_msgs/Twist",
}


@DIALECTS
def test_without_rosapi_a_given_topic_list_is_used(dialect):
    _, findings, seen = looked_at(
        site(dialect, rosapi=False), seconds=LONG, topics=TOPICS
    )
    assert [robot.name for robot in seen.findings.robots] == ["robot_0"]
    assert level_of(findings, "rosapi does not list the topics") == "note"
    assert level_of(findings, "The topics come from the given list") == "good"
    assert level_of(findings, "/robot_0/odom:") == "good"
    assert level_of(findings, "The bridge does not list the publishers of") == "note"


def test_without_rosapi_and_topic_list_the_check_advises_to_give_a_list():
    _, findings, _ = looked_at(site(rosapi=False))
    (found,) = [each for each in findings if "rosapi does not list" in each.text]
    assert found.level == "warning"
    assert "--topics FILE" in found.advice


def test_a_visible_rosout_shows_that_the_bridge_hides_no_topic():
    def log_topic(there):
        there.graph.advertise(object(), "/rosout", "rosgraph_msgs/Log", node="/rosout")

    _, _, seen = looked_at(site(), log_topic)
    assert seen.shown == ("/rosout",)


@pytest.mark.parametrize(("compression", "offered"), [("deflate", True), (None, False)])
def test_the_check_detects_whether_the_bridge_offers_compression(compression, offered):
    async def run():
        async with serve(
            lambda link: link.wait_closed(), "127.0.0.1", 0, compression=compression
        ) as server:
            port = server.sockets[0].getsockname()[1]
            return (await look(f"ws://127.0.0.1:{port}")).deflate

    assert asyncio.run(run()) is offered
