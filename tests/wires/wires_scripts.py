"""Scripts of pages, programs and robots, with real processes and sockets between them.

    python tests/wires/wires_scripts.py RESULT MODE [SCRIPT...]

plays the named scripts, or all, and writes their recordings to the file RESULT as JSON.
MODE is ``compare``, which waits for the recorded messages, or ``write``.
"""

import contextlib
import json
import os
import shutil
import sys
import tempfile
import time
import traceback
from pathlib import Path

import wires_robots as robots
from wires_bench import Bench
from wires_recording import recorded
from wires_robot import REST, scan_of

from webmap.base.errors import MotionError, NoLease
from webmap.base.geometry import Quaternion, Vector3

STORED_STATE = Path(__file__).parents[1] / "gate" / "stored_state"

FULL, CREEP = robots.FULL, robots.FULL / 2
PLACE, TURN = Vector3(1.0, 2.0), Quaternion.from_yaw(0.5)


def held(report):
    return report["state"] == "held" and report["armed"]


def free(report):
    return report["armable"] and report["link"] == "up" and report["holder"] is None


def driven(site, x, at_least=3):
    """Return a check that the robot received a speed a few times."""
    before = site.speeds.count(x)
    return lambda: site.speeds.count(x) >= before + at_least


def a_robot_from_before_the_start(b):
    b.end_with(b.early)
    b.reports("before the start", b.early, lambda r: r["link"] == "down")


def a_page_drives_by_twist(b):
    site, bridge = b.site()
    bob = b.robot(robots.of_twist, bridge, "Bob")
    ann = b.page("Ann")
    b.shows("free", ann, bob, free)
    ann.take(bob)
    ann.rest(bob)
    b.shows("held", ann, bob, held)
    ann.drive(bob, x=1.0, until=driven(site, FULL))
    b.shows("driving", ann, bob, lambda r: r["doing"] == "driven" and r["measured"])
    ann.drive(bob, x=-0.5, turn=0.5, until=driven(site, -FULL / 2))
    ann.release_inputs(bob)
    b.until(lambda: site.speeds[-1] == 0, "a zero")
    b.shows("let go", ann, bob, held)
    ann.inputs = None
    ann.send_op("renew", robot=bob.id, epoch=ann.report(bob)["epoch"])
    ann.send_op("release", robot=bob.id)
    b.shows("released", ann, bob, free)
    b.model(robots.no_velocity, bob)
    b.until(lambda: bob.id not in ann.reports, "the robot's end")


def a_page_drives_by_stamped_twist(b):
    stamped = "geometry_msgs/msg/TwistStamped"
    site, bridge = b.site(types={"/cmd_vel": stamped})
    bob = b.robot(robots.of_stamped, bridge, "Stan")
    ann = b.page("Ann")
    b.until(lambda: stamped in str(site.received("advertise")), "the type of velocity")
    ann.take(bob)
    ann.drive(bob, x=1.0, until=driven(site, FULL))
    ann.drive(bob, y=1.0, until=driven(site, 0.0))
    b.shows("sideways", ann, bob, lambda r: r["sent"][1] and r["doing"] == "driven")
    ann.release_inputs(bob)
    b.shows("let go", ann, bob, held)


def a_page_drives_at_the_speed_of_an_unknown_base(b):
    site, bridge = b.site()
    bob = b.robot(robots.of_unknown_stop, bridge, "Una")
    ann = b.page("Ann")
    b.shows("free", ann, bob, free)
    ann.take(bob)
    ann.drive(bob, turn=1.0, until=lambda: len(site.speeds) > 3)
    ann.release_inputs(bob)


def stop_and_reset(b):
    site, bridge = b.site()
    bob = b.robot(robots.with_hooks, bridge, "Holly")
    ann, vic = b.page("Ann"), b.page("Vic", "viewer")
    b.tasks_up(site, "/lock")
    ann.take(bob)
    ann.drive(bob, x=1.0, until=driven(site, FULL))
    vic.send_op("stop", robot="*")
    b.until(lambda: site.speeds[-1] == 0, "a zero")
    ann.inputs = None
    b.until(lambda: site.received("call_service"), "the hook that is a service")
    b.shows("stopped by a viewer", vic, bob, stop_confirmed)
    vic.reset(bob)
    b.until(lambda: vic.refusals, "the refusal of a viewer's reset")
    ann.send_op("reset", robot=bob.id, stop="0000")
    b.until(lambda: ann.refusals, "the refusal of an old reset")
    ann.reset(bob)
    b.shows("reset", ann, bob, free)
    ann.take(bob)
    b.model(bob.stop)
    b.shows("stopped by the program", ann, bob, stop_confirmed)
    b.until(lambda: bob.report and bob.report.stop, "a report of the STOP")
    b.model(bob.reset_stop)
    b.shows("reset by the program", ann, bob, free)
    with contextlib.suppress(Exception):  # the server closes the socket
        ann.send(' {"op":"stop" nonsense')
    b.shows("stopped by a broken STOP", vic, bob, stop_confirmed)


def stop_confirmed(report):
    return report["latched"] and report["stop"]["confirmed"]


def goals_by_a_topic(b):
    site, bridge = b.site()
    bob = b.robot(robots.by_simple_goals, bridge, "Goran")
    ann = b.page("Ann")
    b.tasks_up(site, "/initialpose")
    ann.take(bob)
    ann.aim("locate", bob)
    b.until(lambda: site.received("publish", "/initialpose"), "the pose")
    ann.aim("goal", bob)
    b.until(lambda: site.received("publish", "/move_base_simple/goal"), "the goal")
    b.shows("sent", ann, bob, lambda r: r["goal"])
    ann.send_op("cancel", robot=bob.id)
    b.until(lambda: site.received("publish", "/move_base/cancel"), "the cancel")
    b.shows("cancelled", ann, bob, goal_is("cancelled"))


def goal_is(state):
    return lambda report: report["goal"] and report["goal"]["state"] == state


def goals_by_move_base(b):
    site, bridge = b.site()
    bob = b.robot(robots.by_move_base, bridge, "Mo")
    ann = b.page("Ann")
    b.tasks_up(site, "/move_base/goal")
    ann.take(bob)
    ann.aim("goal", bob)
    (sent,) = b.until(lambda: site.received("publish", "/move_base/goal"), "the goal")
    b.until(lambda: site.received("subscribe", "/move_base/result"), "its subscription")
    status = {"goal_id": sent["msg"]["goal_id"], "status": 1, "text": ""}
    site.publish("/move_base/status", {"status_list": [status]})
    b.shows("under way", ann, bob, goal_is("under way"))
    ann.send_op("cancel", robot=bob.id)
    b.until(lambda: site.received("publish", "/move_base/cancel"), "the cancel")
    ended = {"status": {**status, "status": 2}, "result": {}}
    site.publish("/move_base/result", ended)
    b.shows("cancelled", ann, bob, goal_is("cancelled"))


def goals_by_navigation(b):
    site, bridge = b.site()
    bob = b.robot(robots.by_navigation, bridge, "Nav")
    ann = b.page("Ann")
    b.tasks_up(site, "/goal_pose")
    ann.take(bob)
    ann.aim("goal", bob)
    (sent,) = b.until(lambda: site.received("send_action_goal"), "the goal")
    link = site.link_that("send_action_goal")
    feedback = {"distance_remaining": 2.5, "number_of_recoveries": 1}
    feedback["navigation_time"] = {"sec": 3, "nanosec": 0}
    message = {"op": "action_feedback", "id": sent["id"], "values": feedback}
    site.send(link, {**message, "action": "/navigate_to_pose"})
    b.shows("under way", ann, bob, goal_is("under way"))
    result = {"op": "action_result", "id": sent["id"], "status": 4, "values": {}}
    site.send(link, {**result, "action": "/navigate_to_pose", "result": True})
    b.shows("reached", ann, bob, goal_is("reached"))
    ann.send_op("cancel", robot=bob.id)
    b.until(lambda: site.received("call_service"), "the cancel")
    b.until(lambda: len(site.received("advertise", "/goal_pose")) == 2, "another lane")
    time.sleep(0.1)  # until the gate knows that the lane is open
    ann.aim("goal", bob, x=3.0)
    b.until(lambda: len(site.received("send_action_goal")) == 2, "another goal")
    ann.close()  # the sender of the goal is lost
    b.until(lambda: len(site.received("call_service")) == 2, "its cancel")
    b.reports("who sent it is lost", bob, goal_is("cancelling"))


def hand_over(b):
    site, bridge = b.site()
    bob = b.robot(robots.of_twist, bridge, "Hank")
    ann, ben, vic = b.page("Ann"), b.page("Ben"), b.page("Vic", "viewer")
    ann.take(bob)
    ann.rest(bob)
    for page in (ben, vic):
        page.send_op("take", robot=bob.id)
        b.until(lambda page=page: page.refusals, "a refusal")
    ben.send_op("ask", robot=bob.id)
    b.shows("asked", ann, bob, lambda r: r["asker"])
    ann.send_op("deny", robot=bob.id)
    b.shows("denied", ann, bob, lambda r: not r["asker"])
    b.until(lambda: len(ben.refusals) == 2, "the answer")
    ben.send_op("ask", robot=bob.id)
    b.until(lambda: ann.report(bob)["asker"], "the request")
    ben.send_op("release", robot=bob.id)
    b.until(lambda: not ann.report(bob)["asker"], "the end of the request")
    ben.send_op("ask", robot=bob.id)
    b.until(lambda: ann.report(bob)["asker"], "the request")
    ann.send_op("grant", robot=bob.id)
    ann.inputs = None
    b.until(lambda: ben.report(bob)["mine"], "the lease")
    ben.rest(bob)
    b.shows("granted", ben, bob, held)
    ben.drive(bob, x=1.0, until=driven(site, FULL))
    ben.release_inputs(bob)
    ben.inputs = None
    ben.close()  # without a release
    b.shows("closed", ann, bob, free)
    b.run(bob.acquire_lease())
    b.shows("taken by the program", ann, bob, lambda r: r["holder"])
    ann.take(bob)
    ann.rest(bob)
    b.shows("taken from the program", ann, bob, held)


def a_program_drives(b):
    site, bridge = b.site()
    bob = b.robot(robots.that_flies, bridge, "Pam")
    received = b.model(bob.add_module, Receiver)
    b.run(bob.acquire_lease())
    b.reports("held by the program", bob, lambda r: r["epoch"])

    def drive(until, *velocity):
        def under_way():
            with contextlib.suppress(NoLease):  # lost on a busy computer
                b.model(bob.twist, *velocity)
                return until()
            b.run(bob.acquire_lease())
            return False

        b.until(under_way, "a robot that is driven")

    drive(driven(site, 0.05), 0.05, 0.0, 0.0, 0.0, 0.0, 0.5)
    drive(driven(site, 0.03), 0.03, 0.0, 0.01, 0.2, 0.3, 0.4)
    drive(lambda: site.speeds[-1] == 0, 0.0)
    b.model(bob.release_lease)
    b.reports("let go", bob, free)
    b.note("what modules heard", once_each(received.twists))
    refused = []
    for act in (lambda: bob.twist(0.1), lambda: bob.move(PLACE, TURN)):
        try:
            b.model(act)
        except NoLease as error:
            refused.append(str(error))
    still = b.robot(robots.of_twist, bridge, "Pat", v_max=0.1)
    try:
        b.model(still.twist, 0.1, 0.0, 0.2)
    except MotionError as error:
        refused.append(str(error))
    b.note("what was refused", b.tap.names.text("\n".join(refused)))


def a_program_sends_goals(b):
    site, bridge = b.site()
    bob = b.robot(robots.by_simple_goals, bridge, "Gail")
    received = b.model(bob.add_module, Receiver)
    b.tasks_up(site, "/initialpose")
    b.run(bob.acquire_lease())
    b.model(bob.locate, PLACE, TURN)
    b.until(lambda: site.received("publish", "/initialpose"), "the pose")
    b.model(bob.move, PLACE, TURN)
    b.until(lambda: site.received("publish", "/move_base_simple/goal"), "the goal")
    b.reports("sent", bob, lambda r: r["goal"])
    b.model(bob.cancel)
    b.reports("cancelled", bob, goal_is("cancelled"))
    b.until(lambda: received.goals, "the trigger")
    b.note("what modules heard", once_each(received.goals))
    alone = b.robot(robots.of_goals_alone, bridge, "Gus")
    b.tasks_up(site, "/goal")
    b.run(alone.acquire_lease())
    b.model(alone.move, PLACE, TURN)
    b.until(lambda: site.received("publish", "/goal"), "the goal")
    b.reports("without velocity", alone, lambda r: r["goal"])


class Receiver:
    """A module that records the velocities and goals that the gate sent."""

    def __init__(self, robot):
        self.twists, self.goals = [], []

    def on_send_twist(self, message):
        self.twists.append(message)

    def on_send_move(self, message):
        self.goals.append(message)


def once_each(messages):
    return "\n".join(dict.fromkeys(json.dumps(message) for message in messages))


def scan_assist(b):
    site, bridge = b.site()
    bob = b.robot(
        robots.that_assists, bridge, "Sue", blind="creep", creep=CREEP, brake=0.05
    )
    ann = b.page("Ann")
    ann.take(bob)
    ann.drive(bob, x=1.0, until=driven(site, CREEP))
    b.shows("blind", ann, bob, lambda r: "no scan yet" in str(r["why"]))
    site.repeated["/scan"] = scan_of(20.0)
    ann.drive(bob, x=1.0, until=driven(site, FULL))
    site.repeated["/scan"] = scan_of(0.44)
    ann.drive(bob, x=1.0, until=lambda: CREEP < site.speeds[-1] < FULL)
    b.shows("near a wall", ann, bob, lambda r: "away" in str(r["why"]))
    ann.release_inputs(bob)
    b.model(robots.no_assist, bob)
    b.until(lambda: not ann.report(bob)["mine"], "the new declaration")
    ann.take(bob)
    ann.drive(bob, x=1.0, until=driven(site, FULL))
    ann.release_inputs(bob)


def another_program_drives(b):
    site, bridge = b.site()
    site.publishers["/cmd_vel"] = ["/teleop", "/rosbridge_websocket"]
    bob = b.robot(robots.of_twist, bridge, "Otto")
    ann = b.page("Ann")
    b.until(lambda: free(ann.report(bob)), "a robot")
    velocity = {"linear": {"x": 0.1, "y": 0.0, "z": 0.0}}
    velocity["angular"] = {"x": 0.0, "y": 0.0, "z": 0.2}

    def written():
        site.publish("/cmd_vel", velocity)
        return "/teleop" in (ann.report(bob)["other_writer"] or "")

    time.sleep(2.1)  # just after a link opened, other writers are not reported
    b.until(written, "a report of the other program")


def a_stop_test(b):
    site, bridge = b.site()
    bob = b.robot(robots.of_unknown_stop, bridge, "Tess")
    ann = b.page("Ann")
    ann.take(bob)
    ann.rest(bob)

    def creeps():
        state = (ann.report(bob)["test"] or {"state": "failed"})["state"]
        if state == "failed":  # at first, and after a delay of a busy computer
            ann.rest(bob)
            ann.send_op("stop-test", robot=bob.id)
            time.sleep(0.2)
        return state == "waiting"

    b.until(creeps, "motion")
    site.now = REST  # without a zero velocity
    b.shows("tested", ann, bob, lambda r: r["test"]["state"] == "done")
    ann.inputs = None


def a_declaration_that_changes(b):
    b.tap.each_declaration = True
    site, bridge = b.site()
    _, second = b.site("other")
    bob = b.robot(robots.of_poses, bridge, "Cher")
    pages = b.page("Ann")

    def known(what, check):
        b.until(lambda: check(pages.report(bob)), what)
        b.shows(what, pages, bob, check)

    b.tasks_up(site, "/initialpose")
    known("told where it is", lambda r: r["locates"])
    b.model(robots.goals, bob, bridge)
    b.tasks_up(site, "/goal")
    known("goals later", lambda r: r["method"] == "topic")
    b.model(robots.velocity, bob, bridge, type="geometry_msgs/Twist")
    known("velocity later", lambda r: r["link"] == "up" and r["armable"])
    b.model(robots.odometry, bob, second)
    b.model(robots.alignment, bob, 1.0, 2.0, 45.0)
    b.model(robots.frames, bob, bridge, base_frame="base", map_frame="map")
    b.model(robots.assist, bob, [(0.2, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.2, -0.1)])
    limits = {"v_max": 0.5, "w_max": 0.75, "stops_within": 0.5}
    b.model(robots.velocity, bob, bridge, type="geometry_msgs/Twist", **limits)
    known("limits later", lambda r: r["v"] == 0.125 and r["stop_time"] == 0.5)
    b.model(robots.goals, bob, bridge, "/goal_pose", frame="hall")
    b.tasks_up(site, "/goal_pose")
    b.model(robots.goals, bob, bridge, action="/drive_to", on_operator_loss="cancel")
    known(
        "an action later", lambda r: r["method"] == "navigate_to_pose" and r["cancels"]
    )
    b.model(robots.velocity, bob, bridge, "/other/cmd_vel", type="geometry_msgs/Twist")
    known("another topic", lambda r: r["stop_time"] is None and r["armable"])
    b.model(robots.no_odometry, bob)
    b.model(robots.no_assist, bob)
    b.model(robots.no_goals, bob)
    known("no goals", lambda r: r["method"] is None)
    b.model(robots.no_velocity, bob)
    known("no velocity", lambda r: r["armable"] is False)
    b.until(
        lambda: site.received("unadvertise", "/other/cmd_vel"), "the end of the topic"
    )


def a_state_that_is_stored(b):
    """STOPs and stop tests that an earlier version stored apply to the robots."""
    for name, url, *where in STORED:
        robot = b.robot(robots.at, name, url, *where)
        seen = b.until(lambda r=robot: b.tap.reports.get(r.id), f"a report of {name}")
        stop = seen["stop"] or {"by": None, "id": None}
        if not stop["id"] or stop["id"].startswith("file-"):
            stop["id"] = None  # the file has none: made from the file
        tested = [seen[f"stop_{key}"] for key in ("source", "time", "date")]
        b.note(name, f"STOP by {stop['by']}, {stop['id']}\nstop test {tested}")


def every_option(b):
    """Every declared field has a value that is not the default."""
    _, bridge = b.site()
    _, other = b.site("other")
    full = b.robot(robots.with_everything, bridge, other, "Eve")
    b.reports("every option", full, lambda r: r["link"] == "up" and r["armable"])


def a_gate_that_dies(b):
    site, bridge = b.site()
    bob = b.robot(robots.by_simple_goals, bridge, "Zoe")
    two = b.robot(robots.of_goals_alone, bridge, "Zac")
    ann, vic = b.page("Ann"), b.page("Vic", "viewer")
    b.tasks_up(site, "/goal")
    ann.take(bob)
    ann.drive(bob, x=1.0, until=driven(site, FULL))
    vic.send_op("stop", robot=bob.id)
    b.until(lambda: ann.report(bob)["latched"], "an active STOP")
    ann.inputs = None
    ann.greeted = vic.greeted = False
    b.kill_the_gate()
    b.until(lambda: ann.greeted and vic.greeted, "another gate")
    b.shows("another gate", ann, bob, stop_confirmed)
    b.shows("another gate, the other robot", ann, two, free)


STORED = (
    ("Here", "ws://127.0.0.1:28461", "/cmd_vel"),
    ("Stamped", "WS://robot-two.EXAMPLE:9090/", "/base/cmd_vel"),
    ("Path", "wss://Robots.example/three/ros/", "cmd_vel"),
    ("Query", "ws://robot-six.example:80?id=7", "robot_6/cmd_vel"),
    ("Numbers", "ws://[fe80::1]:9090/", "/cmd_vel/"),
    ("Goals", "ws://robot-four.example/", "", "/goals/goal"),
    ("Tested", "ws://robot-five.example:9090/", "cmd_vel"),
    ("Never", "ws://Robot-Five.example:9090", "other/cmd_vel"),
    ("Lifted", "ws://robot-seven.example:9090", "cmd_vel"),
    ("Unreadable", "ws://robot-eight.example:9090", "cmd_vel"),
    ("Untouched", "ws://robot-nine.example:9090", "cmd_vel"),
)
"""Robots with files in tests/gate/stored_state, in other spellings: their names,
bridges, velocity topics and goal topics."""

SCRIPTS = {
    script.__name__: script
    for script in (
        a_robot_from_before_the_start,
        a_page_drives_by_twist,
        a_page_drives_by_stamped_twist,
        a_page_drives_at_the_speed_of_an_unknown_base,
        stop_and_reset,
        goals_by_a_topic,
        goals_by_move_base,
        goals_by_navigation,
        hand_over,
        a_program_drives,
        a_program_sends_goals,
        scan_assist,
        another_program_drives,
        a_stop_test,
        a_declaration_that_changes,
        every_option,
        a_state_that_is_stored,
        a_gate_that_dies,
    )
}


def main() -> None:
    """Play scripts and write their recordings."""
    result, mode, *names = sys.argv[1:]
    first, *others = SCRIPTS
    played = {}
    folder = tempfile.mkdtemp(prefix="wires-")
    os.environ["WEBMAP_STATE_DIR"] = folder
    shutil.copytree(STORED_STATE, folder, dirs_exist_ok=True)
    with Bench(recorded if mode == "compare" else lambda name: "") as bench:
        chosen = [name for name in others if not names or name in names]
        for name in (first, *chosen):
            began = time.monotonic()
            try:
                played[name] = bench.play(name, SCRIPTS[name])
            except Exception:
                played[name] = f"it failed:\n{traceback.format_exc()}"
            print(f"{name}: {time.monotonic() - began:.1f} s", flush=True)
            Path(result).write_text(json.dumps(played), "utf-8")
    shutil.rmtree(folder, ignore_errors=True)
    # At once: a normal exit would wait for a page that hangs.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
