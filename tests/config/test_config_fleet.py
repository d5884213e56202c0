"""Fleet files that are written, and read again."""

import tomllib

import pytest

from webmap.config.checks import Mistakes
from webmap.config.fleet import FleetConfig, dump, read_fleet

FILE = """\
title = "Hall \\"1\\""

[bridges]
hall = { url = "ws://hall:9090", alignment = [1.0, 2.0, 3.0] }
"the yard" = "ws://yard:9090"

[[map]]
bridge = "hall"
topic = "/map" # the usual name
palette = "costmap"

[[robots]]
name = "Bob"
bridge = "hall"
odometry = "/odom" # the usual name
tf.quiet = true # if frames lead there
tf.map_frame = "world"
scan = ["/front", "/rear"]
cameras = [
  "/front/image", # pictures
  { url = "http://bob/", name = "Rear" },
]
twist = { topic = "/cmd_vel", stops_within = 0.25 }
# Say more.
buttons = [
  { label = "Dock", service = "/dock" },
]
modules = [
  { name = "Trail", options = { length = 10.0 } },
  { name = "Path", args = [{ bridge = "hall" }, "/plan"] }, # a plan
]
# A last word.

[[robots]]
name = "Ann"
bridge = "the yard"
"""
REMARKS = {
    ("map", 0, "topic"): "the usual name",
    ("robots", 0, "odometry"): "the usual name",
    ("robots", 0, "tf", "quiet"): "if frames lead there",
    ("robots", 0, "cameras", 0): "pictures",
    ("robots", 0, "modules", 1): "a plan",
}
BELOW = {("robots", 0, "twist"): ["Say more."], ("robots", 0): ["A last word."]}


def fleet() -> FleetConfig:
    mistakes = Mistakes()
    found = read_fleet(tomllib.loads(FILE), mistakes)
    assert mistakes.found == []
    return found


def test_dumping_a_fleet_and_its_comments_reproduces_the_fleet_file():
    data = fleet().to_dict()
    data["bridges"]["the yard"] = "ws://yard:9090"
    assert dump(data, remarks=REMARKS, below=BELOW) == FILE


def test_a_fleet_dumped_without_comments_reads_back_as_the_same_fleet():
    text = dump(fleet().to_dict())
    again = read_fleet(tomllib.loads(text), mistakes := Mistakes())
    assert (again, mistakes.found) == (fleet(), [])


def test_a_line_break_in_a_comment_is_escaped():
    data = {"bridges": {"hall": "ws://hall:9090"}}
    text = dump(data, remarks={("bridges", "hall"): "a\n[robots]"})
    assert text == '[bridges]\nhall = "ws://hall:9090" # a\\n[robots]\n'


CHECKED = """
check_every = "12h"
[bridges]
hall = "ws://hall:9090"
[[robots]]
name = "Bob"
twist = "/bob/cmd_vel"
[[robots]]
name = "Eve"
twist = { topic = "/eve/cmd_vel", check_every = "30min" }
[[robots]]
name = "Ada"
odometry = "/ada/odom"
"""


def test_a_check_that_a_fleet_demands_is_demanded_of_each_driven_robot():
    mistakes = Mistakes()
    fleet = read_fleet(tomllib.loads(CHECKED), mistakes)
    assert mistakes.found == []
    found = [robot.motion.twist for robot in fleet.robots]
    assert [each and each.check_every for each in found] == [43200.0, 1800.0, None]


@pytest.mark.parametrize(
    ("time", "seconds"), [("720h", 2592000.0), ("8784h", 31622400.0)]
)
def test_a_check_may_be_demanded_once_in_weeks(time, seconds):
    mistakes = Mistakes()
    fleet = read_fleet(tomllib.loads(CHECKED.replace("30min", time)), mistakes)
    assert mistakes.found == []
    assert fleet.robots[1].motion.twist.check_every == seconds


@pytest.mark.parametrize("time", ["never", "12", "0s", "-1h", "1d", "999999h"])
def test_a_check_that_is_demanded_within_no_time_is_a_mistake(time):
    mistakes = Mistakes()
    read_fleet(tomllib.loads(CHECKED.replace("30min", time)), mistakes)
    ((path, message),) = mistakes.found
    assert path == ("robots", 1, "twist", "check_every")
    assert 'expected a time from 1 s to 366 days, such as "12h"' in message
