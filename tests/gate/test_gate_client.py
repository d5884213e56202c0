"""The gate as a display uses it: a process of its own, with real peers."""

import os
import signal
import time

import pytest
from gate_page import Page
from gate_robot import FakeRobot

from equipment.declarations import changed, declared
from equipment.waiting import wait_for
from webmap.base.errors import ConfigError, MotionError, NoLease
from webmap.base.geometry import Twist
from webmap.config.motion import StopHook
from webmap.gate import protocol
from webmap.gate.display.client import GateClient

# A gate drives in real time, and waits for most of it.
pytestmark = [pytest.mark.slow, pytest.mark.serial]

JITTER = 0.15
"""Seconds that the computer that runs the tests may add to a limit."""


@pytest.fixture
def reports(client):
    seen = []
    removal = client.on_report(seen.append)
    yield seen
    removal.remove()


def of(reports, type):
    return [report for report in reports if isinstance(report, type)]


def first_zero_after(fake, at):
    return next((t for t, vx in fake.velocities if t > at and not vx), None)


class TestPages:
    def test_a_page_takes_control_drives_and_receives_reports_of_the_motion(
        self, page, fake
    ):
        page.drive_off(fake)
        assert page.of("hello")[0]["connection"] == page.connection.id
        wait_for(lambda: page.robot()["echoed"] == [0.25, 0, 0, 0, 0, 0], "the echo")
        wait_for(
            lambda: page.robot()["measured"] == [0.125, 0, -0.5, 0, 0, 0], "odometry"
        )
        report = page.robot()
        assert report["state"] == "driving"
        assert report["sent"] == [0.25, 0, 0, 0, 0, 0]
        assert (report["v"], report["w"], report["link"]) == (0.25, 1.5, "up")
        assert report["why"][0] == "limit of the robot"  # a busy computer adds another

    def test_velocities_have_their_own_socket_that_subscribes_then_advertises(
        self, page, fake
    ):
        page.drive_off(fake)
        page.x = 0.0
        wait_for(lambda: page.robot()["state"] == "held", "standstill")
        received = [t for t in fake.received if t.topic == "/cmd_vel"]
        assert [t.op for t in received[:2]] == ["subscribe", "advertise"]
        advertised = received[1].message
        assert (advertised["queue_size"], advertised["latch"]) == (1, False)
        assert len({t.link for t in received}) == 1
        velocity_link = received[0].link
        others = {t.topic for t in fake.received if t.link == velocity_link}
        assert others == {"/cmd_vel"}, "velocity has a socket of its own"

    def test_released_inputs_send_zeros_for_half_a_second_and_then_nothing(
        self, page, fake
    ):
        page.drive_off(fake)
        page.x = 0.0
        wait_for(lambda: fake.last_speed == 0, "a zero")
        wait_for(lambda: page.robot()["state"] == "held", "standstill")
        last_move = fake.moving[-1][0]
        zeros = [at for at, vx in fake.velocities if at > last_move]
        assert len(zeros) in range(8, 12)
        assert zeros[-1] - zeros[0] < 0.5 + JITTER
        time.sleep(0.3)
        assert fake.velocities[-1][0] == zeros[-1]

    def test_zero_is_sent_within_250_ms_when_a_page_sends_no_more_commands(
        self, page, fake
    ):
        page.drive_off(fake)
        page.x = None
        at = time.monotonic()
        zero = wait_for(lambda: first_zero_after(fake, at), "a zero")
        assert zero - fake.moving[-1][0] <= 0.25 + JITTER

    def test_closing_the_page_sends_zero_at_once(self, page, fake):
        page.drive_off(fake)
        at = time.monotonic()
        page.connection.close()
        zero = wait_for(lambda: first_zero_after(fake, at), "a zero")
        assert zero - at <= 0.1 + JITTER

    def test_stop_by_a_viewer_sends_zero_at_once_and_blocks_motion(
        self, page, client, fake
    ):
        viewer = Page(client, "Vic", "viewer")
        page.drive_off(fake)
        at = time.monotonic()
        viewer.send(op="stop", robot="*")
        zero = wait_for(lambda: first_zero_after(fake, at), "a zero")
        assert zero - at <= 0.05 + JITTER
        wait_for(lambda: fake.of("publish", "/cancel"), "the cancel")
        wait_for(lambda: page.robot()["latched"], "a report of the active STOP")
        assert page.robot()["holder"] is None
        moves = len(fake.moving)
        page.x = 1.0
        wait_for(lambda: page.of("refused"), "a refusal")
        assert len(fake.moving) == moves
        viewer.end()

    def test_only_one_of_two_pages_drives_and_both_see_the_operator(
        self, page, client, fake
    ):
        other = Page(client, "Ben")
        page.drive_off(fake)
        wait_for(lambda: other.robot().get("state") == "driving", "the report")
        assert other.robot()["holder"]["name"] == "Ann"
        assert not other.robot()["mine"]
        other.send(op="take", robot="r1")
        refused = wait_for(lambda: other.of("refused"), "a refusal")
        assert refused[0]["why"] == "Ann has control"
        other.end()

    def test_invalid_commands_move_nothing_and_many_close_the_connection(
        self, page, fake
    ):
        page.take()
        for rubbish in ("", "{", "\ud800", "x" * 5000, '{"op":NaN}', b"\xff\x00"):
            page.connection.receive(rubbish)
        wait_for(lambda: page.of("refused"), "a refusal")
        for _ in range(30):
            page.connection.receive("rubbish")
        wait_for(lambda: page.closed, "the request to close the page")
        assert fake.velocities == []

    def test_the_speed_limit_of_the_page_applies(self, page, fake):
        page.connection.set_speeds(0.125, 0.5)
        page.drive_off(fake)
        assert fake.last_speed == 0.125

    def test_a_page_that_connects_later_receives_reports_of_existing_robots(
        self, page, client
    ):
        wait_for(lambda: page.robot(), "the first report")
        late = Page(client, "Late")
        wait_for(lambda: late.robot(), "the report")
        assert [m["op"] for m in late.on_echo[:2]] == ["hello", "robot"]
        client.forget("r1")
        wait_for(lambda: late.of("gone"), "the end of the robot")
        client.forget("r1")
        late.end()

    def test_an_unknown_role_is_refused(self, client):
        with pytest.raises(ConfigError, match="boss"):
            client.connect("Ann", "boss", print, print)

    def test_a_failing_callback_is_logged_and_does_not_affect_other_pages(
        self, page, client, fake, caplog
    ):
        def fail(text):
            raise RuntimeError("broken page")

        removal = client.on_report(fail)
        client.connect("Broken", "operator", fail, fail)
        page.drive_off(fake)
        assert "a callback failed" in caplog.text
        assert "a listener to the gate failed" in caplog.text
        removal.remove()


class TestGoals:
    def test_a_goal_is_published_on_its_topic_and_reported(self, page, fake, reports):
        page.take()
        wait_for(lambda: self._goes(page, fake, 1), "the goal")
        pose = fake.of("publish", "/goal")[0].message["msg"]
        assert pose["header"] == {"stamp": {"secs": 0, "nsecs": 0}, "frame_id": "map"}
        assert pose["pose"]["position"] == {"x": 1.0, "y": 2.0, "z": 0.0}
        wait_for(lambda: of(reports, protocol.SentGoal), "the report of it")
        page.send(op="cancel", robot="r1")
        wait_for(lambda: fake.of("publish", "/cancel"), "the cancel")
        assert fake.of("publish", "/cancel")[0].message["msg"] == {}

    def test_action_goals_without_an_answer_can_still_be_cancelled(
        self, client, robot_spec
    ):
        with FakeRobot(answers_services=False) as fake:
            client.declare(
                changed(
                    robot_spec,
                    bridge_url=fake.url,
                    goal_topic=None,
                    cancel_topic=None,
                    action="/navigate_to_pose",
                )
            )
            page = Page(client)
            page.take()
            wait_for(lambda: self._goes(page, fake, 1), "the goal")
            first = fake.of("send_action_goal")[0]
            assert first.message["args"]["pose"]["header"]["stamp"] == {
                "sec": 0,
                "nanosec": 0,
            }
            # The first goal may hang in its socket; the second has its own socket.
            wait_for(lambda: self._goes(page, fake, 2), "a second goal")
            second = fake.of("send_action_goal")[1]
            assert second.link != first.link
            page.send(op="stop", robot="r1")
            call = wait_for(lambda: fake.of("call_service"), "the cancel")[0]
            assert call.message["service"] == "/navigate_to_pose/_action/cancel_goal"
            assert call.link not in (first.link, second.link)
            result = {"op": "action_result", "id": second.message["id"]}
            fake.send(second.link, result)
            wait_for(lambda: second.link not in fake._sockets, "its socket's end")
            page.end()

    def test_the_topics_of_move_base_report_the_progress_of_a_goal(
        self, client, robot_spec
    ):
        with FakeRobot() as fake:
            client.declare(
                changed(
                    robot_spec,
                    bridge_url=fake.url,
                    action="/move_base",
                    action_type="move_base_msgs/MoveBaseAction",
                    pose_topic="/initialpose",
                )
            )
            page = Page(client)
            page.take()

            def goal_of(state):
                goal = page.robot().get("goal") or {}
                return goal if goal.get("state") == state else None

            def sent():
                if not fake.of("publish", "/move_base/goal"):
                    page.goal()
                    time.sleep(0.05)
                return fake.of("publish", "/move_base/goal")

            received = wait_for(sent, "the goal")[0]
            seen = {t.topic: t for t in fake.of("subscribe")}
            assert seen["/move_base/result"].at < received.at, "no message is missed"
            id = received.message["msg"]["goal_id"]["id"]
            status = {"goal_id": {"id": id}, "status": 1, "text": ""}
            operation = {"op": "publish", "topic": "/move_base/status"}
            fake.send(received.link, {**operation, "msg": {"status_list": [status]}})
            wait_for(lambda: goal_of("under way"), "a goal that is under way")
            page.send(op="cancel", robot="r1")
            wait_for(lambda: fake.of("publish", "/move_base/cancel"), "the cancel")
            end = {**operation, "topic": "/move_base/result"}
            end["msg"] = {"status": {**status, "status": 2}, "result": {}}
            fake.send(received.link, end)
            wait_for(lambda: goal_of("cancelled"), "its end")
            wait_for(
                lambda: fake.of("unsubscribe", "/move_base/status"),
                "the end of the subscription",
            )
            page.goal(op="locate")
            pose = wait_for(lambda: fake.of("publish", "/initialpose"), "the pose")
            covariance = pose[0].message["msg"]["pose"]["covariance"]
            assert {n: v for n, v in enumerate(covariance) if v} == {
                0: 0.25,
                7: 0.25,
                35: 0.068,
            }
            page.end()

    def test_an_action_reports_its_goal_until_the_connection_is_lost(
        self, client, robot_spec
    ):
        with FakeRobot() as fake:
            client.declare(
                changed(robot_spec, bridge_url=fake.url, action="/navigate_to_pose")
            )
            page = Page(client)
            page.take()
            wait_for(lambda: self._goes(page, fake, 1), "the goal")
            goal = fake.of("send_action_goal")[0]
            assert goal.message["feedback"] is True
            feedback = {"op": "action_feedback", "id": goal.message["id"]}
            feedback["values"] = {"distance_remaining": 2.5, "number_of_recoveries": 1}
            fake.send(goal.link, feedback)
            wait_for(lambda: page.robot()["goal"].get("left") == 2.5, "the feedback")
            assert page.robot()["goal"]["recoveries"] == 1
            fake.cut(goal.link)
            wait_for(lambda: page.robot()["goal"]["state"] == "unknown", "its loss")
            wait_for(lambda: page.robot().get("armable"), "the link")
            assert len(fake.of("send_action_goal")) == 1
            page.end()

    def _goes(self, page, fake, number):
        """Send again until the link is open: a goal never waits for a link."""

        def goals():
            return len(fake.of("send_action_goal") + fake.of("publish", "/goal"))

        if goals() < number:
            page.goal()
            time.sleep(0.05)
        return goals() >= number


class TestProgram:
    def take(self, client):
        def attempt():
            try:
                return client.take("r1").result(5)
            except NoLease:
                return None

        return wait_for(attempt, "the lease")

    def test_a_program_drives_within_the_limits_and_receives_reports(
        self, client, robot_spec, fake, reports
    ):
        client.declare(robot_spec)
        self.take(client)

        def drive():
            client.twist("r1", Twist(9.0, 0.0, 0.5))
            return fake.moving

        wait_for(drive, "motion")
        assert fake.last_speed in (0.25, 0.0)
        wait_for(lambda: of(reports, protocol.SentTwist), "the report of it")
        sent = of(reports, protocol.SentTwist)[0]
        assert (sent.vx, sent.wz, sent.by) == (0.25, 0.5, "program")
        at = fake.moving[-1][0]
        zero = wait_for(lambda: first_zero_after(fake, at), "a zero")
        assert zero - fake.moving[-1][0] <= 0.25 + JITTER

    def test_a_program_sends_and_cancels_goals(self, client, robot_spec, fake):
        client.declare(robot_spec)
        self.take(client)

        def move():
            client.move("r1", 1.0, 2.0, 0.5)
            time.sleep(0.05)
            return fake.of("publish", "/goal")

        wait_for(move, "the goal")
        client.cancel("r1")
        wait_for(lambda: fake.of("publish", "/cancel"), "the cancel")
        client.release("r1")
        with pytest.raises(NoLease):
            client.move("r1", 1.0, 2.0, 0.5)

    def test_a_program_without_the_lease_is_refused_at_once(self, client, robot_spec):
        client.declare(robot_spec)
        with pytest.raises(NoLease, match="'r1'"):
            client.twist("r1", Twist(0.1))

    def test_numbers_that_are_not_finite_are_refused_at_once(self, client):
        with pytest.raises(MotionError):
            client.twist("r1", Twist(float("nan")))
        with pytest.raises(MotionError):
            client.move("r1", 0.0, float("inf"), 0.0)

    def test_a_program_cannot_take_control_of_a_driven_robot(self, client, page, fake):
        page.drive_off(fake)
        with pytest.raises(NoLease, match="Ann has control"):
            client.take("r1").result(5)

    def test_a_program_is_refused_after_an_operator_has_taken_control(
        self, client, page, fake
    ):
        self.take(client)
        fake.at_rest = True
        page.take()

        def refused():
            try:
                client.twist("r1", Twist(0.1))
            except NoLease:
                return True
            return False

        wait_for(refused, "a refusal")
        assert fake.moving == []

    def test_stop_by_a_program_stops_a_robot_driven_by_a_page(self, client, page, fake):
        page.drive_off(fake)
        at = time.monotonic()
        client.stop_robot(None)
        assert wait_for(lambda: first_zero_after(fake, at), "a zero")

    def test_a_gate_that_does_not_run_gives_no_lease(self):
        client = GateClient()
        with pytest.raises(NoLease, match="is not running"):
            client.take("r1").result(1)
        client.stop_robot("r1")
        client.stop()


class TestLinks:
    def test_a_new_link_starts_with_zero_and_requires_released_inputs(self, page, fake):
        page.drive_off(fake)
        links = {t.link for t in fake.received}
        fake.cut_all()

        def again():
            return [t for t in fake.of("publish", "/cmd_vel") if t.link not in links]

        after = wait_for(again, "a velocity on the new link")
        assert after[0].message["msg"]["linear"]["x"] == 0
        wait_for(lambda: page.robot()["link"] == "up", "the report of it")
        moves = len(fake.moving)
        time.sleep(0.5)
        assert len(fake.moving) == moves
        page.x = 0.0
        wait_for(lambda: page.robot()["armed"], "an armed driver")
        page.x = 1.0
        wait_for(lambda: len(fake.moving) > moves, "motion")

    def test_after_a_stall_few_late_velocities_arrive_and_the_last_is_zero(
        self, page, fake
    ):
        page.drive_off(fake)
        before = len(fake.velocities)
        fake.hold()
        wait_for(lambda: not page.robot()["armed"], "a gate that noticed the stall")
        wait_for(lambda: page.robot()["link"] == "down", "a link that is cut")
        fake.go_on()
        wait_for(lambda: page.robot()["link"] == "up", "another link")
        wait_for(lambda: fake.last_speed == 0, "a zero")
        late = [vx for _, vx in fake.velocities[before:]]
        assert len([vx for vx in late if vx]) <= 9
        assert late[-1] == 0

    def test_a_robot_whose_odometry_ends_is_stopped_with_a_reason(self, page, fake):
        page.drive_off(fake)
        fake.sends_odometry = False
        wait_for(lambda: fake.last_speed == 0, "a zero", 3.0)
        wait_for(lambda: page.robot()["reason"] == "no odometry for 1 s", "the reason")


class TestLifecycle:
    def test_a_killed_gate_is_restarted_and_restores_everything_but_leases(
        self, client, page, fake, reports
    ):
        page.drive_off(fake)
        page.x = None
        pid = client.pid
        os.kill(pid, signal.SIGKILL)
        wait_for(lambda: of(reports, protocol.GateDown), "the report of it")
        wait_for(lambda: len(page.of("hello")) == 2, "a new greeting")
        wait_for(lambda: page.robot().get("link") == "up", "a new link")
        assert client.pid != pid
        # The newest report may still be the last report of the killed gate.
        wait_for(lambda: page.robot()["holder"] is None, "a robot without a holder")
        # The robot was driven, so the new gate first sends zero.
        wait_for(lambda: fake.last_speed == 0, "a zero")
        page.drive_off(fake)

    def test_a_pending_request_to_a_killed_gate_is_answered_with_an_error(
        self, client, robot_spec
    ):
        client.declare(robot_spec)
        wait_for(lambda: client.ready, "a gate")
        os.kill(client.pid, signal.SIGSTOP)
        future = client.take("r1")
        os.kill(client.pid, signal.SIGKILL)
        with pytest.raises(NoLease, match="the gate has ended"):
            future.result(10)

    def test_ending_the_gate_sends_zero_to_a_driven_robot_within_100_ms(
        self, client, page, fake
    ):
        page.drive_off(fake)
        at = time.monotonic()
        client.stop()
        assert time.monotonic() - at < 1.5
        zero = first_zero_after(fake, at)
        assert zero is not None
        assert zero - at < 0.1 + JITTER
        assert fake.moving[-1][0] < zero

    def test_a_missing_heartbeat_of_the_display_sends_zero_within_300_ms(
        self, client, page, fake
    ):
        page.drive_off(fake)
        client._supervisor.end_heartbeat()  # only the heartbeat ends
        at = time.monotonic()
        zero = wait_for(lambda: first_zero_after(fake, at), "a zero")
        assert zero - at <= 0.3 + JITTER
        moves = len(fake.moving)
        time.sleep(0.3)
        assert len(fake.moving) == moves

    @pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
    def test_a_signal_to_the_gate_sends_zero_and_ends_the_gate(
        self, client, page, fake, number, reports
    ):
        page.drive_off(fake)
        at = time.monotonic()
        os.kill(client.pid, number)
        zero = wait_for(lambda: first_zero_after(fake, at), "a zero")
        assert zero - at < 0.05 + JITTER
        wait_for(lambda: of(reports, protocol.GateDown), "its end")

    def test_a_second_gate_on_this_computer_shows_the_robot_but_cannot_drive(
        self, client, page, robot_spec
    ):
        page.take()
        second = GateClient()
        second.start()
        second.declare(robot_spec)
        other = Page(second)
        wait_for(lambda: other.robot().get("reason"), "a reason")
        assert not other.robot()["armable"]
        wait_for(lambda: "another WebMap" in other.robot()["reason"], "the reason")
        client.forget("r1")
        wait_for(lambda: other.robot()["armable"], "the lock", 5.0)
        other.end()
        second.stop()

    def test_declaring_an_invalid_robot_raises_a_config_error(self, client):
        spec = declared(bridge_url="ws://x", twist_topic="/cmd_vel", v_max=-1.0)
        with pytest.raises(ConfigError):
            client.declare(spec)

    def test_starting_the_client_twice_starts_one_gate(self, client):
        wait_for(lambda: client.ready, "a gate")
        pid = client.pid
        client.start()
        assert client.pid == pid
        client.stop()
        client.stop()
        assert client.pid is None
        client.start()
        wait_for(lambda: client.ready, "a gate")


class TestActiveStop:
    def test_a_stop_stays_active_after_the_gate_was_killed(self, page, client, fake):
        page.drive_off(fake)
        client.stop_robot("r1")
        wait_for(lambda: page.robot().get("latched"), "a report of the active STOP")
        page.robots.clear()
        os.kill(client.pid, signal.SIGKILL)
        wait_for(lambda: page.robot().get("latched"), "the STOP of the first gate")
        assert page.robot()["state"] == "stopped"
        assert page.robot()["stop"]["by"] == "program"
        at, moves = time.monotonic(), len(fake.moving)
        page.x = 1.0
        page.send(op="take", robot="r1")

        def refused(what):
            return [r["why"] for r in page.of("refused") if r["what"] == what]

        assert "reset it first" in wait_for(lambda: refused("take"), "a refusal")[-1]
        wait_for(lambda: first_zero_after(fake, at), "further zeros")
        page.send(op="reset", robot="r1")
        wait_for(lambda: page.robot().get("armable") or refused("reset"), "an answer")
        if refused("reset"):  # the display has repeated its STOP to the new gate
            page.send(op="reset", robot="r1")
        wait_for(lambda: page.robot().get("armable"), "a free robot")
        assert len(fake.moving) == moves
        page.x = 0.0
        page.drive_off(fake)

    def test_a_stop_stays_active_after_the_client_was_restarted(
        self, client, robot_spec
    ):
        client.declare(robot_spec)
        seen = []
        client.on_report(seen.append)
        client.stop_robot(None)

        def latched():
            return [r for r in of(seen, protocol.RobotReport) if r.latched]

        wait_for(latched, "a report of the active STOP")
        client.stop()
        seen.clear()
        client.start()
        wait_for(latched, "the earlier STOP")

        def reset():
            # The new gate may receive the STOP again, which then has a new identity.
            client.reset("r1", latched()[-1].stop.id)
            return not of(seen, protocol.RobotReport)[-1].latched

        wait_for(reset, "the reset")

    def test_a_stop_is_confirmed_only_when_odometry_shows_standstill(
        self, page, client, fake
    ):
        page.drive_off(fake)
        client.stop_robot("r1")

        def confirmed():
            return (page.robot().get("stop") or {}).get("confirmed")

        wait_for(lambda: confirmed() is False, "a report of motion")
        assert page.robot()["stop"]["why"].startswith("still moving at 0.1")
        fake.at_rest = True
        wait_for(confirmed, "a confirmed STOP")

    def test_a_stop_stays_active_for_a_robot_that_is_removed_and_declared_again(
        self, page, client, robot_spec, fake
    ):
        page.drive_off(fake)
        pid = client.pid
        client.stop_robot("r1")
        wait_for(lambda: page.robot().get("latched"), "a report of the active STOP")
        at = time.monotonic()  # then a removal takes effect at once
        wait_for(lambda: fake.velocities[-1][0] - at > 0.6, "further zeros")
        client.forget("r1")
        wait_for(lambda: page.of("gone"), "the end of the robot")
        page.robots.clear()
        client.declare(robot_spec)
        wait_for(lambda: page.robot().get("latched"), "the earlier STOP")
        fake.at_rest = True
        wait_for(lambda: (page.robot()["stop"] or {}).get("confirmed"), "standstill")
        assert client.pid == pid

    def test_a_reset_without_a_running_gate_raises_no_error(self):
        GateClient().reset("r1", "s1")

    def test_stop_hooks_run_on_stop_and_reset_clears_the_topic_hook(
        self, client, robot_spec, fake
    ):
        hooks = (
            StopHook(topic="/lock", type="std_msgs/Bool"),
            StopHook(service="/e_stop", type="std_srvs/Trigger"),
        )
        spec = changed(robot_spec, stop_hooks=hooks, action="/go")
        client.declare(spec)
        page = Page(client)
        wait_for(lambda: page.robot().get("armable"), "a link")
        page.send(op="stop", robot="r1")

        def flags():
            return [t.message["msg"]["data"] for t in fake.of("publish", "/lock")]

        wait_for(lambda: flags() == [True], "the flag")

        def called():
            return {t.message["service"] for t in fake.of("call_service")}

        wait_for(lambda: "/e_stop" in called(), "the call")
        assert "/go/_action/cancel_goal" in called()
        page.send(op="reset", robot="r1")
        wait_for(lambda: flags() == [True, False], "the cleared flag")
        page.end()
        client.forget("r1")


class TestInputs:
    def test_control_changes_from_page_to_page_at_standstill(self, page, client, fake):
        other = Page(client, "Ben")
        page.drive_off(fake)
        other.send(op="ask", robot="r1")
        wait_for(lambda: page.robot().get("asker"), "the request for control")
        page.send(op="grant", robot="r1")
        wait_for(lambda: page.robot().get("changing"), "the change")
        page.x = None
        assert not other.robot()["mine"]
        fake.at_rest = True
        wait_for(lambda: other.robot().get("mine"), "the lease")
        other.end()

    def test_a_stop_test_measures_the_command_timeout_and_keeps_the_result(
        self, client, robot_spec, fake
    ):
        spec = changed(robot_spec, stops_within=None)
        client.declare(spec)
        page = Page(client)
        fake.at_rest = True
        page.take()
        page.x = 0.0
        wait_for(lambda: page.robot().get("measured"), "odometry")
        wait_for(lambda: page.robot().get("armed"), "an armed driver")
        page.send(op="stop-test", robot="r1")
        wait_for(lambda: fake.moving, "creeping")
        assert fake.moving[0][1] == 0.1
        fake.at_rest = False

        def state():
            return (page.robot().get("test") or {}).get("state")

        wait_for(lambda: state() == "waiting", "silence")
        fake.at_rest = True
        wait_for(lambda: state() == "done", "the result")
        wait_for(lambda: page.robot()["stop_source"] == "tested", "the date")
        assert page.robot()["stop_time"] < 2
        client.stop()
        client.start()
        wait_for(lambda: page.robot().get("stop_date"), "the earlier result")
        page.end()
