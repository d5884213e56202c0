"""Another kind of link: a bridge uses it, and its robots can only be watched."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from pigeon_link import PigeonLink

from webmap import Bridge, Robot
from webmap.base.errors import ConfigError
from webmap.console import make_robot
from webmap.discovery import discover
from webmap.fleet.overrides import Overrides
from webmap.ros import bridge as bridge_module
from webmap.ros import names

ROOT = Path(__file__).parents[2]
URL = "pigeon://loft:7"
KINDS = """
from pigeon_link import PigeonLink
from webmap.ros.bridge import LINKS


class OtherConstructor(PigeonLink):
    def __init__(self, url: str) -> None: ...


class OtherMethod(PigeonLink):
    def publish(self, topic: str) -> None: ...  # type: ignore[override]


class OtherGraph(PigeonLink):
    graph: None  # type: ignore[assignment]


LINKS["pigeon"] = PigeonLink
LINKS["a"] = OtherConstructor  # wrong
LINKS["b"] = OtherMethod  # wrong
LINKS["c"] = OtherGraph  # wrong
LINKS["d"] = dict  # wrong
"""
TOPICS = {
    "/odom": "nav_msgs/Odometry",
    "/cmd_vel": "geometry_msgs/Twist",
    "/initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    "/move_base_simple/goal": "geometry_msgs/PoseStamped",
}


@pytest.fixture(autouse=True)
def pigeons(monkeypatch):
    monkeypatch.setitem(bridge_module.LINKS, "pigeon", PigeonLink)
    monkeypatch.setitem(names._DEFAULT_PORT, "pigeon", 7)


def test_a_bridge_uses_another_kind_of_link():
    bridge = Bridge("Pigeon://Loft:7/")
    assert (bridge.url, bridge.state) == ("pigeon://loft", "new")
    assert isinstance(bridge._link, PigeonLink)


def test_a_bridge_delivers_the_messages_of_another_kind_of_link():
    bridge, got = Bridge(URL), []
    subscription = bridge.subscribe("/odom", got.append)
    bridge._link.pigeon_came("/odom", b'{"x": 1.5}')
    subscription.remove()
    bridge._link.pigeon_came("/odom", b'{"x": 2.5}')
    assert got == [{"x": 1.5}]


@pytest.mark.slow
def test_mypy_accepts_a_right_kind_of_link_and_refuses_wrong_ones(tmp_path):
    file = tmp_path / "kinds.py"
    file.write_text(KINDS)
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", file],
        cwd=ROOT,
        env={**os.environ, "MYPYPATH": str(Path(__file__).parent)},
        capture_output=True,
        text=True,
    )
    found = [int(n) for n in re.findall(r"kinds\.py:(\d+): error: ", run.stdout)]
    lines = enumerate(KINDS.splitlines(), 1)
    assert found == [n for n, line in lines if "wrong" in line], run.stdout
    assert f"Found {len(found)} errors" in run.stdout  # and none in pigeon_link.py


def test_a_robot_that_is_found_behind_another_link_is_shown_and_not_driven(caplog):
    bridge = Bridge(URL)
    (found,) = discover(TOPICS, "loft").robots
    config = Overrides().config(bridge.url, found)
    assert "no gate can move robots behind" in caplog.text
    robot = make_robot(config, [bridge])
    assert robot.motion.spec() is None
    robot.destroy()


def test_the_address_of_another_link_is_refused_for_driving():
    robot = Robot("Bob")
    with pytest.raises(ConfigError, match="can only be watched"):
        robot.set_twist_topic(Bridge(URL), "/cmd_vel")
    robot.destroy()


@pytest.mark.parametrize("wrong", ["http://loft", "", "pigeon://", "pigeon://a@loft"])
def test_an_error_about_an_address_does_not_name_one_kind_of_link(wrong):
    with pytest.raises(ConfigError, match="address of a bridge"):
        names.normalise_url(wrong)
