"""Mistakes in layers are reported, and a refused message changes nothing."""

import ast
import inspect
import logging
import math
import sys
import types

import numpy as np
import pytest
from module_fakes import pose, to_root, typed
from test_layers_frames import send_transforms
from tilted_frames import frame

import webmap
from webmap.base.errors import ConfigError
from webmap.core.registry import map_modules, robot_modules
from webmap.discovery import discover
from webmap.discovery.layers import find_layers
from webmap.modules import declaration
from webmap.modules.declaration import declarations

ROBOT = {"/a/odom": "nav_msgs/Odometry", "/a/cmd_vel": "geometry_msgs/Twist"}


@pytest.fixture(autouse=True)
def _forget_layers(monkeypatch):
    for namespace in (robot_modules, map_modules):
        namespace.names()  # a module that is first imported later would be lost
        monkeypatch.setattr(namespace, "_registered", dict(namespace._registered))


def header(frame_id, seconds):
    whole = int(seconds)
    stamp = {"secs": whole, "nsecs": round((seconds - whole) * 1e9)}
    return {"stamp": stamp, "frame_id": frame_id}


def made(name="Own", base=webmap.RobotLayer, **members):
    return type(name, (base,), {"__module__": "own", **members})


@pytest.mark.parametrize(
    ("types", "options", "words"),
    [
        ((), {}, "one type or more"),
        ((made("Bare"),), {}, "one type or more"),
        (("no type",), {}, "no type"),
        (
            ("my_msgs/X",),
            {"kind": "a", "kinds": [webmap.TopicKind("b")]},
            "kind or kinds",
        ),
        (("my_msgs/X",), {"kind": "a", "names": "["}, "not a regular expression"),
        (
            ("my_msgs/X",),
            {"kinds": [webmap.TopicKind("a", options={"sizes": 1.0})]},
            "no option 'sizes'",
        ),
        (
            ("my_msgs/X",),
            {"kinds": [webmap.TopicKind("a"), webmap.TopicKind("a", most=1)]},
            "only differ in types and names",
        ),
    ],
)
def test_an_invalid_layer_declaration_is_refused(types, options, words):
    with pytest.raises(ConfigError, match=words):
        webmap.layer(*types, **options)(made())
    assert "Own" not in robot_modules


def test_adding_an_undeclared_layer_is_refused(robot, link):
    robot_modules.register(made())
    with pytest.raises(ConfigError, match="the layer Own is not declared"):
        robot.add_module("Own", link, "/topic")


def test_a_kind_declared_by_another_layer_is_ignored_and_logged_once(caplog):
    declaration._warn.cache_clear()
    webmap.layer("my_msgs/X", kinds=[webmap.TopicKind("pose"), webmap.TopicKind("x")])(
        made()
    )
    with caplog.at_level(logging.WARNING, "webmap.modules"):
        for _ in range(2):
            (found,) = (each for each in declarations() if each.name == "Own")
    assert [kind.name for kind in found.kinds] == ["x"]
    (line,) = caplog.messages
    assert "Own has a kind 'pose'" in line
    layers = find_layers({**ROBOT, "/a/x": "my_msgs/X", "/a/p": "my_msgs/X"}, ["/a"])
    assert {layer.kind for layer in layers["/a"].drawn} == {"x"}


def test_a_custom_layer_takes_topics_of_its_type_from_the_roles_of_the_robot():
    webmap.layer("sensor_msgs/LaserScan", kind="my scan")(made("OwnScan"))
    webmap.layer("nav_msgs/Path", kind="my path", names="own")(made("OwnPath"))
    grids = [webmap.TopicKind("my grid", shared=True)]
    webmap.layer("nav_msgs/OccupancyGrid", kinds=grids)(
        made("OwnGrid", webmap.MapLayer)
    )
    topics = ROBOT | {
        "/a/scan": "sensor_msgs/LaserScan",
        "/a/plan": "nav_msgs/Path",
        "/a/own_plan": "nav_msgs/Path",
        "/map": "nav_msgs/OccupancyGrid",
    }
    (robot,) = discover(topics, "host").robots
    assert (robot.topic("scan"), robot.topic("map")) == ("", "")
    assert robot.topic("plan") == "/a/plan"
    kinds = {each.topic: each.kind for each in find_layers(topics, ["/a"])["/a"].drawn}
    assert kinds["/a/scan"] == "my scan"
    assert kinds["/a/own_plan"] == "my path"
    assert kinds["/map"] == "my grid"


def test_option_limits_apply_with_postponed_annotations(monkeypatch, robot, link):
    source = """
from __future__ import annotations
from typing import ClassVar
import webmap

@webmap.layer("my_msgs/X")
class Late(webmap.RobotLayer):
    size: webmap.options.Metres = 0.3
    most: webmap.options.Count | None = None
    unit: ClassVar[str] = "m"
"""
    module = types.ModuleType("own_late")
    monkeypatch.setitem(sys.modules, "own_late", module)
    exec(compile(source, "own_late.py", "exec", dont_inherit=True), vars(module))
    takes = inspect.signature(module.Late).parameters
    assert "size" in takes
    assert "unit" not in takes
    for wrong in ({"size": -1.0}, {"most": 0}, {"age_limit": math.nan}):
        with pytest.raises(ConfigError, match="must be"):
            robot.add_module("Late", link, "/x", **wrong)
    assert robot.add_module("Late", link, "/x", most=None).most is None


def test_a_refused_message_does_not_move_the_last_drawing(map, robot, link):
    def draw(self, message, at):
        self.place = message.x

    webmap.layer("my_msgs/X")(made("OwnMap", webmap.MapLayer, draw=draw))
    webmap.layer("my_msgs/X")(made("OwnFlat", draw=draw, in_plane=True))
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    for seconds in (1.0, 2.0, 3.0, 4.0):
        at = {"header": header("map", seconds), "pose": pose(seconds, 0, 0)}
        link.publish("/odom", at)
    on_map = map.add_module("OwnMap", link, "/zones").layer
    on_robot = robot.add_module("OwnFlat", link, "/flat")
    for topic, sensor in (("/zones", "odom"), ("/flat", "base_link")):
        link.publish(topic, {"header": header(sensor, 2.0), "x": 1.0})
    send_transforms(link, frame("map", "odom", (0.0, 0.0, 0.0), seconds=2.0))
    send_transforms(link, frame("map", "far", (50.0, 0.0, 0.0), seconds=2.0))
    link.publish("/zones", {"header": header("odom", 2.0), "x": 1.0})
    before = [to_root(each.svg).apply(0, 0) for each in (on_map, on_robot)]
    link.publish("/zones", {"header": header("far", 2.0), "x": math.nan})
    link.publish("/flat", {"header": header("base_link", 4.0), "x": math.nan})
    assert [to_root(each.svg).apply(0, 0) for each in (on_map, on_robot)] == before
    assert (on_map.place, on_robot.place) == (1.0, 1.0)


@pytest.mark.parametrize("cbor", [False, True])
def test_nan_in_a_list_is_refused_in_every_encoding(robot, link, cbor):
    seen = []

    def draw(self, message, at):
        seen.append(list(message.ranges))

    webmap.layer("sensor_msgs/LaserScan")(made(draw=draw))
    robot.add_module("Own", link, "/scan")

    def scan(*ranges):
        found = typed(85, np.array(ranges, "<f4")) if cbor else list(ranges)
        return {"header": header("base_link", 2.0), "ranges": found}

    link.publish("/scan", scan(1.0, 2.0), cbor=cbor)
    link.publish("/scan", scan(1.0, math.nan), cbor=cbor)
    assert seen == [[1.0, 2.0]]
    assert "ranges must be" in next(iter(robot.problems.values()))


def test_draw_gets_the_frame_and_the_stamp_of_the_message(robot, link):
    seen = []

    def draw(self, message, at):
        seen.append((message.header.frame_id, message.header.stamp, message.stamp))

    webmap.layer("my_msgs/X")(made(draw=draw))
    robot.add_module("Own", link, "/x")
    link.publish("/x", {"header": header("arm", 3.0)})
    assert seen == [("arm", 3.0, 3.0)]

    def draw_log(self, message, at):
        seen.append((message.frame_id, message.stamp))

    webmap.layer("rcl_interfaces/Log")(made("OwnLog", draw=draw_log))
    robot.add_module("OwnLog", link, "/log")
    link.publish("/log", {"stamp": {"sec": 5, "nanosec": 0}, "msg": "ready"})
    assert seen[1] == ("", 5.0)


PRIVATE = {
    # Layers that draw more than one topic, or in several frames at once.
    "Diagnostics": {"draw_or_report", "Removal", "keep", "robot_modules"},
    "Markers": {"LayerFrames", "TransformError", "not_known", "Removal", "keep"},
    "OccupancyGrid": {"MessageProblems", "cell_at", "spawn"},
    # Names that only these layers use.
    "LaserScanner": {"Rays", "scan_name"},
    "NavSatFix": {"LocalPlane"},
    "Polygon": {"check_items"},
}
PUBLIC_MODULES = ("drawing", "geometry", "html", "messages", "options", "svg")


def test_no_two_built_in_layers_have_the_same_rank():
    ranks = [each.rank for each in declarations() if each.built_in]
    assert len(set(ranks)) == len(ranks)
    assert not [rank for rank in ranks if rank % 10]


@pytest.mark.parametrize("declared", declarations(), ids=lambda each: each.name)
def test_built_in_layers_import_only_public_or_listed_names(declared):
    if not declared.built_in:
        pytest.skip("the layer is not part of WebMap")
    homes = [getattr(webmap, name) for name in PUBLIC_MODULES]
    public = [value for home in homes for value in vars(home).values()]
    public += [getattr(webmap, name) for name in webmap.__all__]
    file = sys.modules[declared.layer.__module__]
    private = set()
    for node in ast.walk(ast.parse(inspect.getsource(file))):
        if not isinstance(node, ast.ImportFrom) or not node.module:
            continue
        own = (
            file.__name__.rpartition(".")[0] + ".",
            "webmap.features.layers.grid_picture",
        )
        errors = "webmap.base.errors"
        if not node.module.startswith("webmap") or node.module.startswith(errors):
            continue
        if node.module.startswith(own):
            continue
        home = sys.modules.get(node.module)
        for name in node.names:
            value = getattr(home, name.name, None)
            if not any(value is each for each in public):
                private.add(name.name)
    assert private == PRIVATE.get(declared.name, set())
