"""``--topics``, for bridges that cannot say which topics there are."""

import subprocess
import sys
import tomllib

TOPICS = "/bob/odom [nav_msgs/msg/Odometry]\n/bob/cmd_vel [geometry_msgs/msg/Twist]\n"


def webmap(*arguments, told=""):
    return subprocess.run(
        [sys.executable, "-m", "webmap", *arguments],
        input=told,
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


def test_robots_of_a_list_are_found_without_asking_the_bridge():
    command = ("discover", "ws://127.0.0.1:1", "--topics", "-", "--toml")
    said = webmap(*command, told=TOPICS)
    assert said.returncode == 0, said.stderr
    (robot,) = tomllib.loads(said.stdout)["robots"]
    assert robot["name"] == "bob"
    assert "/bob/odom" in said.stdout


def test_a_wrong_line_is_said_with_its_number_and_what_was_expected():
    said = webmap("discover", "ws://127.0.0.1:1", "--topics", "-", told="/odom\n")
    assert said.returncode == 2
    assert said.stderr.startswith("Error: <stdin>, line 1: got '/odom'; expected a")


def test_a_list_is_of_one_bridge(tmp_path):
    topics = tmp_path / "topics.txt"
    topics.write_text(TOPICS)
    for command in ("discover", "doctor"):
        said = webmap(command, "ws://a:1", "ws://b:1", "--topics", str(topics))
        assert said.returncode == 2
        assert "one bridge, and 2 were given" in said.stderr


def test_help_shows_each_example_on_a_line_of_its_own():
    lines = webmap("discover", "--help").stdout.splitlines()
    assert "  webmap discover ws://robot:9090 --toml > fleet.toml" in lines


def test_a_list_without_an_end_is_refused():
    said = webmap("discover", "ws://127.0.0.1:1", "--topics", "/dev/zero")
    assert said.returncode == 2
    assert "has more than 4194304 characters, so it is no list of topics" in said.stderr


def test_a_list_that_is_not_utf_8_is_refused_with_a_sentence(tmp_path):
    (tmp_path / "list").write_bytes(b"/odom \xff")
    said = webmap("discover", "ws://127.0.0.1:1", "--topics", str(tmp_path / "list"))
    assert said.returncode == 2
    assert "list is not UTF-8" in said.stderr


def test_a_program_without_an_end_is_refused():
    said = webmap("run", "/dev/zero", "--no-browser")
    assert said.returncode == 2
    assert "/dev/zero: expected a file or a folder, got a device" in said.stderr
