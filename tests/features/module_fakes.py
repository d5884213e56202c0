"""A bridge whose frames come from a test, and a page that records its notices."""

import io
import itertools
import json
import re
import time
from dataclasses import dataclass, field
from typing import Any

import cbor2
import numpy as np
from PIL import Image

from equipment.ray_points import points_of
from webmap.base.errors import ProtocolError
from webmap.base.geometry import Affine
from webmap.base.scope import Removal, current_scope, keep, no_scope
from webmap.core.pictures import pictures
from webmap.ros.rosbridge.protocol import Protocol
from webmap.scene.live import Rays


class Listening(Removal):
    """A subscription whose rate makes no difference."""

    def set_pace(self, throttle, unwatched):
        pass


class Link:
    """A bridge that decodes as a real one does."""

    url = name = "ws://test:9090"
    state = "open"
    lag = 0.0

    def __init__(self) -> None:
        self.listeners: dict[str, list[tuple]] = {}
        self.options: dict[str, dict] = {}
        self.types: dict[str, str] = {}

    def subscribe(self, topic, callback, type=None, *, decode=None, **options):
        entry = (callback, decode, current_scope())
        self.listeners.setdefault(topic, []).append(entry)
        self.options[topic], self.types[topic] = options, type

        def undo():
            self.listeners[topic].remove(entry)
            if not self.listeners[topic]:
                del self.listeners[topic]

        return keep(Listening(undo))

    def on_open(self, fn):
        """Do nothing: the bridge is already open."""
        return keep(Removal(lambda: None))

    def publish(self, topic: str, message: dict | str, *, cbor: bool = False) -> None:
        """Receive a frame in the form that a rosbridge sends."""
        if cbor:
            op = {"op": "publish", "topic": topic, "msg": message}
            frame = cbor2.dumps(op)
        else:
            text = message if isinstance(message, str) else json.dumps(message)
            frame = f'{{"op":"publish","topic":"{topic}","msg":{text}}}'.encode()
        event = Protocol().receive(frame, time.monotonic())
        for callback, decode, scope in self.listeners.get(topic, ()):
            try:
                value = event.decode(decode)
            except ProtocolError as error:
                if scope is not None and scope.report is not None:
                    scope.report(str(error), callback)
                continue
            if scope is not None and scope.mended is not None:
                scope.mended(callback)
            with scope.active() if scope else no_scope():
                callback(value)


@dataclass
class Channel:
    mounted: dict[int, Any] = field(default_factory=dict)
    orders: dict[int, float] = field(default_factory=dict)
    errors: list[str] = field(default_factory=list)
    problems: dict[int, str] = field(default_factory=dict)
    numbers: Any = field(default_factory=lambda: itertools.count(1))

    def mount(self, fragment, *, under, order=0, within=None):
        number = next(self.numbers)
        self.mounted[number], self.orders[number] = fragment, order
        return number

    def unmount(self, mount):
        del self.mounted[mount]

    def error(self, text):
        self.errors.append(text)

    def problem(self, number, text):
        self.errors.append(text)
        self.problems[number] = text

    def mended(self, number):
        self.problems.pop(number, None)

    def __getattr__(self, name):
        return lambda *args, **options: None


def header(frame: str = "map", *, ros2: bool = False) -> dict:
    """Return a header in one of the dialects."""
    if ros2:
        return {"stamp": {"sec": 3, "nanosec": 5}, "frame_id": frame}
    return {"seq": 7, "stamp": {"secs": 3, "nsecs": 5}, "frame_id": frame}


def pose(x: float, y: float, yaw: float = 0.0) -> dict:
    """Return a ``geometry_msgs/Pose`` in the plane."""
    return {
        "position": {"x": x, "y": y, "z": 0.0},
        "orientation": {"x": 0, "y": 0, "z": np.sin(yaw / 2), "w": np.cos(yaw / 2)},
    }


def typed(tag: int, numbers: np.ndarray) -> cbor2.CBORTag:
    """Return a typed array as rosbridge sends it in CBOR."""
    return cbor2.CBORTag(tag, numbers.tobytes())


def images(layer) -> list:
    """Return the ``<image>`` elements of a layer."""
    return [each for each in layer.svg.children if each.tag == "image"]


def image_of(element) -> Image.Image:
    """Return the picture that an ``<image>`` shows."""
    tag = element.get("href").rpartition("/")[2]
    return Image.open(io.BytesIO(pictures.get(tag).data)).convert("RGBA")


def pixel(element, x: float, y: float) -> tuple[int, int, int, int] | None:
    """Return the colour of an ``<image>`` at a place of the world; None outside."""
    picture = image_of(element)
    u, v = element._transform.inverse.apply(x, y)
    width, height = float(element.get("width")), float(element.get("height"))
    column, row = u / width * picture.width, v / height * picture.height
    if not (0 <= column < picture.width and 0 <= row < picture.height):
        return None
    return picture.getpixel((int(column), int(row)))


def matrix_of(element) -> Affine:
    """Return the transform from an element's coordinates to those of its parent."""
    placed = element._transform
    if placed is None:
        return Affine()
    if isinstance(placed, Affine):
        return placed
    x, y, yaw = placed
    return Affine.translation(x, y) @ Affine.rotation(yaw)


def to_root(element) -> Affine:
    """Return the transform from an element to the outside of its fragment."""
    matrix = matrix_of(element)
    while element.parent is not None:
        element = element.parent
        matrix = matrix_of(element) @ matrix
    return matrix


def numbers(text: str) -> list[float]:
    """Return every number of a ``d`` or ``points`` attribute, in order."""
    return [float(n) for n in re.findall(r"-?\d*\.?\d+(?:e-?\d+)?", text)]


def dots(element) -> np.ndarray:
    """Return the dots of a path, of shape (N, 2), in metres of its parent."""
    shown = element._dots
    if isinstance(shown, Rays):
        return points_of(shown)
    points = np.frombuffer(shown.points, "<i2").reshape(-1, 2) * shown.unit
    return points
