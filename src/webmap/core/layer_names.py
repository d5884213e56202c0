"""What one of several drawings of a kind is called in the list of layers."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from webmap.core.robot import Robot
    from webmap.scene.element import Element


def label(drawn: "Element", topic: str, robot: "Robot") -> None:
    """Say what a drawing is of, so that viewers can switch it by itself.

    Robots that are alike are switched together, so the robot's own namespace is left
    out: ``/bob/front/scan`` of Bob is ``front/scan``.

    Args:
        drawn: The element that has the class of its layer.
        topic: What it draws.
        robot: Whose it is.

    """
    drawn.set("data-layer", short(topic, robot.name))


def short(topic: str, name: str) -> str:
    """Return a topic without the namespace of a robot of that name."""
    first, _, rest = topic.strip("/").partition("/")
    own = rest and first.casefold() == name.strip().casefold()
    return rest if own else f"/{topic.strip('/')}"
