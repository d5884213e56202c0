"""The decisions of the readiness check."""

import asyncio
import ipaddress
import json
import sys
from dataclasses import replace
from itertools import pairwise

import pytest
from frames_only import publishing

from webmap.base.geometry import Pose
from webmap.discovery import discover
from webmap.discovery.doctor import BridgeFacts, Measurement, is_ready, judge
from webmap.discovery.doctor.facts import Clock, FramePath
from webmap.discovery.doctor.measure import observe
from webmap.discovery.doctor.samples import (
    MOST_BYTES,
    FrameCheck,
    Sampling,
    TopicSamples,
)
from webmap.discovery.doctor.topic_rules import shown_topics
from webmap.discovery.doctor.verdict import report
from webmap.ros.rosbridge.checks import LinkFacts, is_loopback, listening_addresses
from webmap.ros.rosbridge.events import Publish

pytestmark = pytest.mark.slow

TOPICS = {
    "/odom": "nav_msgs/Odometry",
    "/cmd_vel": "geometry_msgs/Twist",
    "/scan": "sensor_msgs/LaserScan",
}
LISTENED = {
    "/odom": Measurement(60, 3.0, 0.06, 50_000, "odom", 99.97, 100.0),
    "/scan": Measurement(30, 3.0, 0.11, 90_000, "laser", 99.95, 100.0, binary=True),
}
GOOD = BridgeFacts(
    "ws://localhost:9090",
    link=LinkFacts("127.0.0.1", ("127.0.0.1",)),
    findings=discover(TOPICS, "bob"),
    clock=Clock(0.01, 0.004),
    publishers={"/cmd_vel": ()},
    subscribers={"/cmd_vel": ("/base",)},
    measured=LISTENED,
)


def level_of(seen, words):
    """The level of the only finding with this text."""
    (found,) = [each for each in judge(seen) if words in each.text]
    if found.level in ("wrong", "warning"):
        assert found.advice, "the finding has no advice"
    return found.level


def noted(**changes):
    odometry = replace(LISTENED["/odom"], **changes)
    return replace(GOOD, measured={**LISTENED, "/odom": odometry})


def test_a_good_robot_is_ready_and_the_unknown_command_timeout_is_a_note():
    findings = judge(GOOD)
    assert is_ready(findings)
    assert {each.level for each in findings} == {"good", "note"}
    assert level_of(GOOD, "stops by itself") == "note"


AGENT = replace(GOOD, url="zenohs://fleet:7447/bay3", link=LinkFacts())


@pytest.mark.parametrize(
    ("open_at", "words", "level"),
    [
        ((), "listens on its own computer alone", "good"),
        (None, "does not know whether other computers reach its rosbridge", "note"),
        (("0.0.0.0",), "may reach the agent's rosbridge at 0.0.0.0", "warning"),
    ],
)
def test_the_doctor_reports_who_reaches_the_rosbridge_of_an_agent(
    open_at, words, level
):
    seen = replace(AGENT, open_at=open_at)
    assert level_of(seen, words) == level
    texts = " ".join(f"{each.text} {each.advice}" for each in judge(seen))
    assert "compress" not in texts, "the display has no socket to that rosbridge"
    assert "not encrypted" not in texts
    assert "--stop-test" not in texts, "only the gate of the agent moves the robot"
    assert "button on its card" in texts


def test_the_doctor_warns_of_a_router_without_tls_on_another_computer():
    plain = replace(AGENT, url="zenoh://fleet:7447/bay3")
    assert level_of(plain, "not encrypted") == "warning"
    here = replace(AGENT, url="zenoh://127.0.0.1:7447/bay3")
    assert not any("not encrypted" in each.text for each in judge(here))


@pytest.mark.parametrize(
    ("trouble", "advice"),
    [
        (
            "cannot reach the router at tcp/h:7447: nothing listens there",
            "the router's",
        ),
        (
            "the agent bay3 does not reach its rosbridge: no answer",
            "Start rosbridge on",
        ),
        ("no answer from the agent bay3", "with --name bay3"),
    ],
)
def test_advice_for_an_agent_that_cannot_be_reached_fits_the_reason(trouble, advice):
    (finding,) = judge(BridgeFacts("zenoh://h/bay3", trouble=trouble))
    assert finding.level == "wrong"
    assert trouble in finding.text
    assert advice in finding.advice


def test_an_unreachable_bridge_is_the_only_finding():
    findings = judge(BridgeFacts("ws://bob:9090", trouble="nothing listens there"))
    assert [each.level for each in findings] == ["wrong"]
    assert not is_ready(findings)


@pytest.mark.parametrize(
    ("trouble", "advice"),
    [
        ("the host's name is not known (gaierror)", "how the host is spelled"),
        ("the connection was refused, nothing listens there", "address and port"),
        ("no answer within 5 s", "address and firewall"),
    ],
)
def test_the_advice_depends_on_why_the_bridge_is_unreachable(trouble, advice):
    (finding,) = judge(BridgeFacts("ws://bob:9090", trouble=trouble))
    assert advice in finding.advice


@pytest.mark.parametrize(
    ("url", "peer", "level"),
    [
        ("ws://localhost:9090", "::1", "note"),
        ("ws://localhost:9090", "", "note"),
        ("ws://bob:9090", "192.168.1.7", "warning"),
        ("ws://bob:9090", "fe80::1%eth0", "warning"),
        ("wss://bob:9090", "192.168.1.7", "note"),
    ],
)
def test_an_unencrypted_bridge_reachable_from_the_network_is_a_warning(
    url, peer, level
):
    findings = judge(replace(GOOD, url=url, link=LinkFacts(peer)))
    (found,) = [f for f in findings if "open to the" in f.text or "reached" in f.text]
    assert found.level == level
    assert ("topics_glob" in found.advice) is (not url.startswith("ws://localhost"))


@pytest.mark.parametrize(
    ("listens", "level", "words"),
    [
        (("127.0.0.1",), "good", "listens on this machine alone"),
        (("127.0.0.1", "::1"), "good", "listens on this machine alone"),
        (("0.0.0.0",), "warning", "listens at 0.0.0.0: it has no sign-in"),
        (("127.0.0.1", "::"), "warning", "listens at ::: it has no sign-in"),
    ],
)
def test_a_local_bridge_that_listens_on_all_addresses_is_a_warning(
    listens, level, words
):
    assert level_of(replace(GOOD, link=LinkFacts("127.0.0.1", listens)), words) == level


TCP = """\
  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid
   0: 0100007F:2382 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0
   1: 00000000:2383 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0
   2: 0100007F:2384 0100007F:D0F2 01 00000000:00000000 00:00000000 00000000     0
   nonsense
"""
TCP6 = f"""\
  sl  local_address                         remote_address                        st
   0: {"0" * 32}:2382 {"0" * 32}:0000 0A
   1: 0000000000000000FFFF00000100007F:2385 {"0" * 32}:0000 0A
"""


@pytest.mark.skipif(
    sys.byteorder != "little", reason="the tables are of a little-endian machine"
)
@pytest.mark.parametrize(
    ("port", "addresses"),
    [
        (9090, ("127.0.0.1", "::")),
        (9091, ("0.0.0.0",)),
        (9092, ()),
        (9093, ("::ffff:127.0.0.1",)),
        (1, ()),
    ],
)
def test_listening_addresses_are_read_from_the_tcp_tables_of_the_kernel(
    port, addresses
):
    found = listening_addresses(port, [TCP, TCP6])
    assert [ipaddress.ip_address(each) for each in found] == [
        ipaddress.ip_address(each) for each in addresses
    ]


@pytest.mark.parametrize(
    ("address", "here"),
    [
        ("127.0.0.1", True),
        ("::1", True),
        ("::ffff:7f00:1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("::", False),
        ("fe80::1%eth0", False),
        ("bob", False),
    ],
)
def test_only_loopback_addresses_count_as_loopback(address, here):
    assert is_loopback(address) is here


def test_a_reachable_bridge_that_hides_no_topic_is_a_warning():
    link = LinkFacts("192.168.1.7")
    seen = replace(GOOD, url="ws://bob:9090", link=link, shown=("/rosout",))
    assert level_of(seen, "No topic is hidden from its clients (/rosout") == "warning"
    at_home = replace(GOOD, shown=("/rosout",))
    assert not any("hidden" in each.text for each in judge(at_home))


def test_a_note_says_that_only_the_first_ten_robots_are_measured():
    topics = {f"/r{n}/odom": "nav_msgs/Odometry" for n in range(12)}
    many = replace(GOOD, findings=discover(topics))
    assert level_of(many, "Only the first 10 of 12 robots") == "note"


def test_a_map_without_a_publisher_is_a_warning():
    topics = TOPICS | {"/map": "nav_msgs/OccupancyGrid"}
    seen = replace(GOOD, findings=discover(topics, "bob"))
    assert not any("no map under it" in each.text for each in judge(seen))
    seen = replace(seen, publishers={**GOOD.publishers, "/map": ()})
    assert level_of(seen, "No node publishes /map") == "warning"


def test_a_slow_battery_topic_is_no_warning():
    topics = TOPICS | {"/battery_state": "sensor_msgs/BatteryState"}
    seen = replace(GOOD, findings=discover(topics, "bob"))
    seen = replace(
        seen, measured={**LISTENED, "/battery_state": Measurement(seconds=3.0)}
    )
    assert (
        level_of(
            seen, "No message was received on /battery_state in 3 s; the topic may"
        )
        == "note"
    )
    slow = {**LISTENED, "/battery_state": Measurement(1, 3.0, 3.0)}
    assert (
        level_of(replace(seen, measured=slow), "/battery_state: 0.3 messages") == "good"
    )
    broken = {**LISTENED, "/battery_state": Measurement(1, 3.0, trouble="not JSON")}
    assert (
        level_of(replace(seen, measured=broken), "cannot be read: not JSON")
        == "warning"
    )


def test_an_old_battery_message_is_a_warning():
    topics = TOPICS | {"/battery_state": "sensor_msgs/BatteryState"}
    seen = replace(GOOD, findings=discover(topics, "bob"))
    came = Measurement(3, 3.0, 1.0, stamp=99.0, arrived=100.0)
    fresh = {**LISTENED, "/battery_state": came}
    assert (
        level_of(replace(seen, measured=fresh), "1.0 messages a second, 1.0 s old")
        == "good"
    )
    old = {**LISTENED, "/battery_state": replace(came, stamp=10.0)}
    assert (
        level_of(replace(seen, measured=old), "the shown value may be out of date")
        == "warning"
    )


SHOWN = TOPICS | {
    "/camera/image_raw/compressed": "sensor_msgs/CompressedImage",
    "/points": "sensor_msgs/PointCloud2",
    "/local_costmap/costmap": "nav_msgs/OccupancyGrid",
    "/map": "nav_msgs/OccupancyGrid",
    "/plan": "nav_msgs/Path",
    "/rear/scan": "sensor_msgs/LaserScan",
    "/move_base/goal": "move_base_msgs/MoveBaseActionGoal",
}
STATUS = "/move_base/status"
CAMERA = "/camera/image_raw/compressed"
CAME = Measurement(4, 0.6, 0.2, stamp=99.95, arrived=100.0, every=0.2)


def shown(topic, came):
    seen = replace(GOOD, findings=discover(SHOWN, "bob"))
    return replace(seen, measured={**LISTENED, topic: came})


@pytest.mark.parametrize(
    ("topic", "changes", "level", "words"),
    [
        (CAMERA, {}, "good", f"{CAMERA}: 5.0 messages a second, 60 ms old."),
        (CAMERA, {"count": 0}, "warning", "driving with this camera stops"),
        (CAMERA, {"every": 2.0}, "warning", "whenever its picture is older than 1 s"),
        (CAMERA, {"every": 0.0, "longest_gap": 2.5}, "warning", "older than 1 s"),
        (CAMERA, {"stamp": 97.0}, "warning", "arrive too late for driving"),
        (CAMERA, {"trouble": "not JSON"}, "warning", "cannot be read: not JSON"),
        ("/points", {}, "good", "/points: 5.0 messages a second"),
        (
            "/points",
            {"stamp": 97.0},
            "warning",
            "its points are drawn at an earlier pose",
        ),
        ("/points", {"count": 0}, "warning", "so no points are drawn"),
        ("/local_costmap/costmap", {"count": 0}, "warning", "so no costs are drawn"),
        ("/map", {"count": 1, "every": 0.0, "stamp": -7300.0}, "good", ", 2 h old"),
        ("/map", {"count": 1, "every": 0.0, "stamp": -900.0}, "good", ", 17 min old"),
        ("/map", {"count": 0}, "warning", "so no map is drawn under the robot"),
        ("/plan", {"count": 0}, "note", "messages may begin with a goal"),
        (STATUS, {"count": 0}, "note", "messages may begin with a goal"),
        (STATUS, {}, "good", f"{STATUS}: 5.0 messages a second"),
        (
            "/rear/scan",
            {"count": 0, "seconds": 3.0},
            "warning",
            "No message was received on /r",
        ),
    ],
)
def test_every_displayed_topic_is_judged_by_its_rate_and_age(
    topic, changes, level, words
):
    assert level_of(shown(topic, replace(CAME, **changes)), words) == level


def test_the_goal_status_topic_belongs_to_the_action_of_the_robot():
    (robot,) = discover(SHOWN, "bob").robots
    found = {kind: (topic, type) for kind, topic, type in shown_topics(robot)}
    assert found["status"] == (STATUS, "actionlib_msgs/GoalStatusArray")
    topics = TOPICS | {
        "/navigate_to_pose/_action/feedback": (
            "nav2_msgs/action/NavigateToPose_FeedbackMessage"
        )
    }
    (robot,) = discover(topics, "bob").robots
    found = {kind: (topic, type) for kind, topic, type in shown_topics(robot)}
    assert found["status"] == (
        "/navigate_to_pose/_action/status",
        "action_msgs/msg/GoalStatusArray",
    )


def test_a_bridge_without_rosapi_is_a_warning_with_advice():
    bare = BridgeFacts("ws://localhost:9090", unlisted="no answer")
    assert level_of(bare, "rosapi does not list") == "warning"
    assert level_of(bare, "is not known") == "note"


def test_finding_no_robot_is_wrong():
    empty = replace(GOOD, findings=discover({}))
    assert level_of(empty, "No robot was found") == "wrong"


@pytest.mark.parametrize(
    ("ahead", "level", "words"),
    [
        (0.2, "good", "Both clocks agree"),
        (3.0, "warning", "3.0 s ahead of"),
        (-3600.0, "warning", "3600.0 s behind"),
        (-1.7e9, "note", "the clock of a simulator"),
    ],
)
def test_a_clock_difference_is_a_warning(ahead, level, words):
    assert level_of(replace(GOOD, clock=Clock(ahead, 0.004)), words) == level


@pytest.mark.parametrize(
    ("trip", "level"), [(0.02, "good"), (0.2, "warning"), (0.5, "wrong")]
)
def test_a_slow_service_call_is_a_warning_or_wrong(trip, level):
    assert (
        level_of(replace(GOOD, clock=Clock(0.0, trip)), "A service call takes") == level
    )


def test_a_clock_offset_within_half_the_round_trip_is_accepted():
    assert (
        level_of(replace(GOOD, clock=Clock(0.6, 0.28)), "Both clocks agree") == "good"
    )


@pytest.mark.parametrize(
    ("dialect", "threads", "level"),
    [
        ("ros1", None, "good"),
        ("ros2", None, "note"),
        ("ros2", True, "good"),
        ("ros2", False, "warning"),
    ],
)
def test_the_check_says_whether_a_hanging_call_blocks_its_socket(
    dialect, threads, level
):
    findings = replace(GOOD.findings, dialect=dialect)
    seen = replace(GOOD, findings=findings, link=LinkFacts(calls_in_threads=threads))
    (found,) = [f for f in judge(seen) if "hangs" in f.text or "of its own" in f.text]
    assert found.level == level


@pytest.mark.parametrize(
    ("writers", "level", "words"),
    [
        ((), "good", "No other node publishes"),
        (
            ("/joy", "/nav"),
            "warning",
            "Other nodes publish to /cmd_vel too: /joy, /nav",
        ),
        (("/rosbridge_websocket",), "note", "may be WebMap itself"),
        (None, "note", "does not list the publishers"),
    ],
)
def test_other_publishers_of_velocities_are_named(writers, level, words):
    publishers = {} if writers is None else {"/cmd_vel": writers}
    assert level_of(replace(GOOD, publishers=publishers), words) == level


def test_a_velocity_topic_without_subscriber_is_wrong():
    assert (
        level_of(replace(GOOD, subscribers={"/cmd_vel": ()}), "No node subscribes")
        == "wrong"
    )


def test_the_velocity_type_is_reported():
    stamped = TOPICS | {"/cmd_vel": "geometry_msgs/msg/TwistStamped"}
    seen = replace(GOOD, findings=discover(stamped, "bob"))
    assert level_of(seen, "has the type TwistStamped") == "good"


def test_a_missing_pose_is_wrong_and_a_missing_velocity_topic_is_a_warning():
    blind = replace(GOOD, findings=discover({"/cmd_vel": "geometry_msgs/Twist"}))
    assert level_of(blind, "No topic gives its pose") == "wrong"
    fixed = replace(GOOD, findings=discover({"/odom": "nav_msgs/Odometry"}))
    assert level_of(fixed, "seen but not driven") == "warning"


@pytest.mark.parametrize(
    ("changes", "level", "words"),
    [
        ({}, "good", "20.0 messages a second in the frame odom, 40 ms old"),
        ({"count": 0}, "wrong", "No message was received on /odom in 3 s"),
        ({"trouble": "not JSON"}, "wrong", "/odom cannot be read: not JSON"),
        ({"longest_gap": 1.4}, "wrong", "none for 1.4 s"),
        ({"count": 9}, "warning", "3.0 messages a second"),
        ({"stamp": 99.0}, "warning", "1.0 s old when they arrive"),
        ({"stamp": 101.0}, "warning", "1.0 s ahead of the robot's own clock"),
        ({"stamp": None}, "good", "in the frame odom."),
    ],
)
def test_odometry_is_judged_by_its_rate_and_age(changes, level, words):
    assert level_of(noted(**changes), words) == level


def test_a_silent_scan_is_a_warning_and_the_robot_stays_ready():
    seen = replace(GOOD, measured={**LISTENED, "/scan": Measurement(seconds=3.0)})
    assert level_of(seen, "No message was received on /scan") == "warning"
    assert is_ready(judge(seen))


def test_the_worst_findings_of_a_robot_come_first():
    levels = [each.level for each in judge(noted(count=0)) if each.about == "bob"]
    assert levels == sorted(levels, key=["wrong", "warning", "note", "good"].index)


def test_the_report_counts_the_findings_and_removes_control_characters():
    odd = replace(GOOD, publishers={"/cmd_vel": ("/joy\x1b[2J",)})
    text = report(odd.url, judge(odd))
    assert "\x1b" not in text
    assert text.endswith("0 wrong, 1 warning, 1 note, 9 good")


def test_a_frame_path_from_the_map_is_good_and_a_missing_path_is_a_note():
    seen = replace(GOOD, frame_paths={"bob": FramePath("odom")})
    assert level_of(seen, "Frames lead from map to odom") == "good"
    seen = replace(
        GOOD, frame_paths={"bob": FramePath("odom", "there is no frame 'map'")}
    )
    assert (
        level_of(seen, "at the pose from odometry: there is no frame 'map'") == "note"
    )


def test_the_frame_path_starts_in_the_map_frame_of_the_robot():
    seen = replace(GOOD, frame_paths={"bob": FramePath("bob/odom", start="world")})
    assert level_of(seen, "Frames lead from world to bob/odom") == "good"
    lost = FramePath("bob/odom", "there is no frame 'world'", start="world")
    seen = replace(GOOD, frame_paths={"bob": lost})
    (found,) = [each for each in judge(seen) if "no frame 'world'" in each.text]
    assert "start the node that publishes the frame world" in found.advice


PLACED = Pose(1.0, 0.0, 0.0)


def chain(*frames):
    """Transforms from each frame to the next."""
    return [(*pair, PLACED) for pair in pairwise(frames)]


def checked(seen, extra=None):
    """What the check sees of robots that publish their frames."""
    with publishing(seen, extra=extra or {}) as url:
        return asyncio.run(observe(url, seconds=0.5))


@pytest.mark.parametrize(
    ("topic", "frames", "name", "words"),
    [
        (
            "/tf",
            ("map", "bob/odom", "bob/base_link"),
            "bob",
            "Its pose comes from its frames, bob/base_link in map (/tf: ",
        ),
        (
            "/bob/tf",
            ("map", "odom", "base_link"),
            "bob",
            "Its pose comes from its frames, base_link in map (/bob/tf: ",
        ),
        (
            "/bob/tf",
            ("odom", "base_link"),
            "bob",
            "Its pose comes from its frames, base_link in odom (/bob/tf: ",
        ),
    ],
)
def test_a_robot_with_only_frames_is_found_and_its_pose_is_good(
    topic, frames, name, words
):
    seen = checked({topic: chain(*frames)})
    assert [robot.name for robot in seen.findings.robots] == [name]
    assert level_of(seen, words) == "good"
    assert not [each for each in judge(seen) if each.level == "wrong"]


def test_a_robot_without_frame_messages_has_an_unknown_pose():
    seen = checked({"/bob/tf": []}, {"/bob/scan": TOPICS["/scan"]})
    words = (
        "Its pose is unknown: /bob/tf has no transform from map or odom to base_link"
    )
    assert level_of(seen, words) == "wrong"


def test_robots_with_their_own_maps_get_their_pose_in_the_world_frame():
    names = ("ann", "bob")
    seen = [
        transform
        for name in names
        for transform in chain("world", f"{name}/map", f"{name}/base_link")
    ]
    seen = checked({"/tf": seen})
    for name in names:
        assert level_of(seen, f"from its frames, {name}/base_link in world") == "good"


def test_invalid_transforms_are_a_warning():
    seen = replace(
        GOOD, frame_paths={"bob": FramePath("odom", "", ("'a' -> 'a' would close",))}
    )
    assert level_of(seen, "would close") == "warning"


def frames(*transforms, topic="/tf"):
    listening = FrameCheck()
    seen = [
        {
            "header": {"stamp": {"sec": 5}, "frame_id": parent},
            "child_frame_id": child,
            "transform": {
                "translation": {"x": 1.0, "y": 0.0, "z": 0.0},
                "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": w},
            },
        }
        for parent, child, w in transforms
    ]
    operation = {"op": "publish", "topic": topic, "msg": {"transforms": seen}}
    listening.received(Publish(topic, json.dumps(operation).encode()))
    return listening


def test_the_frame_path_from_the_map_is_checked_for_each_namespace():
    whole = frames(("map", "odom", 1.0), ("odom", "base", 1.0))
    assert whole.missing("", "odom") == ""
    assert whole.missing("", "map") == ""
    assert "there is no frame 'lidar'" in whole.missing("", "lidar")
    assert whole.missing("/bob", "odom") == "no message was received on /bob/tf"
    own = frames(("map", "odom", 1.0), topic="/bob/tf")
    assert own.missing("/bob", "odom") == ""


def test_each_invalid_transform_is_stored_once():
    odd = frames(("a", "b", 0.0), ("a", "b", 0.0), ("b", "b", 1.0)).oddities("")
    assert len(odd) == 2
    assert "norm of 0" in odd[0]
    assert "loop" in odd[1]
    listening = FrameCheck()
    listening.received(Publish("/tf", b'{"op":"publish","topic":"/tf","msg":[}'))
    assert "cannot be read" in listening.oddities("")[0]


def message(topic, stamp=(5, 250_000_000), frame="odom"):
    header = {"stamp": {"sec": stamp[0], "nanosec": stamp[1]}, "frame_id": frame}
    operation = {"op": "publish", "topic": topic, "msg": {"header": header}}
    return Publish(topic, json.dumps(operation).encode())


def test_listening_counts_messages_and_measures_the_longest_gap():
    listening = TopicSamples({"/odom": ""}, 10.0)
    for now in (10.5, 10.6, 11.4, 11.5):
        listening.received(message("/odom"), now, now + 1000)
    listening.received(message("/other"), 11.6, 1011.6)
    found = listening.end(13.0)["/odom"]
    assert (found.count, found.seconds, found.frame) == (4, 3.0, "odom")
    assert found.longest_gap == pytest.approx(1.5), "the gap lasts until the end"
    assert found.stamp == 5.25
    assert found.arrived == 1011.5
    assert not found.binary


def test_a_zero_stamp_counts_as_no_stamp():
    listening = TopicSamples({"/odom": ""}, 0.0)
    listening.received(message("/odom", (0, 0)), 1.0, 1.0)
    assert listening.end(2.0)["/odom"].stamp is None


def test_a_message_with_invalid_json_is_reported():
    listening = TopicSamples({"/odom": ""}, 0.0)
    broken = Publish("/odom", b'{"op":"publish","topic":"/odom","msg":[}')
    listening.received(broken, 1.0, 1.0)
    assert "not JSON" in listening.end(2.0)["/odom"].trouble


def test_sampling_leaves_a_topic_after_four_messages():
    sampling = Sampling(["/a", "/b"], 0.0)
    left = [sampling.received(message("/a"), now, now) for now in (1.0, 1.5, 2.0, 2.5)]
    assert left == [False, False, False, True]
    assert not sampling.received(message("/a"), 9.0, 9.0)
    assert not sampling.received(message("/other"), 9.0, 9.0)
    assert not sampling.done
    found = sampling.end(3.0)
    assert (found["/a"].count, found["/a"].every, found["/a"].seconds) == (4, 0.5, 2.5)
    assert (found["/b"].count, found["/b"].every, found["/b"].seconds) == (0, 0.0, 3.0)


def test_sampling_leaves_a_large_topic_at_once_and_ends_at_the_size_limit():
    sampling = Sampling([f"/{n}" for n in range(12)], 0.0)
    large = b"x" * MOST_BYTES
    for n in range(8):
        assert not sampling.done
        assert sampling.received(Publish(f"/{n}", large), 1.0, 1.0)
    assert sampling.done
    assert set(sampling.end(1.0)) == {f"/{n}" for n in range(8)}, (
        "silent topics are included"
    )
