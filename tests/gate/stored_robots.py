"""Robots with files in ``stored_state``, as an earlier gate wrote them.

The folder is not written again when the code changes: a gate must read the old files.
It was made with

    PYTHONPATH=tests python tests/gate/stored_robots.py FOLDER

by a gate that received STOPs, and that was killed while it drove a robot. The files of
the STOP that cannot be read, and of the STOP that was being lifted, were then changed.
"""

import os
import signal
import sys
import time
from pathlib import Path

from equipment.declarations import declared

FOLDER = Path(__file__).with_name("stored_state")

PORT = 28461
"""The port of the robot that was driven."""


def robot(name, url, topic=None, **more):
    """Return a robot as a display declares one."""
    return declared(
        id=name.lower(), name=name, bridge_url=url, twist_topic=topic, **more
    )


STAMPED = "geometry_msgs/msg/TwistStamped"
ROBOTS = (
    robot("Here", f"ws://localhost:{PORT}/", "cmd_vel"),
    robot(
        "Stamped", "ws://Robot-Two.Example:9090", "base//cmd_vel/", twist_type=STAMPED
    ),
    robot("Path", "WSS://Robots.Example:443/three/ros/", "/cmd_vel"),
    robot("Query", "ws://robot-six.example/?id=7", "/robot_6/cmd_vel"),
    robot("Numbers", "ws://[FE80::1]:9090", "/cmd_vel", twist_type=STAMPED),
    robot("Goals", "ws://robot-four.example:80", goal_topic="goals/goal"),
    robot("Action", "ws://robot-four.example", action="navigate_to_pose/"),
    robot("Tested", "ws://robot-five.example:9090", "/cmd_vel"),
    robot("Never", "ws://robot-five.example:9090", "/other/cmd_vel"),
    robot("Lifted", "ws://robot-seven.example:9090", "/cmd_vel"),
    robot("Unreadable", "ws://robot-eight.example:9090", "/cmd_vel"),
    robot("Untouched", "ws://robot-nine.example:9090", "/cmd_vel"),
    robot("Driven", f"ws://127.0.0.1:{PORT}", "/driven/cmd_vel", stops_within=0.25),
)

STOPPED = {
    "Here": "Ann",
    "Stamped": "Bob Ünï",
    "Path": "program",
    "Query": "Ann",
    "Numbers": "Bob Ünï",
    "Goals": "Ann",
    "Action": "program",
    "Lifted": "Ann",
    "Unreadable": "Ann",
}
"""The user of each STOP."""

IDENTITIES = {
    "Here": "b0143f9bae16426b",
    "Stamped": "a542dc38a38446f3",
    "Path": "1b2d48bc0e2fa6e9",
    "Query": "35964899a3152c8c",
    "Numbers": "5e60efe2a5032aab",
    "Goals": "b50c1543748eb264",
    "Action": "74eb79554670dcd6",
    "Lifted": "e1f0e4cf82adc365",
}
"""The identity of each STOP whose file can be read."""

TESTED = {
    "Stamped": (0.42, "2026-03-14"),
    "Tested": (0.305, "2026-02-28"),
    "Never": (None, "2026-01-31"),
}
"""The results of stop tests: seconds, and the date."""


def main() -> None:
    """Let a gate of this version write its files to a folder."""
    from gate_page import Page
    from gate_robot import FakeRobot

    from equipment.waiting import wait_for
    from webmap.gate.disk import Records, path_of
    from webmap.gate.display.client import GateClient
    from webmap.gate.events import StopRecord
    from webmap.gate.specs import checked, key_of

    folder = Path(sys.argv[1])
    os.environ["WEBMAP_STATE_DIR"] = str(folder)
    client = GateClient()
    client.start()
    people = {name: Page(client, name) for name in ("Ann", "Bob Ünï")}
    with FakeRobot(PORT) as fake:
        for spec in ROBOTS:
            client.declare(spec)
        for name, by in STOPPED.items():
            if by == "program":
                client.stop_robot(name.lower())
            else:
                people[by].send(op="stop", robot=name.lower())
        ann = people["Ann"]
        for name in STOPPED:
            wait_for(lambda name=name: ann.robot(name.lower()).get("latched"), name)
        ann.take("driven")
        while not fake.of("publish", "/driven/cmd_vel"):
            ann.drive(1.0 if ann.robot("driven")["armed"] else 0.0, "driven")
            time.sleep(0.05)
        os.kill(client.pid, signal.SIGKILL)
        client._supervisor.end_heartbeat()
    records = Records(folder)
    by_name = {spec.name: key_of(checked(spec)) for spec in ROBOTS}
    for name, (seconds, date) in TESTED.items():
        records.keep_stop_test(by_name[name], StopRecord(seconds, date))
    path = path_of(folder, by_name["Lifted"], "stop")
    path.rename(path.with_suffix(".stop.lifted"))
    path_of(folder, by_name["Unreadable"], "stop").write_text("")
    os._exit(0)


if __name__ == "__main__":
    main()
