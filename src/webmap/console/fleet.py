"""How the console shows a robot: its configured modules, its picture, its name.

``map.css`` has the colours.
"""

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import webmap
from webmap import svg
from webmap.base import geometry

if TYPE_CHECKING:
    from webmap import Bridge, Element, Robot, RobotConfig
    from webmap.config.robot import PictureConfig


def make_robot(
    config: "RobotConfig",
    bridges: "Mapping[str, Bridge] | Iterable[Bridge]",
    picture: str = "",
) -> "Robot":
    """Return a robot with the modules that the console shows.

    Args:
        config: The robot's configuration.
        bridges: The robot's bridges, by their names in the configuration, or in any
            order if the configuration has their addresses.
        picture: The URL from which pages load the robot's picture; empty if none.

    Raises:
        ConfigError: If the configuration is not valid; the error lists every mistake.
    """
    if not isinstance(bridges, Mapping):
        bridges = {bridge.url: bridge for bridge in bridges}
    pictured = config.picture if picture else None
    model = None if config.model is not None else robot_model()
    if pictured is not None:
        model = picture_model(pictured, picture)
    robot = webmap.Robot.from_config(config, bridges, model=model)
    if pictured is not None:  # the name is below the picture
        robot.svg.set_style("--reach", picture_reach(pictured))
    robot.add_module(NameLabel)
    return robot


BODY = (
    "M0.08 -0.19H-0.14A0.08 0.08 0 0 0 -0.22 -0.11V0.11A0.08 0.08 0 0 0 -0.14 0.19"
    "H0.08C0.18 0.19 0.25 0.08 0.25 0C0.25 -0.08 0.18 -0.19 0.08 -0.19Z"
)
HEADING = "M0.19 0L-0.08 0.13L-0.03 0L-0.08 -0.13Z"
HATCH = (
    "M-0.22 0.02L0 0.19M-0.22 -0.12L0.14 0.17M-0.12 -0.19L0.22 0.08"
    "M0.04 -0.19L0.25 -0.02"
)


def robot_model() -> "Element":
    """Return a rounded body of half a metre with an arrow that shows the heading."""
    return svg.g(
        svg.circle(r=0.35, class_="hit"),
        svg.g(
            svg.circle(r=0.37, class_="ring"),
            svg.path(d=BODY, class_="body"),
            svg.path(d=HATCH, class_="hatch"),
            svg.path(d=HEADING, class_="heading"),
            class_="model",
        ),
    )


def picture_reach(picture: "PictureConfig") -> float:
    """Return the greatest distance from robot origin to picture edge, in metres."""
    half = math.hypot(picture.width, picture.height) / 2
    return half + math.hypot(picture.x, picture.y)


def picture_model(picture: "PictureConfig", href: str) -> "Element":
    """Return a model made of a picture, with the same marks as any other robot.

    Args:
        picture: The position of the picture on the robot.
        href: The URL from which pages load the picture.
    """
    width, height = picture.width, picture.height
    placed = geometry.Affine.translation(picture.x, picture.y)
    placed @= geometry.Affine.rotation(math.radians(picture.angle))
    image = svg.image(class_="picture", href=href, preserveAspectRatio="none")
    image.set_matrix(placed @ geometry.Affine(1, 0, 0, -1, 0, 0))
    # The hatching that marks stale data on the usual body is drawn over the picture.
    hatch = svg.path(d=HATCH, class_="hatch")
    hatch.set_matrix(placed @ geometry.Affine(width / 0.47, 0, 0, height / 0.38, 0, 0))
    reach = svg.rect(class_="reach", fill="transparent")
    reach.set_matrix(placed)
    for box in (image, reach):
        box.set(x=-width / 2, y=-height / 2, width=width, height=height)
    around = math.hypot(width, height) / 2 + 0.02
    ring = svg.circle(r=around, cx=picture.x, cy=picture.y, class_="ring")
    model = svg.g(ring, image, hatch, class_="model pictured")
    model.set_style("--length", max(width, height))
    return svg.g(svg.circle(r=0.35, class_="hit"), reach, model)


class NameLabel:
    """The robot's name below the robot, always upright; a module of robots."""

    def __init__(self, robot: "Robot") -> None:
        self.robot = robot
        self.svg = svg.g(svg.text(text=robot.name, class_="label"), class_="upright")
        # Above the body, and below what other modules draw.
        robot.svg.insert(list(robot.svg.children).index(robot.model) + 1, self.svg)
        self.on_odometry_update()

    def destroy(self) -> None:
        """Remove the name."""
        self.svg.remove()

    def on_odometry_update(self) -> None:
        """Turn against the robot's heading, so that the name stays upright."""
        self.svg.set_pose(0.0, 0.0, -self.robot.yaw)
