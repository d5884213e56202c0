"""The simulated camera."""

import base64
import io
import json
import math
from types import SimpleNamespace

import cbor2
import numpy as np
import pytest
from PIL import Image

from webmap.base.geometry import Pose
from webmap.ros.rosbridge.server.dialect import POLITE, Dialect
from webmap.ros.rosbridge.server.encode import Encoder, Publication
from webmap.ros.rosbridge.server.schema import Schema
from webmap.sim.maps import FloorPlan, Obstacles
from webmap.sim.messages import Messages
from webmap.sim.world import HEIGHT, WIDTH, SimCamera


@pytest.fixture
def room():
    """A room of 6 m by 4 m with walls one cell thick."""
    solid = np.zeros((40, 60), bool)
    solid[[0, -1], :] = solid[:, [0, -1]] = True
    cells = np.where(solid, 100, 0).astype(np.int8)
    return SimCamera(Obstacles(FloorPlan(cells, 0.1, 0.0, 0.0)))


def wall_rows(view):
    """Return how many pixels of the middle column show the wall."""
    middle = view[:, WIDTH // 2].astype(int)
    return int((np.abs(middle[:, 2] - middle[:, 0] - 12) < 8).sum())


def test_a_nearer_wall_is_taller_in_the_picture(room):
    far, near = (room.view(Pose(x, 2.0, 0.0)) for x in (1.0, 4.0))
    assert far.shape == (HEIGHT, WIDTH, 3)
    assert wall_rows(near) > wall_rows(far) + 15


def test_a_robot_on_the_left_appears_on_the_left_of_the_picture(room):
    alone = room.view(Pose(1.0, 2.0, 0.0)).astype(int)
    seen = room.view(Pose(1.0, 2.0, 0.0), [(3.0, 2.8, 0.25)]).astype(int)
    columns = np.nonzero(np.abs(seen - alone).sum(axis=(0, 2)))[0]
    assert len(columns) > 5
    assert columns.max() < WIDTH // 2


def test_robots_behind_a_wall_or_behind_the_camera_are_not_visible(room):
    alone = room.view(Pose(1.0, 2.0, 0.0))
    hidden = [(9.0, 2.0, 0.25), (0.5, 2.0, 0.25)]
    assert np.array_equal(room.view(Pose(1.0, 2.0, 0.0), hidden), alone)


def test_the_picture_turns_with_the_robot(room):
    along = wall_rows(room.view(Pose(3.0, 2.0, 0.0)))
    across = wall_rows(room.view(Pose(3.0, 2.0, math.pi / 2)))
    assert across > along


def test_the_picture_is_a_jpeg(room):
    image = Image.open(io.BytesIO(room.jpeg(Pose(1.0, 2.0, 0.0))))
    assert image.format == "JPEG"
    assert image.size == (WIDTH, HEIGHT)


def test_pictures_are_base64_in_json_and_bytes_in_cbor(room):
    dialect = Dialect("ros1")
    encoder = Encoder(Schema(dialect), POLITE)
    jpeg = room.jpeg(Pose(1.0, 2.0, 0.0))
    robot = SimpleNamespace(frames="")
    message = Messages(dialect).camera("/c", 0.0, robot, jpeg)
    publication = Publication("/c", "sensor_msgs/CompressedImage", message, 0.0)
    text = json.loads(publication.form("none", encoder))
    assert base64.b64decode(text["msg"]["data"]) == jpeg
    assert cbor2.loads(publication.form("cbor", encoder))["msg"]["data"] == jpeg
