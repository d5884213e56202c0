"""``webmap doctor``, ``discover`` and ``record`` with the URL of an agent."""

import re
import subprocess
import sys
from contextlib import contextmanager

import pytest
from rosbags.highlevel import AnyReader

from equipment.waiting import wait_for
from equipment.webmap_process import simulator
from equipment.webmap_process import webmap as running
from webmap.agents import address as keys
from webmap.agents.peer import Peer
from webmap.agents.router_access import RouterUser

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
    """Wait until an agent publishes its sign of life.

    An agent publishes the sign once it knows that no other agent has its name.
    """
    signs, peer = [], Peer(router, RouterUser())
    peer.listen(keys.beacon(name), lambda *sign: signs.append(sign))
    peer.start()
    try:
        wait_for(lambda: signs, "a sign of life from the agent")
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


@pytest.mark.serial  # it measures rates
def test_doctor_checks_the_only_agent_of_a_router(router, bay1):
    result = webmap("doctor", router, "--seconds", "1", "--try-call")
    assert result.returncode == 0, result.stdout + result.stderr
    assert result.stdout.startswith(f"{bay1}\n")
    assert "The agent's rosbridge listens on its own computer alone." in result.stdout
    assert re.search(r"/robot_0/odom: \d+\.\d messages a second", result.stdout)
    assert "A service call takes" in result.stdout
    assert "an agent lets a display offer no service" in result.stdout
    assert "Frames lead from map to robot_0/odom" in result.stdout


def test_doctor_checks_a_robot_of_an_agent_as_options_configure_it(bay1):
    given = ("--robot", "Bob:/robot_0/odom:/robot_0/cmd_vel:")
    result = webmap("doctor", bay1, "--seconds", "1", *given)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "robots checked: Bob." in result.stdout


def test_discover_names_the_robots_of_an_agent(bay1):
    result = webmap("discover", bay1)
    assert result.returncode == 0, result.stderr
    assert "robot_0 (in /robot_0)" in result.stdout


def test_a_robot_of_an_agent_is_recorded(router, bay1, tmp_path):
    bag = tmp_path / "robot.bag"
    options = ("--topic", "/robot_0/odom", "--topic", "/map", "--duration", "4")
    result = webmap("record", router, *options, "--out", bag)
    assert result.returncode == 0, result.stderr
    assert f"Recording {bay1} to {bag}" in result.stdout
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
    result = webmap("doctor", "zenoh://127.0.0.1:1", "--wait", "1")
    assert result.returncode == 1
    assert f"WRONG    The agent cannot be reached: {away}" in result.stdout
    bag = tmp_path / "robot.bag"
    result = webmap("record", "zenoh://127.0.0.1:1/bay1", "--wait", "0", "--out", bag)
    assert result.returncode == 2
    assert away in result.stderr.splitlines()[-1]
    result = webmap("discover", f"{router}/bay9", "--wait", "0")
    assert result.returncode == 1
    assert "no answer from the agent bay9" in result.stderr


def test_a_router_without_agents_is_wrong_and_the_advice_starts_one():
    with running("router", "--listen", "tcp/127.0.0.1:0") as empty:
        result = webmap("doctor", empty, "--wait", "0")
        assert result.returncode == 1
        assert f"WRONG    The agent cannot be reached: no agent is at {empty}." in (
            result.stdout
        )
        found = webmap("discover", empty, "--wait", "0")
        assert found.returncode == 1
        assert f"--router {empty} --name NAME" in found.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("doctor", "zenoh://h/a", "--stop-test", "bob"), "press Run stop test"),
        (("discover", "zenoh://h/a", "--toml"), "run webmap discover --toml on the"),
    ],
)
def test_what_only_the_robots_computer_can_do_is_refused_with_a_sentence(
    arguments, message
):
    result = webmap(*arguments)
    assert result.returncode == 2
    assert message in result.stderr
