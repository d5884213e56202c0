"""``webmap doctor --stop-test`` with bases that stop by themselves and that do not."""

import datetime
import json
import re
import signal
import subprocess
import sys
import time

import pytest

from equipment.webmap_process import simulator
from webmap.discovery.doctor.stop_test import GOES_ON, STOPS, UNKNOWN, StopTestClient
from webmap.gate.disk import Records
from webmap.gate.events import Key, Press, StopRecord
from webmap.gate.rules.stop_test import MOVES_ON
from webmap.testing import WitnessRobot

# On a busy machine the simulator's clock lags and a driver sends nothing.
pytestmark = pytest.mark.serial

TODAY = datetime.datetime.now().astimezone().date().isoformat()


def command(url, *arguments):
    return [sys.executable, "-m", "webmap", "doctor", url, "--stop-test", *arguments]


def run(url, *arguments, typed=""):
    return subprocess.run(
        command(url, *arguments),
        capture_output=True,
        input=typed,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))
    return tmp_path


def test_a_base_with_a_command_timeout_passes_and_the_result_is_stored(folder):
    with simulator("--port", "0", "--robot-timeout", "0.25") as url:
        result = run(url, "robot_1", "--yes")
    assert result.returncode == 0, result.stdout + result.stderr
    found = re.search(r"of (\S+): the base stops by itself in (\S+) s", result.stdout)
    assert found, result.stdout
    assert found[1] == TODAY
    assert 0.25 <= float(found[2]) < 0.8
    kept = Records(folder).stop_test_of(Key(url, "/robot_1/cmd_vel"))
    assert kept.seconds == pytest.approx(float(found[2]), abs=0.006)


def test_a_base_without_a_command_timeout_fails_even_after_an_earlier_pass(folder):
    with simulator("--port", "0", "--robot-timeout", "0") as url:
        key = Key(url, "/robot_0/cmd_vel")
        Records(folder).keep_stop_test(key, StopRecord(0.3, TODAY))
        result = run(url, "robot_0", "--yes")
    assert result.returncode == 1, result.stdout + result.stderr
    assert "no more commands: waiting until the base stops" in result.stdout
    assert f"Result of {TODAY}: the base does NOT stop by itself" in result.stdout
    assert Records(folder).stop_test_of(key).seconds is None


def test_the_robot_does_not_move_if_the_user_declines(folder):
    with WitnessRobot() as robot:
        result = run(robot.url, "robot", typed="n\n")
        moving = robot.log.moving_since(0.0)
    assert result.returncode == 2
    assert "will creep forward at 0.1 m/s" in result.stdout
    assert "Nothing was moved." in result.stdout
    assert moving == []


def test_a_stop_test_moves_slowly_and_ends_with_zero_when_interrupted(folder):
    with WitnessRobot(timeout=None) as robot:
        with subprocess.Popen(
            command(robot.url, "robot", "--yes"),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        ) as process:
            for line in process.stdout:
                if "no more commands" in line:
                    break
            process.send_signal(signal.SIGINT)
            rest = process.stdout.read()
            assert process.wait(10) == 2
        moving = robot.log.moving_since(0.0)
        ended = robot.log.twists[-1]
    assert "the robot is stopped" in rest
    assert moving
    assert max(received.speed for received in moving) <= 0.1 + 1e-9
    assert ended.is_zero
    assert time.monotonic() > ended.at > moving[-1].at


def test_a_robot_with_an_active_stop_is_not_moved(folder):
    with WitnessRobot() as robot:
        Records(folder).keep_latch(
            Key(robot.url, "/cmd_vel"), Press("Ann", "a1"), frozenset()
        )
        result = run(robot.url, "robot", "--yes")
        assert robot.log.moving_since(0.0) == []
    assert result.returncode == 2
    assert "The stop test gave no result: STOP" in result.stdout


def test_an_unknown_robot_is_an_error_that_lists_the_known_robots(ros1, folder):
    result = run(ros1, "robot_7", "--yes")
    assert result.returncode == 2
    assert "no robot 'robot_7'" in result.stderr
    assert "robot_0, robot_1" in result.stderr


def test_an_unreachable_bridge_gives_no_result_and_no_traceback():
    result = run("ws://127.0.0.1:1", "robot_0", "--yes", "--wait", "0")
    assert result.returncode == 2
    assert "The stop test gave no result" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_test_interrupted_before_the_bridge_opens_gives_no_result(number):
    with subprocess.Popen(
        command("ws://127.0.0.1:1", "robot_0", "--yes", "--wait", "30"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert "Waiting for the bridge" in process.stderr.readline()
        process.send_signal(number)
        assert "nothing was moved" in process.stdout.read()
        assert process.wait(10) == UNKNOWN


def test_two_urls_are_refused():
    result = run("ws://127.0.0.1:1", "robot_0", "ws://127.0.0.1:2")
    assert result.returncode == 2
    assert "--stop-test takes one URL, got 2" in result.stderr


# Tests of the client without a gate.

FREE = {
    "op": "robot",
    "mine": False,
    "armable": True,
    "armed": False,
    "latched": False,
    "reason": None,
    "epoch": None,
    "test": None,
    "stop_source": None,
    "stop_time": None,
    "stop_date": None,
}
MINE = {**FREE, "mine": True, "armed": True, "epoch": 3}


def client_that_tests():
    """Return a client whose robot moves slowly."""
    client = StopTestClient(0.0)
    client.receive({"op": "tick", "tick": 7}, 0.0)
    client.receive(FREE, 0.0)
    client.begin(0.0)
    client.receive(MINE, 0.1)
    client.receive({**MINE, "test": {"state": "creeping", "text": "creeping"}}, 0.2)
    return client


def test_the_client_takes_control_only_after_the_user_agrees():
    client = StopTestClient(0.0)
    client.receive(FREE, 0.0)
    assert client.stage == "ready"
    assert client.step(60.0) == []
    client.begin(60.0)
    assert client.step(60.0) == [{"op": "take", "robot": "r1"}]
    assert client.step(60.05) == [], "the client does not send it in each step"


def test_the_client_sends_only_released_inputs():
    client = client_that_tests()
    (state,) = client.step(0.25)
    assert json.dumps(state) == (
        '{"op": "drive", "robot": "r1", "epoch": 3, "seq": 1, "tick": 7, '
        '"x": 0.0, "y": 0.0, "turn": 0.0}'
    )


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ({"op": "hello", "connection": "c2"}, "the gate restarted in the meantime"),
        ({"op": "refused", "what": "lease", "why": "STOP by Ann"}, "STOP by Ann"),
        (
            {**MINE, "test": {"state": "failed", "text": "an input was used"}},
            "an input was used",
        ),
    ],
)
def test_the_client_ends_without_result_when_the_test_cannot_continue(words, why):
    client = client_that_tests()
    client.receive(words, 0.3)
    assert client.stage == "over"
    assert client.code == UNKNOWN
    assert client.news[-1] == f"The stop test gave no result: {why}."


def test_the_client_waits_ten_seconds_and_then_reports_why_control_is_impossible():
    client = StopTestClient(0.0)
    client.receive({**FREE, "armable": False, "reason": "another WebMap has it"}, 1.0)
    assert client.step(9.0) == []
    assert client.stage == "coming"
    client.step(10.1)
    assert client.news == ["The stop test gave no result: another WebMap has it."]


@pytest.mark.parametrize(
    ("test", "before", "after", "code"),
    [
        ({"state": "failed", "text": MOVES_ON}, 0.3, None, GOES_ON),
        (
            {"state": "done", "text": "the base stopped after 0.26 s"},
            None,
            0.264,
            STOPS,
        ),
    ],
)
def test_the_client_ignores_the_result_of_an_earlier_stop_test(
    test, before, after, code
):
    client = client_that_tests()
    kept = {**MINE, "test": test, "stop_source": "tested", "stop_date": TODAY}
    client.receive({**kept, "stop_time": before}, 0.3)
    assert client.stage == "testing"
    client.receive({**kept, "stop_time": after}, 0.4)
    assert client.stage == "over"
    assert client.code == code
    assert TODAY in client.news[-1]
