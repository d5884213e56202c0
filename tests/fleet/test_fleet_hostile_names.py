"""Commands print names and texts that contain terminal control characters safely."""

import functools
import json
import re
import subprocess
import sys
import threading
import tomllib
from contextlib import contextmanager
from pathlib import Path

import pytest
from websockets.sync.server import serve

import webmap.cli as webmap_cli
from webmap.base.echo import LONGEST, echo
from webmap.discovery.findings import Findings, FoundRobot, Layers
from webmap.discovery.fleet_toml import fleet_toml
from webmap.discovery.tables import report

pytestmark = pytest.mark.slow

EVIL = "\n[[robots]]\r\x1b[2J\x1b]0;mine\x07\x9b31m\u202eevil"
TOPICS = {
    "/bob/odom": "nav_msgs/Odometry",
    "/bob/cmd_vel": "geometry_msgs/Twist",
    "/bob/base_scan": "sensor_msgs/LaserScan",
    "/tf": "tf2_msgs/TFMessage",
}
TURN = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
STAMP = {"secs": 1, "nsecs": 0}
FRAME = {
    "header": {"frame_id": "map", "stamp": STAMP},
    "child_frame_id": f"evil{EVIL}/base_link",
    "transform": {"translation": TURN, "rotation": TURN},
}
MESSAGES = {
    "/tf": {"transforms": [FRAME]},
    "/bob/odom": {"header": {"frame_id": EVIL}, "child_frame_id": EVIL},
    "/bob/base_scan": {
        "header": {"seq": 0, "stamp": STAMP, "frame_id": EVIL},
        EVIL: EVIL,
    },
}


def answered(socket, *, knows_topics):
    for frame in socket:
        asked = json.loads(frame)
        if asked["op"] == "subscribe":
            message = MESSAGES.get(asked["topic"], {})
            reply = {"op": "publish", "topic": asked["topic"], "msg": message}
        elif asked["op"] == "call_service":
            known = knows_topics and asked["service"] == "/rosapi/topics"
            values = {"topics": [*TOPICS], "types": [*TOPICS.values()]}
            reply = {
                "op": "service_response",
                "service": asked["service"],
                "id": asked.get("id"),
                "result": known,
                "values": values if known else f"there is no such service{EVIL}",
            }
        else:
            reply = {"op": "status", "level": "error", "msg": f"no{EVIL}"}
        socket.send(json.dumps(reply))


@contextmanager
def bridge(*, knows_topics):
    """Yield the address of a bridge with such frames or such errors."""
    answer = functools.partial(answered, knows_topics=knows_topics)
    with serve(answer, "127.0.0.1", 0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"ws://127.0.0.1:{server.socket.getsockname()[1]}"
        server.shutdown()
        thread.join()


def webmap(*arguments):
    done = subprocess.run(
        [sys.executable, "-m", "webmap", *arguments],
        capture_output=True,
        timeout=60,
        check=False,
    )
    return done.stdout.decode() + done.stderr.decode()


def assert_harmless(output):
    assert "evil" in output, output
    lines = output.split("\n")
    assert [line for line in lines if not line.isprintable()] == []
    assert [line for line in lines if line.startswith("[[robots]]\\r")] == []


def test_doctor_escapes_control_characters_in_frame_names():
    with bridge(knows_topics=True) as url:
        assert_harmless(webmap("doctor", "--seconds", "0.5", url))


def test_the_discovery_report_escapes_control_characters_in_robot_names():
    robot = FoundRobot(name=f"Bob{EVIL}", namespace="", notes=(EVIL,))
    assert_harmless(report("ws://127.0.0.1:1", Findings(robots=(robot,))))


def test_record_escapes_control_characters_in_field_names(tmp_path):
    with bridge(knows_topics=True) as url:
        out = str(tmp_path / "bag")
        assert_harmless(webmap("record", url, "--duration", "1", "--out", out))


@pytest.mark.parametrize(
    "command",
    [
        ("discover",),
        ("doctor", "--seconds", "0.5"),
        ("doctor", "--stop-test", "nobody"),
        ("view", "--show"),
        ("record", "--duration", "1"),
    ],
)
def test_commands_escape_control_characters_in_errors_of_a_bridge(command):
    with bridge(knows_topics=False) as url:
        assert_harmless(webmap(*command, url))


def test_a_robot_name_with_control_characters_adds_no_lines_to_a_fleet_file():
    robot = FoundRobot(name=f"Bob{EVIL}\x7f", namespace="", guesses={}, notes=(EVIL,))
    findings = Findings(robots=(robot,), layers={"": Layers()})
    data = tomllib.loads(fleet_toml([("b", "ws://127.0.0.1:1", findings)]))
    assert [one["name"] for one in data["robots"]] == [f"Bob{EVIL}\x7f"]


def test_commands_print_only_through_the_echo_function():
    package = Path(webmap_cli.__file__).parents[1]
    raw = ("click.echo(", "click.secho(", "print(")
    found = {
        (file.name, line.strip())
        for names in ("base/*.py", "bags/record.py", "cli/*.py", "fleet/*.py")
        for file in package.glob(names)
        for line in file.read_text("utf-8").splitlines()
        if any(word in re.sub(r"\w+print\(", "", line) for word in raw)
    }
    allowed = {
        "discover.py": "click.echo(text, nl=False)",  # escaped as in TOML
        "echo.py": "click.echo((lines_of if lines",
        "log.py": "click.echo(csv_of(chosen), nl=False)",  # escaped when noted
        "record.py": 'click.echo(f"\\r{text.ljust(',  # only numbers
    }
    assert {name for name, _ in found} == set(allowed)
    assert all(line.startswith(allowed[name]) for name, line in found)


def test_echo_prints_one_line_of_limited_length(capsys):
    echo(EVIL + "x" * 100_000)
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    assert len(out) == LONGEST + 1
