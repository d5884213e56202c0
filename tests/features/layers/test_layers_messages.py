"""The views of the modules' messages, also with the worker for large frames."""

import json
from collections.abc import Mapping

import pytest
from module_fakes import header, pose
from test_layers_absurd import SCAN
from test_layers_cloud import POINTS, cloud
from test_layers_fix import fix
from test_layers_grid import CORNERS, grid, update
from test_layers_health import array, status
from test_layers_markers import CUBE, marker
from test_layers_points import cells, point
from test_layers_poses import FOOT, covariance, doubtful, polygon, sonar
from test_layers_ways import path

from webmap import Bridge
from webmap.base.errors import ConfigError, ProtocolError
from webmap.core.map import Layer
from webmap.features.layers.diagnostics import DiagnosticArrayMsg
from webmap.features.layers.grid_cells import GridCellsMsg
from webmap.features.layers.laser_scanner import SweepMsg
from webmap.features.layers.marker_drawing import MarkerArrayMsg, MarkerMsg
from webmap.features.layers.nav_sat_fix import NavSatFixMsg
from webmap.features.layers.occupancy_grid import OccupancyGridUpdateMsg
from webmap.features.layers.point_cloud import PointCloud2Msg
from webmap.features.layers.point_stamped import PointStampedMsg
from webmap.features.layers.polygon import PolygonStampedMsg
from webmap.features.layers.pose_array import ParticleCloudMsg, PoseArrayMsg
from webmap.features.layers.pose_with_covariance import UncertainPoseStampedMsg
from webmap.features.layers.range import RangeMsg
from webmap.modules.declaration import declarations
from webmap.ros.messages import OccupancyGridMsg, PathMsg, PoseStampedMsg
from webmap.ros.offload import values
from webmap.ros.rosbridge.events import Publish
from webmap.ros.worker import WorkRequest, answer, view_name

MESSAGES = {
    OccupancyGridMsg: grid(CORNERS),
    OccupancyGridUpdateMsg: update(0, 0, CORNERS),
    SweepMsg: SCAN,
    PathMsg: path([(1, 2), (3, 4)]),
    PoseArrayMsg: {"header": header(), "poses": [pose(1, 2)]},
    ParticleCloudMsg: {
        "header": header(ros2=True),
        "particles": [{"pose": pose(1, 2), "weight": 1.0}],
    },
    UncertainPoseStampedMsg: doubtful(pose(1, 2), covariance(1, 1)),
    PolygonStampedMsg: polygon(FOOT),
    PoseStampedMsg: {"header": header(), "pose": pose(1, 2)},
    RangeMsg: sonar(1.0),
    PointStampedMsg: point(1, 2),
    GridCellsMsg: cells([(1, 2), (3, 4)]),
    PointCloud2Msg: cloud(POINTS),
    MarkerArrayMsg: {"markers": [marker(CUBE)]},
    MarkerMsg: marker(CUBE),
    DiagnosticArrayMsg: array(status("one", 1)),
    NavSatFixMsg: fix(50, 14),
}


@pytest.mark.parametrize("layer", declarations(), ids=lambda layer: layer.name)
def test_every_view_of_a_built_in_layer_has_an_example(layer):
    views = layer.view.values() if isinstance(layer.view, Mapping) else [layer.view]
    assert not layer.built_in or set(views) <= MESSAGES.keys()


@pytest.mark.parametrize("view", MESSAGES, ids=lambda view: view.__name__)
def test_a_message_decoded_by_the_worker_is_the_same(view):
    text = json.dumps({"op": "publish", "topic": "/t", "msg": MESSAGES[view]}).encode()
    here = Publish("/t", text).decode(view)
    name = view_name(view)
    assert name is not None
    *_, there = values(
        *answer(WorkRequest(len(text), "/t", view_name(Publish), name), text), view
    )
    assert there == here


@pytest.mark.parametrize("view", MESSAGES, ids=lambda view: view.__name__)
@pytest.mark.parametrize("message", [{}, {"poses": 1}, {"x": "y"}, [], 5, "a", None])
def test_a_message_of_another_type_is_refused(view, message):
    text = json.dumps({"op": "publish", "topic": "/t", "msg": message}).encode()
    with pytest.raises(ProtocolError, match=r"Expected|missing"):
        Publish("/t", text).decode(view)


def test_a_layer_that_fails_to_start_leaves_no_subscription(map):
    bridge = Bridge("ws://nowhere:9090")
    with pytest.raises(ConfigError):
        map.add_module("OccupancyGrid", bridge, "two words")
    assert Layer._shared == {}
    assert bridge._topics == {}
