"""ROS messages with the fields that layers draw; all other fields are zero."""

import io
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from PIL import Image

Fields = dict[str, Any]


def quaternion(roll: float, pitch: float, yaw: float) -> Fields:
    """Return ``geometry_msgs/Quaternion`` of turns about fixed x, then y, then z."""
    (sr, sp, sy) = (math.sin(a / 2) for a in (roll, pitch, yaw))
    (cr, cp, cy) = (math.cos(a / 2) for a in (roll, pitch, yaw))
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }


def xyz(*values: float) -> Fields:
    """Return ``geometry_msgs/Point``, or a message with the same fields."""
    return dict(zip("xyz", [*map(float, values), 0.0, 0.0], strict=False))


def pose(x: float, y: float, yaw: float = 0.0, *, z: float = 0.0, tilt=()) -> Fields:
    """Return ``geometry_msgs/Pose``; ``tilt`` is a roll and a pitch, if any."""
    return {"position": xyz(x, y, z), "orientation": quaternion(*(tilt or (0, 0)), yaw)}


def header(frame: str) -> Fields:
    """Return a header without a time, which the publisher sets."""
    return {"stamp": "now", "frame_id": frame}


def transform(parent: str, child: str, place, turns=(0.0, 0.0, 0.0)) -> Fields:
    """Return ``geometry_msgs/TransformStamped``."""
    at = {"translation": xyz(*place), "rotation": quaternion(*turns)}
    return {"header": header(parent), "child_frame_id": child, "transform": at}


def covariance(xx: float, xy: float, yy: float, turn: float) -> list[float]:
    """Return the 36 covariances of a pose in the plane."""
    found = [0.0] * 36
    found[0], found[1], found[6], found[7], found[35] = xx, xy, xy, yy, turn
    return found


def grid(frame: str, cells: np.ndarray, size: float, at: Fields) -> Fields:
    """Return ``nav_msgs/OccupancyGrid``."""
    height, width = cells.shape
    info = {"resolution": size, "width": width, "height": height, "origin": at}
    return {"header": header(frame), "info": info, "data": cells.ravel().tolist()}


def scan(frame: str, reach: float, rays: int = 72) -> Fields:
    """Return a sweep of 300 degrees, of which some rays meet nothing or fail."""
    ranges = [reach + 0.5 * math.sin(0.37 * ray) for ray in range(rays)]
    ranges[5], ranges[6], ranges[7], ranges[8] = math.inf, math.nan, -math.inf, 99.0
    return {
        "header": header(frame),
        "angle_min": -2.6,
        "angle_max": 2.6,
        "angle_increment": 5.2 / (rays - 1),
        "range_min": 0.1,
        "range_max": 8.0,
        "ranges": ranges,
    }


def cloud(frame: str, points: Iterable[tuple[float, ...]]) -> Fields:
    """Return ``sensor_msgs/PointCloud2`` of x, y, z and an intensity."""
    data = np.array(list(points), "<f4")
    names = ("x", "y", "z", "intensity")
    return {
        "header": header(frame),
        "height": 1,
        "width": len(data),
        "fields": [
            {"name": name, "offset": 4 * i, "datatype": 7, "count": 1}
            for i, name in enumerate(names)
        ],
        "point_step": 16,
        "row_step": 16 * len(data),
        "data": list(data.tobytes()),
        "is_dense": True,
    }


def path(frame: str, *poses: tuple[float, float, float]) -> Fields:
    """Return ``nav_msgs/Path``."""
    listed = [{"header": header(frame), "pose": pose(*each)} for each in poses]
    return {"header": header(frame), "poses": listed}


def polygon(frame: str, *corners: tuple[float, float]) -> Fields:
    """Return ``geometry_msgs/PolygonStamped``."""
    return {"header": header(frame), "polygon": {"points": [xyz(*c) for c in corners]}}


def poses(frame: str, count: int, x: float, y: float) -> Fields:
    """Return ``geometry_msgs/PoseArray``, along a curl."""
    found = [
        pose(x + 0.08 * i * math.cos(i), y + 0.08 * i * math.sin(i), 0.6 * i)
        for i in range(count)
    ]
    return {"header": header(frame), "poses": found}


def marker(
    number: int, type: int, at: Fields, scale: tuple[float, ...], **more: Any
) -> Fields:
    """Return ``visualization_msgs/Marker``; its default frame is the map's."""
    colour = dict(zip("rgba", more.pop("colour", (0.1, 0.3, 0.9, 0.8)), strict=True))
    return {
        "header": header(more.pop("frame", "map")),
        "ns": more.pop("ns", "shapes"),
        "id": number,
        "type": type,
        "pose": at,
        "scale": xyz(*scale),
        "color": colour,
        **more,
    }


def odometry(name: str, x: float, y: float, yaw: float) -> Fields:
    """Return ``nav_msgs/Odometry`` of a robot at rest."""
    return {
        "header": header(f"{name}/odom"),
        "child_frame_id": f"{name}/base_link",
        "pose": {"pose": pose(x, y, yaw), "covariance": covariance(0.01, 0, 0.01, 0.1)},
    }


def picture() -> bytes:
    """Return a PNG of four colours."""
    image = Image.new("RGB", (64, 48), (200, 30, 30))
    image.paste((30, 200, 30), (32, 0, 64, 24))
    image.paste((30, 30, 200), (0, 24, 32, 48))
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


def sonar(frame: str, distance: float) -> Fields:
    """Return ``sensor_msgs/Range``."""
    limits = {"field_of_view": 0.5, "min_range": 0.05, "max_range": 1.6}
    return {"header": header(frame), **limits, "range": distance}


def battery(charge: float) -> Fields:
    """Return ``sensor_msgs/BatteryState``."""
    fields = {"percentage": charge, "voltage": 24.5, "present": True}
    return {"header": header("base_link"), **fields}
