import contextlib
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.errors import ConfigError
from webmap.ros import names


@pytest.mark.parametrize(
    ("given_name", "resolved"),
    [
        ("/odom", "/odom"),
        ("odom", "/odom"),
        ("/robot_0//odom/", "/robot_0/odom"),
        (" /tf ", "/tf"),
        ("/_hidden/0", "/_hidden/0"),
    ],
)
def test_topic_names_are_normalised(given_name, resolved):
    assert names.normalise_topic(given_name) == resolved


@pytest.mark.parametrize(
    "bad", ["", "/", "/a b", "/a\nb", "/ä", "/a-b", "a" * 300, None]
)
def test_an_invalid_topic_name_is_refused(bad):
    assert not names.is_topic(bad)
    with pytest.raises(ConfigError):
        names.normalise_topic(bad)


def test_ros1_and_ros2_spellings_of_a_type_are_equal():
    assert names.same_type("nav_msgs/Odometry", "nav_msgs/msg/Odometry")
    assert not names.same_type("nav_msgs/Odometry", "nav_msgs/Path")
    assert not names.same_type("", "")
    assert names.is_type("geometry_msgs/msg/Twist", "a/B", "geometry_msgs/Twist")
    assert str(names.split_type("nav_msgs/msg/Odometry")) == "nav_msgs/Odometry"
    assert names.ros2_type("nav_msgs/Odometry") == "nav_msgs/msg/Odometry"


@pytest.mark.parametrize(
    "bad", ["", "Odometry", "a/b/C", "a/msg/", "a//B", "1/B", None]
)
def test_an_invalid_type_name_is_refused(bad):
    with pytest.raises(ConfigError, match="nav_msgs/Odometry"):
        names.split_type(bad)


@pytest.mark.parametrize(
    ("url", "normal"),
    [
        ("ws://localhost:9090", "ws://localhost:9090"),
        ("WS://LocalHost:9090/", "ws://localhost:9090"),
        ("ws://robot:80/", "ws://robot"),
        ("wss://robot:443/ros/", "wss://robot/ros"),
        ("ws://[::1]:9090", "ws://[::1]:9090"),
        ("ws://robot/ros?x=1", "ws://robot/ros?x=1"),
    ],
)
def test_bridge_addresses_are_normalised(url, normal):
    assert names.normalise_url(url) == normal
    assert names.normalise_url(normal) == normal


@pytest.mark.parametrize(
    "bad",
    [
        "",
        "localhost:9090",
        "http://localhost:9090",
        "ws://",
        "ws://:9090",
        "ws://a:99999",
        "ws://a:0",
        "ws://a:b",
        "ws://user:secret@a",
        "ws://a/#x",
        "ws://a b",
        "ws://[::1",
        None,
        9090,
    ],
)
def test_an_invalid_address_is_refused_without_its_password_in_the_error(bad):
    with pytest.raises(
        ConfigError, match=r"expected one such as|no user name|did you mean"
    ) as caught:
        names.normalise_url(bad)
    assert "secret" not in str(caught.value)


@given(st.text())
def test_any_text_is_normalised_or_refused(text):
    for function in (names.normalise_topic, names.split_type, names.normalise_url):
        with contextlib.suppress(ConfigError):
            function(text)


@pytest.mark.parametrize("bare", ["robot:9090", "10.0.0.7:9090", "[::1]:9090", "robot"])
def test_an_address_without_a_scheme_is_refused_with_a_suggestion(bare):
    with pytest.raises(ConfigError, match=re.escape(f"did you mean 'ws://{bare}'?")):
        names.normalise_url(bare)


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "[::1]"])
@pytest.mark.parametrize("rest", ["", ":9090", ":9090/ros?a=1"])
def test_every_address_of_this_computer_gives_the_same_three_spellings(host, rest):
    assert names.spellings_of(f"ws://{host}{rest}") == [
        f"ws://localhost{rest}",
        f"ws://127.0.0.1{rest}",
        f"ws://[::1]{rest}",
    ]


@pytest.mark.parametrize(
    "url", ["ws://robot:9090", "wss://10.0.0.7", "ws://[fe80::1]:9"]
)
def test_the_address_of_another_computer_has_one_spelling(url):
    assert names.spellings_of(url) == [url]


def test_the_kind_of_a_link_is_recognised_by_the_scheme_of_its_address():
    assert names.is_agent_url("ZENOHS://hall/bay3")
    assert not names.is_agent_url("wss://hall/zenoh")
    assert names.is_foxglove_url(" Foxgloves://hall")
    assert names.is_rosbridge_url("WSS://hall")
    assert not names.is_rosbridge_url("foxglove://hall")
    assert names.has_gate("foxglove://hall")
    assert not names.has_gate("lines://hall")


def test_the_agent_in_an_address():
    assert names.agent_named("zenoh://hall:7447/bay3") == "bay3"
    assert names.agent_named("zenoh://hall:7447/") == ""
    assert names.agent_named("ws://robot:9090/bay3") == ""
