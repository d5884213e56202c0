"""Whatever a page sends, a bridge gets only the operations and topics of its robots."""

import contextlib
import itertools
import json
import re

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from equipment.processes import WEB, running
from equipment.server_fakes import sign_in
from equipment.waiting import wait_for
from webmap.testing.witness import WitnessRobot

pytestmark = pytest.mark.slow

SCRIPT = """
import webmap

bridge = webmap.Bridge({url!r})
bob = webmap.Robot("Bob")
bob.set_odometry_topic(bridge, "/odom")
bob.set_twist_topic(bridge, "/cmd_vel", stops_within=0.5)

@webmap.page("/")
def main(page):
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("Teleop", 1.0, 1.5)
    map.add_module("StopButton")
    map.add_module("RosoutPanel", [bridge])
    map.add_robot(bob)

webmap.run()
"""

EVIL = "evil"
"""In every topic, service and address that a page should not be able to name."""

OPERATIONS = [
    {"op": "publish", "topic": "/evil", "msg": {"data": EVIL}},
    {"op": "publish", "topic": "/cmd_vel", "msg": {"linear": {"x": 1.0}, "e": EVIL}},
    {"op": "advertise", "topic": "/evil", "type": "std_msgs/String"},
    {"op": "subscribe", "topic": "/evil", "type": "std_msgs/String"},
    {"op": "call_service", "service": "/evil", "args": {"a": EVIL}},
    {"op": "send_action_goal", "action": "/evil", "action_type": "a/B", "args": {}},
    {"op": "set_level", "level": EVIL},
    {"op": "auth", "mac": EVIL, "client": EVIL},
]

AROUND = [
    lambda one: one,
    lambda one: {"op": "drive", "robot": "r1", **{f"x-{k}": v for k, v in one.items()}},
    lambda one: {"op": "goal", "robot": json.dumps(one), "topic": "/evil"},
    lambda one: {
        "op": "stop-test",
        "robot": "/evil",
        "url": "ws://evil:9090",
        "m": one,
    },
    *(
        lambda one, n=n: {"op": "module", "instance": n, "data": {"open": True, **one}}
        for n in range(1, 8)
    ),
    lambda one: {
        "op": "event",
        "mount": 1,
        "element": 2,
        "event": "click",
        "key": EVIL,
    },
    lambda one: [one],
]

HELLO = json.dumps(
    {
        **{"op": "hello", "page": "p", "url": "/", "width": 800, "height": 600},
        "containers": {"webmap_container": [800, 600]},
    }
)

DECLARED = re.compile(r"/(cmd_vel|odom|rosout|rosapi/\w+)")


def test_no_message_of_a_page_is_passed_on_to_a_bridge(tmp_path):
    file = tmp_path / "page.py"
    with WitnessRobot() as robot:
        file.write_text(SCRIPT.format(url=robot.url))
        with running("run", file, "--port", 0, "--no-browser", pattern=WEB) as process:
            root = process.url.partition("/?")[0]
            browser = sign_in(process.url)
            wait_for(lambda: robot.log.of("advertise", "/cmd_vel"))
            frames = [
                json.dumps(a(o)) for a, o in itertools.product(AROUND, OPERATIONS)
            ]
            for name, n in itertools.product(("drive", "scene"), range(4)):
                address = f"{root.replace('http', 'ws')}/_webmap/{name}?page=/&id=p{n}"
                opened = connect(address, origin=root, subprotocols=browser.protocols)
                with (
                    contextlib.suppress(ConnectionClosed, TimeoutError),
                    opened as link,
                ):
                    if name == "scene":
                        link.send(HELLO)
                    for frame in frames[n::4]:
                        link.send(frame)
                    if name == "drive":
                        link.send('{"op":"stop","robot":"*"}')
                    while '"latched":true' not in str(link.recv(timeout=1)):
                        pass  # until this page's STOP, or nothing more comes
            wait_for(lambda: robot.log.twists)  # the zeros of STOP
        messages = [each.message for each in robot.log.messages]
    assert [m for m in messages if EVIL in json.dumps(m)] == []
    named = {m.get("topic") or m.get("service") for m in messages} - {None}
    assert {name for name in named if not DECLARED.fullmatch(name)} == set()
    assert [t for t in robot.log.twists if not t.is_zero] == []
    assert {m["op"] for m in messages} <= {
        *("advertise", "unadvertise", "publish", "subscribe", "unsubscribe"),
        "call_service",
    }
