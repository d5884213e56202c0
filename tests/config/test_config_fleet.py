"""Fleet files that are written, and read again."""

import tomllib

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
