"""Alignments of a fleet file are read strictly; saved alignments replace them."""

import math

import pytest

from webmap import Robot
from webmap.base.errors import ConfigError
from webmap.base.geometry import Pose
from webmap.core.alignment_store import AlignmentStore
from webmap.fleet.fleet_file import prepare, restore
from webmap.poses.alignment import alignments

FILE = """\
[bridges]
north = "ws://north:9090"
south = { url = "ws://south:9090", alignment = [12.5, -3, 90.0] }

[[robots]]
name = "Bob"
bridge = "south"
odometry = "/odom"

[[robots]]
name = "Ann"
bridge = "south"
odometry = "/ann/odom"
alignment = [1.0, 2.0, -45]
"""


@pytest.fixture
def ready(tmp_path):
    def ready_(text):
        file = tmp_path / "fleet.toml"
        file.write_text(text)
        return prepare(file)

    return ready_


def refused(ready, text):
    with pytest.raises(ConfigError) as error:
        ready(text)
    return str(error.value)


def test_bridges_and_robots_get_their_alignments_from_the_fleet_file(ready):
    bob, ann = ready(FILE).robots
    assert bob.pose_source.alignment == Pose(12.5, -3.0, math.pi / 2)
    assert bob.pose_source.own_alignment is None
    assert ann.pose_source.alignment == Pose(1.0, 2.0, -math.pi / 4)
    assert alignments.of(bob.pose_source.bridge) == Pose(12.5, -3.0, math.pi / 2)


@pytest.mark.parametrize("value", ['"north"', "[1, 2]", "[1, 2, nan]", "[1, 2, true]"])
@pytest.mark.parametrize(
    ("old", "line", "place"),
    [
        ("[1.0, 2.0, -45]", 14, "robots[1].alignment"),
        ("[12.5, -3, 90.0]", 3, "bridges.south.alignment"),
    ],
)
def test_an_invalid_alignment_is_reported_with_its_line_and_key(
    ready, value, old, line, place
):
    refusal = refused(ready, FILE.replace(old, value))
    assert f"fleet.toml:{line}: {place}: got " in refusal
    assert "expected x and y in metres and an angle in degrees" in refusal


def test_a_bridge_table_with_unknown_or_missing_keys_is_refused(ready):
    refusal = refused(ready, FILE.replace("alignment = [12.5", "aligment = [12.5"))
    assert 'did you mean "alignment"?' in refusal
    refusal = refused(ready, FILE.replace('url = "ws://south:9090", ', ""))
    assert 'bridges.south: the key "url" is missing' in refusal


def test_a_saved_alignment_is_used_until_the_fleet_file_changes(
    ready, tmp_path, monkeypatch
):
    store = AlignmentStore(tmp_path / "state")
    store.save(
        "ws://south:9090", Pose(12.5, -3.0, math.pi / 2), Pose(7.0, 0.0, 0.0), "Eve"
    )
    for text, wanted in ((FILE, 7.0), (FILE.replace("12.5", "13.5"), 13.5)):
        fresh = AlignmentStore(tmp_path / "state")
        monkeypatch.setattr("webmap.fleet.fleet_file.store", fresh)
        robots = ready(text).robots
        restore(robots)
        assert alignments.of(robots[0].pose_source.bridge).x == wanted


def test_the_alignment_of_a_robot_survives_to_dict_and_from_dict():
    bob = Robot("Bob")
    assert "alignment" not in bob.to_dict()
    bob.set_alignment(1.5, -2.0, 30.0)
    data = bob.to_dict()
    assert list(data["alignment"]) == [1.5, -2.0, 30.0]
    again = Robot.from_dict(data)
    assert again.to_dict() == data
    with pytest.raises(ConfigError, match="alignment"):
        Robot.from_dict({"name": "Bob", "alignment": [1, 2]})
    for robot in (bob, again):
        robot.destroy()
