"""WebMap: a web interface for safe teleoperation of many robots that run ROS.

    import webmap

    bridge = webmap.Bridge("ws://localhost:9090")
    bob = webmap.Robot("Bob", webmap.svg.circle(r=0.2, fill="red"))
    bob.set_odometry_topic(bridge, "/odom")

    @webmap.page("/")
    def main(page):
        map = webmap.Map(page.element("webmap_container"))
        map.add_robot(bob)

    webmap.run()

Names are loaded on first use, so importing the package is cheap.
"""

import importlib
from typing import TYPE_CHECKING, Any

from webmap.base.logs import guard_loggers

guard_loggers()

if TYPE_CHECKING:
    from webmap import modules
    from webmap.base import errors, geometry
    from webmap.base.errors import WebMapError
    from webmap.base.identifiers import generate_id
    from webmap.config.robot import RobotConfig
    from webmap.core.extendable import Extendable
    from webmap.core.map import Layer, Map
    from webmap.core.page import Page
    from webmap.core.pictures import Picture
    from webmap.core.refusals import refusals
    from webmap.core.registry import Namespace
    from webmap.core.robot import Robot
    from webmap.modules import drawing
    from webmap.modules import layer_options as options
    from webmap.modules.declaration import FoundTopic, TopicKind, layer
    from webmap.modules.map_layer import MapLayer
    from webmap.modules.placed import Placed
    from webmap.modules.robot_layer import RobotLayer
    from webmap.notebook.widget import widget
    from webmap.poses.alignment import align_bridge
    from webmap.ros import messages, tf
    from webmap.ros.bridge import Bridge
    from webmap.ros.tf import Transform
    from webmap.scene import html, svg
    from webmap.scene.element import Element
    from webmap.scene.svg import namespace as svg_ns
    from webmap.scene.svg import xlink_namespace as xlink_ns
    from webmap.server.application import asgi_app, call, page, run, start, stop

__version__ = "0.1.0"

__all__ = [
    "Bridge",
    "Element",
    "Extendable",
    "FoundTopic",
    "Layer",
    "Map",
    "MapLayer",
    "Namespace",
    "Page",
    "Picture",
    "Placed",
    "Robot",
    "RobotConfig",
    "RobotLayer",
    "TopicKind",
    "Transform",
    "WebMapError",
    "align_bridge",
    "asgi_app",
    "call",
    "drawing",
    "errors",
    "generate_id",
    "geometry",
    "html",
    "layer",
    "messages",
    "modules",
    "options",
    "page",
    "refusals",
    "run",
    "start",
    "stop",
    "svg",
    "svg_ns",
    "tf",
    "widget",
    "xlink_ns",
]

_HOMES = {
    "Bridge": "webmap.ros.bridge:Bridge",
    "Element": "webmap.scene.element:Element",
    "Extendable": "webmap.core.extendable:Extendable",
    "FoundTopic": "webmap.modules.declaration:FoundTopic",
    "Layer": "webmap.core.map:Layer",
    "Map": "webmap.core.map:Map",
    "MapLayer": "webmap.modules.map_layer:MapLayer",
    "Namespace": "webmap.core.registry:Namespace",
    "Page": "webmap.core.page:Page",
    "Picture": "webmap.core.pictures:Picture",
    "Placed": "webmap.modules.placed:Placed",
    "Robot": "webmap.core.robot:Robot",
    "RobotConfig": "webmap.config.robot:RobotConfig",
    "RobotLayer": "webmap.modules.robot_layer:RobotLayer",
    "TopicKind": "webmap.modules.declaration:TopicKind",
    "Transform": "webmap.ros.tf:Transform",
    "WebMapError": "webmap.base.errors:WebMapError",
    "align_bridge": "webmap.poses.alignment:align_bridge",
    "asgi_app": "webmap.server.application:asgi_app",
    "call": "webmap.server.application:call",
    "drawing": "webmap.modules.drawing",
    "errors": "webmap.base.errors",
    "generate_id": "webmap.base.identifiers:generate_id",
    "geometry": "webmap.base.geometry",
    "html": "webmap.scene.html",
    "layer": "webmap.modules.declaration:layer",
    "messages": "webmap.ros.messages",
    "modules": "webmap.modules",
    "options": "webmap.modules.layer_options",
    "page": "webmap.server.application:page",
    "refusals": "webmap.core.refusals:refusals",
    "run": "webmap.server.application:run",
    "start": "webmap.server.application:start",
    "stop": "webmap.server.application:stop",
    "svg": "webmap.scene.svg",
    "svg_ns": "webmap.scene.svg:namespace",
    "tf": "webmap.ros.tf",
    "widget": "webmap.notebook.widget:widget",
    "xlink_ns": "webmap.scene.svg:xlink_namespace",
}


def __getattr__(name: str) -> Any:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'webmap' has no attribute {name!r}")
    module, _, attribute = home.partition(":")
    value: Any = importlib.import_module(module)
    if attribute:
        value = getattr(value, attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
