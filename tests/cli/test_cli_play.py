"""``webmap play``: errors for files that cannot be played, and without rosbags."""

import json
import signal
import socket
import subprocess
import sys

import psutil
import pytest
from websockets.sync.client import connect

from equipment.bag_files import ODOMETRY, TWIST, Made
from equipment.command_line import run_inside
from webmap.bags import need_foxglove, need_rosbags
from webmap.bags.playback import PlaybackCommand
from webmap.base.errors import ConfigError
from webmap.cli.play import replay

pytestmark = pytest.mark.slow

COMMAND = [sys.executable, "-m", "webmap", "play", "--no-browser", "--port", "0"]


@pytest.fixture
def bag(tmp_path):
    made = Made("ros1")
    return made.bag(
        tmp_path / "office.bag",
        ("/odom", ODOMETRY, 0.0, made.odometry(0.0, 1.5)),
        ("/cmd_vel", TWIST, 1.0, made.message(TWIST)),
        ("/odom", ODOMETRY, 2.0, made.odometry(2.0, 1.5)),
    )


def run(*arguments):
    return subprocess.run(
        [*COMMAND, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


def assert_refused(done, message):
    assert done.returncode == 2, done.stderr
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_a_missing_file_prints_one_error_line_and_exits_with_code_2(tmp_path):
    done = run_inside("play", tmp_path / "gone.bag")
    assert_refused(done, "gone.bag: there is no such file or folder")
    assert len(done.stderr.splitlines()) == 1


def test_a_truncated_file_prints_one_error_line_and_exits_with_code_2(bag):
    data = bag.read_bytes()
    bag.write_bytes(data[: len(data) // 2])
    done = run(bag)
    assert_refused(done, "office.bag cannot be read as a recording: ")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--start", "5"), "is 2.0 s long, so it cannot be played from 5 s on"),
        (("--rate", "0"), "--rate"),
        (("--rate", "nan"), "--rate"),
        (("--rate", "1e9"), "0.001<=x<=1000"),
    ],
)
def test_an_invalid_start_or_rate_exits_with_code_2(bag, options, message):
    assert_refused(run_inside("play", bag, *options), message)


def test_a_command_to_an_ended_replay_prints_a_notice_and_raises_no_error(bag, capfd):
    with replay("--loop", "--", bag) as (url, give):
        assert url.startswith("ws://")
        (child,) = [
            p for p in psutil.Process().children() if "webmap.bags" in p.cmdline()
        ]
        child.kill()
        psutil.wait_procs([child], timeout=10)
        give(PlaybackCommand("again"))
    assert "The replay has ended" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("package", "need", "extras"),
    [
        ("rosbags", need_rosbags, "bags"),
        ("mcap", need_rosbags, "bags"),
        ("foxglove", need_foxglove, "bags,foxglove"),
    ],
)
def test_the_error_without_a_package_names_the_install_command(
    monkeypatch, package, need, extras
):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ConfigError) as refused:
        need()
    assert str(refused.value).endswith(f'pip install "webmap[{extras}]"')


def test_a_recording_is_served_to_foxglove_beside_the_page(bag):
    with subprocess.Popen(
        [*COMMAND, str(bag), "--loop", "--foxglove", "--foxglove-port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert "WebMap is ready at " in process.stdout.readline()
            lines = iter(process.stderr.readline, "")
            line = next(one for one in lines if one.startswith("Foxglove"))
            assert line.startswith("Foxglove and Lichtblick can connect to ws://127.")
            with connect(
                line.split()[-1], subprotocols=["foxglove.sdk.v1"], close_timeout=1
            ) as client:
                assert json.loads(client.recv(10))["name"] == "office.bag"
                channels = json.loads(client.recv(10))["channels"]
                assert {one["topic"] for one in channels} == {"/odom", "/cmd_vel"}
            process.send_signal(signal.SIGINT)
            printed = process.stderr.read()
            assert process.wait(15) == 0, printed
        finally:
            process.kill()
    assert "Traceback" not in printed


def test_a_port_for_foxglove_in_use_prints_an_error_and_exits_with_code_2(bag):
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = listener.getsockname()[1]
        done = run(bag, "--foxglove", "--foxglove-port", port)
    assert_refused(done, f"Foxglove cannot be served at 127.0.0.1:{port}: ")
    assert len(done.stderr.splitlines()) == 1


def test_a_file_that_was_cut_off_is_played_with_a_warning(tmp_path, capfd):
    made = Made("ros2")
    odometry = ("/odom", ODOMETRY, 0.0, made.odometry(0.0, 1.5))
    whole = made.bag(tmp_path / "office", odometry, odometry) / "office.mcap"
    data = whole.read_bytes()
    short = tmp_path / "short.mcap"
    short.write_bytes(data[:-100])
    with replay("--", short) as (url, _):
        assert url.startswith("ws://")
    printed = capfd.readouterr().err
    assert "short.mcap is played only up to where it can be read" in printed
    assert "`mcap recover`" in printed


def test_play_does_not_use_the_velocity_topic_of_a_recorded_robot(bag):
    with subprocess.Popen(
        [*COMMAND, str(bag), "--loop"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert "WebMap is ready at " in process.stdout.readline()
            process.send_signal(signal.SIGINT)
            printed = process.stderr.read()
            assert process.wait(15) == 0, printed
        finally:
            process.kill()
    (found,) = [line for line in printed.splitlines() if line.startswith("Found ")]
    assert found.startswith("Found office: odometry /odom")
    assert "cmd_vel" not in found


def test_a_bridge_port_in_use_prints_an_error_and_exits_with_code_2(bag):
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = listener.getsockname()[1]
        done = run(bag, "--bridge-port", port)
    assert_refused(done, f"port {port} on 127.0.0.1 is in use")
