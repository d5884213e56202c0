"""The estimated poses of robots: covariance, particles, and a satellite fix."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from webmap.base.geometry import Pose, normalize_angle
from webmap.ros.rosbridge.server.encode import Publication
from webmap.sim.messages import Feed, GraphNode, Message, pose, read_pose

PARTICLES = 150
SURE = (0.12, 0.05, 0.06)
"""Standard deviations ahead and sideways in metres and of the heading in radians, of
a robot that has driven for some time."""

HALVED = 0.5
"""Metres of driving that halve the standard deviations and the error."""

DATUM = (48.4, 9.95)
"""Latitude and longitude of the map's origin, in degrees; its x points east."""

DEVIATION = 0.3
"""Standard deviation in the messages, in metres."""

_SEMI_MAJOR, _FLATTENING = 6378137.0, 1 / 298.257223563
_AUGMENTED, _GPS, _DIAGONAL = 1, 1, 2


class Belief:
    """One robot's estimate of its pose."""

    def __init__(self) -> None:
        self.error = Pose()
        """The estimated pose relative to the true pose."""
        self.deviations = SURE
        self._travelled = 0.0

    def reset(
        self, true: Pose, given: Pose, deviations: tuple[float, float, float]
    ) -> None:
        """Set the estimate to a pose with standard deviations."""
        self.error = true.inverse @ given
        self.deviations = deviations

    def travel(self, travelled: float) -> None:
        """Reduce the error by driving.

        Args:
            travelled: Metres driven since the start.

        """
        share = 0.5 ** ((travelled - self._travelled) / HALVED)
        self._travelled = travelled
        if share == 1:
            return
        error = self.error
        self.error = Pose(error.x * share, error.y * share, error.yaw * share)
        self.deviations = (
            SURE[0] + (self.deviations[0] - SURE[0]) * share,
            SURE[1] + (self.deviations[1] - SURE[1]) * share,
            SURE[2] + (self.deviations[2] - SURE[2]) * share,
        )

    def covariance(self, yaw: float) -> list[float]:
        """Return the 36 numbers of a covariance message, in the map's frame.

        Args:
            yaw: The estimated heading, in radians.

        """
        ahead, aside, turn = (deviation**2 for deviation in self.deviations)
        cos, sin = math.cos(yaw), math.sin(yaw)
        found = [0.0] * 36
        found[0] = cos * cos * ahead + sin * sin * aside
        found[7] = sin * sin * ahead + cos * cos * aside
        found[1] = found[6] = cos * sin * (ahead - aside)
        found[35] = turn
        return found

    def particles(
        self, believed: Pose, random: np.random.Generator
    ) -> list[tuple[float, float, float]]:
        """Return particles as x, y and yaw, spread by the standard deviations."""
        spread: NDArray[np.float64] = (
            random.normal(size=(PARTICLES, 3)) * self.deviations
        )
        cos, sin = math.cos(believed.yaw), math.sin(believed.yaw)
        return [
            (
                believed.x + cos * ahead - sin * aside,
                believed.y + sin * ahead + cos * aside,
                normalize_angle(believed.yaw + turn),
            )
            for ahead, aside, turn in spread.tolist()
        ]


class Localizations:
    """Publishes ``amcl_pose`` and ``particlecloud``; reads ``initialpose``."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        self._beliefs = [Belief() for _ in node.world.robots]
        self._random = np.random.default_rng(node.world.options.seed)
        with_covariance = "geometry_msgs/PoseWithCovarianceStamped"
        poses = "geometry_msgs/PoseArray"
        self.feeds = (
            Feed("amcl_pose", with_covariance, 0.5, "map", self._make_pose),
            Feed("particlecloud", poses, 1.0, "map", self._make_cloud),
        )

    def start(self) -> None:
        """Subscribe to initial poses."""
        for index, robot in enumerate(self._node.world.robots):

            def take(publication: Publication, index: int = index) -> None:
                self._on_initial_pose(index, publication.message)

            self._node.subscribe(
                f"{robot.topics}/initialpose",
                "geometry_msgs/PoseWithCovarianceStamped",
                take,
            )

    def believed(self, index: int) -> Pose:
        """Return the estimated pose of a robot on the map."""
        robot, belief = self._node.world.robots[index], self._beliefs[index]
        belief.travel(robot.travelled)
        return robot.pose if belief.error == Pose() else robot.pose @ belief.error

    def _on_initial_pose(self, index: int, message: dict[str, Any]) -> None:
        given = read_pose(message["pose"]["pose"])
        if given is None or message["header"]["frame_id"].strip("/") not in ("", "map"):
            return
        found = message["pose"]["covariance"]
        variances = [max(float(found[i]), 0.0) for i in (0, 7, 35)]
        if not all(map(math.isfinite, variances)):
            return
        x, y, yaw = map(math.sqrt, variances)
        self._beliefs[index].reset(
            self._node.world.robots[index].pose, given, (x, y, yaw)
        )

    def _make_pose(self, index: int) -> Message:
        believed = self.believed(index)
        covariance = self._beliefs[index].covariance(believed.yaw)
        return {"pose": {"pose": pose(believed), "covariance": covariance}}

    def _make_cloud(self, index: int) -> Message:
        belief = self._beliefs[index]
        places = belief.particles(self.believed(index), self._random)
        return {"poses": [pose(Pose(*place)) for place in places]}


class Satellites:
    """Makes ``sensor_msgs/NavSatFix`` with the true positions of robots."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        self.feed = Feed("fix", "sensor_msgs/NavSatFix", 0.5, "base_link", self._make)

    def _make(self, index: int) -> Message:
        robot = self._node.world.robots[index]
        latitude, longitude = on_the_globe(robot.pose.x, robot.pose.y)
        covariance = [0.0] * 9
        covariance[0] = covariance[4] = DEVIATION**2
        covariance[8] = (2 * DEVIATION) ** 2
        return {
            "status": {"status": _AUGMENTED, "service": _GPS},
            "latitude": latitude,
            "longitude": longitude,
            "altitude": 480.0,
            "position_covariance": covariance,
            "position_covariance_type": _DIAGONAL,
        }


def on_the_globe(x: float, y: float) -> tuple[float, float]:
    """Return latitude and longitude in degrees of a point of the map, in metres."""
    latitude = math.radians(DATUM[0])
    squared = _FLATTENING * (2 - _FLATTENING)
    bend = 1 - squared * math.sin(latitude) ** 2
    meridian = _SEMI_MAJOR * (1 - squared) / bend**1.5
    parallel = _SEMI_MAJOR / math.sqrt(bend) * math.cos(latitude)
    return (
        DATUM[0] + math.degrees(y / meridian),
        DATUM[1] + math.degrees(x / parallel),
    )
