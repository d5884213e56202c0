"""What the console draws on the map for a robot; map.css says in which colours."""

from typing import TYPE_CHECKING

from webmap import svg

if TYPE_CHECKING:
    from webmap import Element, Robot

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
    """Return a rounded body of half a metre with an arrow that says where it looks."""
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


class NameLabel:
    """The robot's name below it, upright wherever it looks; a module of robots."""

    def __init__(self, robot: "Robot") -> None:
        self.robot = robot
        self.svg = svg.g(svg.text(text=robot.name, class_="label"), class_="upright")
        robot.svg.append(self.svg)
        self.on_odometry_update()

    def destroy(self) -> None:
        """Take the name away."""
        self.svg.remove()

    def on_odometry_update(self) -> None:
        """Turn against the robot, so that the name stays upright."""
        self.svg.set_pose(0.0, 0.0, -self.robot.yaw)
