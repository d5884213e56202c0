"""``webmap doctor``, ``discover`` and ``record`` with the address of an agent."""

import re
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from rosbags.highlevel import AnyReader

from webmap.agents import address as keys
from webmap.agents.peer import Peer, User
from webmap_process import simulator
from webmap_process import webmap as running

pytest.importorskip("zenoh")
pytestmark = pytest.mark.slow


def webmap(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "webmap", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@contextmanager
def agent(router, name, folder):
    with (
        simulator("--robots", "1") as url,
        running(
            *("agent", url, "--router", router, "--name", name),
            WEBMAP_STATE_DIR=str(folder / name),
        ) as address,
    ):
        wait_for_sign(router, name)
        yield address


def wait_for_sign(router, name):
    """Wait until an agent shows that it is there, once it knows that no other has its
    name."""
    signs, peer = [], Peer(router, User())
    peer.listen(keys.here(name), lambda *sign: signs.append(sign))
    peer.start()
    try:
        deadline = time.monotonic() + 30
        while not signs:
            assert time.monotonic() < deadline, "the agent gives no sign"
            time.sleep(0.05)
    finally:
        peer.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("agents")


@pytest.fixture(scope="module")
def router():
    with running("router", "--listen", "tcp/127.0.0.1:0") as address:
        yield address


@pytest.fixture(scope="module")
def bay1(router, folder):
    with agent(router, "bay1", folder) as address:
        yield address


def test_doctor_checks_the_only_agent_of_a_router(router, bay1):
    said = webmap("doctor", router, "--seconds", "1", "--try-call")
    assert said.returncode == 0, said.stdout + said.stderr
    assert said.stdout.startswith(f"{bay1}\n")
    assert "The agent's rosbridge listens on its own computer alone." in said.stdout
    assert re.search(r"/robot_0/odom: \d+\.\d messages a second", said.stdout)
    assert "A service call takes" in said.stdout
    assert "an agent lets a display offer no service" in said.stdout
    assert "Frames lead from map to robot_0/odom" in said.stdout


def test_doctor_checks_a_robot_of_an_agent_as_options_configure_it(bay1):
    given = ("--robot", "Bob:/robot_0/odom:/robot_0/cmd_vel:")
    said = webmap("doctor", bay1, "--seconds", "1", *given)
    assert said.returncode == 0, said.stdout + said.stderr
    assert "robots checked: Bob." in said.stdout


def test_discover_names_the_robots_of_an_agent(bay1):
    said = webmap("discover", bay1)
    assert said.returncode == 0, said.stderr
    assert "robot_0 (in /robot_0)" in said.stdout


def test_a_robot_of_an_agent_is_recorded(router, bay1, tmp_path):
    bag = tmp_path / "robot.bag"
    options = ("--topic", "/robot_0/odom", "--topic", "/map", "--duration", "4")
    said = webmap("record", router, *options, "--out", bag)
    assert said.returncode == 0, said.stderr
    assert f"Recording {bay1} to {bag}" in said.stdout
    with AnyReader([bag]) as reader:
        counts = {each.topic: each.msgcount for each in reader.connections}
    assert counts["/robot_0/odom"] > 5
    assert counts["/map"] >= 1


def test_commands_for_several_agents_check_all_or_list_them(router, bay1, folder):
    with agent(router, "bay2", folder) as bay2:
        found = webmap("discover", router)
        assert found.returncode == 0, found.stderr
        assert f"{bay1}: ROS 1" in found.stdout
        assert f"{bay2}: ROS 1" in found.stdout
        checked = webmap("doctor", router, "--seconds", "0.5")
        assert f"{bay1}\n" in checked.stdout
        assert f"{bay2}\n" in checked.stdout
        for more in (("record",), ("doctor", "--set", "robot_0.scan=/s")):
            refused = webmap(more[0], router, *more[1:])
            assert refused.returncode == 2
            assert f"one of them: {bay1}, {bay2}" in refused.stderr


def test_a_router_without_agents_or_that_is_away_is_named(router, tmp_path):
    away = "cannot reach the router at tcp/127.0.0.1:1: the connection was refused"
    said = webmap("doctor", "zenoh://127.0.0.1:1", "--wait", "1")
    assert said.returncode == 1
    assert f"WRONG    The agent cannot be reached: {away}" in said.stdout
    bag = tmp_path / "robot.bag"
    said = webmap("record", "zenoh://127.0.0.1:1/bay1", "--wait", "0", "--out", bag)
    assert said.returncode == 2
    assert away in said.stderr.splitlines()[-1]
    said = webmap("discover", f"{router}/bay9", "--wait", "0")
    assert said.returncode == 1
    assert "no answer from the agent bay9" in said.stderr


def test_a_router_without_agents_is_wrong_and_the_advice_starts_one():
    with running("router", "--listen", "tcp/127.0.0.1:0") as empty:
        said = webmap("doctor", empty, "--wait", "0")
        assert said.returncode == 1
        assert f"WRONG    The agent cannot be reached: no agent is at {empty}." in (
            said.stdout
        )
        found = webmap("discover", empty, "--wait", "0")
        assert found.returncode == 1
        assert f"--router {empty} --name NAME" in found.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("doctor", "zenoh://h/a", "--stop-test", "bob"), "press Stop test"),
        (("discover", "zenoh://h/a", "--toml"), "run webmap discover --toml on the"),
    ],
)
def test_what_only_the_robots_computer_can_do_is_refused_with_a_sentence(
    arguments, words
):
    said = webmap(*arguments)
    assert said.returncode == 2
    assert words in said.stderr
