"""Another kind of link: a bridge uses it, and its robots can only be watched."""

from types import SimpleNamespace
from typing import get_args, get_type_hints

import pytest

from webmap import Bridge, Robot
from webmap.base.errors import ConfigError
from webmap.console import make_robot
from webmap.discovery import discover
from webmap.fleet.overrides import Overrides
from webmap.ros import bridge as bridge_module
from webmap.ros import names

URL = "pigeon://loft:7"
TOPICS = {
    "/odom": "nav_msgs/Odometry",
    "/cmd_vel": "geometry_msgs/Twist",
    "/initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    "/move_base_simple/goal": "geometry_msgs/PoseStamped",
}


class PigeonLink:
    """A link that has no class in common with that of rosbridge."""

    def __init__(self, url, name, *, opened, closed, received, report):
        self.url, self.name = url, name
        self.lane = SimpleNamespace(state="new", last_heard=None, lag=0.0)
        self.graph = SimpleNamespace(topic_type=None)
        self.stats, self.trouble, self.over = None, None, None

    def refuse_if_over(self):
        pass

    def subscribe(self, topic):
        pass

    def unsubscribe(self, topic):
        pass


@pytest.fixture(autouse=True)
def pigeons(monkeypatch):
    monkeypatch.setitem(bridge_module.LINKS, "pigeon", PigeonLink)
    monkeypatch.setitem(names._DEFAULT_PORT, "pigeon", 7)


def test_a_bridge_uses_another_kind_of_link():
    bridge = Bridge("Pigeon://Loft:7/")
    assert (bridge.url, bridge.state) == ("pigeon://loft", "new")
    assert isinstance(bridge._link, PigeonLink)


def test_the_table_of_links_accepts_any_class():
    _, kind = get_args(get_type_hints(bridge_module)["LINKS"])
    assert get_args(kind)[0] is ...


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
